"""points, closures -> radiance.  Shadow rays towards lamps (next-event estimation).

Every lamp gets shadow rays of its own, each with its own length, while lamps are few; of many
lamps one is chosen at each point, by power.  Unbiased.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import F32, Index, Scalar, Vec, check, dot, frame
from ..geometry.accel import FAR
from ..geometry.surface import Points
from ..geometry.terminator import raise_starts
from ..lights import Group as LampGroup
from ..lights import Lights
from ..plan import Plan
from ..sampling.dimensions import LIGHT, LIGHT_CHOICE, dimension
from ..sampling.draws import Draws
from ..shading import Closures, Group
from ..statistics import Tally
from .radiance import Radiance
from .state import Paths

# Shadow rays end a little before the lamp, by the rounding of their direction.
NEARLY = F32(1.0 - 2.0**-16)

# Below this share of points that get light, the others are left out of the query.
WORTH_COMPACTING = 0.75

# Up to so many lamps each get their own shadow rays; of more, one is chosen.
LAMPS_SAMPLED_EACH = 8


@dataclass(frozen=True, eq=False)
class Receiver:
    """The points of one closure type that lamps may light.

    start (3, n): where shadow rays leave; slot (n,) or None.
    """

    points: Points
    group: Group
    start: Vec
    slot: Index | None


def add(
    plan: Plan,
    points: Points,
    closures: Closures,
    paths: Paths,
    draws: Draws,
    bounce: int,
    radiance: Radiance,
    tally: Tally,
) -> None:
    """Add the light of lamps that reaches `points` unblocked and is scattered to the viewer."""
    lights = plan.lights
    assert lights is not None
    for group in closures.groups:
        if group.module.IS_DELTA:
            continue
        to = _receiver(points, group, paths)
        if lights.count <= LAMPS_SAMPLED_EACH:
            light = _light_of_each(plan, lights, to, draws, bounce, tally)
        else:
            light = _light_of_chosen(plan, lights, to, draws, bounce, tally)
        if light is not None:
            radiance.add(group.weight * light, to.slot, bounce)


def _receiver(points: Points, group: Group, paths: Paths) -> Receiver:
    if group.index is None:
        return Receiver(points, group, points.above, paths.slot)
    points = points.take(group.index)
    slot = group.index if paths.slot is None else paths.slot.take(group.index)
    return Receiver(points, group, points.above, slot)


def _light_of_each(
    plan: Plan, lights: Lights, to: Receiver, draws: Draws, bounce: int, tally: Tally
) -> Vec | Scalar | None:
    """Return the scattered light of all lamps, before the closure's colour.

    (3, n), or (n,) if the only lamp is grey.
    """
    split = plan.light_samples if bounce == 0 else 1
    total: Vec | Scalar | None = None
    for number in range(lights.count):
        lamp = lights.single(number)
        is_grey = lights.count == 1 and bool((lamp.colour == lamp.colour[0]).all())
        if bounce > lamp.max_bounces[0] or not lamp.seen_by[0] & to.group.module.RAY_KIND:
            continue
        for item in range(split):
            u, v = draws.pair(dimension(LIGHT, bounce, number), to.slot, item, split)
            seen = _visible(plan, to, lamp, u, v, tally)
            if seen is not None:
                colour = lamp.colour * F32(1 / split)
                light = (colour[0] if is_grey else colour) * seen
                total = light if total is None else np.add(total, light, out=total)
    return total


def _light_of_chosen(
    plan: Plan, lights: Lights, to: Receiver, draws: Draws, bounce: int, tally: Tally
) -> Vec | None:
    """Return the scattered light (3, n) of one lamp at each point, chosen by power."""
    split = plan.light_samples if bounce == 0 else 1
    total = np.zeros(to.start.shape, F32)
    for item in range(split):
        pick, _ = draws.pair(dimension(LIGHT_CHOICE, bounce), to.slot, item, split)
        u, v = draws.pair(dimension(LIGHT, bounce), to.slot, item, split)
        chosen, probability, _ = lights.choose(pick)
        for index, lamps in lights.split(chosen):
            part = Receiver(
                to.points.take(index), to.group.take(index), to.start.take(index, axis=1), None
            )
            seen = _visible(plan, part, lamps, u.take(index), v.take(index), tally)
            if seen is not None:
                seen /= probability.take(index) * F32(split)
                seen *= bounce <= lamps.max_bounces
                seen *= (lamps.seen_by & to.group.module.RAY_KIND) != 0
                light = lamps.colour * seen
                for channel, value in zip(total, light, strict=True):
                    channel[index] += value
    return total


def _visible(
    plan: Plan, to: Receiver, lamp: LampGroup, u: Scalar, v: Scalar, tally: Tally
) -> Scalar | Vec | None:
    """Return f cos x gain (n,) or (3, n) of a lamp where it is not in shadow, else 0."""
    assert plan.accel is not None and plan.triangles is not None
    to_light, gain, _ = lamp.kind.sample(lamp.rows, to.start, u, v)
    scattered, cos_light = _evaluate(to, to_light, gain)
    check("direct", to_light=to_light, gain=gain, scattered=scattered)

    # What carries no light gets no ray; light from below a flat surface does not reach it.
    arriving = scattered if scattered.ndim == 1 else scattered.max(axis=0)
    start = to.start
    if to.points.smooth is not None:
        start = raise_starts(plan.triangles, to.points, start, to_light, cos_light)
    lit = np.flatnonzero(arriving > 0)
    if not lit.size:
        return None
    reach = FAR if lamp.kind.DISTANT else NEARLY
    if lit.size > WORTH_COMPACTING * arriving.size:
        # Nearly all: cheaper to ask for all, those without light with a reach below zero.
        far = np.where(arriving > 0, reach, F32(-1))
        visible = plan.accel.free(start, to_light, far, tally)
    else:
        start, to_light = start.take(lit, axis=1), to_light.take(lit, axis=1)
        visible = np.zeros(arriving.size, F32)
        visible[lit] = plan.accel.free(start, to_light, np.full(lit.size, reach, F32), tally)
    tally.rays_shadow += lit.size
    scattered *= visible
    return scattered


def _evaluate(to: Receiver, to_light: Vec, gain: Scalar) -> tuple[Scalar | Vec, Scalar]:
    """Return f cos x gain, (n,) or (3, n), and the cosine (n,) of the light."""
    normal = to.points.normal
    distance = dot(to_light, to_light)
    np.sqrt(distance, out=distance)
    np.maximum(distance, F32(1e-30), out=distance)
    z = dot(normal, to_light)
    z /= distance
    module = to.group.module
    if module.WEIGHT_IN_WI_Z:
        value, _ = module.evaluate(to.group.parameters, None, (None, None, z))
    else:
        tangent, bitangent = frame(normal)
        wo = to.points.wo
        local_o = np.stack([dot(tangent, wo), dot(bitangent, wo), dot(normal, wo)])
        x, y = dot(tangent, to_light) / distance, dot(bitangent, to_light) / distance
        value, _ = module.evaluate(to.group.parameters, local_o, np.stack([x, y, z]))
    value *= gain
    return value, z
