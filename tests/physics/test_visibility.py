"""rays -> what they see: parts by kind of ray, transparent surfaces, light linking, catchers."""

import numpy as np
import pytest

from penumbra.core import compile_plan
from penumbra.core.geometry.accel import FAR, compile_accel
from penumbra.core.geometry.layers import MOST_LAYERS
from penumbra.core.geometry.mesh import compile_triangles
from penumbra.core.geometry.surface import resolve
from penumbra.core.scene import (
    CAMERA,
    DIFFUSE,
    EVERY_SET,
    GLOSSY,
    SHADOW,
    TRANSMISSION,
    Instance,
    RayKinds,
)
from penumbra.core.statistics import Tally
from tests.support import scenes as s

F32 = np.float32
OPAQUE, CLEAR, BLUE = s.diffuse(), s.diffuse(), s.diffuse()
MATERIALS = {id(OPAQUE): 0, id(CLEAR): 1, id(BLUE): 2, id(None): 3}
KINDS = ("camera", "diffuse", "glossy", "transmission", "shadow")
UP = (0.0, 0.0, 1.0)


def put(shape, material=OPAQUE, **flags):
    return Instance(shape.name, shape, s.affine(), (material,), **flags)


def sheet(z, material=CLEAR, half=1.0, **flags):
    """A horizontal square at height z."""
    return put(s.quad((half, 0, 0), (0, half, 0), (0, 0, z)), material, **flags)


def build(*instances, transparent=(1, 2), hits=np.inf, **more):
    triangles, _ = compile_triangles(
        instances, MATERIALS, np.zeros(3), 2**31, hits, lambda: False, transparent, **more
    )
    accel, _ = compile_accel(triangles, False, lambda: False)
    return triangles, accel


def upward(count=64, half=0.9, length=10.0, z=0.0, seed=1):
    """Rays from z that end `length` higher, at places where no edges are."""
    rng = np.random.default_rng(seed)
    origin = np.vstack([rng.uniform(-half, half, (2, count)), np.full(count, z)])
    direction = np.vstack([rng.normal(0, 0.001, (2, count)), np.full(count, length)])
    return origin.astype(F32), direction.astype(F32), np.ones(count, F32)


def grey(value=0.5, seen=None):
    """What lets pass `value` and remembers in `seen` what was asked."""

    def shade(triangle, u, v, t, ray, met):
        if seen is not None:
            seen.append((triangle.copy(), t.copy(), ray.copy(), u.copy(), v.copy()))
        return np.full(ray.size, value, F32)

    return shade


def passed(accel, rays, shade, limit=100, **more):
    return accel.transmittance(*rays, Tally(), shade, limit, **more)


# --- Kinds of rays ------------------------------------------------------------------------------


@pytest.mark.parametrize("hidden", KINDS)
def test_a_surface_is_hidden_from_just_one_kind_of_ray(hidden):
    _, accel = build(
        sheet(1, OPAQUE, seen_by=RayKinds(**{hidden: False})), sheet(2, OPAQUE), sheet(9, OPAQUE)
    )
    assert len(accel.parts) == 2
    origin, direction, far = upward()
    bits = {"camera": CAMERA, "diffuse": DIFFUSE, "glossy": GLOSSY, "transmission": TRANSMISSION}
    for name, bit in bits.items():
        for kinds in [np.full(64, bit, np.uint8)] + [None] * (name == "camera"):
            hits = accel.closest(origin, direction, None, None, kinds, Tally())
            np.testing.assert_allclose(hits.t, 0.2 if name == hidden else 0.1, rtol=1e-5)
    low = np.full(64, 0.15, F32)
    free = accel.free(origin, direction, low, Tally())
    assert (free == (hidden == "shadow")).all()
    assert not accel.free(origin, direction, far, Tally()).any()


