"""lamps -> what rays see that meet them: the same, whether tried one by one or found by hull."""

import numpy as np

from penumbra.core.arrays import F32, normalize
from penumbra.core.lights import compile_lights, meet
from penumbra.core.plan import LampHulls, _compile_hulls
from penumbra.core.scene import Lamp, RayKinds
from penumbra.core.statistics import Tally
from penumbra.core.transport.emission import _meet_by_hulls


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


def test_hulls_find_what_trying_every_lamp_finds():
    rng = np.random.default_rng(7)
    origin = np.array([0.5, -0.2, 0.1])
    lights = compile_lights(tuple(lamps(60, rng)), origin, 1.0)
    hulls = _compile_hulls(lights, 15, origin, lambda: False)
    assert isinstance(hulls, LampHulls)
    count = 4000
    start = rng.uniform(-1.5, 1.5, (3, count)).astype(F32)
    direction = normalize(rng.normal(size=(3, count)).astype(F32))
    reach = rng.uniform(0, 4, count).astype(F32)
    reach[::3] = np.inf
    kinds = rng.choice(np.array([1, 4, 12], np.uint8), count)
    every = meet(lights, start, direction, reach, kinds)
    found = _meet_by_hulls(hulls, lights, start, direction, reach, kinds, Tally())
    assert (every > 0).any(axis=0).mean() > 0.15
    np.testing.assert_allclose(found, every, rtol=1e-5, atol=1e-6)
