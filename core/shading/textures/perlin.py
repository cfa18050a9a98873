"""points (D, N) -> numbers about -1 to 1.  Perlin's gradient noise in one to four dimensions.

Each corner of the grid cell around a point has a gradient that its hash chooses; the ramps along
them are blended by Perlin's quintic (Perlin 2002, "Improving Noise").  As in Blender the noise
repeats every 100,000 cells.

A batch whose cells fill a small box takes its gradients from a table of that box, made once for
the batch: one hash per corner of the grid instead of 2^D per point.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...arrays import F32
from ..values import Array
from .hashing import Words, hash_words

_CHUNK = 4096  # points: with the eight corners of a cell an array is 128 KB
_PERIOD, _FAR, _HALF = F32(100000), F32(1000000), F32(0.5)
# By dimension, what brings the noise to about -1 to 1
_SCALE = {1: F32(0.25), 2: F32(0.6616), 3: F32(0.982), 4: F32(0.8344)}
_SIGN = (1.0, -1.0)


def _gradient(dimensions: int, number: int) -> list[float]:
    """Return the gradient that a hash's low bits choose."""
    gradient = [0.0] * dimensions
    signs = [_SIGN[number >> bit & 1] for bit in range(3)]
    if dimensions == 1:
        gradient[0] = _SIGN[number >> 3 & 1] * (1 + (number & 7))
    elif dimensions == 2:
        first = 0 if number < 4 else 1
        gradient[first], gradient[1 - first] = signs[0], 2 * signs[1]
    elif dimensions == 3:
        second = 1 if number < 4 else 0 if number in (12, 14) else 2
        gradient[0 if number < 8 else 1] += signs[0]
        gradient[second] += signs[1]
    else:
        gradient[0 if number < 24 else 1] = signs[0]
        gradient[1 if number < 16 else 2] = signs[1]
        gradient[2 if number < 8 else 3] = signs[2]
    return gradient


# By dimension, the components (D, count) of all gradients
_GRADIENTS = {
    dimensions: np.array([_gradient(dimensions, number) for number in range(count)], F32).T.copy()
    for dimensions, count in ((1, 16), (2, 8), (3, 16), (4, 32))
}


def perlin(points: Array) -> Array:
    """Return Perlin noise (N,) at points (D, N), D = 1 to 4, about -1 to 1.

    Source: Perlin 2002; gradients, scale and period as in Blender.
    """
    points = _repeated(points)
    dimensions, size = points.shape
    floor = np.floor(points)
    table = _table(floor)
    out = np.empty(size, F32)
    for start in range(0, size, _CHUNK):
        part = slice(start, start + _CHUNK)
        cell = floor[:, part].astype(np.int32)
        _blend(points[:, part] - floor[:, part], *_corners(cell, table), out[part])
    out *= _SCALE[dimensions]
    return out


def _blend(inside: Array, index: NDArray[np.intp], gradients: Array, out: Array) -> None:
    """Write the noise at points (D, N) in cells whose corners (2, ..., 2, N) have gradients."""
    dimensions = len(inside)

    # Sum the ramps of the corners: their axes stand in the order of the points' ones, reversed.
    total, ramp = np.empty(index.shape, F32), np.empty(index.shape, F32)
    for axis in range(dimensions):
        ends = np.stack((inside[axis], inside[axis] - F32(1))).reshape(_shape(dimensions, axis))
        if axis == 0:
            gradients[0].take(index, mode="clip", out=total)
            total *= ends
        else:
            gradients[axis].take(index, mode="clip", out=ramp)
            ramp *= ends
            total += ramp

    # Blend along one axis after the other.
    fade = inside * F32(6)
    fade -= F32(15)
    fade *= inside
    fade += F32(10)
    for _ in range(3):
        fade *= inside
    for row in fade:
        low, high = total[..., 0, :], total[..., 1, :]
        high -= low
        high *= row
        high += low
        total = high
    out[...] = total


def _repeated(points: Array) -> Array:
    """Return points within the period, half a cell aside where only integers are left."""
    if not points.size or max(points.max(), -points.min()) < _PERIOD:
        return points
    return np.fmod(points, _PERIOD) + _HALF * (np.abs(points) >= _FAR)


def _shape(dimensions: int, axis: int) -> tuple[int, ...]:
    """Return the shape in which the two ends along an axis broadcast over all corners."""
    return (*(2 if place == axis else 1 for place in reversed(range(dimensions))), -1)


@dataclass(frozen=True, eq=False)
class _Table:
    """Gradients (D, ...) of all grid corners in a box that begins at `low` (D, 1)."""

    low: NDArray[np.int32]
    steps: tuple[int, ...]  # in the table, along each axis
    gradients: Array


def _table(floor: Array) -> _Table | None:
    """Return the table for cells (D, N), None where it would be larger than is worth while."""
    dimensions, size = floor.shape
    if size < _CHUNK:
        return None
    low, high = floor.min(axis=1), floor.max(axis=1)
    count = (high - low).astype(np.int64) + 2
    if count.prod(dtype=np.float64) > size:
        return None
    first = low.astype(np.int32)
    keys = [
        np.arange(first[axis], first[axis] + np.int32(count[axis]), dtype=np.int32)
        .view(np.uint32)
        .reshape([-1 if place == axis else 1 for place in reversed(range(dimensions))])
        for axis in range(dimensions)
    ]
    choices = _choices(keys).reshape(-1)
    steps = tuple(int(count[:axis].prod()) for axis in range(dimensions))
    return _Table(first[:, None], steps, _GRADIENTS[dimensions].take(choices, axis=1))


def _corners(cell: NDArray[np.int32], table: _Table | None) -> tuple[NDArray[np.intp], Array]:
    """Return where the corners (2, ..., 2, N) of cells have their gradients, and the gradients."""
    dimensions, size = cell.shape
    if table is None:
        ends = [
            np.stack((row, row + np.int32(1))).view(np.uint32).reshape(_shape(dimensions, axis))
            for axis, row in enumerate(cell)
        ]
        return _choices(ends), _GRADIENTS[dimensions]
    base = np.zeros(size, np.intp)
    for row, low, step in zip(cell, table.low, table.steps, strict=True):
        base += (row - low) * np.intp(step)
    offsets = np.zeros((2,) * dimensions, np.intp)
    for axis, step in enumerate(table.steps):
        offsets += np.array((0, step)).reshape(_shape(dimensions, axis)[:-1])
    return base + offsets[..., None], table.gradients


def _choices(keys: list[Words]) -> NDArray[np.intp]:
    """Return which gradients corners have."""
    words = hash_words(keys)
    words &= np.uint32(_GRADIENTS[len(keys)].shape[1] - 1)
    return words.astype(np.intp)
