"""image sources -> images.  Reading through OpenImageIO, and colours to the scene-linear space.

The only importer of OpenImageIO, and only when there is a file to read.  What is converted, and
when, follows Cycles: data never; sRGB stays encoded where the scene is Linear Rec.709; a space that
is the scene's own stays; every other goes through OpenColorIO with Blender's configuration, with
straight alpha, to half floats at least.
"""

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32
from ..scene import Note
from . import (
    ALPHA_MODES,
    MAGENTA,
    ROWS,
    Image,
    ImageSource,
    Tiles,
    halvings,
    is_opaque,
    make_image,
)
from .lookup import decode_srgb

REC709 = "Linear Rec.709"


Keep = Callable[[tuple[Any, ...], Callable[[], Image]], Image]


def load_image(
    source: ImageSource,
    notes: list[Note],
    side: int = 0,
    keep: Keep = lambda key, make: make(),
) -> Image | Tiles:
    """Return the image of a source; magenta, and a note that names it, if it cannot be read.

    Its sides are at most `side` texels, 0 is any number.  keep(key, make) returns what is known by
    a key, which begins with the path or digest, made if it is not: images that differ in their
    colour space may share texels.
    """
    if source.tiles:
        tiles = ((number, _load(tile, notes, side, keep)) for number, tile in source.tiles)
        return Tiles(tuple(tiles))
    return _load(source, notes, side, keep)


def _load(source: ImageSource, notes: list[Note], side: int, keep: Keep) -> Image:
    limits = source.resolution, source.side, side
    spaces = source.colorspace, source.working_space, source.config
    if source.pixels is not None and source.digest is not None:
        _is_converted(source, notes)
        how = source.alpha_mode, limits, source.is_data, spaces
        return keep((source.digest, *how), lambda: _make(source, [], side))
    if source.pixels is not None or not source.path:
        return _make(source, notes, side)
    if not _is_converted(source, notes):
        # As they are in the file: what is made of alpha is all that matters, if there is any
        alpha = "PREMUL" if source.is_data else source.alpha_mode
        image = keep((source.path, alpha, limits), lambda: _make(source, notes, side))
        if image is MAGENTA:
            return MAGENTA
        for other in ALPHA_MODES if not image.has_alpha and alpha != "NONE" else ():
            keep((source.path, other, limits), lambda: image)
        way = "LINEAR" if source.is_data else _way(source, [])
        can = not source.is_data and source.alpha_mode in ("STRAIGHT", "PREMUL")
        return replace(image, is_srgb=way == "SRGB", can_unassociate=can)
    key = source.path, source.alpha_mode, limits, spaces
    return keep(key, lambda: _make(source, notes, side))


def _is_converted(source: ImageSource, notes: list[Note]) -> bool:
    return not source.is_data and _way(source, notes) == "CONVERT"


def _make(source: ImageSource, notes: list[Note], side: int) -> Image:
    if source.pixels is not None:
        pixels = source.pixels
    elif not source.path:
        return MAGENTA
    else:
        try:
            pixels = _read(source.path)
        except OSError as error:
            notes.append(Note(source.name, f"it cannot be read and is shown in magenta: {error}"))
            return MAGENTA
    has_alpha = not source.is_data and source.alpha_mode in ("STRAIGHT", "PREMUL")
    pixels = _shrunk(pixels, source, side)
    is_linear = source.is_data or (source.pixels is not None and pixels.dtype == F32)
    way = "LINEAR" if is_linear else _way(source, notes)

    # One channel, or four that stay as they are: nothing to do
    has_none = source.alpha_mode == "NONE"
    straight = has_alpha and source.alpha_mode == "STRAIGHT" and pixels.shape[2] == 4
    if way != "CONVERT" and pixels.dtype.kind == "u":
        is_plain = pixels.shape[2] == 4 and (not (straight or has_none) or is_opaque(pixels))
        if is_plain or pixels.shape[2] == 1:
            return make_image(pixels, way == "SRGB", has_alpha)

    # Convert what needs it as floats, so that no precision is lost on the way
    is_float = pixels.dtype == F32
    pixels = _four_channels(pixels)
    if way == "CONVERT" and pixels.dtype.kind == "u":
        pixels = pixels * F32(1 / _one(pixels.dtype))
    if straight:
        _associate(pixels)
    if has_none:
        pixels[:, :, 3] = _one(pixels.dtype)
    if way == "CONVERT":
        pixels = _convert(pixels, source, has_alpha)
        pixels = pixels if is_float else pixels.astype(np.float16)
    return make_image(_finite(pixels), way == "SRGB", has_alpha)


def _read(path: str) -> NDArray[Any]:
    """Return pixels (H, W, C) in the file's own numbers and alpha, the bottom row first.

    Raises: OSError if there is no such file or it is no image.
    """
    import OpenImageIO as oiio  # noqa: N813

    as_it_is = oiio.ImageSpec()
    as_it_is.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageInput.open(path, as_it_is)
    if file is None:
        raise OSError(oiio.geterror() or f"{path} is no image")
    try:
        spec = file.spec()
        kind = _TYPES.get(str(spec.format), "uint8")
        pixels = file.read_image(0, 0, 0, min(spec.nchannels, 4), kind)
        if pixels is None:
            raise OSError(file.geterror() or f"{path} cannot be read")
    finally:
        file.close()
    return np.asarray(pixels)[::-1]


_TYPES = {"half": "half", "float": "float", "double": "float", "uint16": "uint16"}


