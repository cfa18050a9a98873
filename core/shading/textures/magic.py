"""points (3, N) -> colour.  Magic Texture: sines of sums of sines, ten levels deep."""

import numpy as np

from ...arrays import F32, TWO_PI
from ..values import Array

# What each level makes anew: (component, function, its sign, signs of x, y and z in the angle)
_LEVELS = (
    (1, np.cos, -1, (1, -1, 1)),
    (0, np.cos, 1, (1, -1, -1)),
    (2, np.sin, 1, (-1, -1, -1)),
    (0, np.cos, -1, (-1, 1, -1)),
    (1, np.sin, -1, (-1, 1, 1)),
    (1, np.cos, -1, (-1, 1, 1)),
    (0, np.cos, 1, (1, 1, 1)),
    (2, np.sin, 1, (1, 1, -1)),
    (0, np.cos, -1, (-1, -1, 1)),
    (1, np.sin, -1, (1, -1, 1)),
)


def magic(points: Array, distortion: Array, depth: int) -> Array:
    """Return the colours (3, N) of Blender's Magic Texture at scaled points (3, N)."""
    points = np.fmod(points, TWO_PI)
    found = [
        function(_sum(points, signs) * F32(5)) * F32(sign)
        for function, sign, signs in (
            (np.sin, 1, (1, 1, 1)),
            (np.cos, 1, (-1, 1, -1)),
            (np.cos, -1, (-1, -1, 1)),
        )
    ]
    if depth > 0:
        found = [part * distortion for part in found]
    for row, function, sign, signs in _LEVELS[:depth]:
        found[row] = function(_sum(found, signs)) * (F32(sign) * distortion)
    whole = np.stack(np.broadcast_arrays(*found))
    whole /= np.where(distortion != 0, F32(2) * distortion, F32(1))
    return F32(0.5) - whole


def _sum(parts: Array | list[Array], signs: tuple[int, ...]) -> Array:
    """Return the sum of x, y and z with these signs, added in this order."""
    total = parts[0] if signs[0] > 0 else -parts[0]
    for part, sign in zip(parts[1:], signs[1:], strict=True):
        total = total + part if sign > 0 else total - part
    return total
