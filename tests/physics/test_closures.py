"""core.bsdf -> every closure samples what it evaluates, keeps the energy, can be reversed."""

import numpy as np
import pytest

from penumbra.core.arrays import ONE_BELOW, frame
from penumbra.core.bsdf import DIFFUSE, GLOSSY, REGISTRY, STRAIGHT
from tests.physics.cases import CASES, CONTINUOUS, DELTA
from tests.support.lobes import chi2_of_lobe
from tests.support.statistics import SIGNIFICANCE, chi2_of_directions, sidak

F32 = np.float32
COSINES = np.concatenate([np.linspace(0.01, 1, 400), 10.0 ** np.linspace(-4, -2, 50)])
ANGLES = (0, 30, 60, 80, 89)  # of the viewer [degrees]
FLIP = F32([[1], [1], [-1]])  # to the frame of the same surface, seen from the other side

every = pytest.mark.parametrize("case", CASES, ids=str)
continuous = pytest.mark.parametrize("case", CONTINUOUS, ids=str)
delta = pytest.mark.parametrize("case", DELTA, ids=str)


def towards(cosine, azimuth=0.7):
    """Unit directions (3, n) float32 with these cosines (n,)."""
    cosine = np.atleast_1d(np.asarray(cosine, float))
    sine = np.sqrt(np.maximum(1 - cosine * cosine, 0))
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine]).astype(F32)


def from_angle(angle, count):
    """The viewer's direction (3, count) at this angle [degrees]."""
    return np.repeat(towards(np.cos(np.radians(angle))), count, axis=1)


def grid(side):
    """u, v, w (side^2,): a square grid, and another number that goes with neither."""
    middle = (np.arange(side, dtype=F32) + F32(0.5)) / F32(side)
    u, v = np.meshgrid(middle, middle)
    w = (np.arange(side * side) * 0.6180339887498949 % 1).astype(F32)
    return u.ravel(), v.ravel(), np.minimum(w, ONE_BELOW)


def sample(case, wo, u, v, w, columns=None):
    """wi, weight (3, n) and pdf, with constant parameters unless other columns are given."""
    if case.module.DRAWS == 2:
        w = None
    columns = case.columns() if columns is None else columns
    wi, weight, pdf = case.module.sample(columns, wo, u, v, w)
    weight = np.ones(u.size, F32) if weight is None else weight
    return wi, np.broadcast_to(weight, (3, u.size)), pdf


def branches(case, wo):
    """All directions (3, n) of a delta closure, and their weights (3, n)."""
    found = case.module.branches(case.columns(), wo)
    return [(wi, np.broadcast_to(F32(1) if w is None else w, wo.shape)) for wi, w in found]


def evaluate(case, wo, wi, count=1, **changes):
    """The values f cos (3, n) and pdf (n,), with so many columns of parameters."""
    value, pdf = case.module.evaluate(case.columns(count, **changes), wo, wi)
    return np.broadcast_to(value, (3, wi.shape[1])), pdf


def alive(weight):
    return np.flatnonzero(weight.max(axis=0) > 0)


def rounding(function, wi):
    """How far function(wi) may be off (..., n) because wi (3, n) is rounded to float32."""
    here = function(wi)
    off = 1e-5 * np.abs(here) + 1e-30
    for axis in range(3):
        for step in (2.0**-22, -(2.0**-22)):
            moved = wi.copy()
            moved[axis] += F32(step)
            off = np.maximum(off, 2 * np.abs(function(moved) - here))
    return off


def test_every_closure_has_a_row_of_parameters():
    assert {case.closure for case in CASES} == set(REGISTRY)
    for case in CASES:
        assert set(case.parameters) == set(case.module.PARAMETERS), case


@pytest.mark.parametrize("name", REGISTRY)
def test_every_closure_declares_what_the_protocol_asks_for(name):
    module = REGISTRY[name]
    assert name == module.NAME
    assert set(module.PARAMETERS.values()) <= {1, 3}
    assert isinstance(module.IS_DELTA, bool)
    assert isinstance(module.WEIGHT_IN_WI_Z, bool)
    assert isinstance(module.TRANSMITS, bool)
    assert module.RAY_KIND in (DIFFUSE, GLOSSY, STRAIGHT)
    assert module.DRAWS in (2, 3)
    assert callable(module.sample)
    assert callable(module.branches if module.IS_DELTA else module.evaluate)


# --- All closures -------------------------------------------------------------------------------


