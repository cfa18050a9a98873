"""core.film -> means of the samples that each pixel has got."""

import numpy as np

from penumbra.core.film.film import SUMS, drop_not_finite, new_film, rows


def test_a_pixel_is_the_mean_of_its_samples_times_the_exposure():
    film = new_film(3, 2)
    film.add(slice(0, None), np.arange(18.0).reshape(3, 6), 2)
    film.add(slice(4, 6), np.full((3, 2), 10.0), 3)
    picture = film.combined(exposure=2.0)
    assert picture.shape == (2, 3, 4)
    assert picture.dtype == np.float32
    np.testing.assert_allclose(picture[0, 1], (1, 7, 13, 1))
    np.testing.assert_allclose(picture[1, 1], np.array([14, 20, 26, 2.5]) * 2 / 5)


def test_pixels_without_samples_are_transparent_black():
    for passes in (("combined",), ("combined", "alpha"), tuple(SUMS)[:6]):
        film = new_film(2, 1, passes)
        film.add(slice(1, 2), np.ones((rows(passes), 1)), 1)
        np.testing.assert_array_equal(film.combined(1.0)[0], [(0, 0, 0, 0), (1, 1, 1, 1)])


def test_alpha_is_a_mean_without_exposure():
    film = new_film(1, 1, ("combined", "alpha"))
    film.add(slice(0, None), np.array([[1.0], [2.0], [3.0], [1.0]]), 4)
    np.testing.assert_allclose(film.combined(10.0)[0, 0], (2.5, 5, 7.5, 0.25))


def test_ten_thousand_samples_add_up_without_drift():
    film = new_film(1, 1)
    for _ in range(10_000):
        film.add(slice(0, None), np.full((3, 1), np.float32(0.1), float), 1)
    np.testing.assert_array_equal(film.combined(1.0)[0, 0, :3], np.float32(0.1))


def test_the_first_row_is_the_bottom_one():
    film = new_film(2, 3)
    film.add(slice(0, 2), np.ones((3, 2)), 1)
    picture = film.combined(1.0)
    assert (picture[0] == 1).all()
    assert (picture[1:] == 0).all()


def test_samples_that_are_no_numbers_are_drawn_black_and_counted():
    light = np.ones((3, 6), np.float32)
    light[0, 1], light[2, 1], light[1, 3], light[2, 5] = np.nan, np.inf, -np.inf, 2e36
    assert drop_not_finite(light) == 3
    np.testing.assert_array_equal(light, np.ones((3, 1)) * [1, 0, 1, 0, 1, 0])
    holes = np.array([0.5, np.nan], np.float32)
    assert drop_not_finite(holes) == 1
    np.testing.assert_array_equal(holes, [0.5, 0])
    bright = np.full((3, 4), 1e35, np.float32)
    assert drop_not_finite(bright) == 0
    assert (bright == np.float32(1e35)).all()
