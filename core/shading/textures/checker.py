"""points (3, N) -> 0 or 1.  Checker Texture."""

import numpy as np

from ...arrays import F32
from ..values import Array

_NUDGE, _SHRINK = F32(1e-6), F32(0.999999)


def checker(points: Array) -> Array:
    """Return 1 (N,) in every other cube of side 1, else 0, at points (3, N)."""
    # Blender moves points a little, so that whole numbers are not where a cube ends.
    floor = np.floor((points + _NUDGE) * _SHRINK)
    with np.errstate(invalid="ignore"):
        x, y, z = floor.astype(np.int32)
    return ((x ^ y ^ z) & np.int32(1)).astype(F32)