@every
def test_samples_are_unit_finite_float32_even_where_it_is_degenerate(case):
    cosines = (1.0, 0.5, 1e-3, 1e-7, 1e-20, 0.0, -1e-7, -0.5, -1.0)
    corners = np.array((0.0, 2.0**-24, 0.5, ONE_BELOW), F32)
    u, v, w, which = (
        each.ravel() for each in np.meshgrid(corners, corners, corners, np.arange(len(cosines)))
    )
    wo = towards(cosines)[:, which]
    wi, weight, pdf = sample(case, wo, u, v, w)
    for name, array in (("wi", wi), ("weight", weight), ("pdf", pdf)):
        assert array.dtype == F32, name
        assert np.isfinite(array).all(), name
    assert weight.min() >= 0
    assert pdf.min() >= 0
    drawn = alive(weight)
    assert case.module.RAY_KIND != GLOSSY or wo[2, drawn].min(initial=1) > 0
    assert case.module.TRANSMITS or wi[2, drawn].min(initial=0) >= 0
    np.testing.assert_allclose((wi[:, drawn] ** 2).sum(axis=0), 1, atol=3e-6)


@every
def test_constant_parameters_do_what_columns_of_them_do(case):
    rng = np.random.default_rng(3)
    u, v, w = rng.random((3, 500), F32)
    for angle in ANGLES:
        wo = from_angle(angle, 500)
        one, many = (
            sample(case, wo, u, v, w, columns)
            for columns in (case.constants(500), case.columns(500))
        )
        for a, b in zip(one, many, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-9)
        if not case.module.IS_DELTA:
            a = case.module.evaluate(case.constants(500), wo, one[0])
            b = case.module.evaluate(case.columns(500), wo, one[0])
            np.testing.assert_allclose(a[0], b[0], rtol=1e-6)
            np.testing.assert_allclose(a[1], b[1], rtol=1e-6)


@every
def test_arguments_are_left_alone(case):
    u, v, w = grid(4)
    wo = from_angle(40, u.size)
    columns = case.columns(u.size)
    arguments = (wo, u, v, w, *columns)
    before = [each.copy() for each in arguments]
    wi, _, _ = sample(case, wo, u, v, w, columns)
    if case.module.IS_DELTA:
        case.module.branches(columns, wo)
    else:
        there = wi.copy()
        case.module.evaluate(columns, wo, wi)
        np.testing.assert_array_equal(wi, there)
    for a, b in zip(arguments, before, strict=True):
        np.testing.assert_array_equal(a, b)


@every
def test_no_closure_sends_back_more_light_than_it_gets(case):
    u, v, w = grid(128)
    for angle in ANGLES:
        _, weight, _ = sample(case, from_angle(angle, u.size), u, v, w)
        mean = weight.mean(axis=1, dtype=float)
        assert mean.max() <= case.most + 1e-3
        if case.albedo is not None:
            np.testing.assert_allclose(mean, case.albedo, atol=1e-3)


# --- Closures that scatter into all directions --------------------------------------------------


@continuous
def test_sampled_directions_follow_the_pdf(case):
    rng = np.random.default_rng(1)
    count, total = 60_000, 0
    for angle in ANGLES:
        u, v, w = rng.random((3, count), F32)
        wo = from_angle(angle, count)
        wi, _, pdf = sample(case, wo, u, v, w)
        drawn = wi[:, np.flatnonzero(pdf > 0)]
        total += drawn.shape[1]

        def density(there, wo=wo[:, :1]):
            return evaluate(case, wo, there)[1] * case.possible(wo, there)

        found = [chi2_of_lobe(drawn, density, count, above) for above in (True, False)]
        if drawn.size and is_wide(drawn) and not case.edge:
            scale = count / drawn.shape[1]
            found.append(chi2_of_directions(drawn, lambda w, k=scale: density(w) * k, refine=16))
        assert min(found) > sidak(SIGNIFICANCE, 3 * len(ANGLES)), angle
    assert total > count


def is_wide(wi):
    """Tell whether directions (3, n) fill enough of each side for cells of equal size."""
    sides = (wi[:, np.flatnonzero(wi[2] > 0)], wi[:, np.flatnonzero(wi[2] < 0)])
    return all(
        np.linalg.norm(some.mean(axis=1, dtype=float)) < 0.9
        for some in sides
        if some.shape[1] > 0.01 * wi.shape[1]
    )


@pytest.mark.parametrize("case", [c for c in CASES if hasattr(c.module, "sample_about")], ids=str)
@pytest.mark.parametrize("normal", ((0, 0, 1), (0, 0, -1), (0.6, -0.48, 0.64), (0, 1, 0)))
def test_directions_about_a_normal_are_distributed_by_the_pdf(case, normal):
    u, v, _ = grid(256)
    normals = np.repeat(np.array(normal, F32)[:, None], u.size, axis=1)
    direction, weight, _ = case.module.sample_about(case.columns(), normals, u, v)
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
    u, v, w = grid(32)
    for angle in ANGLES:
        wo = from_angle(angle, u.size)
        wi, weight, pdf = sample(case, wo, u, v, w)
        some = alive(weight)
        wo, wi = wo[:, some], wi[:, some]
        for number, found in enumerate(((weight * pdf)[:, some], pdf[some])):
            expected = evaluate(case, wo, wi)[number]
            off = rounding(lambda there, k=number, wo=wo: evaluate(case, wo, there)[k], wi)
            assert (np.abs(found - expected) <= off + 1e-6 * pdf[some]).all(), (angle, number)


