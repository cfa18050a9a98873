"""shadow rays -> light that arrives.  What lies between points and lights.

Opaque surfaces stop light; transparent ones, where the scene has them, colour it on its way.
"""

import numpy as np

from ..arrays import Ids, Index, Scalar, Vec, dot, take, unit
from ..bsdf import SHADOW
from ..geometry.accel import Hits
from ..geometry.surface import resolve
from ..plan import Plan
from ..shading import Arrival
from ..statistics import Tally
from .receiver import Receiver, Sample


def passed(
    plan: Plan,
    to: Receiver,
    start: Vec,
    sample: Sample,
    far: Scalar,
    index: Index | None,
    depth: int,
    tally: Tally,
) -> Scalar | Vec:
    """Return the share (n,) or (3, n) of light that comes through to points `index` or all.

    start (3, n), far (n,): of the shadow rays; a far < 0 gives 0.
    """
    assert plan.accel is not None
    direction = sample.to_light if index is None else sample.to_light.take(index, axis=1)
    blockers = sample.blockers
    if not isinstance(blockers, int):
        blockers = take(blockers, index) if index is not None else blockers
    time = to.points.time if index is None else take(to.points.time, index)
    if not plan.has_transparent:
        return plan.accel.free(start, direction, far, tally, blockers, time)

    points = to.points
    left = points.triangle if index is None else points.triangle.take(index)
    before = to.passed if index is None else take(to.passed, index)
    total = to.total if index is None else take(to.total, index)

    def shade(triangle: Ids, u: Scalar, v: Scalar, t: Scalar, ray: Index, met: Ids) -> Scalar | Vec:
        # For the shader the ray is one bounce further, and has passed what the path has and more.
        total_here = None if total is None else total.take(ray) + np.int16(1)
        passed = met.astype(np.int16)
        if before is not None:
            passed += before.take(ray)
        arrival = Arrival(SHADOW, depth + 1, total=total_here, passed=passed)
        hits = Hits(t, triangle, u, v)
        return _transparency(plan, start, direction, hits, ray, arrival, time)

    limit: int | Ids = plan.transparent_max_bounces
    if before is not None:
        limit = np.maximum(limit - before.astype(np.int32), 0)
    way = start, direction, far
    return plan.accel.transmittance(*way, tally, shade, limit, left, blockers, time)


def _transparency(
    plan: Plan,
    start: Vec,
    direction: Vec,
    hits: Hits,
    ray: Index,
    arrival: Arrival,
    time: Scalar | None,
) -> Vec:
    """Return what surfaces let through (3, n) that rays (n,) hit."""
    assert plan.triangles is not None
    table = plan.surfaces.plain_transparency
    if table is not None:
        return table.take(plan.triangles.ids[:, 0].take(hits.triangle), axis=1)
    direction = direction.take(ray, axis=1)
    length = np.sqrt(dot(direction, direction))
    origin = np.broadcast_to(start, (3, start.shape[1])).take(ray, axis=1)
    there = Hits(hits.t * length, hits.triangle, hits.u, hits.v)
    way = origin, unit(direction, length)
    points = resolve(plan.triangles, *way, there, None, take(time, ray))
    return plan.surfaces.transparency(points, arrival)
