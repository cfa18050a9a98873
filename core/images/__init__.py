"""descriptions, pixels -> images.  What a picture is before it is read, and after.

An image keeps the number format of its file, four channels to a texel, so that one fetch of 4, 8
or 16 bytes brings a texel.  Colours are associated (multiplied with alpha).  An image in sRGB stays
encoded, and is decoded after texels have been mixed, as in Cycles: that shows at magnified edges.
"""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROWS = 16  # of a picture that are looked at, or written, together

ALPHA_MODES = ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")  # Blender's


@dataclass(frozen=True, eq=False)
class ImageSource:
    """Where an image comes from: the file at `path`, or `pixels` if there are any.

    pixels (H, W, C) uint8 or float32, the bottom row first; uint8 is in `colorspace`, float32
    scene-linear, as Blender's own buffers.
    """

    name: str  # "Image 'sky.hdr'"
    path: str = ""  # absolute
    pixels: NDArray[Any] | None = None
    digest: Hashable = None  # tells pixels from others, if the same may come again
    colorspace: str = "sRGB"  # a name in the OpenColorIO configuration
    is_data: bool = False  # numbers, not colours: never converted
    alpha_mode: str = "STRAIGHT"
    working_space: str = "Linear Rec.709"  # the scene-linear space
    tiles: tuple[tuple[int, "ImageSource"], ...] = ()  # UDIM: instead of a picture of its own
    config: str = ""  # OpenColorIO's configuration file; only spaces that are not built in need it
    resolution: float = 1.0  # halved so many times that its sides are at most this large a part
    side: int = 0  # or as many texels as this, 0 is any number

    @property
    def file_key(self) -> Hashable:
        """What its pixels come from."""
        return self.path or id(self)

    @property
    def key(self) -> Hashable:
        """What its picture depends on; sources with the same are the same."""
        if self.pixels is not None or self.tiles:
            return id(self)
        how = self.colorspace, self.is_data, self.alpha_mode, self.working_space, self.config
        return self.file_key, how, self.resolution, self.side

    @property
    def parts(self) -> tuple["ImageSource", ...]:
        """Itself, or its tiles."""
        return tuple(tile for _, tile in self.tiles) or (self,)

    def __post_init__(self) -> None:
        if self.alpha_mode not in ALPHA_MODES:
            raise ValueError(f"{self.name}: unknown alpha mode {self.alpha_mode!r}")
        if self.pixels is not None and self.pixels.dtype not in (np.uint8, np.float32):
            raise ValueError(f"{self.name}: pixels of type {self.pixels.dtype}")


@dataclass(frozen=True, eq=False)
class Image:
    """Texels as one number each, the bottom row first; see `make_image`.

    texels (height width,) unsigned integers or complex128, which are four numbers of `dtype`; of a
    grey image just these numbers.
    """

    texels: NDArray[Any]
    width: int
    height: int
    dtype: np.dtype[Any]
    is_srgb: bool = False
    has_alpha: bool = False  # a texel whose alpha is not 1
    can_unassociate: bool = True  # not if it is data, or if alpha is a channel like the others
    is_grey: bool = False  # and opaque everywhere

    @property
    def memory(self) -> int:
        """What the texels take [bytes]."""
        return self.texels.nbytes

    def blocks(self) -> dict[int, int]:
        """Return what each block of memory takes [bytes], by its address."""
        return block_of(self.texels)


PACKED: dict[int, np.dtype[Any]] = {
    1: np.dtype(np.uint32),
    2: np.dtype(np.uint64),
    4: np.dtype(np.complex128),
}


def make_image(pixels: NDArray[Any], is_srgb: bool = False, can_unassociate: bool = True) -> Image:
    """Return the image of pixels (H, W, 4) or grey ones (H, W, 1).

    uint8, uint16, float16 or float32; they are not copied if their rows follow each other.
    """
    height, width, channels = pixels.shape
    if channels == 1 or is_grey(pixels):
        grey = np.ascontiguousarray(pixels[:, :, 0]).reshape(-1)
        return Image(grey, width, height, pixels.dtype, is_srgb, is_grey=True)
    pixels = np.ascontiguousarray(pixels)
    return Image(
        texels=pixels.reshape(-1, 4).view(PACKED[pixels.dtype.itemsize]).reshape(-1),
        width=width,
        height=height,
        dtype=pixels.dtype,
        is_srgb=is_srgb,
        has_alpha=not is_opaque(pixels),
        can_unassociate=can_unassociate,
    )


def block_of(array: NDArray[Any]) -> dict[int, int]:
    """Return the size of an array's memory [bytes] by its address, which views share."""
    return {array.__array_interface__["data"][0]: array.nbytes}


def image_size(width: int, height: int, side: int, resolution: float = 1.0) -> tuple[int, int]:
    """Return width and height after halving until both are at most `side` (0: any) texels.

    And at most this part of what they were.
    """
    factor = halvings(width, height, side, resolution)
    return max(width // factor, 1), max(height // factor, 1)


def halvings(width: int, height: int, side: int, resolution: float = 1.0) -> int:
    """Return by which power of two an image is made smaller; see `image_size`."""
    largest, factor = max(width, height), 1
    while (side and largest > side * factor) or resolution * factor < 1:
        factor *= 2
    return factor


def is_opaque(pixels: NDArray[Any]) -> bool:
    """Tell whether the alpha of pixels (H, W, 4) is 1 everywhere."""
    one = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1
    return all(bool((part[:, :, 3] == one).all()) for part in _parts(pixels))


def is_grey(pixels: NDArray[Any]) -> bool:
    """Tell whether pixels (H, W, 4) are opaque and have no colour; most that have show it soon."""
    return all(
        bool((part[:, :, 1] == part[:, :, 0]).all() and (part[:, :, 2] == part[:, :, 0]).all())
        for part in _parts(pixels)
    ) and is_opaque(pixels)


def _parts(pixels: NDArray[Any]) -> Iterator[NDArray[Any]]:
    """Yield some rows, from all over the picture, then all, as many at a time as stay in caches."""
    yield pixels[::64]
    for top in range(0, len(pixels), ROWS):
        yield pixels[top : top + ROWS]


@dataclass(frozen=True, eq=False)
class Tiles:
    """Images on the unit squares of a UV map, each with its number: 1001 + column + 10 row."""

    images: tuple[tuple[int, Image], ...]


# What cannot be read, as Blender shows it
MAGENTA = make_image(np.array([[[1, 0, 1, 1]]], np.float32))
