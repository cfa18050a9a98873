"""points, closures -> radiance.  Shadow rays towards lamps (next-event estimation).

Every lamp gets shadow rays of its own, each with its own length, while lamps are few; of many
lamps one is chosen at each point, by power.  Unbiased.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import F32, Index, Scalar, Vec, check, dot, frame
from ..geometry.accel import FAR
from ..geometry.surface import Points
from ..lights import Group as LampGroup
from ..plan import Plan
from ..sampling.dimensions import LIGHT, LIGHT_CHOICE, dimension
from ..sampling.draws import Draws
from ..shading import Closures, Group
from ..statistics import Tally
from .radiance import Radiance
from .state import Paths

# Shadow rays end a little before the lamp, by the rounding of their direction.
NEARLY = F32(1.0 - 2.0**-16)

# Up to so many lamps each get their own shadow rays; of more, one is chosen.
LAMPS_SAMPLED_EACH = 8


@dataclass(frozen=True, eq=False)
class Receiver:
    """The points of one closure type that lamps may light, and what their light is worth.

    weight (3, n) is the closure's colour times the path's throughput; slot (n,) or None.
    """

    points: Points
    group: Group
    weight: Vec
    slot: Index | None
    bounce: int


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
    split = plan.light_samples if bounce == 0 else 1
    for group in closures.groups:
        if group.module.IS_DELTA:
            continue
        to = _receiver(points, group, paths, bounce)
        for item in range(split):
            if lights.count <= LAMPS_SAMPLED_EACH:
                for number in range(lights.count):
                    lamp = lights.single(number)
                    u, v = draws.pair(dimension(LIGHT, bounce, number), to.slot, item, split)
                    _add_lamp(plan, to, lamp, lamp.colour * F32(1 / split), u, v, radiance, tally)
            else:
                _add_chosen(plan, to, draws, item, split, radiance, tally)


def _receiver(points: Points, group: Group, paths: Paths, bounce: int) -> Receiver:
    weight, throughput, slot = group.weight, paths.throughput, paths.slot
    if group.index is None:
        if throughput is not None:
            weight = weight * throughput
        return Receiver(points, group, weight, slot, bounce)
    if throughput is not None:
        weight = weight * throughput.take(group.index, axis=1)
    slot = group.index if slot is None else slot.take(group.index)
    return Receiver(points.take(group.index), group, weight, slot, bounce)


def _add_chosen(
    plan: Plan,
    to: Receiver,
    draws: Draws,
    item: int,
    split: int,
    radiance: Radiance,
    tally: Tally,
) -> None:
    # Choose by power, then sample kind by kind.
    pick, _ = draws.pair(dimension(LIGHT_CHOICE, to.bounce), to.slot, item, split)
    u, v = draws.pair(dimension(LIGHT, to.bounce), to.slot, item, split)
    assert plan.lights is not None
    chosen, probability, _ = plan.lights.choose(pick)
    for index, lamps in plan.lights.split(chosen):
        part = Receiver(
            to.points.take(index),
            Group(to.group.module, None, to.weight, to.group.parameters.take(index, axis=1)),
            to.weight.take(index, axis=1),
            index if to.slot is None else to.slot.take(index),
            to.bounce,
        )
        colour = lamps.colour / (probability.take(index) * F32(split))
        _add_lamp(plan, part, lamps, colour, u.take(index), v.take(index), radiance, tally)


def _add_lamp(
    plan: Plan,
    to: Receiver,
    lamp: LampGroup,
    colour: Vec,
    u: Scalar,
    v: Scalar,
    radiance: Radiance,
    tally: Tally,
) -> None:
    # Sample the lamp and scatter its light: f cos x radiance / pdf.
    start = to.points.above()
    to_light, gain, _ = lamp.kind.sample(lamp.rows, start, u, v)
    scattered = _evaluate(to, to_light, gain)
    check("direct", to_light=to_light, gain=gain, scattered=scattered)

    # Light from below the surface does not reach it; what carries no light gets no ray.
    arriving = scattered if scattered.ndim == 1 else scattered.max(axis=0)
    if not to.points.is_flat:
        arriving = arriving * (dot(to.points.geometric, to_light) > 0)
    lit = np.flatnonzero(arriving > 0)
    if not lit.size:
        return
    if lit.size < arriving.size:
        start, to_light = start.take(lit, axis=1), to_light.take(lit, axis=1)
    far = np.full(lit.size, FAR if lamp.kind.DISTANT else NEARLY, F32)
    assert plan.accel is not None
    free = plan.accel.free(start, to_light, far, tally)

    # Add what is not in shadow.
    seen = free if lit.size == arriving.size else lit.take(free)
    light = to.weight.take(seen, axis=1) * scattered.take(seen, axis=-1)
    light *= colour if colour.shape[1] == 1 else colour.take(seen, axis=1)
    radiance.add(light, seen if to.slot is None else to.slot.take(seen), to.bounce)


def _evaluate(to: Receiver, to_light: Vec, gain: Scalar) -> Scalar | Vec:
    """Return f cos x gain, (n,) or (3, n)."""
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
    return value
