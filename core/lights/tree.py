"""sources -> a binary tree of ranges, and how much each range shines.  For choosing among many.

Lights are sorted along a space-filling curve and split where its leading bit changes (Karras 2012,
"Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees"); what a range of them
is together follows from running sums.  A sketch of where a range shines to is kept as moments of
its axes, which add up: the intensity towards d is (m . d + sqrt(d' M d)) / 2, exact for a single
light that is a point or flat.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Ids
from .kind import BOTH_SIDES, ONE_SIDE, Source

BITS = 17  # of each coordinate on the curve: three fit the 53 of a float64
WEAKEST = 1e-2  # of the mean strength: none is so weak that rounding would never choose it

# Rows of `Tree.node`: strength, centre, spread, m, M
STRENGTH, CENTRE, SPREAD, FIRST, SECOND = 0, slice(1, 4), 4, slice(5, 8), slice(8, 14)
NODE_ROWS = 14
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True, eq=False)
class Sources:
    """`Source` of n lights as arrays: centre (3, n), spread, strength (n,), axis (3, n), sides."""

    centre: NDArray[np.float64]
    spread: NDArray[np.float64]
    strength: NDArray[np.float64]
    axis: NDArray[np.float64]
    sides: Ids

    @property
    def count(self) -> int:
        """Return the number of lights."""
        return self.strength.size

    def join(self, other: "Sources") -> "Sources":
        """Return these lights, and then the others."""
        return Sources(
            np.concatenate([self.centre, other.centre], axis=1),
            np.concatenate([self.spread, other.spread]),
            np.concatenate([self.strength, other.strength]),
            np.concatenate([self.axis, other.axis], axis=1),
            np.concatenate([self.sides, other.sides]),
        )

    def take(self, index: NDArray[np.integer]) -> "Sources":
        """Return the lights of `index`."""
        return Sources(
            self.centre.take(index, axis=1),
            self.spread.take(index),
            self.strength.take(index),
            self.axis.take(index, axis=1),
            self.sides.take(index),
        )


@dataclass(frozen=True, eq=False)
class Tree:
    """A binary tree over n lights: nodes 1 to n - 1 are split before the light of that number.

    order (n,): which light stands where; total (n + 1,): running sum of strength.  node (14, 2 n)
    float32: node k < n is inner, with children left[k] and right[k]; node n + k is light k; a node
    covers the lights from first[k] to end[k] (2 n,), and node `root` all.
    """

    order: Ids
    total: NDArray[np.float64]
    first: Ids
    end: Ids
    left: Ids
    right: Ids
    root: int
    node: NDArray[np.float32]


def lamp_sources(sources: Iterable[Source]) -> Sources:
    """Return sources one by one as arrays."""
    each = list(sources)
    return Sources(
        np.array([source.centre for source in each]).reshape(-1, 3).T,
        np.array([source.spread for source in each], np.float64),
        np.array([source.strength for source in each], np.float64),
        np.array([source.axis for source in each]).reshape(-1, 3).T,
        np.array([source.sides for source in each], np.int32),
    )


def compile_tree(sources: Sources) -> Tree:
    """Build the tree of n >= 1 lights."""
    count = sources.strength.size
    keys = _keys(sources.centre)
    order = np.argsort(keys, kind="stable").astype(np.int32)
    keys, sources = keys.take(order), sources.take(order)

    # How early the curve changes before each light; equal keys are split by their number
    number = np.arange(count)
    change = _highest_bit(keys[1:] ^ keys[:-1]) + 64
    same = _highest_bit(number[1:] ^ number[:-1])
    level = np.concatenate([[999], np.where(change > 64, change, same), [999]])

    first, end, left, right, root = _link(level, count)
    sums = _running_sums(sources)
    leaf = np.arange(count, dtype=np.int32)
    low, high = np.concatenate([first, leaf]), np.concatenate([end, leaf + 1])
    part = sums.take(high, axis=1)
    part -= sums.take(low, axis=1)
    strength = np.maximum(part[STRENGTH], 1e-300)
    part[1:] /= strength
    part[SPREAD] -= (part[CENTRE] * part[CENTRE]).sum(axis=0)
    np.maximum(part[SPREAD], 0.0, out=part[SPREAD])
    part[SPREAD, count:] = sources.spread
    return Tree(order, sums[STRENGTH], low, high, left, right, root, part.astype(np.float32))


def _keys(centre: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return places on the Morton curve (n,)."""
    low = centre.min(axis=1, keepdims=True)
    size = max(float((centre - low).max()), 1e-30)
    cell = np.minimum((centre - low) * (2.0**BITS / size), 2.0**BITS - 1).astype(np.int64)

    # Spread the bits of each coordinate three apart
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        cell |= cell << shift
        cell &= mask
    keys: NDArray[np.int64] = cell[0] << 2 | cell[1] << 1 | cell[2]
    return keys


def _highest_bit(x: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return 1 + the number of the highest bit of integers below 2^53, 0 for 0."""
    return np.frexp(x.astype(np.float64))[1].astype(np.int64)


def _link(level: NDArray[np.int64], count: int) -> tuple[Ids, Ids, Ids, Ids, int]:
    """Return first, end, left, right (n,) and root: splits of the highest level come first."""
    first, end = np.zeros(count, np.int32), np.zeros(count, np.int32)
    left, right = np.zeros(count, np.int32), np.zeros(count, np.int32)
    leaf = np.arange(count, dtype=np.int32) + np.int32(count)
    left[1:], right[1:] = leaf[:-1], leaf[1:]
    root = count  # a single light is its own root
    bounds = np.array([0, count])
    inner = level[1:-1]
    by_level = np.argsort(-inner, kind="stable") + 1
    for splits in np.split(by_level, np.flatnonzero(np.diff(-level.take(by_level))) + 1):
        if not splits.size:
            continue
        # A range is split once in each level; the later of its two bounds is the parent
        place = np.searchsorted(bounds, splits)
        low, high = bounds.take(place - 1), bounds.take(place)
        first[splits], end[splits] = low, high
        is_left = level.take(high) < level.take(low)
        right[low[~is_left]] = splits[~is_left]
        left[high[is_left & (high < count)]] = splits[is_left & (high < count)]
        if bounds.size == 2:
            root = int(splits[0])
        bounds = np.sort(np.concatenate([bounds, splits]), kind="stable")
    return first, end, left, right, root


def _running_sums(sources: Sources) -> NDArray[np.float64]:
    """Return the running sums (14, n + 1) of what `Tree.node` holds, times the strength."""
    count = sources.strength.size
    sums = np.zeros((NODE_ROWS, count + 1))
    each = sums[:, 1:]
    mean = sources.strength.mean()
    each[STRENGTH] = np.maximum(sources.strength, WEAKEST * mean if mean > 0 else 1.0)
    each[CENTRE] = sources.centre
    each[SPREAD] = (sources.centre**2).sum(axis=0) + sources.spread
    each[FIRST] = sources.axis * (sources.sides == ONE_SIDE)
    flat = np.where(sources.sides == BOTH_SIDES, 4.0, np.where(sources.sides == ONE_SIDE, 1.0, 0.0))
    for row, (i, j) in zip(each[SECOND], PAIRS, strict=True):
        row[:] = sources.axis[i] * sources.axis[j] * flat
        if i == j:
            row += 4.0 * (flat == 0.0)
    each[1:] *= each[STRENGTH]
    np.cumsum(sums, axis=1, out=sums)
    return sums
