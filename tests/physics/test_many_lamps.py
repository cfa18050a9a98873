"""lamps -> what rays see that meet them: tried one by one, or found by hull, which is the same."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from penumbra.core import compile_plan, render
from penumbra.core.arrays import F32, normalize
from penumbra.core.bsdf import CAMERA, GLOSSY, TRANSMISSION
from penumbra.core.compile.light import compile_lamp_hulls
from penumbra.core.geometry.mesh import bare_triangles
from penumbra.core.lights import compile_lights
from penumbra.core.plan import LampHulls
from penumbra.core.scene import EVERY_SET, Lamp, RayKinds
from penumbra.core.statistics import Tally
from penumbra.core.transport.emission import Crossing, _meet_all, _meet_by_hulls
from penumbra.core.transport.mis import power_weight
from penumbra.core.transport.receiver import Sample
from penumbra.core.transport.samples import _joined
from tests.support import scenes as s
from tests.support.statistics import assert_same_mean

FLOOR = np.array([(-9, -9, -1), (9, -9, -1), (0, 9, -1)], F32), np.array([(0, 1, 2)], np.int32)


def lamps(count, rng):
    kinds = ("POINT", "SPOT", "AREA", "SUN")
    for number in range(count):
        axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        to_world = np.concatenate([axes, rng.uniform(-1, 1, (3, 1))], axis=1)
        yield Lamp(
            f"lamp {number}",
            kinds[number % 4],
            to_world,
            tuple(rng.uniform(0.5, 2, 3)),
            radius=rng.uniform(0.05, 0.3),
            soft_falloff=bool(number % 3),
            size=tuple(rng.uniform(0.1, 0.6, 2)),
            ellipse=bool(number % 8 == 2),
            angle=rng.uniform(0.3, 1),
            spot_angle=2.5,
            seen_by=RayKinds(camera=bool(number % 5)),
        )


def crossing(start, direction, reach, kinds, **more):
    """Rays straight from the camera, of mirrors or of glass, unless `more` says otherwise."""
    names = ("near", "pdf", "place", "receiver", "arrival", "time")
    rest = dict.fromkeys(names) | more
    return Crossing(start, direction, reach=reach, kinds=kinds, **rest)


def compiled(*made):
    """All that `emission` reads of a plan where rays meet lamps."""
    lights = compile_lights(made, np.zeros(3), bare_triangles(*FLOOR))
    return SimpleNamespace(lights=lights, light_samples=1)


def random_rays(rng, count=4000):
    start = rng.uniform(-1.5, 1.5, (3, count)).astype(F32)
    direction = normalize(rng.normal(size=(3, count)).astype(F32))
    reach = rng.uniform(0, 4, count).astype(F32)
    reach[::3] = np.inf
    return start, direction, reach


@pytest.mark.parametrize("is_weighted", (False, True), ids=("plain", "weighted"))
def test_hulls_find_what_trying_every_lamp_finds(is_weighted):
    rng = np.random.default_rng(7)
    plan = compiled(*lamps(60, rng))
    assert plan.lights.each == 0
    hulls = compile_lamp_hulls(plan.lights, 15, np.zeros(3), lambda: False)
    assert isinstance(hulls, LampHulls)
    start, direction, reach = random_rays(rng)
    kinds = rng.choice(np.array([CAMERA, GLOSSY, GLOSSY | TRANSMISSION], np.uint8), reach.size)
    more = {}
    if is_weighted:
        more = {
            "pdf": rng.uniform(0.01, 2, reach.size).astype(F32),
            "place": plan.lights.place(start, None, 1),
            "near": rng.uniform(0, 0.5, reach.size).astype(F32),
        }
    rays = crossing(start, direction, reach, kinds, **more)
    every = _meet_all(plan, rays, None)
    found = _meet_by_hulls(plan, hulls, rays, Tally(), None)
    assert (every > 0).any(axis=0).mean() > 0.1
    np.testing.assert_allclose(found, every, rtol=1e-5, atol=1e-6)


def test_radiance_of_all_lamps_on_the_way_is_added_up():
    plan = compiled(
        s.area((0, 0, 1), radiance=(1.0, 0.0, 0.0), seen_by=RayKinds()),
        Lamp("sun", "SUN", s.affine(), (0.0, 0.0, 2.0), angle=0.1, seen_by=RayKinds()),
        s.point((0, 0, 3), (0.0, 5.0, 0.0), radius=0.5),
        s.area((0, 0, 2), radiance=(0.0, 1.0, 0.0), seen_by=RayKinds(glossy=False)),
        s.area((0, 0, 1.7), radiance=7.0, seen_by=RayKinds(), sampled=False),
    )
    start, up = np.zeros((3, 4), F32), np.repeat(F32([[0], [0], [1]]), 4, axis=1)
    reach = np.array([0.5, 1.5, 10, np.inf], F32)

    def seen(kinds, direction=up, **more):
        kinds = np.broadcast_to(np.array(kinds, np.uint8), 4)
        return _meet_all(plan, crossing(start, direction, reach, kinds, **more), None)

    # The point lamp hides from the camera, the second area lamp from mirrors.
    disk, sun = 5 / (np.pi * 0.25), 2 / (np.pi * np.sin(0.05) ** 2)
    expected = [[0, 1, 1, 1], [0, 0, disk, disk], [0, 0, 0, sun]]
    np.testing.assert_allclose(seen(GLOSSY), expected, rtol=1e-5)
    expected = [[0, 1, 1, 1], [0, 0, 1, 1], [0, 0, 0, sun]]
    np.testing.assert_allclose(seen(CAMERA), expected, rtol=1e-5)
    each = seen([CAMERA, GLOSSY, GLOSSY, CAMERA])
    np.testing.assert_allclose(each[1], [0, 0, disk, 1], rtol=1e-5)
    assert not seen(CAMERA, -up).any()
    near = np.full(4, 1.2, F32)
    np.testing.assert_allclose(seen(CAMERA, near=near)[0], 0)


def test_what_was_sampled_as_well_is_weighted_against_that():
    # An area lamp of 1 m2, 2 m away: the density of its samples is 4 / 1 per steradian.
    plan = compiled(s.area((0, 0, 2), radiance=1.0, seen_by=RayKinds()))
    start, up = np.zeros((3, 3), F32), np.repeat(F32([[0], [0], [1]]), 3, axis=1)
    own, far = np.array([0.5, 4, np.inf], F32), np.full(3, np.inf, F32)
    kinds = np.full(3, GLOSSY, np.uint8)
    light = plan.lights.single(0)
    _, _, pdf = light.kind.intersect(light.rows, start, up)
    plan.light_samples = 4
    for place, split in ((0, 1), (-1, 4)):  # at first hits, lamps get all their samples
        places = np.full(3, place, np.int32)
        found = _meet_all(plan, crossing(start, up, far, kinds, pdf=own, place=places), None)
        np.testing.assert_allclose(found[1], power_weight(own, pdf * split), rtol=1e-6)
    np.testing.assert_allclose(found[1, 2], 1)


def test_a_million_lamps_light_a_floor_as_ten_thousand_of_their_power_do():
    """So close to each other, compared with their height, that the floor cannot tell."""

    def floor_under(side):
        lamp = s.point((0, 0, 0), 1e4 / side**2)
        place = np.linspace(-20, 20, side, endpoint=False) + 20 / side
        spots = np.stack(np.meshgrid(place, place, [2.0]), axis=-1).reshape(-1, 3)
        axes = np.eye(3)
        many = (
            replace(lamp, to_world=np.concatenate([axes, spot[:, None]], axis=1)) for spot in spots
        )
        floor = s.put(s.quad((2, 0, 0), (0, 2, 0)), s.diffuse(0.7))
        view = s.camera((0, -0.5, 1.5), (0, 0, 0), size=8)
        plan = compile_plan(s.scene(view, floor, *many), s.replace(s.DEFAULTS, samples=1024))
        assert plan.lights.count == side**2
        return np.array(
            [render(replace(plan, seed=seed)).combined()[..., :3].mean() for seed in range(8)]
        )

    few, million = floor_under(100), floor_under(1000)
    assert few.std(ddof=1) < 0.01 * few.mean()
    assert_same_mean(million, few)


def test_samples_of_two_kinds_keep_what_each_kind_has_in_common():
    def of(count, **common):
        one = np.ones(count, np.float32)
        return Sample(np.ones((3, count), np.float32), one, one[None], one, one, one, **common)

    links = {"receivers": EVERY_SET, "blockers": EVERY_SET}
    index = np.array([0, 3, 4]), np.array([1, 2])
    few = of(3, far=np.float32(2), seen_by=3, receivers=5, blockers=1, casts_shadow=False)
    rest = of(2, far=np.float32(2), seen_by=15, **links)
    joined = _joined([(index[0], few), (index[1], rest)], 5)
    assert joined.far == 2
    for name, one, other in (
        ("seen_by", 3, 15),
        ("receivers", 5, EVERY_SET),
        ("blockers", 1, EVERY_SET),
        ("casts_shadow", False, True),
    ):
        found = getattr(joined, name)
        assert found.tolist() == [one, other, other, one, one]
    assert joined.receivers.dtype == joined.blockers.dtype == np.uint64
