"""rays to stars -> light that arrives.  What lies between the camera and a star.

As the camera sees it, not as shadows do: opaque surfaces hide stars, transparent ones dim them.
"""

import numpy as np

from ..arrays import F32, Scalar, Vec, take
from ..bsdf import CAMERA
from ..geometry import surface
from ..plan import Plan
from ..shading import Arrival
from ..statistics import Tally


def passed(
    plan: Plan, origin: Vec, direction: Vec, far: Scalar, time: Scalar | None, tally: Tally
) -> Vec:
    """Return the share (3, N) of light that comes through to the camera.

    origin and unit direction (3, N), far (N,) [m]: from the camera to the stars.
    """
    through = np.ones((3, far.size), F32)
    if plan.accel is None or plan.triangles is None:
        return through
    tally.rays_camera += far.size
    ray, left, travelled = np.arange(far.size), None, np.zeros(far.size, F32)
    for met in range(plan.transparent_max_bounces + 1):
        hits = plan.accel.closest(origin, direction, far, left, None, tally, time)
        found = np.flatnonzero(hits.triangle >= 0)
        ray = ray.take(found)
        if not ray.size:
            break
        if not plan.has_transparent or met == plan.transparent_max_bounces:
            through[:, ray] = 0
            break

        # Let through what the surface does, as the camera's paths would meet it
        points = surface.resolve(plan.triangles, origin, direction, hits, found, time)
        travelled, far = travelled.take(found), far.take(found)
        count = np.full(ray.size, met, np.int16)
        arrival = Arrival(CAMERA, met, travelled, passed=count)
        points = plan.surfaces.bend(points, arrival)
        share = np.clip(plan.surfaces.transparency(points, arrival), F32(0), None)
        share = share * through.take(ray, axis=1)
        for channel, values in zip(through, share, strict=True):
            channel[ray] = values

        # Go on behind it
        on = np.flatnonzero(share.any(axis=0))
        ray, points = ray.take(on), points.take(on)
        if not ray.size:
            break
        origin = points.position - points.geometric * points.offset
        direction, left, time = points.arriving, points.triangle, points.time
        travelled = travelled.take(on) + points.distance
        far = np.maximum(take(far, on) - points.distance, F32(0))
    return through