def test_rays_of_all_kinds_in_one_batch_see_each_their_own():
    _, accel = build(
        *(
            sheet(z, OPAQUE, seen_by=RayKinds(**{k: k == kind for k in KINDS}))
            for z, kind in enumerate(KINDS, 1)
        )
    )
    assert len(accel.parts) == 5
    origin, direction, _ = upward(1000)
    kinds = np.random.default_rng(5).choice([1, 2, 4, 8], 1000).astype(np.uint8)
    hits = accel.closest(origin, direction, None, None, kinds, Tally())
    np.testing.assert_allclose(hits.t * 10, np.log2(kinds) + 1, rtol=1e-5)
    far = np.full(1000, 0.05 + 0.1 * 2, F32)
    hits = accel.closest(origin, direction, far, None, kinds, Tally())
    np.testing.assert_array_equal(hits.triangle >= 0, kinds <= 2)
    assert (hits.t[kinds > 2] == far[0]).all()


@pytest.mark.parametrize("scattering", (DIFFUSE, GLOSSY))
def test_a_transmitted_ray_counts_as_nothing_else(scattering):
    no_glass, only_glass = RayKinds(transmission=False), RayKinds(False, False, False, True)
    _, accel = build(sheet(1, OPAQUE, seen_by=no_glass), sheet(2, OPAQUE, seen_by=only_glass))
    origin, direction, _ = upward()
    kinds = np.full(64, scattering | TRANSMISSION, np.uint8)
    hits = accel.closest(origin, direction, None, None, kinds, Tally())
    np.testing.assert_allclose(hits.t, 0.2, rtol=1e-5)


def test_rays_from_one_point_see_parts_of_their_kind():
    _, accel = build(
        sheet(1, OPAQUE, seen_by=RayKinds(camera=False)),
        sheet(2, OPAQUE, half=3, seen_by=RayKinds(diffuse=False)),
    )
    origin, direction, _ = upward(half=0.0)
    kinds = np.resize([CAMERA, DIFFUSE], 64).astype(np.uint8)
    mixed = accel.closest(origin[:, :1], direction, None, None, kinds, Tally())
    np.testing.assert_allclose(mixed.t, np.resize([0.2, 0.1], 64), rtol=1e-5)
    camera = accel.closest(origin[:, :1], direction, None, None, None, Tally())
    np.testing.assert_allclose(camera.t, 0.2, rtol=1e-5)


def test_the_triangle_a_ray_has_left_is_traced_again_for_its_own_kind():
    triangles, accel = build(sheet(0, OPAQUE), sheet(1, OPAQUE, seen_by=RayKinds(diffuse=False)))
    origin, direction, _ = upward(z=-1e-3)
    first = accel.closest(origin, direction, None, None, None, Tally())
    kinds = np.resize([GLOSSY, DIFFUSE], 64).astype(np.uint8)
    second = accel.closest(origin, direction, None, first.triangle, kinds, Tally())
    np.testing.assert_array_equal(second.triangle >= 0, kinds == GLOSSY)


def test_what_no_ray_sees_is_not_there():
    nowhere = RayKinds(False, False, False, False, False)
    triangles, accel = build(sheet(1, OPAQUE, seen_by=nowhere), sheet(2, OPAQUE))
    assert triangles.count == 2
    assert len(accel.parts) == 1
    only_nothing, _ = compile_triangles(
        (sheet(1, seen_by=nowhere),), MATERIALS, np.zeros(3), 2**31, np.inf, lambda: False
    )
    assert only_nothing is None


def test_plain_triangles_are_one_part_whatever_their_materials():
    triangles, accel = build(sheet(1, OPAQUE), sheet(2, CLEAR), transparent=())
    assert len(accel.parts) == 1
    assert triangles.part is None
    assert accel.parts[0].number is None
    assert accel.parts[0].shared[1] is triangles.corners
    assert not triangles.is_numbered


