"""pixels -> depth, position, numbers.  What a ray through the middle of each pixel meets.

These passes are not filtered: a mean of the depths of two objects is the depth of neither.  One
ray, drawn without chance, gives the same numbers for any samples and seed.  Source: Cycles,
film_write_data_passes, which takes its first sample through the middle of the pixel; ours goes
through the middle of the lens, too, when half of the light has come through the shutter.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec, take
from ..camera import FILTER_ENTRIES
from ..geometry.surface import Points
from ..plan import Plan
from ..shading import Arrival
from ..statistics import Tally
from .gaze import Gaze

MIDDLE = F32(0.5)


def look(plan: Plan, x: Scalar, y: Scalar) -> NDArray[np.float32]:
    """Return the rows of `film.MIDDLES` (C, n) of pixels whose corners are at x, y (n,).

    0 where there is nothing.
    """
    out = np.zeros((6, x.size), F32)
    if plan.accel is None or plan.triangles is None:
        return out
    tally = Tally()
    tally.start()
    # The filter's own middle is half an entry of its table away from that of the pixel.
    half = np.full(x.size, MIDDLE)
    shift = MIDDLE - plan.camera.offsets[FILTER_ENTRIES // 2]
    time, camera = None, plan.camera
    if plan.shutter is not None:
        time = plan.shutter.open(half, y)
        if plan.camera_motion is not None:
            camera = plan.camera_motion.at(time)
    pinhole = replace(camera, aperture=None)
    origin, direction, far, pixel = pinhole.rays(x + shift, y + shift, half, half)
    origin = np.broadcast_to(origin, direction.shape)
    pixel = np.arange(x.size) if pixel is None else pixel
    gaze = Gaze(origin, direction, far, take(time, pixel))
    while (met := gaze.meet(plan, tally)) is not None:
        points, arrival = met
        is_clear = _is_clear(plan, points, arrival)
        shown = np.flatnonzero(~is_clear & ~_is_held_out(plan, points))
        out[:, pixel.take(gaze.ray.take(shown))] = _rows(plan, points.take(shown))

        # Look on behind what is not opaque enough.
        gaze.go_on(points, np.flatnonzero(is_clear))
    return out


def _is_clear(plan: Plan, points: Points, arrival: Arrival) -> NDArray[np.bool_]:
    """Tell which points (n,) passes look through."""
    assert plan.ledger is not None
    if not plan.has_transparent:
        return np.zeros(points.size, bool)
    share = np.clip(plan.surfaces.transparency(points, arrival), F32(0), F32(1))
    alpha: Scalar = F32(1) - share.mean(axis=0)
    return alpha < plan.ledger.alpha_threshold


def _is_held_out(plan: Plan, points: Points) -> NDArray[np.bool_]:
    if not plan.has_held_out:
        return np.zeros(points.size, bool)
    assert plan.triangles is not None and plan.triangles.objects is not None
    assert points.instance is not None
    return plan.triangles.objects.holdout.take(points.instance)


def _rows(plan: Plan, points: Points) -> Vec:
    place, ledger = plan.surfaces.place, plan.ledger
    assert place.view is not None and ledger is not None and points.instance is not None
    out = np.empty((6, points.size), F32)
    out[0] = place.view.depth(place.view.point(points.position))
    out[1:4] = points.position + place.origin
    out[4] = ledger.numbers[0].take(points.instance)
    out[5] = ledger.numbers[1].take(points.material)
    return out
