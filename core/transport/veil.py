"""rays to stars -> light that arrives.  What lies between the camera and a star.

As the camera sees it, not as shadows do: opaque surfaces hide stars, transparent ones dim them.
"""

import numpy as np

from ..arrays import F32, Scalar, Vec
from ..plan import Plan
from ..statistics import Tally
from .gaze import Gaze


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
    if not plan.has_transparent:
        hits = plan.accel.closest(origin, direction, far, None, None, tally, time)
        through[:, np.flatnonzero(hits.triangle >= 0)] = 0
        return through
    gaze = Gaze(origin, direction, far, time)
    while (met := gaze.meet(plan, tally)) is not None:
        if gaze.passed == plan.transparent_max_bounces:
            through[:, gaze.ray] = 0
            break

        # Let through what the surface does, as the camera's paths would meet it
        points, arrival = met
        assert gaze.far is not None
        share = np.clip(plan.surfaces.transparency(points, arrival), F32(0), None)
        share = share * through.take(gaze.ray, axis=1)
        for channel, values in zip(through, share, strict=True):
            channel[gaze.ray] = values

        # Go on behind it
        on = np.flatnonzero(share.any(axis=0))
        rest = np.maximum(gaze.far - points.distance, F32(0))
        gaze.go_on(points, on, rest.take(on))
    return through
