"""bpy images -> core.images.ImageSource.  Where pixels are, or themselves if no file has them.

Files are left to the core, which reads them as Cycles does.  Pixels are taken from Blender where it
alone has them: packed files, generated images, and edits that were not saved.  Its buffers of bytes
are in the image's colour space, those of floats scene-linear.
"""

import copy
import functools
import hashlib
import os
from collections.abc import Hashable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.images import ROWS, ImageSource
from ...core.images.shelf import Pixels, Shelf
from ...core.scene import Note
from .known import Known

_REC709 = "Linear Rec.709"
_NOT_HONOURED = {
    "MOVIE": "movies are not honoured: it is shown in magenta",
    "VIEWER": "results of renders are not honoured: it is shown in magenta",
}


class Images:
    """The images of one export: each is read once, however many nodes show it.

    scene: whose Simplify may ask for smaller ones, others in viewports; known: earlier exports;
    moment: the scene's frame and seconds, by output of Scene Time.
    """

    def __init__(
        self,
        notes: list[Note],
        scene: bpy.types.Scene | None = None,
        known: Known | None = None,
        is_viewport: bool = False,
    ) -> None:
        self._notes = notes
        frame = 0.0 if scene is None else scene.frame_current_final
        rate = 1.0 if scene is None else scene.render.fps / scene.render.fps_base
        self.moment = {"Frame": frame, "Seconds": frame / rate}
        self._limits = read_limits(scene, is_viewport) if scene else {}
        self._known: dict[tuple[int, str], ImageSource] = {}
        self._before = known or Known()
        self._before.keep_limits(self._limits)

    def noting(self, notes: list[Note]) -> "Images":
        """Return the same images, with what they do not honour noted in `notes`."""
        other = copy.copy(self)
        other._notes = notes
        return other

    def export(self, image: bpy.types.Image, user: bpy.types.ImageUser | None) -> ImageSource:
        """Return where the pixels of an image come from, as a node with the image user shows it."""
        key = image.as_pointer(), _path(image, user)
        if key not in self._known:
            self._known[key] = self._before.image(
                image,
                key[1],
                self._notes,
                lambda notes: export_image(image, user, notes, self._limits, self._before.shelf),
            )
        return self._known[key]


def read_limits(scene: bpy.types.Scene, is_viewport: bool = False) -> dict[str, float]:
    """Return what Simplify asks of images: `resolution` and `side` of an ImageSource.

    They are settings of Cycles, there while its add-on is enabled.
    """
    cycles = getattr(scene, "cycles", None)
    if not scene.render.use_simplify or cycles is None:
        return {}
    end = "" if is_viewport else "_render"
    side = getattr(cycles, f"texture_limit{end}", "OFF")
    return {
        "resolution": getattr(cycles, f"texture_resolution{end}", 1.0),
        "side": 0 if side == "OFF" else int(side),
    }


def export_image(
    image: bpy.types.Image,
    user: bpy.types.ImageUser | None,
    notes: list[Note],
    limits: Mapping[str, float] = MappingProxyType({}),
    shelf: Shelf | None = None,
) -> ImageSource:
    """Return where the pixels of an image come from, as a node with the image user shows it.

    shelf: where those of packed images stay for later exports, if anywhere.
    """
    name = f"Image '{image.name}'"
    path, pixels, digest = "", None, None
    if image.source in _NOT_HONOURED:
        notes.append(Note(name, _NOT_HONOURED[image.source]))
    elif _is_only_in_memory(image):
        digest = None if shelf is None else _digest(image)
        found = None if shelf is None or digest is None else shelf.find(digest)
        pixels = _pixels(image) if found is None else found.pixels
        if shelf is not None and digest is not None and pixels is not None:
            shelf.put(digest, Pixels(pixels))
        if pixels is None:
            notes.append(Note(name, "it has no pixels and is shown in magenta"))
    else:
        path = _path(image, user)
    space = image.colorspace_settings
    source = ImageSource(
        name=name,
        path=path,
        pixels=pixels,
        digest=digest,
        colorspace=space.name,
        is_data=space.is_data,
        alpha_mode=image.alpha_mode,
        working_space=working_space(),
        config=configuration(),
        **limits,
    )
    if image.source != "TILED" or pixels is not None:
        return source
    tiles = tuple(
        (tile.number, replace(source, path=_path(image, user, tile.number))) for tile in image.tiles
    )
    return replace(source, tiles=tiles)


def _is_only_in_memory(image: bpy.types.Image) -> bool:
    if image.source == "SEQUENCE":
        return False
    return image.source == "GENERATED" or image.is_dirty or len(image.packed_files) > 0


def _digest(image: bpy.types.Image) -> Hashable | None:
    """Return what tells the pixels of a packed image from all others, None if nothing does."""
    if image.is_dirty or image.source == "GENERATED" or not image.packed_files:
        return None
    found = hashlib.blake2b(digest_size=16)
    for file in image.packed_files:
        found.update(file.packed_file.data)
    how = image.colorspace_settings.name, image.alpha_mode, tuple(image.size), image.is_float
    return found.digest(), working_space(), *how


def _pixels(image: bpy.types.Image) -> NDArray[np.uint8] | NDArray[np.float32] | None:
    """Return Blender's own buffer (H, W, C), the bottom row first; None if it cannot be had."""
    width, height = image.size
    if width * height * image.channels == 0 or len(image.pixels) == 0:
        return None
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(height, width, image.channels)
    if image.is_float:
        return values
    whole = np.empty(values.shape, np.uint8)
    for top in range(0, height, ROWS):
        part = values[top : top + ROWS]
        part *= 255
        whole[top : top + ROWS] = np.rint(part, out=part)
    return whole


def _path(image: bpy.types.Image, user: bpy.types.ImageUser | None, tile: int = 1001) -> str:
    """Return the absolute path of the file, or of one tile if there are several."""
    if image.source == "TILED":
        path = image.filepath
    else:
        path = image.filepath_from_user(image_user=user) if user else image.filepath_from_user()
    path = bpy.path.abspath(path, library=image.library)
    row, column = divmod(tile - 1001, 10)
    return path.replace("<UDIM>", str(tile)).replace("<UVTILE>", f"u{column + 1}_v{row + 1}")


def working_space() -> str:
    """Return the name of the file's scene-linear space; before Blender 5 it was fixed."""
    settings = getattr(bpy.data, "colorspace", None)
    return settings.working_space if settings is not None else _REC709


@functools.cache
def configuration() -> str:
    """Return the OpenColorIO configuration that Blender uses."""
    override = os.environ.get("OCIO") or os.environ.get("BLENDER_OCIO")
    if override:
        return override
    folder = bpy.utils.system_resource("DATAFILES", path="colormanagement")
    return str(Path(folder) / "config.ocio")
