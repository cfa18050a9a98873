"""core.bsdf.thin_film, thin_wall -> interference as summed over wavelengths; sheets by bounces."""

import numpy as np
import pytest

from penumbra.core.bsdf import fresnel, thin_film, thin_wall

F32 = np.float32
COSINES = np.concatenate([[0, 1e-20, 1e-7, 1e-4], np.linspace(0.005, 1, 200)]).astype(F32)
STEEP = COSINES[COSINES > 0.15]
WHITE = np.ones((3, 1), F32)
N, K = (0.2, 0.9, 1.1), (3.9, 2.4, 2.5)


def f32(*values):
    return np.array(values, F32)


def colour(*values):
    return np.array(values, F32)[:, None]


def plain(eta):
    return np.repeat(fresnel.f0_from_ior(f32(eta))[None], 3, axis=0)


def on_glass(thickness, film_ior, cosine=COSINES, eta=1.5, f0=None):
    f0 = plain(eta) if f0 is None else f0
    return thin_film.film_remapped(cosine, f32(eta), f0, f32(thickness), f32(film_ior))


def on_paint(thickness, film_ior, cosine=COSINES, f0=(0.9, 0.6, 0.3), tint=(1, 0.5, 0.2)):
    f0 = colour(*f0)
    b = fresnel.f82_b(f0, colour(*tint))
    return thin_film.film_f82(cosine, f0, b, f32(thickness), f32(film_ior))


def on_metal(thickness, film_ior, cosine=COSINES, n=N, k=K):
    return thin_film.film_conductor(cosine, colour(*n), colour(*k), f32(thickness), f32(film_ior))


BASES = {
    on_glass: fresnel.remapped(COSINES, f32(1.5), plain(1.5)),
    on_paint: fresnel.f82(
        COSINES, colour(0.9, 0.6, 0.3), fresnel.f82_b(colour(0.9, 0.6, 0.3), colour(1, 0.5, 0.2))
    ),
    on_metal: fresnel.conductor(COSINES, colour(*N), colour(*K)),
}
bases = pytest.mark.parametrize("film", BASES, ids=lambda film: film.__name__)


# --- Limits -------------------------------------------------------------------------------------


@bases
def test_no_film_is_fresnel(film):
    np.testing.assert_array_equal(film(0.0, 1.33), BASES[film])
    np.testing.assert_array_equal(film(0.1, 1.33), BASES[film])


@pytest.mark.parametrize("film", (on_glass, on_metal), ids=("on_glass", "on_metal"))
def test_films_below_a_nanometre_fade_out(film):
    steep = COSINES > 0.15  # where the sum has converged
    np.testing.assert_allclose(film(0.11, 1.8)[:, steep], BASES[film][:, steep], atol=0.01)


@bases
def test_a_film_like_air_does_nothing(film):
    steep = COSINES > 0.15
    np.testing.assert_allclose(film(500.0, 1.0)[:, steep], BASES[film][:, steep], atol=1e-3)


def test_a_film_like_its_base_does_nothing():
    np.testing.assert_allclose(on_glass(500.0, 1.5), BASES[on_glass], atol=2e-3)


@bases
def test_films_reflect_between_nothing_and_all_and_all_at_the_horizon(film):
    random = np.random.default_rng(1)
    for thickness, ior in random.uniform((0, 0.7), (3000, 3), (40, 2)):
        found = film(thickness, ior)
        assert found.dtype == F32
        assert found.shape == (3, COSINES.size)
        assert np.isfinite(found).all()
        assert found.min() >= 0
        assert found.max() <= 1
        np.testing.assert_allclose(found[:, 0], 1, atol=1e-5)


def test_degenerate_metals_stay_finite():
    for n, k in ((0, 0), (1, 0), (0.7, 0), (1.33, 0), (0, 1), (1e4, 1e4)):
        for ior in (0.7, 1.0, 1.33):
            assert np.isfinite(on_metal(500.0, ior, n=(n, n, n), k=(k, k, k))).all()
    for value in (0.0, 1.0):
        assert np.isfinite(on_paint(500.0, 1.33, f0=(value,) * 3, tint=(0, 0, 0))).all()


# --- Interference -------------------------------------------------------------------------------


def eye(wavelength):
    """Linear Rec. 709 (3, n) by the fit of Wyman et al. 2013 to the CIE 1931 observer."""

    def lobe(x, peak, below, above):
        return np.exp(-0.5 * ((x - peak) * np.where(x < peak, below, above)) ** 2)

    x = (
        1.056 * lobe(wavelength, 599.8, 0.0264, 0.0323)
        + 0.362 * lobe(wavelength, 442.0, 0.0624, 0.0374)
        - 0.065 * lobe(wavelength, 501.1, 0.0490, 0.0382)
    )
    y = 0.821 * lobe(wavelength, 568.8, 0.0213, 0.0247) + 0.286 * lobe(
        wavelength, 530.9, 0.0613, 0.0322
    )
    z = 1.217 * lobe(wavelength, 437.0, 0.0845, 0.0278) + 0.681 * lobe(
        wavelength, 459.0, 0.0385, 0.0725
    )
    return thin_film.RGB @ np.stack([x, y, z])


