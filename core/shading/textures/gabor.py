"""points (2 or 3, N) -> value, phase, intensity.  Gabor Texture: sparse waves in random places.

Sources: Lagae et al. 2009, "Procedural Noise using Sparse Gabor Convolution"; Tavernier et al.
2019, "Making Gabor Noise Fast and Normalized" (eight impulses of weight 1 or -1 per cell); Tricard
et al. 2019, "Procedural Phasor Noise", eqs. 8 and 9 (intensity and phase).

What is random in a cell is computed once for all points of a batch that it concerns.
"""

from itertools import product

import numpy as np

from ...arrays import F32, TWO_PI, Index, normalize
from ..values import Array
from .batches import in_chunks, spread
from .hashing import hash_floats

_IMPULSES = 8
_PI, _HALF, _ONE = F32(np.pi), F32(0.5), F32(1)
_CHUNK = 32768  # points: the more, the more of them share a cell
# By dimension, six standard deviations of the sum: sqrt(impulses x 1/2 x the wave's energy)
_REACH = {2: F32(6.0), 3: F32(6 * np.sqrt(4 / (4 * np.sqrt(2))))}
# By dimension, which of the cell's coordinates and the seed, in which order, make random numbers
_KEYS = {2: ((0, 1, 2), (2, 0, 1)), 3: ((0, 1, 2, 3), (2, 0, 3, 1), (3, 2, 1, 0))}


def gabor(
    points: Array, frequency: Array, anisotropy: Array, orientation: Array, output: str
) -> Array:
    """Return "Value", "Phase" or "Intensity" (N,) at scaled points (D, N), D = 2 or 3.

    orientation: an angle (1,) or (N,) [rad] where D = 2, else a direction (3, 1) or (3, N).
    """
    isotropy = _ONE - np.minimum(np.maximum(anisotropy, F32(0)), _ONE)
    frequency = np.maximum(frequency, F32(0.001))
    base = orientation[None] if len(points) == 2 else normalize(orientation.copy())
    real, imaginary = in_chunks(_phasor, (points, frequency, isotropy, base), 2, _CHUNK)
    reach = _REACH[len(points)]
    if output == "Phase":
        return (np.arctan2(imaginary, real) + _PI) / TWO_PI
    if output == "Intensity":
        return np.sqrt(real * real + imaginary * imaginary) / reach
    return imaginary / reach * _HALF + _HALF


def _phasor(points: Array, frequency: Array, isotropy: Array, base: Array) -> Array:
    """Return the real and imaginary sums (2, N) of the waves of the 3^D cells around points."""
    dimensions = len(points)
    points = spread(points, frequency, isotropy, base)
    floor = np.floor(points)
    local = points - floor
    cells, which = _different(floor)
    is_even = isotropy.size == 1 and base.shape[1] == 1
    total = np.zeros((2, points.shape[1]), F32)
    for offset in product((-1, 0, 1), repeat=dimensions):
        step = np.array(offset, F32)[:, None]
        cell = cells + step
        for impulse in range(_IMPULSES):
            # Find the points that the impulse reaches.
            centre = _random(cell, 3 * impulse + 1, dimensions) + step
            square = np.zeros(points.shape[1], F32)
            for row, here in zip(centre, local, strict=True):
                way = row.take(which)
                way -= here
                way *= way
                square += way
            index = np.flatnonzero(square < _ONE)
            if not index.size:
                continue

            # Add its wave there.
            place, square = which.take(index), square.take(index)
            angles = _random(cell, 3 * impulse, dimensions - 1)
            sign = np.copysign(_ONE, _random(cell, 3 * impulse + 2, 1)[0] - _HALF)
            if is_even:
                direction = _direction(angles, isotropy, base).take(place, axis=1)
            else:
                direction = _direction(
                    angles.take(place, axis=1), _some(isotropy, index), _some(base, index)
                )
            envelope = np.exp(square * -_PI) * (np.cos(square * _PI) * _HALF + _HALF)
            envelope *= sign.take(place)
            way = local.take(index, axis=1) - centre.take(place, axis=1)
            turn = (direction * way).sum(axis=0) * (_some(frequency, index) * TWO_PI)
            total[0, index] += np.cos(turn) * envelope
            total[1, index] += np.sin(turn) * envelope
    return total


def _some(array: Array, index: Index) -> Array:
    return array if array.shape[-1] == 1 else array.take(index, axis=-1)


def _different(floor: Array) -> tuple[Array, Index]:
    """Return the different ones (D, M) among cells (D, N), and which of them each one is (N,)."""
    low = floor.min(axis=1, keepdims=True)
    count = (floor - low).max(axis=1).astype(np.float64) + 1
    if count.prod() > 2.0**62:
        return floor, np.arange(floor.shape[1])
    key = np.zeros(floor.shape[1], np.int64)
    for row, here, length in zip(floor, low, count, strict=True):
        key *= np.int64(length)
        key += (row - here).astype(np.int64)
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    return floor.take(first, axis=1), which.reshape(-1)


def _random(cell: Array, seed: int, count: int) -> Array:
    """Return random numbers (count, N) of cells, 0 to 1."""
    rows = [*cell, float(seed)]
    return np.stack([hash_floats([rows[key] for key in keys]) for keys in _KEYS[len(cell)][:count]])


def _direction(angles: Array, isotropy: Array, base: Array) -> Array:
    """Return the directions of waves: the base, turned by a random angle where isotropic."""
    if len(base) == 1:
        turn = base[0] + (angles[0] - _HALF) * _PI * isotropy
        return np.stack((np.cos(turn), np.sin(turn)))
    if not isotropy.any():
        return np.broadcast_to(base, (3, max(angles.shape[1], base.shape[1])))
    polar = np.arccos(np.minimum(np.maximum(base[2], -_ONE), _ONE)) + angles[0] * _PI * isotropy
    azimuth = np.arctan2(base[1], base[0]) + angles[1] * _PI * isotropy
    sine = np.sin(polar)
    return np.stack((sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(polar)))
