"""function, batch -> results.  Runs a texture on pieces of a batch that stay in the cache."""

from collections.abc import Callable, Sequence

import numpy as np

from ...arrays import F32
from ..values import Array

WHOLE = 1 << 30  # of textures that divide batches themselves
MOST_OCTAVES = F32(15)


def in_chunks(
    function: Callable[..., Array], arrays: Sequence[Array], rows: int, chunk: int
) -> Array:
    """Return function(*arrays), (rows, N), computed `chunk` points at a time.

    Arrays are (..., N), or (..., 1) where they are the same for all points.
    """
    size = max(array.shape[-1] for array in arrays)
    if size <= chunk:
        return function(*arrays)
    out = np.empty((rows, size), F32)
    for start in range(0, size, chunk):
        part = slice(start, start + chunk)
        out[:, part] = function(
            *(array if array.shape[-1] == 1 else array[..., part] for array in arrays)
        )
    return out


def spread(points: Array, *others: Array) -> Array:
    """Return points as (D, N), if they are the same everywhere and one of the others is not."""
    size = max(points.shape[-1], *(other.shape[-1] for other in others))
    return points if points.shape[-1] == size else np.broadcast_to(points, (len(points), size))


def by_octaves(
    function: Callable[..., Array],
    detail: Array,
    arrays: Sequence[Array],
    rows: int,
    chunk: int,
) -> Array:
    """Return function(octaves, share, *arrays), (rows, N), for points of any detail.

    octaves: the whole part of the detail, 0 to 15, one number for all points of a call; share:
    its fraction (1,) or (N,).
    """
    detail = np.minimum(np.maximum(detail, F32(0)), MOST_OCTAVES)
    whole = np.floor(detail)

    def run(octaves: int, share: Array, some: Sequence[Array]) -> Array:
        def call(share: Array, *some: Array) -> Array:
            return function(octaves, share, *some)

        return in_chunks(call, (share, *some), rows, chunk)

    counts = np.unique(whole)
    if counts.size == 1:
        return run(int(counts[0]), detail - whole, arrays)
    out = np.empty((rows, detail.size), F32)
    for count in counts:
        index = np.flatnonzero(whole == count)
        out[:, index] = run(
            int(count),
            detail.take(index) - count,
            [array if array.shape[-1] == 1 else array.take(index, axis=-1) for array in arrays],
        )
    return out
