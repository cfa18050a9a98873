"""core.bsdf.fresnel -> reflectances by the book, and averages that are their integrals."""

import numpy as np
import pytest

from penumbra.core.bsdf import fresnel

F32 = np.float32
ETAS = (0.4, 0.5, 0.7, 0.9, 1.0001, 1.33, 1.5, 2.4, 3.0)
COSINES = np.concatenate([np.linspace(0.01, 1, 400), 10.0 ** np.linspace(-4, -2, 50)])
METALS = {
    "gold": ((0.18, 0.42, 1.37), (3.42, 2.35, 1.77)),
    "copper": ((0.2, 0.92, 1.1), (3.91, 2.45, 2.14)),
    "titanium": ((2.74, 2.54, 2.27), (3.81, 3.43, 3.04)),
    "not absorbing": ((1.5, 0.7, 2.4), (0.0, 0.0, 0.0)),
}
metals = pytest.mark.parametrize("n, k", METALS.values(), ids=METALS)
etas = pytest.mark.parametrize("eta", ETAS)


def column(values):
    return np.array(values, F32)[:, None]


def one(value):
    return np.full(1, value, F32)


def exact(cosine, index):
    """Reflectance by complex amplitudes in float64 (Born and Wolf, section 1.5)."""
    beyond = np.sqrt(np.asarray(index, complex) ** 2 - (1 - cosine**2))
    s = (cosine - beyond) / (cosine + beyond)
    p = (index**2 * cosine - beyond) / (index**2 * cosine + beyond)
    return (np.abs(s) ** 2 + np.abs(p) ** 2) / 2


def average(reflectance):
    """The integral of 2 cos F(cos) over cos, in n channels."""
    node, weight = np.polynomial.legendre.leggauss(200)
    cosine = (node + 1) / 2
    return (reflectance(cosine.astype(F32)).astype(float) * cosine * weight).sum(axis=-1)


@etas
def test_a_dielectric_reflects_what_fresnel_says(eta):
    cosine = COSINES.astype(F32)
    reflectance, beyond = fresnel.dielectric(cosine, one(eta))
    assert reflectance.dtype == beyond.dtype == F32
    index = float(F32(eta))
    expected = exact(cosine.astype(float), index)

    # Next to the critical angle the reflectance is as steep as a square root.
    clear = np.abs(cosine.astype(float) ** 2 - (1 - index**2)) > 1e-4
    np.testing.assert_allclose(reflectance[clear], expected[clear], atol=2e-5)
    sine = np.sqrt(1 - cosine.astype(float) ** 2) / index
    snell = np.sqrt(np.maximum(1 - sine**2, 0))
    np.testing.assert_allclose(beyond[clear], snell[clear], atol=2e-5)


@etas
def test_reflection_is_total_exactly_where_snell_says(eta):
    cosine = COSINES.astype(F32)
    expected = np.sqrt(1 - cosine.astype(float) ** 2) > float(F32(eta))
    reflectance, beyond = fresnel.dielectric(cosine, one(eta))
    np.testing.assert_array_equal(reflectance == 1, expected)
    np.testing.assert_array_equal(beyond == 0, expected)


def test_fresnel_is_finite_and_at_most_1_at_every_index_and_angle():
    cosine = np.array([0, 1e-20, 1e-7, 1e-3, 0.5, 1], F32)
    for eta in (1e-5, 0.5, 1.0, 1.5, 1e5):
        for found in (
            *fresnel.dielectric(cosine, one(eta)),
            fresnel.remapped(cosine, one(eta), column((0, 0.5, 1))),
            fresnel.conductor(cosine, column((eta, 0, 1)), column((0, eta, 0))),
            fresnel.f82(cosine, column((0, 0.5, 1)), column((17, 2, 17))),
        ):
            assert found.dtype == F32
            assert np.isfinite(found).all()
            assert found.min() >= 0
            assert found.max() <= 1 + 1e-6


