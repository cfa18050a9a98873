"""core.bsdf -> closures sample what they evaluate, keep the energy, obey Snell and Fresnel."""

import numpy as np
import pytest

from penumbra.core.arrays import ONE_BELOW, frame
from penumbra.core.bsdf import REGISTRY, glass
from tests.physics.cases import CASES, CONTINUOUS, DELTA
from tests.support.statistics import SIGNIFICANCE, chi2_of_directions, sidak

F32 = np.float32
IORS = (0.5, 0.9, 1.0001, 1.33, 1.5, 2.4)
COSINES = np.concatenate([np.linspace(0.01, 1, 400), 10.0 ** np.linspace(-4, -2, 50)])
ANGLES = (0, 30, 60, 80, 89)  # of the viewer [degrees]

every = pytest.mark.parametrize("case", CASES, ids=str)
continuous = pytest.mark.parametrize("case", CONTINUOUS, ids=str)
delta = pytest.mark.parametrize("case", DELTA, ids=str)
sides = pytest.mark.parametrize("back", (False, True), ids=("front", "back"))


def towards(cosine, azimuth=0.7):
    """Unit directions (3, n) float32 with these cosines (n,)."""
    cosine = np.atleast_1d(np.asarray(cosine, float))
    sine = np.sqrt(np.maximum(1 - cosine * cosine, 0))
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine]).astype(F32)


def grid(side):
    """u, v (side^2,) at the middles of a square grid."""
    middle = (np.arange(side, dtype=F32) + F32(0.5)) / F32(side)
    u, v = np.meshgrid(middle, middle)
    return u.ravel(), v.ravel()


def sample(case, wo, back, u, v):
    count = wo.shape[1]
    wi, weight, pdf = case.module.sample(case.columns(count), wo, np.full(count, back), u, v)
    return wi, np.ones(count, F32) if weight is None else weight, pdf


def evaluate(case, wo, wi):
    return case.module.evaluate(case.columns(wi.shape[1]), wo, wi)


def test_every_closure_has_a_row_of_parameters():
    assert {case.closure for case in CASES} == set(REGISTRY)
    for case in CASES:
        assert len(case.parameters) == len(case.module.PARAMETERS), case


@pytest.mark.parametrize("name", REGISTRY)
def test_every_closure_declares_what_the_protocol_asks_for(name):
    module = REGISTRY[name]
    assert name == module.NAME
    assert isinstance(module.IS_DELTA, bool)
    assert isinstance(module.WEIGHT_IN_WI_Z, bool)
    assert isinstance(module.TRANSMITS, bool)
    assert callable(module.sample)
    assert callable(module.branches if module.IS_DELTA else module.evaluate)


# --- All closures -------------------------------------------------------------------------------


@every
@sides
def test_samples_are_unit_finite_float32_even_where_it_is_degenerate(case, back):
    cosines = (1.0, 0.5, 1e-3, 1e-7, 1e-20, 0.0, -1e-7, -0.5)
    corners = (0.0, 0.5, ONE_BELOW)
    wo = np.repeat(towards(cosines), 9, axis=1)
    u = np.tile(np.repeat(np.array(corners, F32), 3), len(cosines))
    v = np.tile(np.array(corners, F32), 3 * len(cosines))
    wi, weight, pdf = sample(case, wo, back, u, v)
    weight = np.broadcast_to(weight, (3, u.size))
    for name, array in (("wi", wi), ("weight", weight), ("pdf", pdf)):
        assert array.dtype == F32, name
        assert np.isfinite(array).all(), name
    assert weight.min() >= 0
    assert pdf.min() >= 0
    alive = weight.max(axis=0) > 0
    assert case.module.TRANSMITS or wi[2, alive].min(initial=0) >= 0
    np.testing.assert_allclose((wi[:, alive] ** 2).sum(axis=0), 1, atol=3e-6)


@every
@sides
def test_no_closure_sends_back_more_light_than_it_gets(case, back):
    u, v = grid(64)
    for cosine in np.cos(np.radians(ANGLES)):
        wo = np.repeat(towards(cosine), u.size, axis=1)
        _, weight, _ = sample(case, wo, back, u, v)
        mean = np.broadcast_to(weight, (3, u.size)).mean(axis=1, dtype=float)
        assert mean.max() <= 1 + 1e-3
        if case.albedo is not None:
            np.testing.assert_allclose(mean, case.albedo, atol=1e-3)


# --- Closures that scatter into all directions --------------------------------------------------


@continuous
def test_sampled_directions_follow_the_pdf(case):
    rng = np.random.default_rng(1)
    for angle in ANGLES:
        u, v = rng.random((2, 60_000), F32)
        wo = np.repeat(towards(np.cos(np.radians(angle))), u.size, axis=1)
        wi, weight, _ = sample(case, wo, False, u, v)
        drawn = wi[:, np.flatnonzero(np.broadcast_to(weight, (3, u.size)).max(axis=0) > 0)]
        probability = chi2_of_directions(
            drawn, lambda there, wo=wo: evaluate(case, wo[:, :1], there)[1]
        )
        assert probability > sidak(SIGNIFICANCE, len(ANGLES)), angle