def test_parts_share_the_vertices_and_the_plain_one_is_first():
    hidden = RayKinds(camera=False)
    triangles, accel = build(sheet(1, CLEAR), sheet(2, OPAQUE, seen_by=hidden), sheet(3, OPAQUE))
    assert [part.traits.is_transparent for part in accel.parts] == [False, False, True]
    assert accel.parts[0].traits.seen_by == CAMERA | DIFFUSE | GLOSSY | TRANSMISSION | SHADOW
    assert all(part.shared[0] is triangles.vertices for part in accel.parts)


# --- Transparent surfaces -----------------------------------------------------------------------


@pytest.mark.parametrize("hits", (0, np.inf), ids=("rows", "tables"))
@pytest.mark.parametrize("layers", (1, 2, 7, 40))
def test_k_layers_let_pass_the_product_of_what_each_does(layers, hits):
    heights = np.random.default_rng(layers).permutation(np.linspace(0.5, 9.5, layers))
    _, accel = build(*(sheet(z) for z in heights), hits=hits)
    through = passed(accel, upward(), grey(0.9))
    assert through.dtype == np.float32
    np.testing.assert_allclose(through, 0.9**layers, rtol=1e-5)


def test_every_surface_is_asked_once_in_order_with_its_place_and_its_ray():
    triangles, accel = build(*(sheet(z) for z in (7, 3, 5)), put(s.quad(centre=(0, 0, 20))))
    rays = upward(500)
    seen = []
    passed(accel, rays, grey(0.5, seen))
    triangle, t, ray, u, v = (np.concatenate(each) for each in zip(*seen, strict=True))
    assert np.bincount(ray, minlength=500).tolist() == [3] * 500
    by_ray = t[np.argsort(ray, kind="stable")].reshape(500, 3)
    np.testing.assert_allclose(by_ray, np.tile([0.3, 0.5, 0.7], (500, 1)), rtol=1e-5)
    corner = triangles.vertices[triangles.corners[triangle]]
    place = corner[:, 0] * (1 - u - v)[:, None] + corner[:, 1] * u[:, None]
    place += corner[:, 2] * v[:, None]
    expected = rays[0][:, ray] + rays[1][:, ray] * t
    np.testing.assert_allclose(place.T, expected, atol=1e-5)


def test_colours_multiply_channel_by_channel():
    things = sheet(1, CLEAR), sheet(2, BLUE), sheet(3, CLEAR), sheet(4, OPAQUE, half=0.5)
    _, accel = build(*things)
    colours = np.array([[0, 0.5, 0.1], [0, 0.5, 0.2], [0, 0.5, 1.0]], F32)

    def shade(triangle, u, v, t, ray, met):
        return colours[:, np.where((triangle == 2) | (triangle == 3), 2, 1)]

    rays = upward()
    through = passed(accel, rays, shade)
    expected = np.tile([[0.025], [0.05], [0.25]], 64)
    expected *= np.abs(rays[0][:2] + rays[1][:2] * 0.4).max(axis=0) > 0.5
    np.testing.assert_allclose(through, expected, rtol=1e-5)


def test_each_surface_is_told_how_many_were_met_before():
    _, accel = build(*(sheet(z, CLEAR, half) for z, half in ((1, 1.0), (2, 0.5), (3, 1.0))))
    rays = upward()

    def shade(triangle, u, v, t, ray, met):
        between = np.abs(rays[0][:2] + rays[1][:2] * 0.2).max(axis=0) < 0.5
        before = np.where(t < 0.15, 0, np.where(t < 0.25, 1, 1 + between.take(ray)))
        np.testing.assert_array_equal(met, before)
        return np.full(ray.size, 0.5, F32)

    assert set(passed(accel, rays, shade).tolist()) == {0.25, 0.125}


@pytest.mark.parametrize("limit", (0, 1, 4, 5, 6))
def test_more_surfaces_than_the_limit_let_nothing_pass(limit):
    _, accel = build(*(sheet(z) for z in range(1, 6)))
    through = passed(accel, upward(), grey(), limit)
    np.testing.assert_allclose(through, 0.5**5 if limit >= 5 else 0)


