"""integers -> random words.  Random numbers as pure functions of what they are for.

A key starts a stream; number i of the stream is one hash of key and i (SplitMix64: Steele et al.
2014, "Fast Splittable Pseudorandom Number Generators"), so that any of them can be had at once.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32

Words = NDArray[np.uint32]
Keys = NDArray[np.uint64]

_GAMMA = 0x9E3779B97F4A7C15
_WORDS_START = 1 << 40  # words of a key come from further down its stream than any sample
_UNIT = F32(2.0**-24)  # one step of the 24 random bits of a number


def _mix(z: Keys) -> Keys:
    """Scramble 64-bit words in place and return them (Stafford 2011, mix 13)."""
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        z ^= z >> np.uint64(shift)
        z *= np.uint64(factor)
    z ^= z >> np.uint64(31)
    return z


def keys_of(purpose: tuple[int, ...], count: int) -> Keys:
    """Return keys (count,) for the items 0 .. count - 1 of a purpose, each a stream of its own."""
    key = np.zeros(1, np.uint64)
    for number in purpose:
        key = _mix(key + np.uint64((number + 1) * _GAMMA % 2**64))
    return _mix(key + np.arange(1, count + 1, dtype=np.uint64) * np.uint64(_GAMMA))


def _stream(keys: Keys, index: NDArray[np.integer]) -> Keys:
    """Return the 64-bit numbers `index` of each stream."""
    return _mix(keys + index.astype(np.uint64) * np.uint64(_GAMMA))


def words_of(keys: Keys, number: int) -> Words:
    """Return `number` random 32-bit words (number, C) for each key (C,)."""
    index = np.arange((number + 1) // 2, dtype=np.uint64)[:, None] + np.uint64(_WORDS_START)
    z = _stream(keys, index)
    words = np.concatenate([z >> np.uint64(32), z & np.uint64(0xFFFFFFFF)])
    return words[:number].astype(np.uint32)


def uniform(words: Words, out: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
    """Return float32 numbers in [0, 1) from the upper 24 bits of words."""
    upper = (words >> np.uint32(8)).view(np.int32)  # signed integers convert faster
    if out is None:
        out = np.empty(words.shape, F32)
    return np.multiply(upper, _UNIT, out=out, dtype=F32, casting="unsafe")


def pairs(keys: Keys, index: Words, out: NDArray[np.float32]) -> None:
    """Write independent uniform pairs `index` (n, 1) of each stream (C,) into `out` (2, n, C)."""
    halves = _stream(keys, index).view(np.uint32).reshape(*out.shape[1:], 2)
    for axis in (0, 1):
        uniform(halves[..., axis], out[axis])