@pytest.mark.parametrize("case", [c for c in CONTINUOUS if c.reciprocal], ids=str)
def test_light_takes_the_same_way_in_both_directions(case):
    # What passes is seen in the frame of the other side; radiance is carried without eta^2.
    u, v, w = grid(16)
    pairs = 0
    for angle in (20, 73):
        a = from_angle(angle, u.size)
        b, weight, _ = sample(case, a, u, v, w)
        some = np.intersect1d(alive(weight), np.flatnonzero(np.abs(b[2]) > 1e-2))
        pairs += some.size
        for through in (False, True):
            here = some[(b[2, some] < 0) == through]
            wo, wi = a[:, here], b[:, here]

            def there(wi, wo=wo):
                return evaluate(case, wo, wi, wi.shape[1])[0] / np.abs(wi[2])

            def back(wi, wo=wo, through=through):
                if not through:
                    return evaluate(case, wi, wo, wi.shape[1])[0] / wo[2]
                value, _ = evaluate(case, wi * FLIP, wo * FLIP, wi.shape[1], **case.turned)
                return value / wo[2] * case.eta**2

            off = rounding(there, wi) + rounding(back, wi)
            assert (np.abs(there(wi) - back(wi)) <= off).all(), (angle, through)
    assert pairs > 50 or case.albedo == 0


@continuous
def test_nothing_is_scattered_where_nothing_can_be(case):
    below = towards(np.linspace(-1, 0, 50))
    both = np.concatenate([below, -below], axis=1)
    # What is matte scatters, as in Cycles, also where its shading normal turns from the viewer.
    unseen = [both] if case.module.RAY_KIND == GLOSSY else []
    pairs = [(towards(-0.5), wi) for wi in unseen]
    if not case.module.TRANSMITS:
        pairs.append((towards(0.5), below))
    for wo, wi in pairs:
        value, pdf = evaluate(case, wo, wi)
        assert np.abs(value).max() == 0
        assert np.abs(pdf).max() == 0


@continuous
def test_values_are_finite_and_not_negative_at_grazing_angles(case):
    cosines = [1e-20, 1e-7, 1e-3, 0.0, -0.0, 1.0, 0.5, -1e-20, -1e-7, -1e-3, -0.5, -1.0]
    wi = np.concatenate([towards(cosines, azimuth) for azimuth in (0.7, 0.7 + np.pi, 2)], axis=1)
    for cosine in (1.0, 0.5, 1e-3, 1e-7, 0.0, -0.5, -1.0):
        wo = np.repeat(towards(cosine), wi.shape[1], axis=1)
        for array in evaluate(case, wo, wi):
            assert array.dtype == F32
            assert np.isfinite(array).all()
            assert array.min() >= 0


# --- Closures that scatter into single directions -----------------------------------------------


@delta
def test_one_sample_is_on_average_the_sum_of_all_branches(case):
    u = (np.arange(1 << 14, dtype=F32) + F32(0.5)) / F32(1 << 14)
    for cosine in (1.0, 0.7, 0.3, 0.05):
        wo = np.repeat(towards(cosine), u.size, axis=1)
        wi, weight, pdf = sample(case, wo, u, np.zeros_like(u), None)
        left = np.ones(u.size, bool)
        for there, share in branches(case, wo[:, :1]):
            here = (wi == there).all(axis=0)
            left &= ~here
            mean = np.where(here, weight, 0).mean(axis=1, dtype=float)
            np.testing.assert_allclose(mean, share[:, 0], atol=2e-4)
            expected = np.repeat(share, here.sum(), axis=1)
            np.testing.assert_allclose((weight * pdf)[:, here], expected, rtol=1e-5)
        assert weight[:, left].sum() == 0


@delta
def test_all_branches_together_keep_the_energy(case):
    wo = towards(COSINES)
    found = branches(case, wo)
    total = sum(weight.astype(float) for _, weight in found)
    assert total.max() <= 1 + 1e-6
    if case.albedo is not None:
        np.testing.assert_allclose(total, case.albedo, atol=1e-6)
    for wi, weight in found:
        assert wi.dtype == weight.dtype == F32
        assert case.module.TRANSMITS or wi[2].min() >= 0
