"""image -> levels.  The same picture at half the size, again and again (mip maps).

Each texel of a level is the mean, in scene-linear numbers, of what lookups give on the texels of
the finest level below it.  That is not the mean of those texels: colours are decoded after they are
mixed, as in Cycles.  So the mean of a lookup stays what it is, whatever level it takes.
Source: Williams 1983, "Pyramidal Parametrics".
"""

from collections.abc import Callable
from dataclasses import replace
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec
from . import Image
from .lookup import Tap, decode_srgb, find_taps, mix_grey, mix_taps

WORTHWHILE = 256  # images with shorter sides stay in the caches as they are
LEAST = 16  # texels along the shorter side of the coarsest level, at least
ROWS = 8  # rows of a level that are made at a time

# Where the mean of a lookup is taken between two texels: Gauss' two points
NODE = F32(0.5 - 0.5 / np.sqrt(3))


def level_sizes(width: int, height: int) -> NDArray[np.int32]:
    """Return width, height and first texel (3, L) of each level but the finest.

    Sides are halved while both are even: so texels lie on texels.
    """
    sizes, start = [], 0
    while width % 2 == 0 and height % 2 == 0 and min(width, height) >= 2 * LEAST:
        width, height = width // 2, height // 2
        sizes.append((width, height, start))
        start += width * height
    return np.array(sizes, np.int32).reshape(-1, 3).T.copy()


class Levels:
    """An image and its levels, which are made when they are first looked up: a third of it."""

    def __init__(self, image: Image) -> None:
        self.finest = image
        self._coarse: Image | None = None
        self._lock = Lock()

    @property
    def memory(self) -> int:
        """What the levels take when they are made [bytes]."""
        sizes = level_sizes(self.finest.width, self.finest.height)
        return int((sizes[0] * sizes[1]).sum()) * self.finest.texels.itemsize

    @property
    def coarse(self) -> Image:
        """The texels of all levels but the finest, as `level_sizes` says."""
        if self._coarse is None:
            with self._lock:
                if self._coarse is None:
                    self._coarse = _made(self.finest)
        return self._coarse


class LevelTaps:
    """Texels of n points: of the finest level at `fine`, of the coarse ones at the others."""

    def __init__(
        self,
        u: Scalar,
        v: Scalar,
        footprint: Scalar,
        size: tuple[int, int],
        interpolation: str,
        extension: str,
    ) -> None:
        width, height = size
        self.size = u.size
        self.fine: Index | None = None  # all of them
        self.near: list[Tap] = []
        self.far: list[Tap] = []
        sizes = level_sizes(width, height)
        level = choose_level(footprint, min(width, height), sizes.shape[1])
        if level is None:
            self.near = find_taps(u, v, width, height, interpolation, extension)
            return
        fine, coarse = np.flatnonzero(level == 0), np.flatnonzero(level)
        self.fine, self.beyond = fine, coarse
        if fine.size:
            near = u.take(fine), v.take(fine)
            self.near = find_taps(*near, width, height, interpolation, extension)
            u, v, level = u.take(coarse), v.take(coarse), level.take(coarse)
        wide, high, first = (row.take(level - 1) for row in sizes)
        # A texel is less than a pixel; to mix some would blur, and darken what is decoded after
        self.far = find_taps(u, v, wide, high, "Closest", extension, first)


def choose_level(footprint: Scalar, side: int, count: int) -> Ids | None:
    """Return the level (n,) whose texels are at most as wide as a footprint (n,); None: all 0.

    footprint: in units of the whole image, whose shorter side has so many texels.
    """
    texels = footprint * F32(side)
    if not texels.size or texels.max() < 2:
        return None
    # The exponent of a float is the floor of its logarithm
    exponent = np.maximum(texels, F32(1)).view(np.int32) >> np.int32(23)
    exponent -= np.int32(127)
    return np.minimum(exponent, np.int32(count))


def mix_levels(levels: Levels, taps: LevelTaps) -> Vec:
    """Return colours and alphas (4, n) of weighed texels."""
    return _mixed(levels, taps, mix_taps)


def mix_grey_levels(levels: Levels, taps: LevelTaps) -> Scalar:
    """Return the grey (n,) of weighed texels of a grey image."""
    return _mixed(levels, taps, mix_grey)