@metals
def test_a_conductor_reflects_by_its_complex_index(n, k):
    found = fresnel.conductor(COSINES.astype(F32), column(n), column(k))
    for channel in range(3):
        index = complex(n[channel], k[channel])
        if n[channel] < 1 and k[channel] == 0:
            continue  # total reflection has its own test
        np.testing.assert_allclose(found[channel], exact(COSINES, index), atol=2e-6)


@etas
def test_index_and_perpendicular_reflectance_are_inverse(eta):
    f0 = fresnel.f0_from_ior(one(eta))
    np.testing.assert_allclose(f0, fresnel.dielectric(one(1), one(eta))[0], atol=1e-7)
    np.testing.assert_allclose(fresnel.ior_from_f0(f0), max(eta, 1 / eta), rtol=2e-4)


@pytest.mark.parametrize("eta", (0.5, 1.2, 1.5, 2.4))
def test_the_remapped_curve_goes_from_f0_to_white_along_the_true_one(eta):
    f0 = column((0.0, 0.04, 0.5))
    cosine = COSINES.astype(F32)
    found = fresnel.remapped(cosine, one(eta), f0)
    np.testing.assert_allclose(fresnel.remapped(one(1), one(eta), f0), f0, atol=1e-6)
    assert fresnel.remapped(one(1e-6), one(eta), f0).min() > 1 - 1e-4
    true = fresnel.dielectric(cosine, one(eta))[0]
    own = fresnel.f0_from_ior(one(eta))
    np.testing.assert_allclose(
        found[2], 0.5 + 0.5 * np.maximum(true - own, 0) / (1 - own), atol=1e-5
    )
    np.testing.assert_allclose(
        fresnel.remapped(cosine, one(eta), own * np.ones((3, 1), F32))[0],
        np.maximum(true, own),
        atol=1e-6,
    )


def test_the_f82_model_is_schlicks_times_the_tint_at_82_degrees():
    f0, tint = column((1.0, 0.71, 0.1)), column((0.9, 0.5, 0.0))
    b = fresnel.f82_b(f0, tint)
    cosine = np.array([1, 1 / 7, 0], F32)
    schlick = f0 + (1 - f0) * (1 - cosine) ** 5
    found = fresnel.f82(cosine, f0, b)
    expected = schlick * np.concatenate([np.ones((3, 1)), tint, np.ones((3, 1))], axis=1)
    np.testing.assert_allclose(found, expected, atol=1e-6)
    white = np.ones((3, 1), F32)
    np.testing.assert_allclose(
        fresnel.f82(COSINES.astype(F32), f0, fresnel.f82_b(f0, white)),
        f0 + (1 - f0) * (1 - COSINES) ** 5,
        atol=1e-6,
    )


def test_averages_of_colour_models_are_their_integrals():
    f0, tint = column((0.9, 0.71, 0.1)), column((0.9, 0.5, 0.8))
    b = fresnel.f82_b(f0, tint)
    found = fresnel.f82_average(f0, b)[:, 0]
    np.testing.assert_allclose(found, average(lambda cos: fresnel.f82(cos, f0, b)), atol=2e-5)


@pytest.mark.parametrize("eta", (0.4, 0.5, 0.7, 0.9, 1.2, 1.5, 2.4, 3.0))
def test_the_fitted_average_of_dielectrics_is_near_the_integral(eta):
    # Kulla and Conty state no bound; these were measured over all of [0.4, 3].
    true = average(lambda cos: fresnel.dielectric(cos, one(eta))[0])
    np.testing.assert_allclose(fresnel.dielectric_average(one(eta)), true, atol=0.0066)
    f0 = column((0.0, 0.04, 0.5))
    true = average(lambda cos: fresnel.remapped(cos, one(eta), f0))
    np.testing.assert_allclose(fresnel.remapped_average(one(eta), f0)[:, 0], true, atol=0.008)


@metals
def test_the_average_of_a_conductor_is_near_the_integral(n, k):
    if 0.0 in k:
        pytest.skip("not a metal")
    true = average(lambda cos: fresnel.conductor(cos, column(n), column(k)))
    found = fresnel.conductor_average(column(n), column(k))[:, 0]
    np.testing.assert_allclose(found, true, atol=0.03)
