"""core.lights.reach -> lamps worth sampling.  What is left out lights nothing, and only that."""

import numpy as np
import pytest

from penumbra.core import compile_plan
from penumbra.core.geometry.mesh import boxes_of
from penumbra.core.lights import REGISTRY, compile_lights
from penumbra.core.lights.reach import BOXES, NO_SAMPLES, useful_lamps
from penumbra.core.scene import RayKinds
from tests.support import scenes as s

F32 = np.float32
SEEN = RayKinds(camera=True)
UP, DOWN = (0, 0, 9), (0, 0, -9)
FLOOR = s.put(s.quad(u=(2, 0, 0), v=(0, 2, 0)), s.diffuse(0.7))
VIEW = s.camera((0, -4, 1), (0, 0, 0.5))
KINDS = {
    "spot": {"spot_angle": 1.2},
    "ball of a spot": {"spot_angle": 0.7, "radius": 0.3, "soft_falloff": False},
    "wide spot": {"spot_angle": np.pi},
    "disk of a spot": {"spot_angle": 0.05, "radius": 0.2},
    "area": {},
    "area with spread": {"spread": 0.8},
    "ellipse with spread": {"spread": 2.9, "ellipse": True},
    "beam": {"spread": 0.0},
}


def lamp(name, position, target, **more):
    make = s.spot if "spot" in name else s.area
    return s.replace(make(position, target, **KINDS[name]), **more)


def useful(lamps, instances, shift=(0.0, 0.0, 0.0)):
    return useful_lamps(tuple(lamps), instances, boxes_of(instances), np.array(shift, float))


@pytest.mark.parametrize("name", KINDS)
def test_all_light_of_a_lamp_falls_into_its_region(name):
    rng = np.random.default_rng(5)
    outside = 0
    for _ in range(40):
        stretched = np.diag(rng.uniform(0.3, 3, 3)) if "spot" in name else np.eye(3)
        made = lamp(name, rng.normal(size=3), rng.normal(size=3) * 3)
        matrix = np.column_stack([made.to_world[:, :3] @ stretched, made.to_world[:, 3]])
        made = s.replace(made, to_world=matrix)
        origin = rng.normal(size=3)
        kind = REGISTRY[made.kind](made)
        rows = compile_lights((made,), origin).single(0).rows
        points = rng.normal(size=(3, 4096)).astype(F32) * 3
        u, v = rng.random((2, 4096), F32)
        lit = kind.sample(rows, points, u, v).gain > 0
        region = kind.region(made, origin)
        inside = (region.normals @ points >= region.least[:, None] - 1e-5).all(axis=0)
        assert not (lit & ~inside).any()
        outside += (~inside).sum()
    assert outside > 0.4 * 40 * 4096


@pytest.mark.parametrize("shift", [(0, 0, 0), (3e5, -1e5, 7)])
@pytest.mark.parametrize("name", KINDS)
def test_lamps_that_look_away_are_left_out(name, shift):
    floor = s.replace(FLOOR, to_world=s.affine(1.0, shift))
    above, up, down = (np.add(each, shift) for each in ((0.3, 0, 3), (0.3, 0, 9), (0.3, 0, -9)))
    below = np.add((0, 0, -3), shift)
    away = lamp(name, above, up), lamp(name, below, down)
    at_it = lamp(name, above, down), lamp(name, below, up)
    assert useful(away + at_it, (floor,), shift) == at_it


@pytest.mark.parametrize("shift", [0.0, 3e5])
def test_a_lamp_in_the_plane_of_what_there_is_is_kept(shift):
    floor = s.replace(FLOOR, to_world=s.affine(1.0, (shift, 0, 0)))
    touching = lamp("area", (shift, 0, 1e-9 * shift), (shift, 0, 9))
    assert useful((touching,), (floor,)) == (touching,)


def test_a_narrow_lamp_beside_all_there_is_is_left_out():
    narrow = lamp("area with spread", (9, 0, 3), (9, 0, 0)), lamp("spot", (9, 0, 3), (9, 0, 0))
    wide = lamp("area", (9, 0, 3), (9, 0, 0)), lamp("wide spot", (9, 0, 3), (9, 0, 0))
    assert useful(narrow + wide, (FLOOR,)) == wide


def test_lamps_without_sides_are_kept_whatever_they_are_near():
    lamps = s.point((0, 0, 99)), s.sun((0, 0, -1)), s.spot((0, 0, 3), UP, spot_angle=4.0)
    assert useful(lamps, (FLOOR,)) == lamps


