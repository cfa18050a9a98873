"""points, lights -> samples of light.  Which lights are asked, and from where on them light comes.

Every lamp is asked while lamps are few; of many lights one is chosen at each point; the world is
asked where it is bright.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..arrays import F32, Scalar, check
from ..bsdf import CAMERA
from ..geometry.accel import FAR
from ..lights import SAMPLED_EACH, Lights, triangle
from ..lights import Group as LampGroup
from ..plan import Plan
from ..sampling.dimensions import LAST_ITEM, LIGHT, LIGHT_CHOICE, WORLD, dimension
from ..sampling.draws import Draws
from ..scene import EVERY_SET
from .emission import emitted, shone
from .receiver import Receiver, Sample

# Shadow rays end a little before the light, by the rounding of their direction.
NEARLY = F32(1.0 - 2.0**-16)


def samples(plan: Plan, to: Receiver, draws: Draws, depth: int) -> Iterator[Sample]:
    """Yield samples of all lights towards the points of `to`, light by light."""
    split = plan.light_samples if depth == 0 else 1
    lights = plan.lights
    for item in range(split):
        part = item, split
        for number in range(lights.each_at(depth) if lights is not None else 0):
            assert lights is not None
            lamp = lights.single(number, to.points.time)
            if to.total is not None or depth <= lamp.max_bounces[0]:
                u, v = draws.pair(dimension(LIGHT, depth, number), to.slot, item, split)
                yield _of_lamp(plan, lamp, to, u, v, part, number)
        if lights is not None and lights.chooses_at(depth):
            sample = _of_chosen(plan, lights, to, draws, depth, item, split)
            yield replace(sample, item=SAMPLED_EACH, part=part)
        if plan.environment is not None:
            u, v = draws.pair(dimension(WORLD, depth), to.slot, item, split)
            sample = _of_world(plan, to, depth, u, v, split)
            yield replace(sample, item=SAMPLED_EACH + 1, part=part)


def _of_lamp(
    plan: Plan,
    lamp: LampGroup,
    to: Receiver,
    u: Scalar,
    v: Scalar,
    part: tuple[int, int],
    number: int,
) -> Sample:
    """Return the light of one lamp, number `number`, for all points."""
    split = part[1]
    with_pdf = bool(plan.lamps_seen_by & ~CAMERA)
    to_light, gain, pdf, distance = lamp.kind.sample(lamp.rows, to.points.above, u, v, with_pdf)
    check("direct", to_light=to_light, gain=gain)
    if split > 1:
        gain *= F32(1 / split)
        pdf = None if pdf is None else pdf * F32(split)
    if to.total is not None:
        gain *= to.total <= lamp.max_bounces
    light = lamp.colour
    if to.arrival is not None:
        assert plan.lights is not None and plan.lights.shaders is not None
        light = light * shone(
            plan.lights.shaders, lamp.first, to.points.above, to_light, distance, to.arrival
        )
    return Sample(
        to_light,
        distance,
        light,
        gain,
        pdf if lamp.is_met[0] else None,
        None,
        FAR if lamp.kind.DISTANT else NEARLY,
        int(lamp.seen_by[0]),
        int(lamp.receivers[0]),
        int(lamp.blockers[0]),
        bool(lamp.casts_shadow[0]),
        number,
        part,
        number,
    )


def _of_chosen(
    plan: Plan, lights: Lights, to: Receiver, draws: Draws, depth: int, item: int, split: int
) -> Sample:
    """Return the light of one lamp or glowing triangle at each point, chosen among many."""
    size = to.points.size
    pick = draws.pair(dimension(LIGHT_CHOICE, depth), to.slot, item, split)
    u, v = draws.pair(dimension(LIGHT, depth, LAST_ITEM), to.slot, item, split)
    assert to.points.place is not None
    chosen, pmf = lights.choose(to.points.place, *pick, depth)
    to_light, light = np.empty((3, size), F32), np.empty((3, size), F32)
    distance, gain, far = (np.empty(size, F32) for _ in range(3))
    pdf, matte_pdf = np.empty(size, F32), np.empty(size, F32)
    seen_by, casts_shadow = np.empty(size, np.int32), np.empty(size, bool)
    receivers, blockers = np.empty(size, np.uint64), np.empty(size, np.uint64)
    start = to.points.above
    for index, some in lights.split(chosen, to.points.time):
        origin, a, b = start.take(index, axis=1), u.take(index), v.take(index)
        if some.kind is triangle.TRIANGLE:
            sampled, place = triangle.sample_place(some.rows, origin, a, b, True)
            colour = some.colour
            if plan.emission_varies:
                assert lights.triangle_of is not None
                number = lights.triangle_of.take(chosen.take(index) - lights.first_triangle)
                colour = emitted(plan, number, origin, sampled, place, depth)
            matte_pdf[index] = sampled.pdf
        else:
            sampled = some.kind.sample(some.rows, origin, a, b, True)
            colour = some.colour
            if lights.shaders is not None and to.arrival is not None:
                number = chosen.take(index)
                way = origin, sampled.to_light, sampled.distance
                arrival = to.arrival.take(index)
                colour = colour * shone(lights.shaders, number, *way, arrival)
            matte_pdf[index] = 0
        to_light[:, index], light[:, index] = sampled.to_light, colour
        total = depth if to.total is None else to.total.take(index)
        gain[index] = sampled.gain * (total <= some.max_bounces)
        assert sampled.pdf is not None
        pdf[index], distance[index] = sampled.pdf * some.is_met, sampled.distance
        far[index] = FAR if some.kind.DISTANT else NEARLY
        seen_by[index], casts_shadow[index] = some.seen_by, some.casts_shadow
        receivers[index], blockers[index] = some.receivers, some.blockers
    check("direct", to_light=to_light, gain=gain, light=light)
    pmf *= F32(split)
    gain /= pmf
    pdf *= pmf
    matte_pdf *= pmf
    return Sample(
        to_light,
        distance,
        light,
        gain,
        pdf if plan.needs_pdf else None,
        matte_pdf if plan.needs_pdf and lights.of_triangle is not None else None,
        far,
        seen_by,
        receivers,
        blockers if plan.links_shadows else EVERY_SET,
        True if casts_shadow.all() else casts_shadow,
        light_number=chosen,
    )


def _of_world(plan: Plan, to: Receiver, depth: int, u: Scalar, v: Scalar, split: int) -> Sample:
    assert plan.environment is not None and plan.world is not None
    direction, pdf = plan.environment.sample(u, v)
    light = plan.world.radiance(direction, 0)
    gain = np.reciprocal(np.maximum(pdf, F32(1e-30))) * (pdf > 0)
    if split > 1:
        gain *= F32(1 / split)
        pdf = pdf * F32(split)
    gain *= (depth if to.total is None else to.total) <= plan.world_max_bounces
    one = np.ones(u.size, F32)
    return Sample(
        direction,
        one,
        light,
        gain,
        pdf,
        pdf,
        FAR,
        plan.world_seen_by,
        casts_shadow=plan.world_casts_shadow,
    )