def read_header(path: str) -> tuple[int, int, int] | None:
    """Return width, height and the bytes of a texel of an image file, None if it is none."""
    import OpenImageIO as oiio  # noqa: N813

    file = oiio.ImageInput.open(path)
    if file is None:
        oiio.geterror()
        return None
    spec = file.spec()
    number = {"half": 2, "uint16": 2, "float": 4, "double": 4}.get(str(spec.format), 1)
    file.close()
    return spec.width, spec.height, number * (1 if spec.nchannels == 1 else 4)


def _shrunk(pixels: NDArray[Any], source: ImageSource, side: int) -> NDArray[Any]:
    """Return pixels as the limits have them: means of squares, of the numbers as they are."""
    height, width, channels = pixels.shape
    if side and source.side:
        side = min(side, source.side)
    factor = halvings(width, height, side or source.side, source.resolution)
    if factor == 1:
        return pixels
    wide, high = max(width // factor, 1), max(height // factor, 1)
    rows, columns = min(factor, height), min(factor, width)
    whole = pixels[: high * rows, : wide * columns]
    squares = whole.reshape(high, rows, wide, columns, channels)
    mean = squares.mean(axis=(1, 3), dtype=F32)
    return (np.rint(mean) if pixels.dtype.kind == "u" else mean).astype(pixels.dtype)


def _four_channels(pixels: NDArray[Any]) -> NDArray[Any]:
    """Return a copy (H, W, 4) of pixels (H, W, C): grey, grey and alpha, colour, or the first 4."""
    height, width, channels = pixels.shape
    full = np.empty((height, width, 4), pixels.dtype)
    for top in range(0, height, ROWS):
        part, of = full[top : top + ROWS], pixels[top : top + ROWS]
        for channel in range(3):
            part[:, :, channel] = of[:, :, 0 if channels < 3 else channel]
        if channels in (1, 3):
            part[:, :, 3] = _one(pixels.dtype)
        else:
            part[:, :, 3] = of[:, :, 1 if channels == 2 else 3]
    return full


def _one(dtype: np.dtype[Any]) -> int:
    return int(np.iinfo(dtype).max) if dtype.kind == "u" else 1


def _associate(pixels: NDArray[Any]) -> None:
    """Multiply colours of pixels (H, W, 4) with alpha, in their own numbers."""
    one = _one(pixels.dtype)
    colour, alpha = pixels[:, :, :3], pixels[:, :, 3:]
    if is_opaque(pixels):
        return
    if pixels.dtype.kind == "u":
        colour[:] = colour.astype(np.uint32) * alpha.astype(np.uint32) // np.uint32(one)
    else:
        colour *= alpha


def _finite(pixels: NDArray[Any]) -> NDArray[Any]:
    """Return pixels, black and transparent where any channel is not finite."""
    if pixels.dtype.kind == "f":
        bad = ~np.isfinite(pixels).all(axis=2)
        if bad.any():
            pixels = pixels.copy()
            pixels[bad] = 0
    return pixels


def _way(source: ImageSource, notes: list[Note]) -> str:
    """Return LINEAR (as it is), SRGB (decoded when looked up) or CONVERT."""
    space, scene = source.colorspace, source.working_space
    if space in (scene, "scene_linear"):
        return "LINEAR"
    if scene == REC709 and space == "sRGB":
        return "SRGB"
    way = _way_by_trial(source.config, space, scene)
    if way is None:
        notes.append(
            Note(source.name, f"colour space {space} is unknown here: it counts as linear")
        )
        return "LINEAR"
    return way


@functools.lru_cache(maxsize=64)
def _way_by_trial(config: str, space: str, scene: str) -> str | None:
    """Return how a space gets to the scene's, found by converting a ramp; None if it cannot."""
    ramp = np.zeros((4, 256, 3), F32)
    values = np.linspace(0, 1, 256, dtype=F32)
    for row in range(3):
        ramp[row, :, row] = values
    ramp[3] = values[:, None]
    converted = convert_colours(ramp, config, space, scene)
    if converted is None:
        return None
    if np.allclose(converted, ramp, rtol=1e-5, atol=1e-6):
        return "LINEAR"
    if np.allclose(converted, decode_srgb(ramp), rtol=1e-4, atol=1e-6):
        return "SRGB"
    return "CONVERT"


def convert_colours(
    colours: NDArray[np.float32], config: str, space: str, scene: str
) -> NDArray[np.float32] | None:
    """Return colours (H, W, 3) of an OpenColorIO space in another; None if they are unknown."""
    import OpenImageIO as oiio  # noqa: N813

    source = oiio.ImageBuf(np.ascontiguousarray(colours, F32))
    result = oiio.ImageBufAlgo.colorconvert(source, space, scene, False, "", "", config)
    if result.has_error:
        result.geterror()
        return None
    return np.asarray(result.get_pixels(oiio.FLOAT), F32)


def _convert(pixels: NDArray[Any], source: ImageSource, has_alpha: bool) -> NDArray[np.float32]:
    """Return associated pixels (H, W, 4) in the scene's colour space, as float32."""
    values = pixels.astype(F32)
    alpha = values[:, :, 3:]
    share = np.where((alpha > 0) & (alpha != 1) & has_alpha, alpha, F32(1))
    straight = np.divide(values[:, :, :3], share, dtype=F32)
    converted = convert_colours(straight, source.config, source.colorspace, source.working_space)
    assert converted is not None  # `_way` has tried it
    values[:, :, :3] = converted * share
    return values
