"""node -> Value.  Ambient Occlusion, Bevel and Raycast: nodes that look around.

As in Cycles they see nothing where shadow rays, light samples and lamps ask for a shader.  Their
random numbers are pairs of their own, which only scenes with these nodes draw.
Sources: King et al. 2013, "BSSRDF Importance Sampling" (Bevel: normals near by, by a falloff).
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import F32, Scalar, Vec, dot, frame, normalize, take
from ...geometry.accel import FAR
from ...geometry.surface import Points, resolve
from ...sampling.dimensions import LENS, PIXEL
from ...sampling.warp import cosine_hemisphere
from ...scene import Node
from .. import values
from ..context import Context
from ..graph import Graph, NodeFunction, title
from ..inputs import NORMAL
from ..tracing import EVERYWHERE, OWN, Probe, Tracer
from ..values import COLOUR, FLOAT, SEVERAL, Array, Value, constant, read, step, widened

OCCLUSION, BEVEL = PIXEL, LENS  # pairs, see `tracing.Probe`

# Less likely paths do not see bevels [1/sr] (Cycles)
SHARP = F32(8)


def _reaches(reach: Callable[[tuple[Any, ...]], int]) -> Callable[[Any], Any]:
    """Tell of a step how far it looks, by what is static in it."""

    def mark(function: Any) -> Any:
        function.reach = reach
        return function

    return mark


def _equipment(context: Context) -> tuple[Tracer, Probe] | None:
    """Return what tracing takes, None where nobody may."""
    tracer, probe = context.place.tracer, context.arrival.probe
    if tracer is None or probe is None:
        return None
    return tracer, probe if context.index is None else probe.take(context.index)


def _everywhere(context: Context, array: Array) -> Array:
    return np.broadcast_to(array, (*array.shape[:-1], context.size))


# --- Ambient Occlusion --------------------------------------------------------------------------


def _ambient_occlusion(graph: Graph, node: Node, output: str) -> Value:
    given = graph.vector(node, "Normal") if graph.is_linked(node, "Normal") else None
    choices = (
        int(graph.choice(node, "samples", 16)),
        bool(graph.choice(node, "inside", False)),
        bool(graph.choice(node, "only_local", False)),
    )
    distance = graph.number(node, "Distance", 1.0)
    if distance.is_exactly(0) and not graph.is_linked(node, "Distance"):
        distance = constant(min(graph.far, FAR))  # what the world says
    share = graph.share(node, lambda: read(unoccluded, given or NORMAL, distance, static=choices))
    return share if output == "AO" else graph.colour(node, "Color") * share


@_reaches(lambda static: OWN if static[2] else EVERYWHERE)
def unoccluded(
    context: Context,
    normal: Array,
    distance: Array,
    samples: int,
    inside: bool,
    only_local: bool,
) -> Scalar:
    """Return the share (n,) of cosine-weighted rays about normals that meet nothing so near."""
    found = _equipment(context)
    if found is None or samples < 1:
        return np.ones(1, F32)
    tracer, probe = found
    up = normalize(np.array(_everywhere(context, normal)))
    up = np.negative(up) if inside else up
    x, y = frame(up)
    far = np.array(_everywhere(context, distance), F32)
    points = context.points if context.index is None else context.points.take(context.index)
    free = np.zeros(context.size, F32)
    for sample in range(samples):
        local = cosine_hemisphere(*probe.pair(OCCLUSION, sample, samples))
        direction = x * local[0] + y * local[1] + up * local[2]
        side = np.copysign(points.offset, dot(direction, context.geometric))
        start = context.local + context.geometric * side
        if only_local:
            free += _is_alone(tracer, probe, points, start, direction, far)
        else:
            free += tracer.is_free(start, direction, far.copy(), probe.tally, points.time)
    return np.where(far > 0, free * F32(1 / samples), F32(1))


def _is_alone(
    tracer: Tracer, probe: Probe, points: Points, start: Vec, direction: Vec, far: Scalar
) -> Scalar:
    """Return 1 for each ray (n,) that does not meet the object it starts from, else 0."""
    alone = np.ones(far.size, F32)
    instance = tracer.instance(points.triangle)
    way = start, direction, far, points.triangle, probe.tally, points.time
    for ray, _ in tracer.hits_of(instance, *way):
        alone[ray] = 0
    return alone


# --- Bevel --------------------------------------------------------------------------------------


def _bevel(graph: Graph, node: Node, output: str) -> Value:
    radius = graph.number(node, "Radius", 0.05)
    found = read(
        bevelled, radius, kind=values.VECTOR, static=(int(graph.choice(node, "samples", 4)),)
    )
    if not graph.is_linked(node, "Normal"):
        return found
    given = graph.vector(node, "Normal")
    assert given is not None
    return step(_unit, given + (found - NORMAL), kind=values.VECTOR)


def _unit(vector: Array) -> Array:
    return normalize(np.array(vector))


@_reaches(lambda static: OWN)
def bevelled(context: Context, radius: Array, samples: int) -> Vec:
    """Return normals (3, n), unit: the mean of those of the same object within a radius [m].

    Points are found by rays along one of three axes through disks about the point, and weighted by
    all three (power heuristic), and by a falloff (radius - r)^3.  Biased, since few are averaged
    before the sum is made unit: by as much as in Cycles, if the axes are the same.
    """
    found = _equipment(context)
    if found is None or samples < 1:
        return context.normal
    tracer, probe = found
    radius = np.array(_everywhere(context, radius), F32)
    wanted = radius > 0
    if probe.is_sharp is not None:
        wanted &= probe.is_sharp
    index = np.flatnonzero(wanted)
    if not index.size:
        return context.normal
    points = context.points if context.index is None else context.points.take(context.index)
    points, probe, radius = points.take(index), probe.take(index), radius.take(index)
    x, y = (axis.take(index, axis=1) for axis in context.sideways)
    axes = points.geometric, x, y
    total = np.zeros((3, index.size), F32)
    for sample in range(samples):
        u, v = probe.pair(BEVEL, sample, samples)
        total += _normals_around(tracer, points, axes, radius, u, v, probe)
    length = np.sqrt(dot(total, total))
    mean = total / np.where(length > 0, length, F32(1))
    mean *= np.where(points.back, F32(-1), F32(1))
    out = context.normal.copy()
    out[:, index] = np.where(length > 0, mean, context.normal.take(index, axis=1))
    return out


def _normals_around(
    tracer: Tracer,
    points: Points,
    axes: tuple[Vec, Vec, Vec],
    radius: Scalar,
    u: Scalar,
    v: Scalar,
    probe: Probe,
) -> Vec:
    """Return the weighted sum (3, n) of the normals that one ray for each point meets."""
    # The axis of the disk: the normal half the time
    normal, x, y = axes
    first, second = u < F32(0.5), u < F32(0.75)
    axis = np.where(first, normal, np.where(second, x, y))
    tangent = np.where(first, x, np.where(second, normal, x))
    other = np.where(first | second, y, normal)
    spare = np.where(first, u * F32(2), np.where(second, u - F32(0.5), u - F32(0.75)) * F32(4))

    # A place on it, and a ray through the ball above and below
    r = _falloff_inverse(v) * radius
    height = np.sqrt(np.maximum(radius * radius - r * r, F32(0)))
    angle = F32(2 * np.pi) * spare
    start = points.position + axis * height
    start += tangent * (r * np.cos(angle)) + other * (r * np.sin(angle))
    direction, far = np.negative(axis), F32(2) * height

    # All that it meets of the object
    total = np.zeros_like(start)
    instance = tracer.instance(points.triangle)
    way = start, direction, far, None, probe.tally, points.time
    for ray, hits in tracer.hits_of(instance, *way):
        met = resolve(
            tracer.triangles,
            start.take(ray, axis=1),
            direction.take(ray, axis=1),
            hits,
            None,
            take(points.time, ray),
        )
        outward = np.where(met.back, F32(-1), F32(1))
        across = met.geometric
        apart = met.position - points.position.take(ray, axis=1)
        limit = radius.take(ray)
        falloff = np.maximum(limit - np.sqrt(dot(apart, apart)), F32(0)) ** 3
        chosen = np.maximum(limit - r.take(ray), F32(1e-30)) ** 3
        pdfs = [
            share * np.abs(dot(axis_at.take(ray, axis=1), across))
            for share, axis_at in ((F32(0.5), normal), (F32(0.25), x), (F32(0.25), y))
        ]
        picked = np.where(first, F32(0.5), F32(0.25)).take(ray)
        picked = picked * np.abs(dot(axis.take(ray, axis=1), across))
        squares = pdfs[0] ** 2 + pdfs[1] ** 2 + pdfs[2] ** 2
        weight = picked / np.maximum(squares, F32(1e-30)) * falloff / chosen
        total[:, ray] += met.normal * (outward * weight)
    return total


def _falloff_inverse(u: Scalar) -> Scalar:
    """Return r (n,) within which the share u of (1 - r)^3 over the unit disk lies.

    The root of 10 r^2 - 20 r^3 + 15 r^4 - 4 r^5 = u, by Newton's method.
    """
    r = np.full(u.shape, 0.25)
    for _ in range(12):
        slope = 20 * r * (1 - r) ** 3
        miss = r * r * (10 + r * (-20 + r * (15 - 4 * r))) - u
        r = np.clip(r - miss / np.maximum(slope, 1e-12), 0, 1)
    return r.astype(F32)


# --- Raycast ------------------------------------------------------------------------------------

# Output -> its row among the results, and how many it has
RESULTS = {
    "Is Hit": (0, 1),
    "Self Hit": (1, 1),
    "Hit Distance": (2, 1),
    "Hit Position": (3, 3),
    "Hit Normal": (6, 3),
}


def _raycast(graph: Graph, node: Node, output: str) -> Value | None:
    if output not in RESULTS:
        graph.note(f"{title(node)}: attributes of what is hit are not read; {output} is 0")
        return Value(COLOUR, np.zeros((3, 1), F32))
    row, count = RESULTS[output]
    found = graph.share(node, lambda: _cast(graph, node))
    kind = FLOAT if count == 1 else values.VECTOR
    return Value(kind, None, _rows, (found,), (row, count))


def _cast(graph: Graph, node: Node) -> Value:
    place = graph.vector(node, "Position") if graph.is_linked(node, "Position") else None
    way = graph.vector(node, "Direction") if graph.is_linked(node, "Direction") else None
    only_local = bool(graph.choice(node, "only_local", False))
    args = () if place is None else (widened(place, values.VECTOR),)
    return read(
        cast,
        way or NORMAL,
        graph.number(node, "Length", 1.0),
        *args,
        kind=SEVERAL,
        static=(only_local,),
    )


def _rows(results: Array, row: int, count: int) -> Array:
    return results[row] if count == 1 else results[row : row + count]


@_reaches(lambda static: OWN if static[0] else EVERYWHERE)
def cast(context: Context, direction: Array, length: Array, *rest: Any) -> Array:
    """Return what rays meet (9, n), see RESULTS: of any direction, `length` times as long.

    The last argument is whether only the same object counts; before it may come where rays start.
    """
    *given, only_local = rest
    direction = np.array(_everywhere(context, direction), F32)
    far = np.array(_everywhere(context, length), F32)
    position = _everywhere(context, given[0]) if given else context.position
    out = np.zeros((9, context.size), F32)
    out[2] = far
    found = _equipment(context)
    if found is None:
        return out
    tracer, probe = found

    # Rays from the point itself do not meet its triangle, and start beyond its rounding
    points = context.points if context.index is None else context.points.take(context.index)
    here = (position == context.position).all(axis=0)
    side = np.copysign(points.offset, dot(direction, context.geometric))
    above = context.local + context.geometric * side
    start = np.where(here, above, position - context.place.origin)
    left = np.where(here, points.triangle, np.int32(-1))
    far = np.where((direction != 0).any(axis=0), far, F32(0))
    index = np.flatnonzero(far > 0)
    if not index.size:
        return out
    start, direction = start.take(index, axis=1), direction.take(index, axis=1)
    far, left, own = far.take(index), left.take(index), tracer.instance(points.triangle.take(index))
    time = take(points.time, index)
    if only_local:
        ray, hits = _first(tracer.hits_of(own, start, direction, far, left, probe.tally, time))
    else:
        hits = tracer.closest(start, direction, far.copy(), left, probe.tally, time)
        ray = np.flatnonzero(hits.triangle >= 0)
        hits = hits.take(ray)
    if not ray.size:
        return out
    direction = direction.take(ray, axis=1)
    met = resolve(tracer.triangles, start.take(ray, axis=1), direction, hits, None, take(time, ray))
    where = index.take(ray)
    out[0, where] = 1
    out[1, where] = tracer.instance(hits.triangle) == own.take(ray)
    out[2, where] = hits.t
    out[3:6, where] = position.take(where, axis=1) + direction * hits.t
    out[6:, where] = met.normal
    return out


def _first(hits: Any) -> tuple[Any, Any]:
    """Return the first hit of each ray."""
    rays, found = [np.zeros(0, np.intp)], []
    for ray, some in hits:
        new = np.flatnonzero(~np.isin(ray, np.concatenate(rays)))
        rays.append(ray.take(new))
        found.append(some.take(new))
    together = np.concatenate(rays)
    if not found:
        return together, None
    names = ("t", "triangle", "u", "v")
    return together, type(found[0])(
        *(np.concatenate([getattr(each, name) for each in found]) for name in names)
    )


TRACED: dict[str, NodeFunction] = {
    "AmbientOcclusion": _ambient_occlusion,
    "Bevel": _bevel,
    "Raycast": _raycast,
}
