"""What holds for all numbers, searched for numbers for which it does not (by hypothesis)."""

import os

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from penumbra.core import compile_plan, render
from penumbra.core.arrays import F32, ONE_BELOW, frame
from penumbra.core.bsdf import REGISTRY
from tests.support import scenes as s
from tests.unit.test_warp import ALL, DIRECTIONS

# Cases of each property, the same ones in every run; the long form asks for more
COUNT = int(os.environ.get("PENUMBRA_CASES", "50"))
MOST = 7  # a weight that no closure reaches: reflected and bent rays of one colour share the odds
search = settings(max_examples=COUNT, deadline=None, derandomize=True, database=None)


def number(low, high):
    """Floats from low to high that float32 has, edges and subnormal ones among them."""
    return st.floats(float(F32(low)), float(F32(high)), width=32)


DRAW = number(0, ONE_BELOW)
# What closures may be given, by the names of their parameters; what is made of others is not here
RANGES = {
    **dict.fromkeys(("alpha", "alpha_x", "alpha_y"), number(0, 1)),
    "eta": number(0.2, 5),
    "f0": number(0, 1),
    "reflection": number(0, 1),
    "transmission": number(0, 1),
    "b": number(0, 8),
    "n": number(0, 10),
    "k": number(0, 10),
    "thickness": number(0, 3000),
    "film_ior": number(1, 4),
    "sigma": number(0, 1),
    "size": number(0, 1),
    "smooth": number(0, 1),
}
CLOSURES = [name for name, each in REGISTRY.items() if set(each.PARAMETERS) <= set(RANGES)]
ROUGH = [name for name in CLOSURES if not REGISTRY[name].IS_DELTA]
DIRECTION = st.tuples(*[number(-1, 1)] * 3).map(np.float64)


def one(*numbers):
    """Return each number as an array (1,)."""
    return tuple(np.full(1, each, F32) for each in numbers)


def unit(way):
    """Return a unit direction (3, 1) of float32."""
    length = np.linalg.norm(way)
    assume(length > 1e-6)
    return (way / length).astype(F32)[:, None]


@st.composite
def parameters(draw, module):
    found = []
    for name, rows in module.PARAMETERS.items():
        values = [draw(RANGES[name]) for _ in range(rows)]
        found.append(np.array(values, F32)[:, None] if rows == 3 else np.array(values, F32))
    return tuple(found)


@pytest.mark.parametrize("name", ALL)
def test_warps_give_points_of_their_domain_that_lead_back_to_themselves(name):
    sample, invert = ALL[name]

    @search
    @given(DRAW, DRAW)
    def holds(u, v):
        point = sample(*one(u, v))
        assert np.isfinite(point).all()
        if name in DIRECTIONS:
            assert abs(np.linalg.norm(point.astype(float)) - 1) < 1e-6
            assert np.isfinite(DIRECTIONS[name][1](point)).all()
            assert (DIRECTIONS[name][1](point) >= 0).all()
        again = invert(point)
        assert all((each >= 0).all() and (each <= 1).all() for each in again)
        back = sample(*(np.minimum(each, ONE_BELOW) for each in again))
        np.testing.assert_allclose(back, point, atol=2e-3)

    holds()


@search
@given(DIRECTION)
def test_frames_are_orthonormal_and_right_handed(way):
    normal = unit(way)
    tangent, bitangent = frame(normal)
    axes = np.concatenate([tangent, bitangent, normal], axis=1).astype(float)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-6)
    assert np.linalg.det(axes) > 0


@pytest.mark.parametrize("name", CLOSURES)
def test_closures_send_finite_light_into_unit_directions(name):
    module = REGISTRY[name]

    @search
    @given(parameters(module), DIRECTION, st.tuples(DRAW, DRAW, DRAW))
    def holds(given_parameters, way, draws):
        wo = unit(way)
        u, v, w = one(*draws)
        wi, weight, pdf = module.sample(given_parameters, wo, u, v, w if module.DRAWS > 2 else None)
        weight = np.ones(1, F32) if weight is None else weight
        assert np.isfinite(wi).all()
        assert np.isfinite(weight).all()
        assert (weight >= 0).all()
        assert not np.isnan(pdf).any()
        assert (np.asarray(pdf) >= 0).all()
        if wo[2] <= 0:
            return
        if (weight > 0).any():
            assert abs(np.linalg.norm(wi.astype(float)) - 1) < 1e-4
        assert weight.max() < MOST

    holds()


@pytest.mark.parametrize("name", ROUGH)
def test_closures_evaluate_to_finite_light_in_all_directions(name):
    module = REGISTRY[name]

    @search
    @given(parameters(module), DIRECTION, DIRECTION)
    def holds(given_parameters, way, other):
        wo, wi = unit(way), unit(other)
        value, pdf = module.evaluate(given_parameters, wo, wi)
        assert np.isfinite(value).all()
        assert np.isfinite(pdf).all()
        assert (np.asarray(value) >= 0).all()
        assert (np.asarray(pdf) >= 0).all()

    holds()


@search
@given(
    st.tuples(*[number(-1, 1)] * 9).map(lambda values: np.reshape(values, (3, 3)).astype(float)),
    number(-6, 6),
    st.tuples(*[number(-1e3, 1e3)] * 3).map(np.float64),
    st.integers(0, 2**31 - 1),
)
def test_triangles_neither_shadow_themselves_nor_let_light_through(corners, size, shift, seed):
    # A triangle of any size and place, a lamp on each side, a camera on one
    edges = corners[1] - corners[0], corners[2] - corners[0]
    normal = np.cross(*edges)
    area = np.linalg.norm(normal)
    assume(area > 0.05)
    normal /= area
    scale = 10.0**size
    middle = corners.mean(axis=0)

    def place(point):
        return (point + shift) * scale

    mesh = s.mesh(np.stack([place(each) for each in corners]), [(0, 1, 2)])

    eye = place(middle + 0.5 * normal)
    view = s.camera(eye, place(middle), size=4, fov=1.0, clip_start=1e-3 * scale)
    lit = s.point(place(middle + 0.3 * normal), scale**2)
    below = s.point(place(middle - 0.3 * normal), scale**2)
    for lamp, is_lit in ((lit, True), (below, False)):
        few = s.replace(s.DEFAULTS, samples=2, max_bounces=0, seed=seed)
        plan = compile_plan(s.scene(view, s.put(mesh, s.diffuse(1.0)), lamp), few)
        pixels = render(plan, 1).combined()[..., :3]
        assert np.isfinite(pixels).all()
        assert (pixels > 0).all() == is_lit
        assert (pixels == 0).all() != is_lit