@continuous
@pytest.mark.parametrize("normal", ((0, 0, 1), (0, 0, -1), (0.6, -0.48, 0.64), (0, 1, 0)))
def test_directions_about_a_normal_are_distributed_by_the_pdf(case, normal):
    if not hasattr(case.module, "sample_about"):
        pytest.skip("samples in the local frame only")
    u, v = grid(256)
    normals = np.repeat(np.array(normal, F32)[:, None], u.size, axis=1)
    direction, weight, _ = case.module.sample_about(case.columns(u.size), normals, u, v)
    assert weight is None or np.allclose(weight, 1)
    assert direction.dtype == F32
    np.testing.assert_allclose((direction * direction).sum(axis=0), 1, rtol=1e-5)
    tangent, bitangent = frame(normals)
    local = np.stack([(axis * direction).sum(axis=0) for axis in (tangent, bitangent, normals)])
    wo = towards(0.5)
    probability = chi2_of_directions(local, lambda there: evaluate(case, wo, there)[1])
    assert probability > sidak(SIGNIFICANCE, 4)


@continuous
def test_weight_times_pdf_is_f_cos_and_both_pdfs_agree(case):
    u, v = grid(32)
    for angle in ANGLES:
        wo = np.repeat(towards(np.cos(np.radians(angle))), u.size, axis=1)
        wi, weight, pdf = sample(case, wo, False, u, v)
        value, again = evaluate(case, wo, wi)
        np.testing.assert_allclose(pdf, again, rtol=1e-5, atol=1e-7)
        np.testing.assert_allclose(weight * pdf, value, rtol=1e-5, atol=1e-7)


@continuous
def test_light_takes_the_same_way_in_both_directions(case):
    u, v = grid(16)
    a = np.repeat(towards(0.3), u.size, axis=1)
    b, _, _ = sample(case, a, False, u, v)
    b = b[:, np.flatnonzero(b[2] > 1e-3)]
    a = a[:, : b.shape[1]]
    there, back = evaluate(case, a, b)[0] / b[2], evaluate(case, b, a)[0] / a[2]
    np.testing.assert_allclose(there, back, rtol=1e-5)


@continuous
def test_nothing_is_scattered_below_the_horizon(case):
    wi = towards(np.linspace(-1, 0, 50))
    value, pdf = evaluate(case, towards(0.5), wi)
    assert np.abs(value).max() == 0
    assert np.abs(pdf).max() == 0


@continuous
def test_values_are_finite_and_not_negative_at_grazing_angles(case):
    wi = towards([1e-20, 1e-7, 1e-3, 0.0, -0.0, 1.0])
    for cosine in (1.0, 1e-7, 0.0, -0.5):
        wo = np.repeat(towards(cosine), wi.shape[1], axis=1)
        for array in evaluate(case, wo, wi):
            assert array.dtype == F32
            assert np.isfinite(array).all()
            assert array.min() >= 0


# --- Closures that scatter into single directions -----------------------------------------------


@delta
@sides
def test_one_sample_is_on_average_the_sum_of_all_branches(case, back):
    u = (np.arange(1 << 14, dtype=F32) + F32(0.5)) / F32(1 << 14)
    for cosine in (1.0, 0.7, 0.3, 0.05):
        wo = np.repeat(towards(cosine), u.size, axis=1)
        wi, weight, pdf = sample(case, wo, back, u, np.zeros_like(u))
        weight = np.broadcast_to(weight, (3, u.size))
        left = np.ones(u.size, bool)
        for there, share in case.module.branches(case.columns(1), wo[:, :1], np.array([back])):
            share = np.broadcast_to(share, (3, 1))
            here = (wi == there).all(axis=0)
            left &= ~here
            mean = np.where(here, weight, 0).mean(axis=1, dtype=float)
            np.testing.assert_allclose(mean, share[:, 0], atol=2e-4)
            expected = np.repeat(share, here.sum(), axis=1)
            np.testing.assert_allclose((weight * pdf)[:, here], expected, rtol=1e-5)
        assert weight[:, left].sum() == 0


@delta
@sides
def test_all_branches_together_keep_the_energy(case, back):
    wo = towards(COSINES)
    branches = case.module.branches(case.columns(COSINES.size), wo, np.full(COSINES.size, back))
    total = sum(np.broadcast_to(weight, (3, COSINES.size)).astype(float) for _, weight in branches)
    assert total.max() <= 1 + 1e-6
    if case.albedo is not None:
        np.testing.assert_allclose(total, case.albedo, atol=1e-6)
    for wi, weight in branches:
        assert wi.dtype == weight.dtype == F32


