"""pattern, seed, dimension, samples -> tables of points in the unit square.

A pixel takes its random numbers in pairs.  For each pair of dimensions there are `SEQUENCES`
sequences of points, each stratified by itself and independent of all others; a pixel picks one of
them per pair (padding: Kollig and Keller 2002, "Efficient Multidimensional Sampling").  Every
number is a hash of (seed, pair, sequence, sample), so that samples may be asked for in any order.

What makes the pairs of one pixel independent is that each sequence is visited in its own random
order.  For Sobol points that order must be a nested permutation (Burley 2020): after an XOR of the
index the pairs are still in step, and the error of a pixel stops falling.  A nested order costs at
most a factor of 2 in the variance of what two pairs do together, and keeps short runs stratified.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import isqrt

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, ONE_BELOW
from .hashing import Keys, Words, keys_of, pairs, uniform, words_of
from .poisson import LARGEST_SET, bounded_points, poisson_sets

Points = NDArray[np.float32]  # (2, n, C): coordinate, sample, sequence

SEQUENCES = 1024

_BLOCK = 1 << 14  # points worked on at a time, so that temporaries stay in the L2 cache


@dataclass(frozen=True)
class Pattern:
    """One way to spread samples; `fill(out, keys, index, total, pair)` writes its points.

    progressive: any run of samples is well spread, so that the pattern may be stopped, split by
    sample ranges or combined with adaptive sampling.  Otherwise it is a set of `total` points,
    good only as a whole: the caller renders all of it or says that it does not.
    """

    fill: Callable[[Points, Keys, Words, int, int], None]
    progressive: bool


def points(
    pattern: str,
    seed: int,
    pair: int,
    first: int,
    count: int,
    total: int,
    sequences: int = SEQUENCES,
) -> Points:
    """Return samples `first` to `first + count - 1` of each sequence of one dimension pair.

    Shape (2, count, sequences), float32 in [0, 1).  A pure function: a number depends on the
    pattern, seed, pair, sequence and absolute sample index alone, and on `total` only if the
    pattern is not progressive.  Every point is uniform over the square, so estimates are unbiased,
    except pair 0 (the pixel) of REGULAR, which is a quadrature rule.
    Raises: ValueError for an unknown pattern, or samples that the pattern does not have.
    """
    if pattern not in PATTERNS:
        raise ValueError(f"Pattern {pattern!r} is not one of {', '.join(PATTERNS)}")
    entry = PATTERNS[pattern]
    limit = 1 << 32 if entry.progressive else total
    if first < 0 or count < 0 or first + count > limit:
        raise ValueError(f"Pattern {pattern}: samples {first} to {first + count - 1} of {limit}")

    keys = keys_of((seed, pair), sequences)
    out = np.empty((2, count, sequences), F32)
    rows = max(1, _BLOCK // sequences)
    for start in range(0, count, rows):
        stop = min(start + rows, count)
        index = np.arange(first + start, first + stop, dtype=np.uint32)[:, None]
        entry.fill(out[:, start:stop], keys, index, total, pair)
    return out


# --- Random -------------------------------------------------------------------------------------


def _fill_random(out: Points, keys: Keys, index: Words, total: int, pair: int) -> None:
    """Write independent uniform points."""
    pairs(keys, index, out)


# --- Owen-scrambled Sobol points ----------------------------------------------------------------


def _reverse(x: Words) -> None:
    """Reverse the bits of 32-bit words in place."""
    x.byteswap(inplace=True)
    spare = np.empty_like(x)
    for shift, mask in ((4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        np.right_shift(x, np.uint32(shift), out=spare)
        spare &= np.uint32(mask)
        x &= np.uint32(mask)
        x <<= np.uint32(shift)
        x |= spare


def _permute_nested(x: Words, key: Words) -> Words:
    """Return an Owen scrambling of bit-reversed words: a bit changes with the lower bits only.

    Source: Laine and Karras 2011, "Stratified Sampling for Stochastic Transparency"; constants of
    Vegdahl 2021, "Building a Better LK Hash".
    """
    x = x ^ x * np.uint32(0x3D20ADEA)
    x = x + key
    x *= (key >> np.uint32(16)) | np.uint32(1)
    for factor in (0x05526C56, 0x53A22864):
        x ^= x * np.uint32(factor)
    return x


def _fill_sobol(out: Points, keys: Keys, index: Words, total: int, pair: int) -> None:
    """Write the first two Sobol dimensions, Owen-scrambled, in a nested random order.

    Any aligned block of 2^k samples is a (0, k, 2) net: one point in every elementary interval.
    Source: Burley 2020, "Practical Hash-based Owen Scrambling", section 3.
    """
    order_key, *scramble_keys = words_of(keys, 3)

    # Shuffle the index: blocks of 2^k stay together, at every level
    order = index.copy()
    _reverse(order)
    order = _permute_nested(order, order_key)
    _reverse(order)

    # Take both Sobol coordinates with their bits reversed: the index itself, and its product with
    # Pascal's triangle modulo 2, which factors into one step per bit of the position of a bit
    x = np.empty((2, *order.shape), np.uint32)
    x[0] = order
    for shift, mask in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF)):
        order ^= (order >> np.uint32(shift)) & np.uint32(mask)
    np.bitwise_xor(order, order >> np.uint32(16), out=x[1])

    # Scramble each, and keep the 24 bits that a float32 holds
    x = _permute_nested(x, np.stack(scramble_keys)[:, None])
    _reverse(x)
    uniform(x, out)


# --- Sets of a known size -----------------------------------------------------------------------

_ROUNDS = 8


def _permute(index: Words, words: Words, total: int) -> NDArray[np.int32]:
    """Return a random permutation of 0 .. total - 1 for each sequence, at `index`: (n, C).

    Rounds of affine maps and shifts permute the next power of two; what falls outside is mapped
    again until it is inside (cycle walking: Black and Rogaway 2002).  `words` are 2 * _ROUNDS.
    """
    bits = max(1, (total - 1).bit_length())
    mask, shift = np.uint32((1 << bits) - 1), np.uint32((bits + 1) // 2)
    factors, offsets = words[:_ROUNDS] | np.uint32(1), words[_ROUNDS : 2 * _ROUNDS]

    def walk(x: Words, factors: Words, offsets: Words) -> Words:
        for factor, offset in zip(factors, offsets, strict=True):
            x = x * factor
            x += offset
            x &= mask
            x ^= x >> shift
        return x

    site = walk(index, factors, offsets)
    flat = site.reshape(-1)
    outside = np.flatnonzero(flat >= total)
    while outside.size:
        column = outside % site.shape[1]
        again = walk(flat.take(outside), factors.take(column, axis=1), offsets.take(column, axis=1))
        flat[outside] = again
        outside = outside.take(np.flatnonzero(again >= total))
    return site.view(np.int32)


def _wrap(out: Points, shift: Points) -> None:
    """Move points (2, n, C) around the unit torus by one shift (2, C) for each sequence."""
    out += shift[:, None]
    np.subtract(out, out >= 1, out=out, dtype=F32)


def _write_cells(out: Points, site: NDArray[np.int32], u: Points, v: Points, total: int) -> None:
    """Write the points at (u, v) of the cells `site` of a grid of `total` cells of equal area.

    A total with two near factors gives a true grid; any other gives rows that differ by one cell
    in length, their heights in proportion, so that all cells keep the area 1 / total.
    """
    rows = next(r for r in range(isqrt(total), 0, -1) if total % r == 0)
    if total > 2 * rows * rows:
        rows = round(total**0.5)
    short, long_rows = divmod(total, rows)  # the first `long_rows` rows have one cell more

    row = np.maximum(site // np.int32(short + 1), (site - np.int32(long_rows)) // np.int32(short))
    first = row * np.int32(short) + np.minimum(row, np.int32(long_rows))
    length = (np.int32(short) + (row < long_rows)).astype(F32)
    out[0] = ((site - first).astype(F32) + u) / length
    out[1] = (first.astype(F32) + v * length) * F32(1 / total)
    np.minimum(out, ONE_BELOW, out=out)


def _fill_jittered(out: Points, keys: Keys, index: Words, total: int, pair: int) -> None:
    """Write one uniform point in each cell of a grid, the cells in random order (Cook 1986)."""
    site = _permute(index, words_of(keys, 2 * _ROUNDS), total)
    pairs(keys, index, out)
    _write_cells(out, site, out[0], out[1], total)


def _fill_regular(out: Points, keys: Keys, index: Words, total: int, pair: int) -> None:
    """Write the centres of the cells of a grid, in random order.

    For the pixel (pair 0) that is the plain grid.  Any other grid is moved around the torus by one
    random shift per sequence (Cranley and Patterson 1976), so that its estimates are unbiased.
    """
    words = words_of(keys, 2 * _ROUNDS + 2)
    half = np.full(1, 0.5, F32)
    _write_cells(out, _permute(index, words, total), half, half, total)
    if pair > 0:
        _wrap(out, uniform(words[2 * _ROUNDS :]))


def _fill_poisson(out: Points, keys: Keys, index: Words, total: int, pair: int) -> None:
    """Write points that keep the distance 1 / (2 sqrt(total)) on the torus, in random order.

    Each sequence is one of a few precomputed sets, randomly shifted; past `LARGEST_SET` points it
    is a lattice, each point moved at random by what the distance leaves (see poisson.py).
    """
    words = words_of(keys, 2 * _ROUNDS + 3)
    site = _permute(index, words, total)
    if total <= LARGEST_SET:
        sets = poisson_sets(total)
        site += (words[2 * _ROUNDS + 2] % np.uint32(sets.shape[1])).view(np.int32) * np.int32(total)
        for axis in (0, 1):
            sets[axis].take(site, out=out[axis])
    else:
        pairs(keys, index, out)
        out[:] = bounded_points(site, out, total)
    _wrap(out, uniform(words[2 * _ROUNDS : 2 * _ROUNDS + 2]))


PATTERNS = {
    "SOBOL": Pattern(_fill_sobol, progressive=True),
    "POISSON": Pattern(_fill_poisson, progressive=False),
    "JITTERED": Pattern(_fill_jittered, progressive=False),
    "REGULAR": Pattern(_fill_regular, progressive=False),
    "RANDOM": Pattern(_fill_random, progressive=True),
}