def _mixed(
    levels: Levels, taps: LevelTaps, mix: Callable[[Image, list[Tap]], NDArray[np.float32]]
) -> NDArray[np.float32]:
    if taps.fine is None:
        return mix(levels.finest, taps.near)
    far = mix(levels.coarse, taps.far)
    if not taps.fine.size:
        return far
    out = np.empty((*far.shape[:-1], taps.size), F32)
    out[..., taps.beyond] = far
    out[..., taps.fine] = mix(levels.finest, taps.near)
    return out


# --- Making them ---------------------------------------------------------------------------------
# In planes, one for each channel: numpy is slow where the innermost axis is short


def _made(image: Image) -> Image:
    """Return an image whose texels are those of all levels but the finest."""
    sizes = level_sizes(image.width, image.height)
    channels = 1 if image.is_grey else 4
    texels = np.empty((int((sizes[0] * sizes[1]).sum()), channels), image.dtype)
    planes = channels if image.has_alpha else min(channels, 3)
    texels[:, planes:] = _one(image)
    linear: NDArray[np.float32] | None = None
    for width, height, first in sizes.T.tolist():
        level = np.empty((planes, height, width), F32)
        for top in range(0, height, ROWS):
            bottom = min(top + ROWS, height)
            if linear is None:
                fine = _looked_up(image, 2 * top, 2 * bottom, planes)
            else:
                fine = linear[:, 2 * top : 2 * bottom]
            part = level[:, top:bottom]
            rows = fine[:, 0::2] + fine[:, 1::2]
            np.add(rows[..., 0::2], rows[..., 1::2], out=part)
            part *= F32(0.25)
            place = texels[first + top * width : first + bottom * width]
            place[:, :planes] = _encoded(part, image).reshape(planes, -1).T
        linear = level
    return replace(image, texels=texels.reshape(-1).view(image.texels.dtype))


def _one(image: Image) -> int:
    return int(np.iinfo(image.dtype).max) if image.dtype.kind == "u" else 1


def _looked_up(image: Image, top: int, bottom: int, planes: int) -> NDArray[np.float32]:
    """Return the means (C, R, W), linear, of lookups around the texels of some rows."""
    texels = image.texels.view(image.dtype).reshape(image.height, image.width, -1)
    # With the texels around: what lies beyond an edge is on the other side
    rows = np.arange(top - 1, bottom + 1) % image.height
    part = np.empty((planes, rows.size, image.width + 2), F32)
    part[..., 1:-1] = texels.take(rows, axis=0)[..., :planes].transpose(2, 0, 1)
    part[..., 0], part[..., -1] = part[..., -2], part[..., 1]
    by_table = image.is_srgb and image.dtype.kind == "u"
    part *= F32((_STEPS if by_table else 1) / _one(image))

    # A lookup decodes what it has mixed: its mean is that of points between texels
    total = np.zeros((planes, bottom - top, image.width), F32)
    much, little = part * (F32(1) - NODE), part * NODE
    for upper in (little[:, :-2], little[:, 2:]):
        between = much[:, 1:-1] + upper
        most, least = between[..., 1:-1] * (F32(1) - NODE), between * NODE
        for beside in (least[..., :-2], least[..., 2:]):
            there = most + beside
            colours = there[:3]
            if by_table:
                colours += F32(0.5)
                _DECODED.take(colours.astype(np.int32), out=colours, mode="clip")
                there[3:] *= F32(1 / _STEPS)
            elif image.is_srgb:
                colours[...] = decode_srgb(colours)
            total += there
    total *= F32(0.25)
    return total


# Colours of integers, decoded finely enough for means that are rounded
_STEPS = 1 << 14
_DECODED = decode_srgb(np.arange(_STEPS + 1, dtype=F32) * F32(1 / _STEPS))


def _encoded(linear: NDArray[np.float32], image: Image) -> NDArray[np.float32]:
    """Return linear planes (C, R, W) in the numbers of an image."""
    if image.is_srgb:
        linear = linear.copy()
        linear[:3] = _encode_srgb(linear[:3])
    return np.rint(linear * F32(_one(image))) if image.dtype.kind == "u" else linear


def _encode_srgb(colour: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return sRGB numbers of linear ones; see `decode_srgb`."""
    high = F32(1.055) * np.power(colour, F32(1 / 2.4)) - F32(0.055)
    return np.where(colour < F32(0.04045 / 12.92), colour * F32(12.92), high)