def test_a_mirror_reflects_by_the_law_and_by_schlick():
    wo = towards(COSINES)
    ((wi, weight),) = REGISTRY["mirror"].branches(
        np.repeat(F32([[0.9], [0.5], [0.1], [1.0], [0.9], [0.3]]), COSINES.size, axis=1), wo, None
    )
    np.testing.assert_array_equal(wi, wo * F32([[-1], [-1], [1]]))
    schlick = 0.5 + (0.9 - 0.5) * (1 - COSINES) ** 5
    np.testing.assert_allclose(weight[1], schlick, atol=1e-6)


def reference_fresnel(cosine, eta):
    """Reflectance in float64 by angles, 1 beyond the critical one (Born & Wolf, section 1.5)."""
    sine = np.sqrt(1 - cosine**2) / eta
    inside = np.sqrt(np.maximum(1 - sine**2, 0))
    s = (cosine - eta * inside) / (cosine + eta * inside)
    p = (eta * cosine - inside) / (eta * cosine + inside)
    return np.where(sine >= 1, 1.0, (s**2 + p**2) / 2)


@pytest.mark.parametrize("ior", IORS)
@sides
def test_glass_reflects_what_fresnel_says(ior, back):
    eta = np.full(COSINES.size, F32(1) / F32(ior) if back else F32(ior), F32)
    cosine = COSINES.astype(F32)
    reflectance, _ = glass.fresnel(cosine, eta)
    assert reflectance.dtype == F32
    expected = reference_fresnel(cosine.astype(float), eta.astype(float))

    # Next to the critical angle the reflectance is as steep as a square root.
    clear = np.abs(cosine.astype(float) ** 2 - (1 - eta.astype(float) ** 2)) > 1e-4
    np.testing.assert_allclose(reflectance[clear], expected[clear], atol=2e-5)


@pytest.mark.parametrize("ior", IORS)
@sides
def test_reflection_is_total_exactly_where_snell_says(ior, back):
    eta = np.full(COSINES.size, F32(1) / F32(ior) if back else F32(ior), F32)
    cosine = COSINES.astype(F32)
    expected = np.sqrt(1 - cosine.astype(float) ** 2) > eta.astype(float)
    reflectance, beyond = glass.fresnel(cosine, eta)
    np.testing.assert_array_equal(reflectance == 1, expected)
    np.testing.assert_array_equal(beyond == 0, expected)
    for name in ("glass", "refraction"):
        parameters = np.ones((len(REGISTRY[name].PARAMETERS), cosine.size), F32)
        parameters[0] = ior
        wo = towards(COSINES)
        *_, (_, weight) = REGISTRY[name].branches(parameters, wo, np.full(cosine.size, back))
        np.testing.assert_array_equal(np.broadcast_to(weight, (3, cosine.size))[0] == 0, expected)


@sides
def test_glass_of_index_1_is_transparent(back):
    wo = towards(COSINES)
    (_, reflected), (wi, through) = glass.branches(
        np.ones((7, COSINES.size), F32), wo, np.full(COSINES.size, back)
    )
    assert reflected.max() == 0
    assert through.min() == 1
    np.testing.assert_allclose(wi, -wo, atol=1e-7)


@pytest.mark.parametrize("ior", IORS)
@pytest.mark.parametrize("name", ("glass", "refraction"))
@sides
def test_refracted_directions_obey_snell(name, ior, back):
    module, count = REGISTRY[name], COSINES.size
    parameters = np.ones((len(module.PARAMETERS), count), F32)
    parameters[0] = ior
    wo = towards(COSINES)
    *_, (wi, weight) = module.branches(parameters, wo, np.full(count, back))
    through = np.flatnonzero(np.broadcast_to(weight, (3, count))[0] > 0)
    assert through.size > 30
    eta = 1 / ior if back else ior
    np.testing.assert_allclose(wi[:2, through] * eta, -wo[:2, through], atol=1e-6)
    np.testing.assert_allclose((wi[:, through] ** 2).sum(axis=0), 1, atol=2e-6)
    assert wi[2, through].max() < 0


@pytest.mark.parametrize("ior", IORS)
@pytest.mark.parametrize("name", ("glass", "refraction"))
def test_refracted_light_finds_its_way_back(name, ior):
    module, count = REGISTRY[name], COSINES.size
    parameters = np.ones((len(module.PARAMETERS), count), F32)
    parameters[0] = ior
    wo = towards(COSINES)
    *_, (wi, there) = module.branches(parameters, wo, np.zeros(count, bool))
    there = np.broadcast_to(there, (3, count))
    open_ = np.flatnonzero((there[0] > 0) & (wo[2] > 0.02) & (wi[2] < -0.02))
    assert open_.size > 50

    # The same surface seen from inside: its frame is the mirrored one.
    flip = F32([[1], [1], [-1]])
    *_, (home, back) = module.branches(
        parameters[:, open_], (wi * flip)[:, open_], np.ones(open_.size, bool)
    )
    np.testing.assert_allclose(home, (wo * flip)[:, open_], atol=2e-5)
    np.testing.assert_allclose(np.broadcast_to(back, (3, open_.size)), there[:, open_], atol=1e-4)
