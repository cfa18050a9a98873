"""points, lights -> samples of light.  Which lights are asked, and from where on them light comes.

Every lamp is asked while lamps are few; of many lights one is chosen at each point; the world is
asked where it is bright.
"""

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np

from ..arrays import F32, Ids, Index, Scalar, check, take
from ..bsdf import CAMERA
from ..geometry.accel import FAR
from ..lights import SAMPLED_EACH, Lights, triangle
from ..lights import Group as LampGroup
from ..lights.kind import LampKind
from ..plan import Plan
from ..sampling.dimensions import LAST_ITEM, LIGHT, LIGHT_CHOICE, WORLD, dimension
from ..sampling.draws import Draws
from ..scene import EVERY_SET
from .emission import emitted, shone
from .receiver import Receiver, Sample

# What samples of points have each
OF_POINTS = [item.name for item in fields(Sample)[:-3]]  # all but which one it is
KINDS = {"seen_by": np.int32, "receivers": np.uint64, "blockers": np.uint64, "casts_shadow": bool}

# Rays to a light, or another hit, end a little before it, by the rounding of their direction.
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
            limit = lamp.max_bounces[0]
            if depth <= limit or (to.total is not None and limit >= 0):
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
    pick = draws.pair(dimension(LIGHT_CHOICE, depth), to.slot, item, split)
    u, v = draws.pair(dimension(LIGHT, depth, LAST_ITEM), to.slot, item, split)
    assert to.points.place is not None
    chosen, pmf = lights.choose(to.points.place, *pick, depth)
    pmf *= F32(split)
    some = [
        (index, _of_group(plan, lights, group, chosen, index, to, depth, u, v))
        for index, group in lights.split(chosen, to.points.time)
    ]
    index, sample = some[0]
    if index is not None:
        sample = _joined(some, to.points.size)
    check("direct", to_light=sample.to_light, gain=sample.gain, light=sample.light)

    # Weigh it by the probability of the choice; both densities may be one array
    np.divide(sample.gain, pmf, out=sample.gain)
    pdf = matte_pdf = None if sample.pdf is None else sample.pdf * pmf
    if sample.matte_pdf is not sample.pdf:
        matte_pdf = None if sample.matte_pdf is None else sample.matte_pdf * pmf
    return replace(sample, pdf=pdf, matte_pdf=matte_pdf, light_number=chosen)


def _of_group(
    plan: Plan,
    lights: Lights,
    group: LampGroup,
    chosen: Ids,
    index: Index | None,
    to: Receiver,
    depth: int,
    u: Scalar,
    v: Scalar,
) -> Sample:
    """Return the light of lamps or triangles of one kind at points `index`, all if it is None."""
    start, total, arrival = to.points.above, to.total, to.arrival
    if index is not None:
        start, u, v = start.take(index, axis=1), u.take(index), v.take(index)
        chosen = chosen.take(index)
        total = take(total, index)
    colour = group.colour
    glows = not isinstance(group.kind, LampKind)
    if glows:
        sampled, place = triangle.sample_place(group.rows, start, u, v, plan.needs_pdf)
        if plan.emission_varies:
            assert lights.triangle_of is not None
            number = lights.triangle_of.take(chosen - np.int32(lights.first_triangle))
            colour = emitted(plan, number, start, sampled, place, depth)
    else:
        sampled = group.kind.sample(group.rows, start, u, v, plan.needs_pdf)
        if lights.shaders is not None and arrival is not None:
            arrival = arrival if index is None else arrival.take(index)
            way = start, sampled.to_light, sampled.distance
            colour = colour * shone(lights.shaders, chosen, *way, arrival)
    gain = sampled.gain
    if total is not None or depth > group.max_bounces.min():
        gain = gain * ((depth if total is None else total) <= group.max_bounces)
    pdf = matte_pdf = sampled.pdf
    if not glows:  # rays from matte closures meet none of them
        matte_pdf = None if pdf is None or lights.of_triangle is None else np.zeros_like(pdf)
    if pdf is not None and not group.is_met.all():
        pdf = pdf * group.is_met
    return Sample(
        sampled.to_light,
        sampled.distance,
        colour,
        gain,
        pdf,
        matte_pdf,
        FAR if group.kind.DISTANT else NEARLY,
        _one(group.seen_by),
        _one(group.receivers),
        _one(group.blockers) if plan.links_shadows else EVERY_SET,
        True if group.casts_shadow.all() else _one(group.casts_shadow),
    )


def _one(values: Any) -> Any:
    """Return values (N,) of lights; what they have in common, (1,), as a number."""
    return values[0].item() if values.size == 1 else values


def _joined(some: list[tuple[Index | None, Sample]], size: int) -> Sample:
    """Return the samples of `size` points, which are here by the kind of their lights."""
    joined: dict[str, Any] = {}
    for name in OF_POINTS:
        values = [getattr(sample, name) for _, sample in some]
        if all(np.ndim(value) == 0 and value == values[0] for value in values):
            joined[name] = values[0]
            continue
        rows = (3,) if np.ndim(values[0]) == 2 else ()
        out = np.empty((*rows, size), KINDS.get(name, F32))
        for (index, _), value in zip(some, values, strict=True):
            out[..., index] = value
        joined[name] = out
    return replace(some[0][1], **joined)


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
