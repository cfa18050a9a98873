"""aperture, u in the unit square -> points in the opening.  The shapes of what is out of focus."""

import numpy as np

from ..arrays import F32, Scalar, Vec
from ..optics import Aperture
from ..sampling.warp import concentric_disk, uniform_triangle


def opening(aperture: Aperture, half: Vec, u: Scalar, v: Scalar) -> Vec:
    """Return points (2, N) [m], right and up, uniform in the opening; unbiased.

    half (2, 1) or (2, N) [m]: half of its width and of its height, see `Aperture.half`.

    Polygons have their corners on the circle of the aperture's radius, one of them half a side
    from the rotation; fewer than three blades make no polygon, but a disk (Cycles).
    """
    if aperture.blades < 3:
        point = concentric_disk(u, v)
    else:
        point = _polygon(aperture.blades, aperture.rotation, u, v)
    point *= half
    return point


def _polygon(corners: int, rotation: float, u: Scalar, v: Scalar) -> Vec:
    # Choose one of the triangles around the middle, and stretch what is left of u
    u = u * F32(corners)
    side = np.minimum(u.astype(np.int32), np.int32(corners - 1))
    u -= side.astype(F32)

    # Find the point between the two corners of that side
    first, second = uniform_triangle(u, v)
    angle = rotation + (2 * np.arange(corners + 1) - 1) * (np.pi / corners)
    corner = np.stack([np.cos(angle), np.sin(angle)]).astype(F32)
    point = corner.take(side, axis=1)
    point *= first
    point += corner.take(side + np.int32(1), axis=1) * second
    return point