def test_a_lamp_that_only_shines_on_others_is_left_out():
    one = s.replace(FLOOR, receiver_set=1)
    other = s.replace(FLOOR, receiver_set=2, to_world=s.affine(1.0, (0, 0, 9)))
    nobody, first = s.point((0, 0, 3), receivers=1 << 5), s.point((0, 0, 3), receivers=1 << 1)
    below, above = (lamp("area", (0, 0, 4), end, receivers=1 << 2) for end in (DOWN, UP))
    assert useful((nobody, first, below, above), (one, other)) == (first, above)


def test_a_lamp_between_things_is_judged_by_each():
    corner = s.put(s.quad(u=(2, 0, 0), v=(0, 0, 2), centre=(0, 2, 2)), s.diffuse(0.7))
    away = lamp("area", (0, 0, 3), (0, -9, 12))
    assert useful((away,), (FLOOR, corner)) == ()
    joined = s.put(s.quad(u=(2, 0, 0), v=(0, 2, 2), centre=(0, 0, 2)), s.diffuse(0.7))
    assert useful((away,), (joined,)) == (away,)


def test_many_things_of_two_sets_keep_to_their_set():
    things = tuple(
        s.replace(FLOOR, receiver_set=k % 2, to_world=s.affine(0.01, (k % 40, k // 40, k % 2)))
        for k in range(3 * BOXES + 2)
    )
    low, high = (lamp("area", (9, 9, 0.5), (9, 9, end)) for end in (-9, 9))
    lamps = tuple(s.replace(each, receivers=1 << k) for each in (low, high) for k in (0, 1))
    assert useful(lamps, things) == (lamps[0], lamps[3])


def test_no_lamp_is_left_out_where_things_move():
    away = lamp("area", (0, 0, 3), UP)
    moving = s.replace(FLOOR, motion=np.stack([FLOOR.to_world, s.affine(1.0, (0, 0, -1))]))
    for floor, count in ((FLOOR, 0), (moving, 1)):
        assert compile_plan(s.scene(VIEW, floor, away), s.DEFAULTS).prepared.lights == count


def test_a_lamp_that_moves_is_kept():
    away = lamp("area", (0, 0, 3), UP)
    turning = s.replace(away, motion=np.stack([away.to_world, s.look_at((0, 0, 3), DOWN)]))
    assert useful((away, turning), (FLOOR,)) == (turning,)


def test_a_picture_without_a_lamp_that_looks_away_is_that_with_it():
    light, away = s.point((1, 0, 3), 9.0), lamp("area", (0, 0, 3), UP)
    seen = s.pixels(VIEW, FLOOR, light)
    assert seen.max() > 0.01
    np.testing.assert_array_equal(s.pixels(VIEW, FLOOR, away, light), seen)


def test_the_camera_still_sees_a_lamp_that_looks_away_from_all_else():
    view = s.camera((0, 0, 4), (0, 0, 0))
    away = lamp("area", (0, 0, 2), UP, strength=(3.0, 2.0, 1.0), seen_by=SEEN)
    (kept,) = useful((away,), (FLOOR,))
    assert kept.max_bounces == NO_SAMPLES
    assert not useful((s.replace(away, sampled=False),), (FLOOR,))
    black = s.replace(FLOOR, materials=(s.BLACK,))
    for others in ((), (s.point((1, 0, 1)),), (s.point((1, 0, 1)),) * 20):
        seen = s.pixels(view, black, away, *others)[3:5, 3:5, :3]
        np.testing.assert_allclose(seen, np.broadcast_to((3, 2, 1), (2, 2, 3)), rtol=1e-5)


@pytest.mark.parametrize("clear", [0.0, 0.5])
def test_what_takes_no_samples_lights_nothing(clear):
    mixed = s.node("MixShader", Fac=clear)
    mixed.inputs["Shader"] = s.Link(s.diffuse(0.7).surface, "BSDF")
    mixed.inputs["Shader_001"] = s.Link(s.node("BsdfTransparent", Color=(1, 1, 1)), "BSDF")
    floor = s.put(FLOOR.mesh, s.Material("Mixed", mixed))
    for limit, is_lit in ((0, True), (NO_SAMPLES, False)):
        light = lamp("area", (0, 0, 2), DOWN, max_bounces=limit)
        for count in (1, 20):
            assert s.pixels(VIEW, floor, *[light] * count)[..., :3].any() == is_lit