def test_each_ray_has_a_limit_of_its_own_over_all_parts():
    soft = RayKinds(camera=False)
    _, accel = build(sheet(1), sheet(2, seen_by=soft), sheet(3), sheet(4, seen_by=soft))
    assert len(accel.transparent) == 2
    limit = np.arange(64, dtype=np.int32) % 8
    through = passed(accel, upward(), grey(), limit)
    np.testing.assert_allclose(through, np.where(limit >= 4, 0.5**4, 0))


def test_coplanar_surfaces_each_take_their_share():
    copies = [sheet(1) for _ in range(4)]
    turned = put(s.quad((0, 1, 0), (1, 0, 0), (0, 0, 1)), CLEAR)  # its normal is down
    diagonal = put(s.quad((1, 1, 0), (-1, 1, 0), (0, 0, 1)), CLEAR)  # other triangles
    _, accel = build(*copies, turned, diagonal, sheet(2), sheet(2))
    np.testing.assert_allclose(passed(accel, upward(2000), grey()), 0.5**8, rtol=1e-6)


def test_copies_of_a_mesh_that_is_turned_and_far_away_each_take_their_share():
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    matrix = s.affine(turn * 2, (300.0, -200.0, 100.0))
    shape = s.sphere(levels=2)
    copies = [Instance("Ball", shape, matrix, (CLEAR,)) for _ in range(3)]
    _, accel = build(*copies)
    rng = np.random.default_rng(1)
    target = rng.normal(size=(3, 2000))
    target *= 1.5 / np.linalg.norm(target, axis=0) * rng.uniform(size=2000)
    start = np.tile([[300.0], [-200.0], [90.0]], 2000) + rng.normal(0, 0.1, (3, 2000))
    direction = 2 * (target + matrix[:, 3:] - start)
    rays = start.astype(F32), direction.astype(F32), np.ones(2000, F32)
    through = passed(accel, rays, grey())
    np.testing.assert_allclose(through, 0.5**6)


def test_more_copies_than_there_are_layers_end_in_the_last_one():
    _, accel = build(*(sheet(1) for _ in range(MOST_LAYERS + 4)))
    assert len(accel.parts) <= MOST_LAYERS
    through = passed(accel, upward(), grey(0.9))
    np.testing.assert_allclose(through, 0.9**MOST_LAYERS, rtol=1e-5)


def test_surfaces_nearer_than_rounding_are_two_layers():
    _, accel = build(sheet(1), sheet(1 + 2e-7), sheet(1 + 1e-4))
    assert len(accel.parts) == 2
    np.testing.assert_allclose(passed(accel, upward(2000), grey()), 0.125)


def test_surfaces_that_overlap_by_a_part_of_them_take_their_share():
    aside = put(s.quad(centre=(1.5, 0, 1)), CLEAR)
    _, accel = build(sheet(1), aside)
    rays = upward(2000)
    through = passed(accel, rays, grey())
    in_both = (rays[0] + rays[1] / 10)[0] > 0.5
    np.testing.assert_allclose(through, np.where(in_both, 0.25, 0.5))


@pytest.mark.parametrize("flipped", (False, True))
def test_no_pair_of_a_thousand_copied_triangles_is_missed(flipped):
    rng = np.random.default_rng(8)
    corners = rng.uniform(-1, 1, (1000, 3, 3)) * (0.1, 0.1, 0.1) + rng.uniform(-5, 5, (1000, 1, 3))
    order = (0, 2, 1) if flipped else (1, 2, 0)
    pairs = np.concatenate([corners, corners[:, order]])
    shape = s.mesh(pairs.reshape(-1, 3), np.arange(6000).reshape(-1, 3))
    triangles, accel = build(put(shape, CLEAR))
    assert [len(part.number) for part in accel.parts] == [1000, 1000]
    np.testing.assert_array_equal(
        np.sort(accel.parts[0].number % 1000), np.sort(accel.parts[1].number % 1000)
    )


