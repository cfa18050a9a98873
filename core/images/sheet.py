"""images -> Sheet.  Texels of images that are looked up together, side by side.

A material's set of maps (colour, roughness, normals, ...) is looked up at the same places.  Where
their texels are one record, the processor waits for memory once for all of them.  Sets of the same
layout follow each other: points of materials that differ in their images only are one batch.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar
from . import PACKED, ROWS, Image, block_of
from .lookup import Tap

LARGEST_RECORD = 16  # bytes that one fetch brings
BLOCK = 1 << 13  # points whose texels stay in the caches


class Sheet:
    """Records of the texels of S sets of images of the same size and `channels`.

    channels: how many of each image of a set are kept; grey ones have one, others three or four.
    """

    def __init__(self, sets: list[tuple[Image, ...]], channels: tuple[int, ...]) -> None:
        first = sets[0][0]
        self.sets, self.channels = sets, channels
        self.width, self.height, self.dtype = first.width, first.height, first.dtype
        # As many channels to a record as fit; records are as long as numbers are
        most, count = LARGEST_RECORD // self.dtype.itemsize, sum(channels)
        self._records: list[NDArray[Any]] = []
        self._parts = [range(low, min(low + most, count)) for low in range(0, count, most)]

    @property
    def memory(self) -> int:
        """What the records take [bytes]."""
        size = len(self.sets) * self.width * self.height * self.dtype.itemsize
        return size * sum(_length(part) for part in self._parts)

    def blocks(self) -> dict[int, int]:
        """Return what each block of memory takes [bytes], by its address; of its images, too."""
        found: dict[int, int] = {}
        for record in self._records:
            found |= block_of(record)
        for images in self.sets:
            for image in images:
                found |= image.blocks()
        return found

    def pack(self) -> None:
        """Write the records, if that was not done: arrays (S height width,), set after set."""
        if self._records:
            return
        made = []
        for part in self._parts:
            shape = len(self.sets), self.height, self.width, _length(part)
            texels = np.empty(shape, self.dtype)
            if len(self.sets) > 1:
                with ThreadPoolExecutor(min(len(self.sets), os.cpu_count() or 1)) as pool:
                    list(pool.map(self._pack, texels, self.sets, repeat(part)))
            else:
                self._pack(texels[0], self.sets[0], part)
            made.append(texels.reshape(-1).view(_record(texels.dtype, shape[3])))
        self._records = made

    def _pack(self, texels: NDArray[Any], images: tuple[Image, ...], part: range) -> None:
        """Write the channels `part` of one set to its texels (H, W, C)."""
        planes = [
            plane
            for image, count in zip(images, self.channels, strict=True)
            for plane in _planes(image, count)
        ]
        for top in range(0, self.height, ROWS):
            rows = slice(top, top + ROWS)
            for place, number in enumerate(part):
                texels[rows, :, place] = planes[number][rows]

    def fetch(self, taps: list[Tap], number: Scalar) -> NDArray[np.float32]:
        """Return all channels (C, n), encoded, of weighed texels of the sets `number` (n,) or (1,).

        Integers are divided by their largest.
        """
        size = self.width * self.height
        records, offset = self._records, None
        if number.size == 1:
            start = int(number[0]) * size
            records = [each[start : start + size] for each in records]
        else:
            offset = number.astype(np.intp)
            offset *= size
        count = max(taps[0][0].size, number.size)
        out = np.empty((sum(self.channels), count), F32)
        for low in range(0, count, BLOCK):
            some = slice(low, low + BLOCK)
            _fetch(records, self._parts, self.dtype, taps, offset, some, out[:, some])
        if self.dtype.kind == "u":
            out *= F32(1.0 / np.iinfo(self.dtype).max)
        return out


def _fetch(
    records: list[NDArray[Any]],
    parts: list[range],
    dtype: np.dtype[Any],
    taps: list[Tap],
    offset: NDArray[np.intp] | None,
    some: slice,
    out: NDArray[np.float32],
) -> None:
    """Write the weighed sums of some points' texels to `out` (C, m)."""
    texel = np.empty_like(out)
    for place, (index, weight) in enumerate(taps):
        index = index[some] if index.size > 1 else index
        if offset is not None:
            index = index + offset[some]
        to = texel if place else out
        for part, array in zip(parts, records, strict=True):
            # Every index is inside; clip is take's fastest mode
            found = array.take(index, mode="clip").view(dtype).reshape(-1, _length(part))
            to[part.start : part.stop] = found.T[: len(part)]
        if weight is not None:
            to *= weight[some] if weight.size > 1 else weight
        if place:
            out += texel


def _length(part: range) -> int:
    """Return how many numbers a record of some channels has."""
    return 1 << (len(part) - 1).bit_length()


def _record(dtype: np.dtype[Any], length: int) -> np.dtype[Any]:
    sizes: dict[int, np.dtype[Any]] = {1: np.dtype(np.uint8), 2: np.dtype(np.uint16)}
    for size, four in PACKED.items():
        sizes[4 * size] = four
    return sizes[dtype.itemsize * length]


def _planes(image: Image, count: int) -> list[NDArray[Any]]:
    texels = image.texels.view(image.dtype).reshape(image.height, image.width, -1)
    return [texels[:, :, channel] for channel in range(count)]
