"""integers, or the bits of floats -> pseudo-random numbers.  The hashes of Blender's textures.

Jenkins' lookup3 (Jenkins 2006) is behind Perlin noise and white noise; PCG in D dimensions
(Jarzynski and Olano 2020, "Hash Functions for GPU Rendering", on signed integers) behind Voronoi
cells.  Arguments broadcast: the corners of a grid cell share the work up to where they differ.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import F32
from ..values import Array

Words = NDArray[np.uint32]
Integers = NDArray[np.int32]

_START = 0xDEADBEEF + 13
_PER_WORD = F32(1.0 / 0xFFFFFFFF)
_PER_INTEGER = F32(1.0 / 0x7FFFFFFF)
_FACTOR, _SUMMAND = np.int32(1664525), np.int32(1013904223)
_HALF, _POSITIVE = np.int32(16), np.int32(0x7FFFFFFF)


def hash_words(keys: Sequence[Words]) -> Words:
    """Return the lookup3 hash of one to four words; the arrays broadcast, and stay as they are.

    The last key should be the one with the fewest different values next to each other: what
    depends on the later keys alone is computed once for all values of the first.
    """
    count = len(keys)
    start = np.full(1, (_START + 4 * count) & 0xFFFFFFFF, np.uint32)
    a, b, c = (keys[place] + start if place < count else start for place in range(3))
    if count == 4:
        a, b, c = _stir(a, b, c)
        a = a + keys[3]
    return _finish(a, b, c)


def _rotate(word: Words, bits: int) -> Words:
    left = word << np.uint32(bits)
    left |= word >> np.uint32(32 - bits)
    return left


def _stir(a: Words, b: Words, c: Words) -> tuple[Words, Words, Words]:
    for bits in (4, 6, 8, 16, 19, 4):
        a = a - c
        a = a ^ _rotate(c, bits)
        c = c + b
        a, b, c = b, c, a
    return a, b, c


def _finish(a: Words, b: Words, c: Words) -> Words:
    for step, bits in enumerate((14, 11, 25, 16, 4, 14, 24)):
        # The first round makes arrays of its own, which the others may write to.
        if step >= 3 and c.shape == b.shape:
            c ^= b
        else:
            c = c ^ b
        c -= _rotate(b, bits)
        a, b, c = b, c, a
    return b


def fractions(words: Words) -> Array:
    """Return hashes as numbers from 0 to 1."""
    return words.astype(F32) * _PER_WORD


def hash_floats(keys: Sequence[NDArray[Any] | float]) -> Array:
    """Return the hash, 0 to 1, of the bits of one to four floats."""
    return fractions(
        hash_words([np.atleast_1d(np.asarray(key, F32)).view(np.uint32) for key in keys])
    )


def hash_cells(cells: Sequence[Integers]) -> list[Integers]:
    """Return D hashes, 0 to 2^31 - 1, of D = 2 to 4 integers each; the arrays broadcast."""
    found = [cell * _FACTOR + _SUMMAND for cell in cells]
    _ROUNDS[len(found)](found)
    for part in found:
        part ^= part >> _HALF
    _ROUNDS[len(found)](found)
    for part in found:
        part &= _POSITIVE
    return found


def _add(found: list[Integers], to: int, one: int, other: int | np.int32) -> None:
    """Add the product of two parts to a third."""
    product = found[one] * (found[other] if isinstance(other, int) else other)
    if product.shape == found[to].shape:
        found[to] += product
    else:
        found[to] = found[to] + product


def _round_2(found: list[Integers]) -> None:
    _add(found, 0, 1, _FACTOR)
    _add(found, 1, 0, _FACTOR)


def _round_3(found: list[Integers]) -> None:
    _add(found, 0, 1, 2)
    _add(found, 1, 2, 0)
    _add(found, 2, 0, 1)


def _round_4(found: list[Integers]) -> None:
    _add(found, 0, 1, 3)
    _add(found, 1, 2, 0)
    _add(found, 2, 0, 1)
    _add(found, 3, 1, 2)


_ROUNDS = {2: _round_2, 3: _round_3, 4: _round_4}


def cell_fractions(cells: Sequence[Integers]) -> list[Array]:
    """Return D numbers, 0 to 1, that belong to a cell of D = 2 to 4 integers."""
    return [part.astype(F32) * _PER_INTEGER for part in hash_cells(cells)]
