"""slots, dimension -> random pairs.  Numbers in [0, 1) as a pure function, without state.

(seed, pixel, absolute sample, branch, dimension) decides each number, so that pictures do not
depend on threads, tiles or the order of rounds, and a frame can be shared out by sample range.
A pixel hashes to one of many sequences of each dimension (Burley 2020, "Practical Hash-based
Owen Scrambling": pairs are made independent by shuffling); the sample is the row.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar
from . import patterns
from .dimensions import is_stratified

Keys = NDArray[np.uint32]
Warp = Callable[[NDArray[np.float32]], NDArray[np.float32]]  # of numbers in [0, 1), one by one

GOLDEN = 0x9E3779B9


def hash32(x: Keys) -> Keys:
    """Mix the bits of x (N,) uint32; every input bit reaches every output bit.

    Source: Wellons 2018, "Prospecting for Hash Functions" (the lowbias32 constants).
    """
    x = x ^ (x >> np.uint32(16))
    x *= np.uint32(0x21F0AAAD)
    x ^= x >> np.uint32(15)
    x *= np.uint32(0xD35A2D97)
    x ^= x >> np.uint32(15)
    return x


@lru_cache(maxsize=4096)
def _odd(dimension: int) -> np.uint32:
    # A multiplier of its own for each dimension: the high bits of key x odd pick a sequence.
    mixed = int(hash32(np.array([dimension * GOLDEN & 0xFFFFFFFF], np.uint32))[0])
    return np.uint32(mixed | 1)


@dataclass(frozen=True, eq=False)
class Numbers:
    """The tables of one chunk of samples, made as dimensions are asked for.

    Threads may make the same table at the same time: both get the same bits, one is dropped.
    """

    pattern: str
    seed: int
    first: int
    count: int
    total: int
    sequences: int
    tables: dict[tuple[int, int, Warp | None], NDArray[np.float32]]

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel to another process without the tables, which are soon made there."""
        *own, _ = (getattr(self, item.name) for item in fields(self))
        return Numbers, (*own, {})

    def table(
        self, dimension: int, split: int = 1, warp: Warp | None = None
    ) -> NDArray[np.float32]:
        """Return the pairs (2, count x split x sequences) of `dimension`, row-major by sample.

        Their numbers are mapped by `warp`, if there is one: samples are many, the table is small.
        """
        key = dimension, split, warp
        found = self.tables.get(key)
        if found is None and warp is not None:
            found = self.tables[key] = warp(self.table(dimension, split))
        elif found is None:
            found = patterns.points(
                self.pattern,
                self.seed,
                dimension,
                self.first * split,
                self.count * split,
                self.total * split,
                self.sequences,
            ).reshape(2, -1)
            self.tables[key] = found
        return found


def pixel_keys(seed: int, pixel: NDArray[np.int64]) -> Keys:
    """Return the keys (N,) of pixels by their number in the full frame."""
    salt = np.uint32((seed * 0x85EBCA6B + 0x2545F491) & 0xFFFFFFFF)
    low = (pixel & 0xFFFFFFFF).astype(np.uint32)
    high = (pixel >> 32).astype(np.uint32)
    return hash32(hash32(low ^ salt) + high)


@dataclass(frozen=True, eq=False)
class Draws:
    """The random numbers of one wave of slots.

    key (slots,) uint32 of each slot's pixel and branch; row (slots,) int32, the slot's sample
    counted from the chunk's first one, or one int for all.  sequences: by dimension, the sequence
    (slots,) that each slot has there, as far as asked; waves of the same keys may share them.
    column (slots,): which of the keys and rows is a slot's, None is its own.
    """

    numbers: Numbers
    key: Keys
    row: NDArray[np.int32] | int
    sequences: dict[int, Index] = field(default_factory=dict)
    column: Index | None = None

    def pair(
        self,
        dimension: int,
        slot: Index | None,
        item: int = 0,
        split: int = 1,
        warp: Warp | None = None,
    ) -> tuple[Scalar, Scalar]:
        """Return two independent numbers (N,) in [0, 1) for each slot, mapped by `warp` if given.

        The item-th of `split` draws of one sample is sample s x split + item of the sequence.
        """
        row = self.row
        if slot is not None and self.column is not None:
            slot = self.column.take(slot)
        if slot is not None and not isinstance(row, int):
            row = row.take(slot)
        if not is_stratified(dimension):
            key = self.key if slot is None else self.key.take(slot)
            u, v = _independent(dimension, key, (row + self.numbers.first) * split + item)
            return (u, v) if warp is None else (warp(u), warp(v))
        place, count = self._sequence(dimension, slot), self.numbers.sequences
        table = self.numbers.table(dimension, split, warp)
        if isinstance(row, int):
            first = (row * split + item) * count
            table = table[:, first : first + count]
        else:
            place = place + np.multiply(row * split + item, count)
        # No number is outside of its table; to clip is the cheapest way to have numpy know that.
        return table[0].take(place, mode="clip"), table[1].take(place, mode="clip")

    def _sequence(self, dimension: int, slot: Index | None) -> Index:
        """Return the sequences (N,) that the slots have in a dimension."""
        found = self.sequences.get(dimension)
        if found is None:
            is_few = slot is not None and 2 * slot.size < self.key.size
            key = self.key.take(slot) if slot is not None and is_few else self.key
            index = key * _odd(dimension)
            index >>= np.uint32(33 - self.numbers.sequences.bit_length())
            found = index.astype(np.intp)
            if is_few:
                return found
            self.sequences[dimension] = found
        return found if slot is None else found.take(slot)

    def branch(self, slot: Index, number: int) -> "Draws":
        """Return draws with one more slot for each of `slot`, keyed as their branch `number`."""
        column = self.column
        if column is not None:
            new = np.arange(self.key.size, self.key.size + slot.size)
            slot, column = column.take(slot), np.concatenate([column, new])
        key = hash32(self.key.take(slot) + np.uint32(number * GOLDEN & 0xFFFFFFFF))
        row = (
            self.row
            if isinstance(self.row, int)
            else np.concatenate([self.row, self.row.take(slot)])
        )
        return Draws(self.numbers, np.concatenate([self.key, key]), row, {}, column)

    def twin(self, slot: Index) -> "Draws":
        """Return draws with one more slot for each of `slot`, with the same numbers."""
        column = np.arange(self.key.size) if self.column is None else self.column
        column = np.concatenate([column, column.take(slot)])
        return replace(self, column=column)


def _independent(
    dimension: int, key: Keys, sample: NDArray[np.int32] | int
) -> tuple[Scalar, Scalar]:
    state = hash32(key ^ (np.asarray(sample).astype(np.uint32) * np.uint32(GOLDEN)))
    first = hash32(state + _odd(2 * dimension))
    second = hash32(first ^ _odd(2 * dimension + 1))
    return _unit(first), _unit(second)


def _unit(bits: Keys) -> Scalar:
    # 24 bits: what a float32 below 1 can hold.
    return (bits >> np.uint32(8)).astype(F32) * F32(2.0**-24)
