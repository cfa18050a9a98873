"""points (3, N) -> how much mortar, which brick.  Brick Texture."""

import numpy as np

from ...arrays import F32
from ..values import Array

Pattern = tuple[float, int, float, int]  # offset, its period in rows, squash, its period


def _random(number: np.ndarray) -> Array:
    """Return a random number (N,), 0 to 1, of integers (N,): a polynomial, bits overflowing."""
    number = (number.view(np.uint32) + np.uint32(1013)) & np.uint32(0x7FFFFFFF)
    number = (number >> np.uint32(13)) ^ number
    mixed = number * (number * number * np.uint32(60493) + np.uint32(19990303))
    mixed = (mixed + np.uint32(1376312589)) & np.uint32(0x7FFFFFFF)
    return mixed.astype(F32) * F32(2.0**-31)


def brick(
    points: Array,
    mortar_size: Array,
    mortar_smooth: Array,
    bias: Array,
    width: Array,
    height: Array,
    pattern: Pattern,
) -> Array:
    """Return the bricks' shade, 0 to 1, and the share of mortar: (2, N), at scaled points (3, N).

    mortar_size, width and height are in units of the points; mortar_smooth and bias as Blender's.
    """
    offset, offset_period, squash, squash_period = pattern
    x, y = points[0], points[1]
    row = _whole(y, height)
    if offset_period and squash_period:
        width = np.where(row % np.int32(squash_period), width, width * F32(squash))
        x = x + np.where(row % np.int32(offset_period), F32(0), width * F32(offset))
    column = _whole(x, width)
    x = x - width * column.astype(F32)
    y = y - height * row.astype(F32)

    number = (row << np.int32(16)) + (column & np.int32(0xFFFF))
    shade = np.minimum(np.maximum(_random(number) + bias, F32(0)), F32(1))

    near = np.minimum(np.minimum(x, y), np.minimum(width - x, height - y))
    inside = near < mortar_size
    with np.errstate(all="ignore"):
        depth = F32(1) - near / np.where(inside, mortar_size, F32(1))
        depth = np.where(mortar_smooth != 0, depth / mortar_smooth, F32(1))
    depth = np.minimum(np.maximum(depth, F32(0)), F32(1))
    mortar = depth * depth * (F32(3) - F32(2) * depth) * inside
    return np.stack(np.broadcast_arrays(shade, mortar))


def _whole(x: Array, step: Array) -> np.ndarray:
    """Return the number (N,) int32 of the step that x is in; steps of no length have number 0."""
    good = step != 0
    part = np.floor(np.where(good, x / np.where(good, step, F32(1)), F32(0)))
    return np.minimum(np.maximum(part, F32(-(2.0**31))), F32(2.0**31 - 128)).astype(np.int32)