def test_opaque_surfaces_block_before_any_transparent_one_is_asked():
    _, accel = build(sheet(1), sheet(2, OPAQUE, half=0.5))
    rays = upward(1000)
    seen = []
    through = passed(accel, rays, grey(0.5, seen))
    blocked = np.abs(rays[0][:2] + rays[1][:2] * 0.2).max(axis=0) < 0.5
    np.testing.assert_array_equal(through, np.where(blocked, 0, 0.5).astype(F32))
    asked = np.concatenate([ray for _, _, ray, _, _ in seen])
    assert not blocked[asked].any()


def test_rays_stop_at_their_own_end():
    _, accel = build(*(sheet(z) for z in range(1, 9)))
    origin, direction, _ = upward(200)
    far = np.random.default_rng(2).uniform(0, 1, 200).astype(F32)
    through = passed(accel, (origin, direction, far), grey())
    np.testing.assert_allclose(through, 0.5 ** np.minimum(np.floor(far * 10), 8))
    none = passed(accel, (origin, direction, np.full(200, -1, F32)), grey())
    assert not none.any()


def test_a_dark_surface_ends_the_walk():
    _, accel = build(*(sheet(z) for z in (1, 2, 3)))
    seen = []
    assert not passed(accel, upward(), grey(0.0, seen)).any()
    assert len(seen) == 1


def test_surfaces_that_cast_no_shadows_take_no_share():
    _, accel = build(sheet(1, seen_by=RayKinds(shadow=False)), sheet(2))
    np.testing.assert_allclose(passed(accel, upward(), grey()), 0.5)
    _, accel = build(sheet(1, seen_by=RayKinds(shadow=False)))
    assert accel.transparent == ()
    assert accel.free(*upward(), Tally()).all()


def test_a_ray_does_not_pass_the_triangle_it_starts_from():
    triangles, accel = build(sheet(0), sheet(1))
    rays = upward(z=-1e-6)
    left = accel.closest(*rays[:2], None, None, None, Tally()).triangle
    np.testing.assert_allclose(passed(accel, rays, grey()), 0.25)
    np.testing.assert_allclose(passed(accel, rays, grey(), left=left), 0.5)


@pytest.mark.parametrize("scale", (1e-3, 1.0, 1e4))
@pytest.mark.parametrize("length", (1.0, 1e-4, 1e5))
def test_nothing_is_passed_twice_at_any_scale_or_length_of_the_ray(scale, length):
    """Grazing rays through a tilted stack, about a place that is not the origin."""
    rng = np.random.default_rng(7)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] * scale
    shift = np.array([0.3, -0.7, 0.4]) * scale
    stack = s.affine(turn, shift)
    shape = s.quad((50, 0, 0), (0, 50, 0))
    sheets = [
        Instance("Sheet", shape, s.affine(turn, shift + turn @ (0, 0, z)), (CLEAR,))
        for z in np.linspace(0.1, 0.9, 9)
    ]
    _, accel = build(*sheets)
    start = np.vstack([rng.uniform(-5, 5, (2, 500)), np.zeros(500)])
    end = np.vstack([rng.uniform(-30, 30, (2, 500)), np.ones(500)])
    start, end = (stack[:, :3] @ x + stack[:, 3:] for x in (start, end))
    direction = (end - start) / scale * length
    far = np.full(500, scale / length, F32)
    through = passed(accel, (start.astype(F32), direction.astype(F32), far), grey())
    np.testing.assert_allclose(through, 0.5**9)