def airy(cosine, film_ior, base, thickness):
    """Linear Rec. 709 (3, n) of an exact film, summed over wavelengths; base is complex."""
    wavelength = np.arange(360, 831, 1.0)[:, None]
    inside = np.sqrt(1 - (1 - cosine**2) / film_ior**2)
    beyond = np.sqrt(1 + 0j - (1 - cosine**2) / base**2)
    turn = np.exp(4j * np.pi * film_ior * thickness * inside / wavelength)
    total = 0
    for s in (True, False):
        a, b = (1, film_ior) if s else (film_ior, 1)
        upper = (a * cosine - b * inside) / (a * cosine + b * inside)
        a, b = (film_ior, base) if s else (base, film_ior)
        lower = (a * inside - b * beyond) / (a * inside + b * beyond)
        total = total + abs((upper + lower * turn) / (1 + upper * lower * turn)) ** 2 / 2
    weight = eye(wavelength[:, 0])
    return weight @ total / weight.sum(axis=1)[:, None]


@pytest.fixture
def long_sums(monkeypatch):
    """Sum over so many paths that nothing is left; the engine, as Cycles, ends at the third."""
    thin_film._tabulated.cache_clear()
    monkeypatch.setattr(thin_film, "ORDERS", 60)
    yield
    thin_film._tabulated.cache_clear()


@pytest.mark.parametrize("thickness", (80, 250, 400, 700, 1500))
@pytest.mark.parametrize("film_ior", (1.33, 1.9))
def test_films_on_glass_are_the_sum_over_wavelengths(thickness, film_ior):
    found = on_glass(thickness, film_ior, STEEP)
    expected = airy(STEEP.astype(float), film_ior, 1.5, thickness)
    # The fit of the eye is good to 1 % of its peak
    assert np.ptp(expected, axis=1).min() > 0.02
    np.testing.assert_allclose(found, expected, atol=0.008)


@pytest.mark.parametrize("thickness", (80, 250, 400, 700, 1500))
def test_films_on_metal_are_the_sum_over_wavelengths(thickness, long_sums):
    found = on_metal(thickness, 1.5, STEEP)
    for channel in range(3):
        base = N[channel] + 1j * K[channel]
        expected = airy(STEEP.astype(float), 1.5, base, thickness)[channel]
        np.testing.assert_allclose(found[channel], expected, atol=0.008)


def test_light_passes_a_film_both_ways_alike(long_sums):
    """If its path is as long: as Cycles, a film counts the wavelength outside of what it is on."""
    eta, film_ior, thickness = 1.5, 1.9, 400.0
    beyond = np.sqrt(1 - (1 - STEEP**2) / F32(eta**2))
    behind = on_glass(thickness * eta, film_ior / eta, beyond, 1 / eta)
    np.testing.assert_allclose(behind, on_glass(thickness, film_ior, STEEP), atol=5e-4)


def test_inside_glass_nothing_passes_beyond_the_critical_angle():
    critical = np.sqrt(1 - 1 / 1.5**2)
    cosine = np.linspace(0, critical * 0.9999, 100, dtype=F32)
    assert on_glass(400.0, 1.33 / 1.5, cosine, 1 / 1.5).min() == 1
    assert on_glass(400.0, 1.33 / 1.5, f32(critical + 0.01, 1), 1 / 1.5).max() < 1


def test_a_tint_scales_dark_films_and_leaves_what_reflects_all():
    cosine = f32(1.0)
    f0 = colour(0.04, 0.02, 0.0)
    dark = on_glass(400.0, 1.2, cosine, f0=f0)
    clear = on_glass(400.0, 1.2, cosine)
    assert dark[0] == pytest.approx(clear[0])
    assert clear.max() < 0.04
    np.testing.assert_allclose(dark[1:], (clear * f0 / 0.04)[1:], atol=1e-6)
    bright = on_glass(400.0, 2.0, cosine)
    share = (1 - bright) / (1 - 0.04)
    assert share.max() < 1
    found = on_glass(400.0, 2.0, cosine, f0=f0)
    np.testing.assert_allclose(found, bright * (1 - share * (1 - f0 / 0.04)), atol=1e-6)
    np.testing.assert_allclose(on_glass(400.0, 1.2, f32(0.0), f0=f0), 1, atol=1e-5)


