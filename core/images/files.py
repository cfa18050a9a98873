"""image sources -> images.  Reading through OpenImageIO, and colours to the scene-linear space.

The only importer of OpenImageIO, and only when there is a file to read.  What is converted, and
when, follows Cycles: data never; sRGB stays encoded where the scene is Linear Rec.709; a space that
is the scene's own stays; every other goes through OpenColorIO with Blender's configuration, with
straight alpha, to half floats at least.
"""

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32
from ..scene import Note
from . import MAGENTA, Image, ImageSource, Tiles, make_image
from .lookup import decode_srgb

REC709 = "Linear Rec.709"


def load_image(source: ImageSource, notes: list[Note]) -> Image | Tiles:
    """Return the image of a source; magenta, and a note that names it, if it cannot be read."""
    if source.tiles:
        return Tiles(tuple((number, _load(tile, notes)) for number, tile in source.tiles))
    return _load(source, notes)


def _load(source: ImageSource, notes: list[Note]) -> Image:
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
    is_linear = source.is_data or (source.pixels is not None and pixels.dtype == F32)
    way = "LINEAR" if is_linear else _way(source, notes)

    # Convert what needs it as floats, so that no precision is lost on the way
    straight = has_alpha and source.alpha_mode == "STRAIGHT" and pixels.shape[2] == 4
    is_float = pixels.dtype == F32
    pixels = _four_channels(pixels)
    if way == "CONVERT" and pixels.dtype.kind == "u":
        pixels = pixels * F32(1 / _one(pixels.dtype))
    if straight:
        _associate(pixels)
    if source.alpha_mode == "NONE":
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


def _four_channels(pixels: NDArray[Any]) -> NDArray[Any]:
    """Return a copy (H, W, 4) of pixels (H, W, C): grey, grey and alpha, colour, or the first 4."""
    height, width, channels = pixels.shape
    full = np.empty((height, width, 4), pixels.dtype)
    full[:, :, :3] = pixels[:, :, :1] if channels < 3 else pixels[:, :, :3]
    if channels in (1, 3):
        full[:, :, 3] = _one(pixels.dtype)
    else:
        full[:, :, 3] = pixels[:, :, 1 if channels == 2 else 3]
    return full


def _one(dtype: np.dtype[Any]) -> int:
    return int(np.iinfo(dtype).max) if dtype.kind == "u" else 1


def _associate(pixels: NDArray[Any]) -> None:
    """Multiply colours of pixels (H, W, 4) with alpha, in their own numbers."""
    one = _one(pixels.dtype)
    colour, alpha = pixels[:, :, :3], pixels[:, :, 3:]
    if (alpha == one).all():
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
