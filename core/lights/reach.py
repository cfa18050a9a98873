"""lamps, boxes of objects -> lamps that light any of them.  Lamps that look away are left out.

What a lamp lights lies within half spaces: in front of an area, in the cone of a spot.  Where one
of them holds nothing of an object's box, the lamp does not light that object; where that is so of
all objects that it is linked to, no sample of it brings light and no ray that leaves a surface
meets it.  Only the camera may still see it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..scene import EVERY_SET, Instance, Lamp, RayKinds
from . import REGISTRY

BOXES = 256  # at most, that a lamp is compared with; of more objects, neighbours share one
ROUNDING = 1e-5  # of the places of hits, as a share of coordinates: far above that of float32
NO_SAMPLES = -1  # bounces up to which a lamp is sampled
ONLY_CAMERA = RayKinds(diffuse=False, glossy=False, transmission=False, shadow=False)


def useful_lamps(
    lamps: Sequence[Lamp],
    instances: tuple[Instance, ...],
    boxes: NDArray[np.float64],
    origin: NDArray[np.float64],
) -> tuple[Lamp, ...]:
    """Return the lamps that light any of the instances at rest, or are seen by the camera.

    Those that are seen only are never sampled.  boxes (N, 2, 3) of the instances [m]; moving lamps
    are kept.  Exact: the converged picture is that of all lamps.
    """
    if not any(_may_look_away(lamp) for lamp in lamps):
        return tuple(lamps)
    sets = np.array([instance.receiver_set for instance in instances], np.int64)
    low, high, sets = _grouped(boxes, sets)
    kept = []
    for lamp in lamps:
        if not _may_look_away(lamp) or _lights_any(lamp, low - origin, high - origin, sets, origin):
            kept.append(lamp)
        elif lamp.seen_by.camera and lamp.sampled:
            kept.append(replace(lamp, max_bounces=NO_SAMPLES, seen_by=ONLY_CAMERA))
    return tuple(kept)


def _may_look_away(lamp: Lamp) -> bool:
    return lamp.motion is None and (lamp.kind in ("AREA", "SPOT") or lamp.receivers != EVERY_SET)


def _grouped(
    boxes: NDArray[np.float64], sets: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return the low and the high corners (M, 3) of boxes, and their link sets (M,).

    Those of a set share some, if there are many.
    """
    some = np.flatnonzero((boxes[:, 0] <= boxes[:, 1]).all(axis=1))
    boxes, sets = boxes.take(some, axis=0), sets.take(some)
    if some.size <= BOXES:
        return boxes[:, 0], boxes[:, 1], sets
    order = np.argsort(sets, kind="stable")
    boxes, sets = boxes.take(order, axis=0), sets.take(order)
    starts = np.flatnonzero(np.diff(sets, prepend=-1))
    evenly = np.arange(0, some.size, -(-some.size // BOXES))
    starts = np.union1d(starts, evenly)
    low = np.minimum.reduceat(boxes[:, 0], starts, axis=0)
    return low, np.maximum.reduceat(boxes[:, 1], starts, axis=0), sets.take(starts)


def _lights_any(
    lamp: Lamp,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    sets: NDArray[np.int64],
    origin: NDArray[np.float64],
) -> bool:
    """Tell whether a lamp may light boxes (M, 3) about `origin`, of link `sets` (M,)."""
    if lamp.receivers != EVERY_SET:
        linked = np.array([lamp.receivers >> int(each) & 1 for each in sets], bool)
        low, high = low[linked], high[linked]
    kind = REGISTRY[lamp.kind](lamp)
    if kind is None or not len(low):
        return False
    region = kind.region(lamp, origin)
    if region is None:
        return True

    # Reach of each box along the normals, and as much as rounding may move it
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    reach = region.normals @ middle.T + np.abs(region.normals) @ half.T
    sizes = (
        np.maximum(np.abs(low), np.abs(high)).sum(axis=1)
        + np.abs(lamp.to_world[:, 3] - origin).sum()
    )
    return bool((reach + ROUNDING * sizes >= region.least[:, None]).all(axis=0).any())