@bases
def test_one_film_is_interpolated_and_many_agree_with_it(film):
    constant = film(450.0, 1.6, STEEP)
    many = np.full(STEEP.size, 450.0, F32)
    if film is on_glass:
        varied = thin_film.film_remapped(STEEP, f32(1.5), plain(1.5), many, f32(1.6))
    elif film is on_paint:
        f0 = colour(0.9, 0.6, 0.3)
        b = fresnel.f82_b(f0, colour(1, 0.5, 0.2))
        varied = thin_film.film_f82(STEEP, f0, b, many, f32(1.6))
    else:
        varied = thin_film.film_conductor(STEEP, colour(*N), colour(*K), many, f32(1.6))
    assert varied.dtype == F32
    np.testing.assert_allclose(constant, varied, atol=5e-4)


def test_points_with_and_without_a_film_are_told_apart():
    thickness = np.where(np.arange(STEEP.size) % 2, 400, 0).astype(F32)
    f0 = colour(0.1, 0.04, 0.0)
    found = thin_film.film_remapped(STEEP, f32(1.5), f0, thickness, f32(1.33))
    bare = fresnel.remapped(STEEP, f32(1.5), f0)
    np.testing.assert_array_equal(found[:, ::2], bare[:, ::2])
    film = on_glass(400.0, 1.33, STEEP, f0=f0)
    np.testing.assert_allclose(found[:, 1::2], film[:, 1::2], atol=5e-4)


# --- Thin walls ---------------------------------------------------------------------------------


def wall(tint=WHITE, thickness=0.0, film_ior=1.33, ior=1.5, **more):
    return thin_wall.thin_glass(
        COSINES, f32(ior), plain(ior), tint, f32(thickness), f32(film_ior), **more
    )


@pytest.mark.parametrize("ior", (1.0, 1.2, 1.5, 2.4, 0.8))
def test_a_clear_wall_loses_nothing(ior):
    reflected, through = wall(ior=ior)
    assert reflected.dtype == through.dtype == F32
    np.testing.assert_allclose(reflected + through, 1, atol=1e-4)


@pytest.mark.parametrize("thickness, film_ior", ((0.0, 1.33), (300.0, 1.33), (500.0, 2.0)))
def test_a_wall_is_the_sum_of_its_bounces(thickness, film_ior):
    tint = colour(0.9, 0.5, 0.0)
    reflected, through = wall(tint, thickness, film_ior)
    beyond = np.sqrt(1 - (1 - COSINES * COSINES) / F32(1.5**2))
    outer = on_glass(thickness, film_ior).astype(float)
    inner = on_glass(thickness, film_ior / 1.5, beyond, 1 / 1.5).astype(float)
    absorbed = tint.astype(float) ** (1 / beyond)
    light, up, down = (1 - outer) * absorbed, outer.copy(), 0 * outer
    for bounce in range(2000):
        passed = light * (1 - inner)
        if bounce % 2:
            up += passed
        else:
            down += passed
        light = light * inner * absorbed
    alive = COSINES > 1e-2
    np.testing.assert_allclose(reflected[:, alive], up[:, alive], atol=2e-3 if thickness else 1e-4)
    np.testing.assert_allclose(through[:, alive], down[:, alive], atol=2e-3 if thickness else 1e-4)


def test_films_on_walls_keep_the_energy():
    for thickness, ior in ((0.05, 2.0), (300.0, 1.33), (600.0, 2.0)):
        reflected, through = wall(thickness=thickness, film_ior=ior)
        total = reflected + through
        assert np.isfinite(total).all()
        assert min(reflected.min(), through.min()) >= 0
        # Both ways through a face differ a little, as the sum over paths ends at the third
        np.testing.assert_allclose(total, 1, atol=0.02)


def test_switches_for_caustics_take_one_side_of_the_light():
    face = fresnel.remapped(COSINES, f32(1.5), plain(1.5))
    reflected, through = wall(reflective=False)
    assert reflected.max() == 0
    np.testing.assert_allclose(through, (1 - face) ** 2, atol=1e-5)
    reflected, through = wall(refractive=False)
    assert through.max() == 0
    np.testing.assert_allclose(reflected, face, atol=1e-6)


def test_what_passes_a_wall_is_blurred_by_its_index():
    alpha = f32(0.0, 0.1, 1.0)
    np.testing.assert_array_equal(thin_wall.transmission_alpha(alpha, f32(1.0)), 0)
    np.testing.assert_array_equal(thin_wall.transmission_alpha(alpha, f32(0.8)), 0)
    found = thin_wall.transmission_alpha(alpha, f32(1.5))
    np.testing.assert_allclose(found, alpha * np.sqrt(3.4 * 0.5 * 1 / 1.5**3), rtol=1e-6)
    assert thin_wall.transmission_alpha(f32(1.0), f32(10.0))[0] == 1
