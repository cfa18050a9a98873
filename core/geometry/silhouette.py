"""normals -> normals.  Shading normals bent so that glossy surfaces reflect to the outside.

Near the silhouette of a smooth mesh, the mirrored ray about the shading normal would run into the
flat triangle, or the normal even turn away from the viewer: black rims.  There the normal is
turned towards the geometric one until the mirrored ray is just above the triangle, by as much
as in Blender.
"""

import numpy as np

from ..arrays import F32, Vec, dot, normalize

# The mirrored ray rises at least so much, or a little less than the viewer's if that is lower.
RISE, SHARE = F32(0.01), F32(0.9)


def bent_normals(geometric: Vec, normal: Vec, wo: Vec) -> Vec:
    """Return shading normals (3, N) that mirror the viewer's ray `wo` above the surface."""
    height = dot(geometric, wo)
    rise = np.minimum(height * SHARE, RISE)
    mirrored = F32(2) * dot(normal, wo) * dot(normal, geometric) - height
    low = np.flatnonzero(mirrored < rise)
    if not low.size:
        return normal

    # Work in the plane of both normals, with angles from the geometric one, up, towards x.
    up, wo, rise = geometric.take(low, axis=1), wo.take(low, axis=1), rise.take(low)
    x = normal.take(low, axis=1)
    x = normalize(x - up * dot(x, up))
    across, height = dot(wo, x), height.take(low)
    length = np.maximum(np.sqrt(across * across + height * height), F32(1e-20))

    # A normal at angle a mirrors the viewer's ray at angle b to a height of length cos(2 a - b).
    viewer = np.arctan2(across, height)
    angle = F32(0.5) * (viewer + np.arccos(np.minimum(rise / length, F32(1))))
    bent = normal.copy()
    bent[:, low] = x * np.sin(angle) + up * np.cos(angle)
    return bent
