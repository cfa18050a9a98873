"""weights -> index.  Tables that turn one uniform number into a choice or into a position.

An alias table chooses among any number of entries in constant time: the unit interval is cut into
one slot per entry, and each slot is shared by at most two of them.  An inverse table holds the
inverse of a distribution function at equal steps.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import F32, ONE_BELOW, Ids, Scalar

_STEPS = 16  # density steps per table entry


@dataclass(frozen=True)
class AliasTable:
    """Choice of an index with a probability in proportion to its weight; see `compile_alias`."""

    threshold: Scalar  # (N,): the part of slot i that belongs to entry i
    alias: Ids  # (N,): the entry that has the rest of slot i
    probability: Scalar  # (N,)

    def sample(self, u: Scalar | NDArray[np.float64]) -> tuple[Ids, Scalar, Scalar]:
        """Return index (M,) int32, its pmf (M,), and what is left of u: uniform in [0, 1).

        Unbiased but for the steps of u: they are 2^-24, so that among N entries the probability of
        each is met to N 2^-24 of the mean one, and as many bits are left of u as log2 N leaves of
        24.  With more than some 10^4 entries, pass float64 u that carry more bits.
        """
        # Find the slot, and the place in it
        size = self.threshold.size
        place = u * u.dtype.type(size)
        slot = np.minimum(place.astype(np.int32), np.int32(size - 1))
        place = np.minimum((place - slot.astype(u.dtype)).astype(F32), ONE_BELOW)

        # Take the owner of that part of the slot, and stretch the part to the unit interval
        threshold = self.threshold.take(slot)
        other = place >= threshold
        index = np.where(other, self.alias.take(slot), slot)
        place -= other * threshold
        place /= np.where(other, F32(1) - threshold, threshold)
        return index, self.probability.take(index), np.minimum(place, ONE_BELOW)

    def pmf(self, index: Ids) -> Scalar:
        """Return the probability (M,) of each index (M,)."""
        return self.probability.take(index)


def compile_alias(weights: ArrayLike) -> AliasTable:
    """Build the alias table of weights (N,), in float64 and without a loop.

    Entries below the mean ("light") fill their slots from those above it ("heavy"), in order; a
    heavy entry that falls below the mean is filled from the next.  Who fills whom follows from the
    running sums of what is missing and what is in excess.
    Raises: ValueError if there is no weight, or none above 0, or one is negative or not finite.
    Source: Vose 1991; sums as Huebschle-Schneider and Sanders 2022, "Parallel Weighted Random
    Sampling", section 4.
    """
    weights = np.asarray(weights, np.float64)
    if weights.ndim != 1 or weights.size == 0:
        raise ValueError(f"Weights of an alias table: shape {weights.shape}, expected (N,), N > 0")
    bad = np.flatnonzero(~(np.isfinite(weights) & (weights >= 0)))
    if bad.size:
        raise ValueError(f"Weight {bad[0]} of {weights.size} is {weights[bad[0]]}")
    largest = np.max(weights)
    if largest == 0:
        raise ValueError(f"All {weights.size} weights are 0: there is nothing to choose")
    size = weights.size
    share = weights / largest  # the sum cannot overflow
    share *= size / share.sum()

    # Sum what light entries miss and what heavy entries have in excess of one slot
    light, heavy = np.flatnonzero(share < 1), np.flatnonzero(share >= 1)
    missing = np.concatenate([[0.0], np.cumsum(1 - share[light])])
    excess = np.cumsum(share[heavy] - 1)

    # Fill each light slot from the first heavy entry that is not used up before it
    threshold, alias = share.copy(), np.arange(size)
    donor = np.searchsorted(excess, missing[:-1], side="right")
    alias[light] = heavy[np.minimum(donor, heavy.size - 1)]

    # Fill what is left of each heavy entry, when it is used up, from the next; the last stays whole
    used_up = np.searchsorted(missing, excess, side="left")
    threshold[heavy] = 1 + excess - missing[np.minimum(used_up, light.size)]
    alias[heavy[:-1]] = heavy[1:]
    threshold[heavy[-1]] = 1
    return AliasTable(
        np.clip(threshold, 0, 1).astype(F32),
        alias.astype(np.int32),
        (share / size).astype(F32),
    )


@dataclass(frozen=True)
class InverseTable:
    """The inverse of a distribution function at equal steps; see `compile_inverse`."""

    value: Scalar  # (size,): where each step starts
    step: Scalar  # (size,): how far it goes


def compile_inverse(
    density: Callable[[NDArray[np.float64]], NDArray[np.float64]] | NDArray[np.float64],
    lo: float,
    hi: float,
    size: int,
) -> InverseTable:
    """Tabulate the inverse distribution function of a density on [lo, hi] in `size` equal steps.

    `density` is a function of positions, or values at equally spaced positions from lo to hi with
    straight lines between; it need not integrate to 1.  What `lookup` then samples has exactly
    1 / size of the probability, evenly spread, between one entry and the next; a gap where the
    density is 0 is crossed by one step.
    Raises: ValueError if the density is negative, not finite, or 0 everywhere.
    """
    # Evaluate the density at the nodes, and between them more finely than the table
    if callable(density):
        x = np.linspace(lo, hi, _STEPS * size + 1)
        y = np.asarray(density(x), np.float64)
    else:
        nodes = np.asarray(density, np.float64)
        parts = -(-_STEPS * size // (nodes.size - 1)) * (nodes.size - 1)
        x = np.linspace(lo, hi, parts + 1)
        y = np.interp(x, np.linspace(lo, hi, nodes.size), nodes)
    if not np.isfinite(y).all() or np.min(y) < 0 or np.max(y) == 0:
        raise ValueError(f"Density on [{lo}, {hi}]: from {np.min(y)} to {np.max(y)}")

    # Integrate by trapezoids, and read the integral backwards
    integral = np.concatenate([[0.0], np.cumsum(y[1:] + y[:-1])])
    value = np.interp(np.linspace(0, integral[-1], size + 1), integral, x)
    positive = np.flatnonzero(y > 0)
    value[0], value[-1] = x[max(positive[0] - 1, 0)], x[min(positive[-1] + 1, x.size - 1)]
    return InverseTable(value[:-1].astype(F32), np.diff(value).astype(F32))


def lookup(table: InverseTable, u: Scalar) -> Scalar:
    """Return positions (N,) for u (N,) in [0, 1), linear between the entries of the table."""
    place = u * F32(table.value.size)
    entry = np.minimum(place.astype(np.int32), np.int32(table.value.size - 1))
    place -= entry.astype(F32)
    place *= table.step.take(entry)
    place += table.value.take(entry)
    return place
