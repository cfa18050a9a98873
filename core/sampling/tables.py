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

_NUMBERS = 1 << 24  # that a float32 in [0, 1) of equal steps can be
_STEPS = 16  # density steps per table entry


@dataclass(frozen=True, eq=False)
class AliasTable:
    """Choice of an index with a probability in proportion to its weight; see `compile_alias`.

    A power of two of slots S, so that a slot number and the place in the slot are exact.
    """

    threshold: Scalar  # (S,): where slot i is cut in two
    owner: Ids  # (2 S,): the entries that have the parts of the slots
    stretch: Scalar  # (2 S,): 1 / the size of the parts
    probability: Scalar  # (S,)

    def sample(self, u: Scalar | NDArray[np.float64]) -> tuple[Ids, Scalar, Scalar]:
        """Return index (N,) int32, its pmf (N,), and what is left of u: uniform in [0, 1).

        Unbiased: the pmf is the share of all 24-bit numbers that choose the index.  What is left
        of u has log2(S) bits less, and less again in small parts: where that will not do, draw
        another number, or pass float64 u that carry more bits.
        """
        # Find the slot, and the place in it
        size = self.threshold.size
        place = u * u.dtype.type(size)
        slot = place.astype(np.int32)
        place -= slot.astype(u.dtype)

        # Take the owner of that part of the slot
        threshold = self.threshold.take(slot)
        other = place >= threshold
        part = slot * np.int32(2)
        part += other
        index = self.owner.take(part)

        # Stretch the part to the unit interval, the steps of float32 u centred in it
        rest = place.astype(F32)
        rest -= other * threshold
        if u.dtype == F32:
            rest += F32(size * 2.0**-25)
        rest *= self.stretch.take(part)
        np.minimum(rest, ONE_BELOW, out=rest)
        return index, self.probability.take(index), rest

    def pmf(self, index: Ids) -> Scalar:
        """Return the probability (N,) of each index (N,)."""
        return self.probability.take(index)


def compile_alias(weights: ArrayLike) -> AliasTable:
    """Build the alias table of weights (M,), in float64 and without a loop.

    Probabilities are rounded to steps of 2^-24, those above 0 to no less than one step, and `pmf`
    returns the rounded ones.
    Raises: ValueError if there is no weight, or none above 0, or one is negative or not finite.
    Source: Vose 1991; built from sums as Huebschle-Schneider and Sanders 2022, "Parallel Weighted
    Random Sampling", section 4.
    """
    weights = np.asarray(weights, np.float64)
    if weights.ndim != 1 or not 0 < weights.size <= _NUMBERS:
        raise ValueError(f"Weights: shape {weights.shape}, expected 1 to {_NUMBERS} in a row")
    bad = np.flatnonzero(~(np.isfinite(weights) & (weights >= 0)))
    if bad.size:
        raise ValueError(f"Weight {bad[0]} of {weights.size} is {weights[bad[0]]}")
    largest = np.max(weights)
    if largest == 0:
        raise ValueError(f"All {weights.size} weights are 0: there is nothing to choose")

    # Scale to a mean of one slot; entries beyond the last weigh nothing
    slots = 1 << (weights.size - 1).bit_length()
    share = np.zeros(slots)
    share[: weights.size] = weights / largest  # so that the sum cannot overflow
    share *= slots / share.sum()

    # Sum what light entries miss and what heavy entries have in excess of one slot
    light, heavy = np.flatnonzero(share < 1), np.flatnonzero(share >= 1)
    missing = np.concatenate([[0.0], np.cumsum(1 - share[light])])
    excess = np.cumsum(share[heavy] - 1)

    # Fill each light slot from the first heavy entry that is not used up before it
    threshold, alias = share.copy(), np.arange(slots)
    donor = np.searchsorted(excess, missing[:-1], side="right")
    alias[light] = heavy[np.minimum(donor, heavy.size - 1)]

    # Fill what is left of each heavy entry, when it is used up, from the next; the last stays whole
    used_up = np.searchsorted(missing, excess, side="left")
    threshold[heavy] = 1 + excess - missing[np.minimum(used_up, light.size)]
    alias[heavy[:-1]] = heavy[1:]
    threshold[heavy[-1]] = 1

    # Count the numbers of 24 bits that choose each entry
    steps = _NUMBERS // slots
    kept = np.clip(np.rint(threshold * steps), 0, steps)
    positive = np.flatnonzero(weights > 0)
    kept[positive] = np.maximum(kept[positive], 1)
    owner = np.stack([np.arange(slots), alias], axis=1).ravel()
    parts = np.stack([kept, steps - kept], axis=1).ravel()
    chosen = np.bincount(owner, parts, minlength=slots)
    return AliasTable(
        threshold=(kept / steps).astype(F32),
        owner=owner.astype(np.int32),
        stretch=(steps / np.maximum(parts, 1)).astype(F32),
        probability=(chosen / _NUMBERS).astype(F32),
    )


@dataclass(frozen=True, eq=False)
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