def test_passing_stops_in_a_crowd_of_a_thousand_surfaces():
    rng = np.random.default_rng(4)
    leaves = rng.uniform(-1, 1, (1000, 1, 3)) * (1, 1, 4) + (0, 0, 5)
    leaves = leaves + rng.normal(0, 0.4, (1000, 3, 3))
    shape = s.mesh(leaves.reshape(-1, 3), np.arange(3000).reshape(-1, 3))
    triangles, accel = build(put(shape, CLEAR))
    origin, direction, far = upward(300)
    a, b, c = triangles.vertices[triangles.corners].astype(float).transpose(1, 0, 2)
    e1, e2 = b - a, c - a
    p = np.cross(direction.T[:, None].astype(float), e2)
    det = (e1 * p).sum(axis=2)
    s0 = origin.T[:, None] - a
    u, q = (s0 * p).sum(axis=2) / det, np.cross(s0, e1)
    v = (direction.T[:, None] * q).sum(axis=2) / det
    t = (e2 * q).sum(axis=2) / det
    crossings = ((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 1)).sum(axis=1)
    assert crossings.max() > 20
    through = passed(accel, (origin, direction, far), grey(0.9), 1024)
    np.testing.assert_allclose(through, 0.9**crossings, rtol=1e-4)


# --- Linking, catchers, objects -----------------------------------------------------------------


def test_only_the_sets_of_a_light_cast_its_shadows():
    things = sheet(1, OPAQUE, blocker_set=1), sheet(2, CLEAR, blocker_set=2), sheet(3, CLEAR)
    _, accel = build(*things, links_shadows=True)
    rays = upward()
    for blockers, expected in (
        (EVERY_SET, 0.0),
        (EVERY_SET & ~0b10, 0.25),
        (0b101, 0.25),
        (0b100, 0.5),
        (1 << 63, 1.0),
    ):
        np.testing.assert_allclose(passed(accel, rays, grey(), blockers=blockers), expected)
        free = accel.free(*rays, Tally(), blockers=blockers)
        assert (free == (expected > 0)).all()


def test_lights_of_different_links_are_asked_in_one_batch():
    things = sheet(1, OPAQUE, blocker_set=1), sheet(2, CLEAR, blocker_set=63), sheet(3, OPAQUE)
    _, accel = build(*things, links_shadows=True)
    masks = np.array([EVERY_SET, 1 << 63, 0b10, 0, (1 << 63) | 1], np.uint64)
    blockers = np.resize(masks, 65)
    rays = upward(65)
    expected = np.resize([0, 0.5, 0, 1, 0], 65)
    np.testing.assert_allclose(passed(accel, rays, grey(), blockers=blockers), expected)
    free = np.resize([0, 1, 0, 1, 0], 65)
    np.testing.assert_array_equal(accel.free(*rays, Tally(), blockers=blockers), free)
    things = sheet(1, OPAQUE), sheet(20, OPAQUE, blocker_set=1)
    _, accel = build(*things, links_shadows=True)
    blockers = np.resize(np.array([0b11, 0b10, 0b01], np.uint64), 65)
    free = np.resize([0, 1, 0], 65)
    np.testing.assert_array_equal(accel.free(*rays, Tally(), blockers=blockers), free)


def test_blockers_are_one_part_unless_a_light_tells_them_apart():
    things = sheet(1, OPAQUE, blocker_set=1), sheet(2, OPAQUE, blocker_set=2)
    assert len(build(*things)[1].parts) == 1
    assert len(build(*things, links_shadows=True)[1].parts) == 2


@pytest.mark.parametrize("linked", ("lamp", "instance", None))
def test_a_plan_tells_blockers_apart_where_something_links_shadows(linked):
    lamp = s.point((0, 0, 5), blockers=0b1 if linked == "lamp" else EVERY_SET)
    mask = 0b1 if linked == "instance" else EVERY_SET
    things = sheet(1, OPAQUE, blocker_set=1, blockers=mask), sheet(2, OPAQUE)
    scene = s.scene(s.camera((0, 0, 9)), lamp, *things)
    assert compile_plan(scene, s.DEFAULTS).prepared.parts == (2 if linked else 1)


