"""core.geometry.mesh -> flattened instances: places, sides, normals, materials, what is dropped."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Cancelled, Instance, SceneError
from penumbra.core.geometry import mesh as m
from penumbra.core.scene import RayKinds
from tests.support import scenes as s

TABLES = (0, np.inf)  # hits expected: rows made for each hit, or in advance
BOX, SPHERE = s.box(), s.sphere(levels=1)
with_and_without_tables = pytest.mark.parametrize("hits", TABLES, ids=("rows", "tables"))


def flatten(*instances, origin=(0, 0, 0), limit=2**30, hits=np.inf, should_stop=lambda: False):
    materials = {}
    for instance in instances:
        for material in instance.materials or (None,):
            materials.setdefault(id(material), len(materials))
    return m.compile_triangles(
        instances, materials, np.asarray(origin, float), limit, hits, should_stop
    )


def columns(triangles):
    return triangles.columns(np.arange(triangles.count, dtype=np.int32))


def middles(triangles):
    return triangles.vertices[triangles.corners].astype(float).mean(axis=1).T


def corner_normals(triangles):
    """Corner normals (F, 3, 3) and the positions of the corners (F, 3, 3)."""
    every = np.arange(triangles.count, dtype=np.int32)
    return triangles.corner_normals(every).T.reshape(-1, 3, 3), triangles.vertices[
        triangles.corners
    ]


@with_and_without_tables
def test_a_row_holds_the_unit_normal_and_the_plane_of_its_triangle(hits):
    triangles, notes = flatten(s.put(BOX), hits=hits)
    table = columns(triangles)
    assert notes == []
    assert triangles.count == 12
    normal, plane = table[:3], table[m.PLANE]
    np.testing.assert_allclose((normal**2).sum(axis=0), 1, atol=1e-6)
    np.testing.assert_allclose(plane, 1, atol=1e-6)
    np.testing.assert_allclose((normal * middles(triangles)).sum(axis=0), 1, atol=1e-6)
    assert (table[m.OFFSET] > 0).all()
    assert (triangles.ids[:, 1] == m.FLAT).all()
    assert triangles.is_flat


@with_and_without_tables
def test_instances_are_placed_about_the_local_origin_in_double_precision(hits):
    far = np.array([1e7, -2e7, 3e6])
    placed = s.put(s.box(0.1), to_world=s.affine(2.0, far + 0.3))
    triangles, _ = flatten(placed, origin=far, hits=hits)
    expected = (s.box(0.1).positions * 2 + 0.3).astype(np.float32)
    np.testing.assert_allclose(triangles.vertices, expected, atol=4e-9)  # doubles at 1e7
    away = s.mesh(s.box(0.1).positions - far, BOX.triangles)
    triangles, _ = flatten(s.put(away, to_world=s.affine(2.0, 2 * far + 0.3)), hits=hits)
    np.testing.assert_allclose(triangles.vertices, expected, atol=2e-8)
    assert triangles.vertices.dtype == np.float32
    assert triangles.corners.dtype == np.int32


@with_and_without_tables
def test_every_instance_of_a_mesh_has_its_own_triangles(hits):
    pair = s.put(BOX), s.put(BOX, to_world=s.affine(0.5, (5, 0, 0)))
    triangles, _ = flatten(*pair, hits=hits)
    assert triangles.count == 24
    np.testing.assert_allclose(middles(triangles)[0, 12:].mean(), 5, atol=1e-6)
    assert triangles.corners[:12].max() == 7
    assert triangles.corners[12:].min() == 8


@with_and_without_tables
@pytest.mark.parametrize("scale", ((-1, 1, 1), (2, -3, 0.5), (-1, -1, -1), (-1, -2, 1)))
def test_mirrored_objects_keep_their_outside(scale, hits):
    for shape in (BOX, SPHERE, s.sphere(levels=1, smooth=False)):
        triangles, _ = flatten(s.put(shape, to_world=s.affine(scale)), hits=hits)
        outward = (columns(triangles)[:3] * middles(triangles)).sum(axis=0)
        assert outward.min() > 0
        if not triangles.is_flat:
            normals, corners = corner_normals(triangles)
            assert (normals * corners).sum(axis=2).min() > 0


@with_and_without_tables
@pytest.mark.parametrize("per_corner", (False, True), ids=("vertex", "corner"))
@pytest.mark.parametrize("scale", ((1, 1, 1), (1, 2, 3), (1e-4, 1e3, 1), (-1, 2, 1)))
def test_normals_stay_square_to_the_surface_under_uneven_scale(scale, per_corner, hits):
    shape = SPHERE
    if per_corner:
        shape = s.mesh(shape.positions, shape.triangles, shape.normals[shape.triangles])
    triangles, _ = flatten(s.put(shape, to_world=s.affine(scale)), hits=hits)
    normals, corners = corner_normals(triangles)
    expected = corners / np.square(scale)  # the gradient of the ellipsoid
    expected /= np.linalg.norm(expected, axis=2, keepdims=True)
    np.testing.assert_allclose(normals, expected, atol=2e-6)


@with_and_without_tables
def test_flat_and_smooth_meshes_live_together(hits):
    own = s.mesh(SPHERE.positions, SPHERE.triangles, SPHERE.normals[SPHERE.triangles] * -1)
    triangles, _ = flatten(s.put(BOX), s.put(SPHERE), s.put(own), hits=hits)
    smooth = columns(triangles).view(np.int32)[m.SMOOTH]
    count = len(SPHERE.triangles)
    assert (smooth[:12] == m.FLAT).all()
    assert (smooth[12:] != m.FLAT).all()
    normals, corners = corner_normals(triangles)
    np.testing.assert_allclose(normals[12 : 12 + count], corners[12 : 12 + count], atol=1e-6)
    np.testing.assert_allclose(normals[12 + count :], -corners[12 + count :], atol=1e-6)


@with_and_without_tables
def test_material_slots_become_numbers_and_too_high_ones_the_last(hits):
    red, blue = s.diffuse((1, 0, 0)), s.diffuse((0, 0, 1))
    shape = s.mesh(BOX.positions, BOX.triangles[:4], slots=(0, 1, 6, 1))
    triangles, _ = flatten(s.put(BOX, blue), s.put(shape, red, blue), s.put(BOX), hits=hits)
    material = columns(triangles).view(np.int32)[m.MATERIAL]
    assert (material[:12] == 0).all()
    assert material[12:16].tolist() == [1, 0, 0, 0]
    assert (material[16:] == 2).all()


@with_and_without_tables
def test_triangles_know_their_instance_by_its_place_in_the_scene(hits):
    nothing = s.put(s.mesh(np.zeros((3, 3)), np.zeros((0, 3), int)))
    unseen = Instance("Unseen", BOX, s.affine(), seen_by=RayKinds(*[False] * 5))
    triangles, _ = flatten(nothing, s.put(BOX), unseen, s.put(BOX), hits=hits)
    numbered = replace(triangles, is_numbered=True)
    instance = columns(numbered).view(np.int32)[m.INSTANCE]
    assert instance.tolist() == [1] * 12 + [3] * 12
    assert len(triangles.objects.seen_by) == 4


@pytest.mark.parametrize("bad", (np.nan, np.inf, -np.inf))
@pytest.mark.parametrize("dtype", (np.float32, np.float64))
def test_triangles_with_a_vertex_that_is_no_number_are_left_out_and_noted(bad, dtype):
    positions = BOX.positions.astype(dtype)
    positions[3, 1] = bad
    broken = m.Mesh("Torn", positions, BOX.triangles, slots=np.arange(12, dtype=np.int32))
    left_out = (BOX.triangles == 3).any(axis=1)
    triangles, notes = flatten(s.put(broken), s.put(broken, to_world=s.affine(2.0)))
    assert triangles.count == 2 * (~left_out).sum()
    assert np.isfinite(triangles.vertices).all()
    assert np.isfinite(columns(triangles)[: m.MATERIAL]).all()
    ((owner, what),) = [(note.owner, note.what) for note in notes]
    assert owner == "Mesh 'Torn'"
    assert f"{left_out.sum()} triangles" in what
    assert "vertex 3" in what
    assert np.isfinite(m.bounds((s.put(broken),))).all()


def test_a_mesh_of_nothing_but_nan_is_no_mesh():
    nothing = s.mesh(np.full((3, 3), np.nan), [(0, 1, 2)])
    triangles, notes = flatten(s.put(nothing))
    assert triangles is None
    assert len(notes) == 1
    assert m.bounds((s.put(nothing),)) is None


def test_meshes_without_triangles_are_skipped():
    empty = s.mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    points = s.mesh(np.ones((5, 3)), np.zeros((0, 3), int))
    assert flatten(s.put(empty), s.put(points)) == (None, [])
    assert m.bounds((s.put(empty), s.put(points))) is None
    triangles, _ = flatten(s.put(empty), s.put(BOX), s.put(points))
    assert triangles.count == 12


@with_and_without_tables
def test_triangles_without_area_and_singular_matrices_have_finite_rows(hits):
    flat = s.mesh([(0, 0, 0), (1, 1, 1), (2, 2, 2), (0, 0, 0)], [(0, 1, 2), (0, 0, 0), (0, 3, 1)])
    parts = [s.put(flat)]
    for scale in ((1, 1, 0), (0, 0, 1), (0, 0, 0)):
        parts += [s.put(shape, to_world=s.affine(scale)) for shape in (BOX, SPHERE)]
    triangles, notes = flatten(*parts, hits=hits)
    assert notes == []
    assert np.isfinite(columns(triangles)[: m.MATERIAL]).all()
    assert np.isfinite(corner_normals(triangles)[0]).all()


def test_a_scene_too_large_for_its_memory_names_the_largest_object():
    small, large = s.put(BOX, name="Pebble"), s.put(SPHERE, name="Mountain")
    many = [s.put(BOX, name="Swarm") for _ in range(100)]
    with pytest.raises(SceneError, match=r"'Mountain'.*Instance Memory"):
        flatten(small, large, limit=10_000)
    with pytest.raises(SceneError, match=r"'Swarm'.*Instance Memory"):
        flatten(small, large, *many, limit=10_000)


@with_and_without_tables
def test_flattening_stops_when_asked(hits):
    with pytest.raises(Cancelled):
        flatten(s.put(BOX), hits=hits, should_stop=lambda: True)


def test_bounds_hold_all_vertices_of_turned_instances():
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0] * (1, 2, 3)
    parts = s.put(SPHERE, to_world=s.affine(turn, (5, 6, 7))), s.put(BOX)
    low, high = m.bounds(parts)
    triangles, _ = flatten(*parts)
    assert (triangles.vertices >= low - 1e-5).all()
    assert (triangles.vertices <= high + 1e-5).all()
    assert (high - low < 2 * np.array([10, 10, 12])).all()
