"""names, hits -> ranked coverage.  Which objects and materials a pixel shows, and how much of each.

A hit adds its weight to the pixel and to what was hit, both in one number, the key; sums of equal
keys are exact.  A picture then shows the parts of each pixel from the largest on, as pairs of a
name's hash, in the bits of a float, and a weight.  Source: Friedman and Jones 2015, "Fully
Automatic ID Mattes with Support for Motion Blur and Transparency"; MurmurHash3_x86_32 by Appleby.
"""

import json
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar

Keys = NDArray[np.int64]

_MASK = 0xFFFFFFFF
_CROWDED = 4  # times as many keys as pixels are summed up


# --- Names --------------------------------------------------------------------------------------


def hash_of(name: str) -> int:
    """Return the 32 bits by which a cryptomatte knows a name."""
    data = name.encode()
    number = 0
    for (block,) in struct.iter_unpack("<I", data[: len(data) // 4 * 4]):
        number ^= _mixed(block)
        number = (_rotated(number, 13) * 5 + 0xE6546B64) & _MASK
    number ^= _mixed(int.from_bytes(data[len(data) // 4 * 4 :], "little"))
    number ^= len(data)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        number = ((number ^ number >> shift) * factor) & _MASK
    return number


def _mixed(block: int) -> int:
    return _rotated(block * 0xCC9E2D51 & _MASK, 15) * 0x1B873593 & _MASK


def _rotated(number: int, by: int) -> int:
    return (number << by | number >> 32 - by) & _MASK


def as_float(number: int) -> np.float32:
    """Return a hash as a float32 that is neither infinite, NaN nor denormal, as agreed."""
    exponent = min(max(number >> 23 & 0xFF, 1), 254)
    bits = number & 0x807FFFFF | exponent << 23
    return F32(np.array(bits, np.uint32).view(F32))


def manifest(names: Iterable[str]) -> str:
    """Return the names with their hashes, as readers want them."""
    found = {name: f"{hash_of(name):08x}" for name in dict.fromkeys(names)}
    return json.dumps(found, ensure_ascii=False, separators=(",", ":"))


def metadata(layer: str, names: Sequence[str]) -> dict[str, str]:
    """Return what a file says of the cryptomatte `layer` whose parts have these names."""
    prefix = f"cryptomatte/{hash_of(layer):08x}"[:-1]
    return {
        f"{prefix}/name": layer,
        f"{prefix}/hash": "MurmurHash3_32",
        f"{prefix}/conversion": "uint32_to_float32",
        f"{prefix}/manifest": manifest(names),
    }


# --- Coverage -----------------------------------------------------------------------------------


def summed(keys: Keys, weights: NDArray[np.floating]) -> tuple[Keys, NDArray[np.float64]]:
    """Return each key once, in order, with the sum of its weights."""
    unique, place = np.unique(keys, return_inverse=True)
    return unique, np.bincount(place.reshape(-1), weights, unique.size)


@dataclass(eq=False)
class Parts:
    """What pixels show: a key is the pixel x owners + the owner, one of `owners`."""

    owners: int
    pixels: int
    _keys: list[Keys] = field(default_factory=list)
    _weights: list[NDArray[np.float64]] = field(default_factory=list)

    def add(self, pixels: slice | Index, keys: Keys, weights: NDArray[np.float64]) -> None:
        """Add sums of some pixels; keys count these from 0 on."""
        if isinstance(pixels, slice):
            keys = keys + (pixels.start or 0) * self.owners
        else:
            pixel, owner = np.divmod(keys, self.owners)
            keys = pixels.take(pixel) * self.owners + owner
        self._keys.append(keys)
        self._weights.append(weights)
        if sum(map(len, self._keys)) > _CROWDED * self.pixels + 1024:
            self._settle()

    def _settle(self) -> None:
        keys = np.concatenate([np.empty(0, np.int64), *self._keys])
        keys, weights = summed(keys, np.concatenate([np.empty(0), *self._weights]))
        self._keys, self._weights = [keys], [weights]

    def ranked(self, matte: "Matte", levels: int) -> NDArray[np.float32]:
        """Return (2 x levels, pixels): name and weight of the largest parts of each pixel.

        Weights are sums, the largest first; smaller parts than the last level are left out.
        """
        self._settle()
        pixel, owner = np.divmod(self._keys[0], self.owners)
        unique, number = np.unique(matte.hashes, return_inverse=True)
        number = number.reshape(-1).take(owner // matte.divisor % matte.count)
        keys, weights = summed(pixel * unique.size + number, self._weights[0])
        pixel, number = np.divmod(keys, unique.size)
        order = np.lexsort((-weights, pixel))
        pixel, number, weights = pixel[order], number[order], weights[order]
        rank = np.arange(pixel.size) - np.searchsorted(pixel, pixel)
        kept = np.flatnonzero(rank < levels)
        out = np.zeros((2 * levels, self.pixels), F32)
        row, column = 2 * rank.take(kept), pixel.take(kept)
        out[row, column] = unique.take(number.take(kept))
        out[row + 1, column] = weights.take(kept)
        return out


@dataclass(frozen=True)
class Matte:
    """One cryptomatte: its kind, and the names of the parts it tells apart.

    An owner's part is number owner // divisor % count of `names`.
    """

    kind: str
    names: tuple[str, ...]
    divisor: int
    count: int

    @property
    def hashes(self) -> NDArray[np.float32]:
        """The hashes of the names (count,), as cryptomattes write them."""
        known = {name: as_float(hash_of(name)) for name in set(self.names)}
        return np.array([known[name] for name in self.names], F32)


def owners(instance: Ids, material: Ids, materials: int) -> Keys:
    """Return whose part (n,) a hit shows."""
    return instance.astype(np.int64) * materials + material


@dataclass(frozen=True, eq=False)
class Seen:
    """Hits of one bounce: which slots (n,), which owners (n,), and how much the viewer sees."""

    slot: Index
    owner: Keys
    weight: Scalar
