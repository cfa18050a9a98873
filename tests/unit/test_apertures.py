"""core.camera.aperture, .eyes -> uniform points in openings of the right shape, and two eyes."""

import math

import numpy as np
import pytest

from penumbra.core.camera import aperture as apertures
from penumbra.core.camera.eyes import look
from penumbra.core.optics import Aperture, Eye

F32 = np.float32
COUNT = 200_000


def opening(aperture, u, v):
    half = np.array(aperture.half, F32)[:, None]
    return apertures.opening(aperture, half, u, v)


def numbers(count=COUNT):
    return np.random.default_rng(11).random((2, count), F32)


def uniform_of_polygon(point, blades, rotation):
    """Return unit-square coordinates of points in a regular polygon of circumradius 1."""
    x, y = point.astype(float)
    step = 2 * np.pi / blades
    angle = (np.arctan2(y, x) - rotation + step / 2) % (2 * np.pi)
    side = np.minimum((angle / step).astype(int), blades - 1)
    # In its triangle: how far out, whose square is uniform, and how far along the side
    middle = rotation + side * step
    out = (x * np.cos(middle) + y * np.sin(middle)) / math.cos(step / 2)
    along = (-x * np.sin(middle) + y * np.cos(middle)) / math.sin(step / 2)
    return side, out**2, 0.5 + 0.5 * along / np.maximum(out, 1e-12)


@pytest.mark.parametrize("blades", (0, 1, 2))
def test_fewer_than_three_blades_make_a_uniform_disk(blades, chi2):
    x, y = opening(Aperture(0.5, 1.0, blades, rotation=0.7), *numbers()) / 0.5
    r2, phi = x * x + y * y, np.arctan2(y, x)
    assert r2.max() <= 1 + 1e-6
    counts, *_ = np.histogram2d(r2, phi, (12, 12), ((0, 1 + 1e-6), (-np.pi, np.pi)))
    assert chi2(counts, np.full(144, COUNT / 144)) < 4


@pytest.mark.parametrize("rotation", (0.0, 0.4, -2.0))
@pytest.mark.parametrize("blades", (3, 4, 5, 8))
def test_points_are_uniform_in_the_polygon_of_the_blades(blades, rotation, chi2):
    point = opening(Aperture(0.25, 1.0, blades, rotation), *numbers()) / F32(0.25)
    side, out, along = uniform_of_polygon(point, blades, rotation)
    assert out.max() <= 1 + 1e-5
    assert along[out > 1e-3].min() >= -1e-4
    assert along[out > 1e-3].max() <= 1 + 1e-4
    sample = np.column_stack([side + 0.5, np.clip(out, 0, 1), np.clip(along, 0, 1)])
    counts, _ = np.histogramdd(sample, (blades, 8, 8), ((0, blades), (0, 1), (0, 1)))
    assert chi2(counts, np.full(counts.size, COUNT / counts.size)) < 4


def test_corners_are_half_a_side_from_the_rotation():
    x, y = opening(Aperture(1.0, 1.0, 5, rotation=0.3), *numbers())
    farthest = np.argmax(x * np.cos(0.3 + np.pi / 5) + y * np.sin(0.3 + np.pi / 5))
    corner = np.cos(0.3 + np.pi / 5), np.sin(0.3 + np.pi / 5)
    np.testing.assert_allclose((x[farthest], y[farthest]), corner, atol=0.01)


def test_the_ratio_squeezes_the_width_after_the_rotation():
    u, v = numbers(1000)
    plain = opening(Aperture(0.1, 1.0, 6, 0.5), u, v)
    squeezed = opening(Aperture(0.1, 1.0, 6, 0.5, ratio=2.5), u, v)
    np.testing.assert_allclose(squeezed[0], plain[0] / 2.5, rtol=1e-6)
    np.testing.assert_array_equal(squeezed[1], plain[1])


def test_the_last_random_number_is_in_the_opening():
    last = np.array([0, 1 - 2.0**-24], F32)
    for blades in (0, 3, 7, 40):
        point = opening(Aperture(1.0, 1.0, blades), last, last)
        assert (np.linalg.norm(point, axis=0) <= 1 + 1e-6).all()


# --- Two eyes -----------------------------------------------------------------------------------


def directions(count=500):
    d = np.random.default_rng(5).normal(size=(3, count))
    return (d / np.linalg.norm(d, axis=0)).astype(F32)


@pytest.mark.parametrize("convergence", (0.7, 30.0, math.inf))
def test_both_eyes_are_level_and_look_at_the_same_point(convergence):
    middle = directions()
    places, ways = zip(
        *(look(Eye(side * 0.1, convergence), middle) for side in (-1, 1)), strict=True
    )
    for side, place, way in zip((-1, 1), places, ways, strict=True):
        np.testing.assert_allclose(np.linalg.norm(place, axis=0), 0.1, rtol=1e-5)
        np.testing.assert_allclose(place[2], 0)
        np.testing.assert_allclose((place * middle).sum(axis=0), 0, atol=1e-6)
        right = np.cross(middle.T, (0, 0, 1)).T  # of who looks there, head up
        assert (side * (right * place).sum(axis=0) > 0).all()
        np.testing.assert_allclose(np.linalg.norm(way, axis=0), 1, rtol=1e-6)
        if convergence < math.inf:
            distance = np.hypot(convergence, 0.1)
            np.testing.assert_allclose(place + way * distance, middle * convergence, atol=1e-5)
        else:
            np.testing.assert_allclose(way, middle, atol=2e-7)


def test_eyes_come_together_towards_the_poles():
    height = np.radians([0, 59, 60, 67.5, 75, 76, 90, -67.5]).astype(F32)
    middle = np.stack([np.cos(height), np.zeros(8, F32), np.sin(height)])
    place, _ = look(Eye(0.2, 5.0, poles=(np.radians(60), np.radians(75))), middle)
    share = np.linalg.norm(place, axis=0) / 0.2
    np.testing.assert_allclose(share, [1, 1, 1, 0.5**0.5, 0, 0, 0, 0.5**0.5], atol=1e-5)


def test_an_eye_that_looks_straight_up_stays_in_the_middle():
    up = np.array([[0, 0], [0, 0], [1, -1]], F32)
    place, way = look(Eye(0.1, 2.0), up)
    np.testing.assert_array_equal(place, 0)
    np.testing.assert_allclose(way, up)
