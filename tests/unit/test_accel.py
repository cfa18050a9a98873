"""core.geometry.accel -> the closest hits, against brute force in float64."""

import numpy as np
import pytest

from penumbra.core.geometry import accel as accel_module
from penumbra.core.geometry.accel import FAR, compile_accel
from penumbra.core.geometry.mesh import compile_triangles
from penumbra.core.scene import Instance, RayKinds
from penumbra.core.statistics import Tally
from tests.support import scenes as s

F32 = np.float32


def build(*shapes, is_quick=False):
    parts = tuple(s.put(shape) for shape in shapes)
    triangles, _ = compile_triangles(
        parts, {id(None): 0}, np.zeros(3), 2**30, np.inf, lambda: False
    )
    accel, _ = compile_accel(triangles, is_quick, lambda: False)
    return triangles, accel


def brute_force(triangles, origin, direction):
    """Distance (N,) and triangle (N,) of the closest hits; Moeller and Trumbore 1997."""
    a, b, c = triangles.vertices[triangles.corners].astype(float).transpose(1, 0, 2)
    e1, e2 = b - a, c - a
    p = np.cross(direction.T[:, None], e2)
    det = (e1 * p).sum(axis=2)
    s0 = origin.T[:, None] - a
    u = (s0 * p).sum(axis=2) / det
    q = np.cross(s0, e1)
    v = (direction.T[:, None] * q).sum(axis=2) / det
    t = (e2 * q).sum(axis=2) / det
    t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
    return t.min(axis=1), np.where(np.isinf(t.min(axis=1)), -1, t.argmin(axis=1))


def rays(count, seed=1):
    rng = np.random.default_rng(seed)
    origin = rng.normal(size=(3, count)) * 2
    direction = -origin + rng.normal(size=(3, count))
    direction /= np.linalg.norm(direction, axis=0)
    return origin.astype(F32), direction.astype(F32)


@pytest.mark.parametrize("is_quick", (False, True))
def test_closest_hits_are_those_of_brute_force(is_quick):
    triangles, accel = build(s.sphere(levels=1), s.box(0.7), is_quick=is_quick)
    origin, direction = rays(500)
    t, triangle = brute_force(triangles, origin.astype(float), direction.astype(float))
    hits = accel.closest(origin, direction, None, None, None, Tally())
    assert (hits.triangle == triangle).mean() > 0.99  # neighbours share their edges
    found = triangle >= 0
    assert 50 < found.sum() < 500
    np.testing.assert_array_equal(hits.triangle >= 0, found)
    np.testing.assert_allclose(hits.t[found], t[found], rtol=1e-5, atol=1e-6)
    corner = triangles.vertices[triangles.corners[hits.triangle[found]]]
    u, v = hits.u[found, None], hits.v[found, None]
    point = corner[:, 0] * (1 - u - v) + corner[:, 1] * u + corner[:, 2] * v
    np.testing.assert_allclose(point.T, (origin + direction * hits.t)[:, found], atol=1e-5)


def test_chunks_uploaded_through_embreex_are_hit_as_the_shared_triangles_are(monkeypatch):
    shapes = [s.quad(centre=(0, 0, z / 10)) for z in range(-20, 20)]
    _, shared = build(*shapes)
    monkeypatch.setattr(accel_module.embree, "open_library", lambda package: None)
    monkeypatch.setattr(accel_module, "CHUNK", 20)
    _, uploaded = build(*shapes)
    assert len(shared.parts[0].first) == 1
    assert len(uploaded.parts[0].first) == 4
    origin, direction = rays(2000)
    a = shared.closest(origin, direction, None, None, None, Tally())
    b = uploaded.closest(origin, direction, None, None, None, Tally())
    assert (a.triangle >= 0).any()
    assert (a.triangle < 0).any()
    np.testing.assert_array_equal(a.triangle, b.triangle)
    np.testing.assert_array_equal(a.t, b.t)


def test_parts_uploaded_through_embreex_are_hit_as_the_shared_ones_are(monkeypatch):
    shapes = [s.quad(centre=(0, 0, z / 10)) for z in range(-20, 20)]
    mixed = [
        Instance("Sheet", shape, s.affine(), seen_by=RayKinds(camera=bool(number % 3)))
        for number, shape in enumerate(shapes)
    ]
    triangles, _ = compile_triangles(
        tuple(mixed), {id(None): 0}, np.zeros(3), 2**30, np.inf, lambda: False
    )
    shared, _ = compile_accel(triangles, False, lambda: False)
    monkeypatch.setattr(accel_module.embree, "open_library", lambda package: None)
    monkeypatch.setattr(accel_module, "CHUNK", 20)
    uploaded, _ = compile_accel(triangles, False, lambda: False)
    assert [len(part.first) for part in shared.parts] == [1, 1]
    assert [len(part.first) for part in uploaded.parts] == [3, 2]
    origin, direction = rays(2000)
    for kinds in (None, np.full(2000, 2, np.uint8)):
        a = shared.closest(origin, direction, None, None, kinds, Tally())
        b = uploaded.closest(origin, direction, None, None, kinds, Tally())
        assert (a.triangle >= 0).any()
        np.testing.assert_array_equal(a.triangle, b.triangle)
        np.testing.assert_array_equal(a.t, b.t)


def test_rays_end_at_their_own_distance():
    triangles, accel = build(s.box())
    origin, direction = rays(500)
    t, triangle = brute_force(triangles, origin.astype(float), direction.astype(float))
    for share, blocked in ((0.99, False), (1.01, True)):
        far = np.where(np.isinf(t), FAR, t * share).astype(F32)
        before = far.copy()
        hits = accel.closest(origin, direction, far, None, None, Tally())
        np.testing.assert_array_equal(far, before)
        np.testing.assert_array_equal(hits.triangle >= 0, (triangle >= 0) & blocked)
        free = accel.free(origin, direction, far.copy(), Tally())
        np.testing.assert_array_equal(
            np.flatnonzero(free), np.flatnonzero(~((triangle >= 0) & blocked))
        )


def test_the_triangle_that_a_ray_has_left_is_no_hit():
    _, accel = build(s.quad(), s.quad(centre=(0, 0, 2)))
    below = np.array([[0.3], [0.2], [-1e-3]], F32)
    up = np.array([[0], [0], [1]], F32)
    tally = Tally()
    first = accel.closest(below, up, None, None, None, tally)
    assert first.triangle[0] < 2
    assert tally.self_hits == 0
    second = accel.closest(below, up, None, first.triangle, None, tally)
    assert second.triangle[0] >= 2
    np.testing.assert_allclose(second.t, 2.001, rtol=1e-6)
    assert tally.self_hits == 1
    limited = accel.closest(below, up, np.array([1.5], F32), first.triangle, None, tally)
    assert limited.triangle[0] == -1


def test_missed_rays_are_not_taken_for_rays_that_left_nothing():
    _, accel = build(s.quad())
    tally = Tally()
    away = np.array([[0], [0], [1]], F32)
    hits = accel.closest(away, away, None, np.array([-1], np.int32), None, tally)
    assert hits.triangle[0] == -1