def test_catchers_are_seen_alone_when_only_they_are_asked():
    things = (
        sheet(1, OPAQUE, half=0.5),
        sheet(2, OPAQUE, is_shadow_catcher=True),
        sheet(3, CLEAR, is_shadow_catcher=True),
        sheet(0.5, CLEAR),
        sheet(2.7, CLEAR),
    )
    _, accel = build(*things)
    origin, direction, far = upward(half=0.4)
    every = accel.closest(origin, direction, None, None, None, Tally())
    np.testing.assert_allclose(every.t, 0.05, rtol=1e-5)
    alone = accel.only_catchers()
    catchers = alone.closest(origin, direction, None, None, None, Tally())
    np.testing.assert_allclose(catchers.t, 0.2, rtol=1e-5)
    near = np.full(64, 0.15, F32)
    assert alone.free(origin, direction, near, Tally()).all()
    assert not accel.free(origin, direction, near, Tally()).any()
    beyond = origin + direction * F32(0.25)
    through = passed(alone, (beyond, direction, far), grey())
    np.testing.assert_allclose(through, 0.5)


def test_hits_know_their_object_where_it_matters():
    things = [sheet(1, OPAQUE, half=0.5), sheet(2, OPAQUE, receiver_set=3)]
    things.insert(1, put(s.mesh(np.zeros((0, 3)), np.zeros((0, 3), int))))
    for numbered in (False, True):
        flags = things if numbered else [sheet(1, OPAQUE, half=0.5), sheet(2, OPAQUE)]
        triangles, accel = build(*flags)
        assert triangles.is_numbered == numbered
        origin, direction, _ = upward(200)
        hits = accel.closest(origin, direction, None, None, None, Tally())
        points = resolve(triangles, origin, direction, hits, None)
        if not numbered:
            assert points.instance is None
            continue
        low = hits.t < 0.15
        assert 20 < low.sum() < 180
        np.testing.assert_array_equal(points.instance, np.where(low, 0, 2))
        some = points.take(np.flatnonzero(~low))
        assert (triangles.objects.receiver_set.take(some.instance) == 3).all()
    assert build(*flags[:1], is_numbered=True)[0].is_numbered


def test_a_far_end_beyond_everything_is_no_obstacle():
    _, accel = build(sheet(1), sheet(5))
    origin, direction, far = upward()
    through = passed(accel, (origin, direction, np.full_like(far, FAR)), grey())
    np.testing.assert_allclose(through, 0.25)


# --- Pictures -----------------------------------------------------------------------------------


@pytest.mark.parametrize("hidden", ("camera", "glossy", "diffuse", "shadow"))
def test_pictures_show_a_thing_to_just_the_rays_that_see_it(hidden):
    """A ceiling that glows, over a mirror and a matte floor; a dark one in the sun."""
    shape, seen_by = s.quad((9, 0, 0), (0, -9, 0), (0, 0, 2)), RayKinds(**{hidden: False})
    bright, dark = (
        Instance("Ceiling", shape, s.affine(), (material,), seen_by=seen_by)
        for material in (s.emission(1.0), s.BLACK)
    )
    view = s.orthographic((0, 0, 1), size=2, scale=0.1)
    up = s.orthographic((0, 0, 1), (0, 0, 2), size=2, scale=0.1)
    mirror, floor = s.put(s.quad(), s.mirror()), s.put(s.quad(), s.diffuse())
    more = {"samples": 64, "max_bounces": 1}
    by_camera = s.pixels(up, bright, **more)[..., 0]
    by_mirror = s.pixels(view, bright, mirror, **more)[..., 0]
    by_floor = s.pixels(view, bright, floor, **more)[..., 0]
    in_sun = s.pixels(view, dark, floor, s.sun((0, 0, 1), np.pi), **more)[..., 0]
    np.testing.assert_allclose(by_camera, hidden != "camera")
    np.testing.assert_allclose(by_mirror, hidden != "glossy")
    np.testing.assert_allclose(by_floor, 0.97 * (hidden != "diffuse"), atol=0.04)
    np.testing.assert_allclose(in_sun, hidden == "shadow", atol=1e-5)
