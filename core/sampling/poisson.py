"""number of points -> sets of points that keep a distance.  Poisson disk sets on the unit torus.

Dart throwing slows down as a set fills, and leaves holes.  Here each set begins as the rank-1
lattice of largest minimum distance (Dammertz and Keller 2008, "Image Synthesis by Rank-1
Lattices"); its points are thrown off their sites at random, and then pushed apart until all keep
the distance.  No point leaves a square around its site, so that no hole can open, the density stays
even, and the few neighbours that can ever meet are the same lattice vectors for all points.
The throw cancels the lattice's own frequency.

Lengths are in units of 1 / sqrt(number of points).
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, ONE_BELOW
from .hashing import keys_of, pairs

DISTANCE = 0.5  # what is promised
LARGEST_SET = 1 << 16  # points of the largest set that is stored

_GOAL = 0.7  # what the stored sets keep; 1.07 is the most that any set can
_PUSH = 0.8  # pairs closer than this are pushed apart; lattices keep 0.81
_THROW = 0.5  # how far a point is thrown along each axis: over a square of its share of the area
_REACH = 1.0  # how far along each axis it may ever be
_SLACK = 0.005  # for the rounding of points to float32
_STORED = 1 << 17  # points of all sets of one size
_SETS = 16  # sets of one size, if there is room


@lru_cache(maxsize=64)
def lattice(total: int) -> tuple[int, NDArray[np.int64]]:
    """Return the best found generator g and a reduced basis, rows (2, 2), of a rank-1 lattice.

    Site i is (i, g i mod total) / total; the basis is in units of 1 / total, shortest vector
    first; it is at least 0.81 sqrt(total) long (checked for all totals to 4096, and some beyond).
    """
    # Try all generators of small lattices, and evenly spread ones of large lattices
    tries = min(total, 4096)
    generator = np.arange(tries, dtype=np.int64) * total // tries
    basis = np.zeros((2, 2, tries), np.int64)  # vector, coordinate, try
    basis[0, 0], basis[0, 1] = 1, generator
    basis[1, 1] = total

    # Reduce each basis (Gauss): subtract the shorter vector from the longer while that shortens it
    while True:
        length = (basis * basis).sum(axis=1)
        basis = np.where(length[0] > length[1], basis[::-1], basis)
        steps = np.rint((basis[0] * basis[1]).sum(axis=0) / (basis[0] ** 2).sum(axis=0))
        if not steps.any():
            break
        basis[1] -= steps.astype(np.int64) * basis[0]
    best = int(np.argmax((basis[0] ** 2).sum(axis=0)))
    return int(generator[best]), basis[:, :, best].copy()


def _sites(index: NDArray[np.int32], total: int) -> NDArray[np.float64]:
    """Return lattice sites (2, ...) in [0, 1) for indices of any shape (...)."""
    generator, _ = lattice(total)
    index = index.astype(np.int64)
    return np.stack([index, index * generator % total]) / total


def _neighbours(total: int) -> tuple[NDArray[np.float64], list[int]]:
    """Return the vectors (V, 2) to sites whose points may come too close, and the index steps.

    One of each pair of opposite vectors; no vector from a site to itself around the torus.
    """
    _, basis = lattice(total)
    steps = np.arange(-5, 6)
    vectors = (steps[:, None, None] * basis[0] + steps[:, None] * basis[1]).reshape(-1, 2)
    upper = (vectors[:, 1] > 0) | ((vectors[:, 1] == 0) & (vectors[:, 0] > 0))
    other = vectors[:, 0] % total != 0
    close = (vectors**2).sum(axis=1) < total * (_GOAL + 2 * np.sqrt(2) * _REACH) ** 2
    vectors = vectors[upper & other & close]
    return vectors / np.sqrt(total), [int(x) for x in vectors[:, 0] % total]


@lru_cache(maxsize=8)
def poisson_sets(total: int) -> NDArray[np.float32]:
    """Return sets (2, sets, total) of points in [0, 1) that keep a toroidal distance of 0.7.

    Unbiased if a set is shifted by one uniform random vector.  The same bits on every machine:
    only correctly rounded operations are used.
    """
    sets = max(1, min(_SETS, _STORED // total))
    index = np.arange(total, dtype=np.uint32)[:, None]
    throw = np.empty((2, total, sets), F32)
    pairs(keys_of((total,), sets), index, throw)
    move = np.ascontiguousarray(throw.transpose(0, 2, 1) - 0.5, np.float64) * (2 * _THROW)
    vectors, hops = _neighbours(total)

    # Push close pairs apart, each point by half, and draw all a little towards their sites
    least = 0.0
    while least < _GOAL:
        least = np.inf
        push = np.zeros_like(move)
        for vector, hop in zip(vectors, hops, strict=True):
            gap = np.roll(move, -hop, axis=2) - move + vector[:, None, None]
            length = np.sqrt(gap[0] * gap[0] + gap[1] * gap[1])
            least = min(least, float(length.min()))
            gap *= 0.25 * np.maximum(_PUSH / np.maximum(length, 1e-3) - 1, 0)
            push -= gap
            push += np.roll(gap, hop, axis=2)
        if least < _GOAL:
            move += push
            move *= 0.995
            np.clip(move, -_REACH, _REACH, out=move)

    # Put the points on their sites, and every other set on the transposed lattice
    sites = _sites(np.arange(total, dtype=np.int32), total)
    points = (sites[:, None] + move / np.sqrt(total)) % 1.0
    points[:, 1::2] = points[::-1, 1::2].copy()
    stored: NDArray[np.float32] = np.minimum(points.astype(F32), ONE_BELOW)
    stored.setflags(write=False)
    return stored


def bounded_points(
    site: NDArray[np.int32], throw: NDArray[np.float32], total: int
) -> NDArray[np.float32]:
    """Return the points (2, ...) of sets too large to store: sites, each moved by its `throw`.

    The throw, uniform pairs (2, ...) in [0, 1), is scaled to a square inside the disk that leaves
    the toroidal distance 0.5 to any neighbour.
    """
    _, basis = lattice(total)
    spare = np.sqrt(float((basis[0] ** 2).sum())) - (DISTANCE + _SLACK) * np.sqrt(total)
    side = spare / np.sqrt(2) / total
    points = (_sites(site, total) + (throw.astype(np.float64) - 0.5) * side) % 1.0
    rounded: NDArray[np.float32] = np.minimum(points.astype(F32), ONE_BELOW)
    return rounded
