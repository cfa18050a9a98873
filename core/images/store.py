"""image sources -> images.  Each file is read once, and smaller if all of them would be too large.

Images that differ only in their colour space share their texels where these stay as they are in
the file.  How large all will be is estimated from their headers; then the largest are halved, as
Simplify does.
"""

import os
from collections.abc import Callable, Hashable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from ..scene import Note
from . import MAGENTA, Image, ImageSource, Tiles, image_size
from .files import load_image, read_header
from .levels import WORTHWHILE, Levels
from .shelf import Shelf, Stamp, stamp_of

READERS = 8  # files that are read at the same time, at most: each takes its memory twice

Header = tuple[int, int, int]  # width, height, bytes of a texel


class Store:
    """The images of a scene, by what they are made from; `side` limits both sides, 0 does not.

    spare: what levels of images may take [bytes], None: there shall be none; shelf: what was read
    before, if that is kept.
    """

    def __init__(
        self, side: int = 0, spare: float | None = None, shelf: Shelf | None = None
    ) -> None:
        self.side, self.spare, self.shelf = side, spare, shelf
        self._known: dict[Hashable, Any] = {}
        self._stamps: dict[str, Stamp | None] = {}
        self._notes: dict[Hashable, list[Note]] = {}  # of images that nobody has asked for yet
        self._levels: dict[tuple[int, bool], Levels] = {}

    @property
    def has_levels(self) -> bool:
        """Whether images may have levels."""
        return self.spare is not None

    def get(self, source: ImageSource, notes: list[Note]) -> Image | Tiles:
        """Return the image of a source, which is read if it is not known."""
        for part in source.parts:
            notes += self._notes.pop(part.key, ())
        return self._keep(source.key, lambda: load_image(source, notes, self.side, self._read))

    def read(self, sources: Iterable[ImageSource]) -> None:
        """Read the files of sources, several at the same time, before they are asked for."""
        files: dict[str, dict[Hashable, ImageSource]] = {}
        for source in sources:
            for part in source.parts:
                if part.pixels is None and part.path:
                    files.setdefault(part.path, {})[part.key] = part

        # Sources of one file share texels: they are for one thread
        def read(parts: dict[Hashable, ImageSource]) -> None:
            for key, part in parts.items():
                notes: list[Note] = []
                self.get(part, notes)
                self._notes[key] = notes

        if len(files) > 1:
            with ThreadPoolExecutor(min(READERS, os.cpu_count() or 1)) as pool:
                list(pool.map(read, files.values()))

    def _keep(self, key: Hashable, make: Callable[[], Any]) -> Any:
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]

    def _read(self, key: tuple[Any, ...], make: Callable[[], Image]) -> Image:
        """Return what is made of the file whose path, or digest, begins the key."""
        return self._keep(key, lambda: self._from_shelf(key, make))

    def _from_shelf(self, key: tuple[Any, ...], make: Callable[[], Image]) -> Image:
        if self.shelf is None:
            return make()
        path, stamp = key[0], None
        if isinstance(path, str):
            stamp = self._stamps.setdefault(path, stamp_of(path))
            if stamp is None:
                return make()
        found: Image | None = self.shelf.find((key, stamp))
        if found is None:
            found = make()
            if found is not MAGENTA:
                self.shelf.put((key, stamp), found)
        return found

    def levels_of(self, image: Image) -> Levels | None:
        """Return the levels of an image; None if they would not help, or not fit."""
        key = id(image.texels), image.is_srgb
        if key not in self._levels:
            made = Levels(image)
            is_small = min(image.width, image.height) < WORTHWHILE
            if self.spare is None or is_small or not 0 < made.memory <= self.spare:
                return None
            self.spare -= made.memory
            self._levels[key] = made
        return self._levels[key]

    @property
    def images(self) -> list[Image]:
        """All images that were found, those of tiles too, once each."""
        found: list[Image] = []
        for item in self._known.values():
            if isinstance(item, Tiles):
                found += [image for _, image in item.images]
            elif isinstance(item, Image):
                found.append(item)
        each = {id(image.texels): image for image in found if image is not MAGENTA}
        return list(each.values())

    @property
    def memory(self) -> int:
        """What the texels of all images take, with their levels [bytes]."""
        levels = sum(each.memory for each in self._levels.values())
        return levels + sum(image.memory for image in self.images)


class Asked(Store):
    """Reads nothing, and knows what it was asked for."""

    def __init__(self) -> None:
        super().__init__()
        self.sources: list[ImageSource] = []

    def get(self, source: ImageSource, notes: list[Note]) -> Image | Tiles:
        """Return what is shown in place of images that are missing."""
        self.sources.append(source)
        return MAGENTA


def fit(sources: Iterable[ImageSource], memory: float, notes: list[Note]) -> tuple[int, float]:
    """Return which sides images may have so that all take at most `memory`, and the rest [bytes].

    Sides of 0 are any.  Images that will be smaller for it are named.
    """
    each = {part.file_key: part for source in sources for part in source.parts}
    headers = {key: header for key, part in each.items() if (header := _header(part))}
    sizes = [image_size(width, height, 0) for width, height, _ in headers.values()]
    side = max((max(size) for size in sizes), default=0)
    if _total(headers.values(), 0) <= memory:
        return 0, memory - _total(headers.values(), 0)
    while side > 1 and _total(headers.values(), side) > memory:
        side //= 2
    for key, (width, height, _) in headers.items():
        if max(width, height) > side:
            smaller = image_size(width, height, side)
            notes.append(
                Note(
                    each[key].name,
                    f"it is read as {smaller[0]} x {smaller[1]} instead of {width} x {height} "
                    f"pixels: images may take {memory / 2**30:.3g} GB (Texture Memory)",
                )
            )
    return side, memory - _total(headers.values(), side)


def _header(source: ImageSource) -> Header | None:
    if source.pixels is not None:
        height, width = source.pixels.shape[:2]
        return width, height, 4 * source.pixels.dtype.itemsize
    return read_header(source.path) if source.path else None


def _total(headers: Iterable[Header], side: int) -> float:
    sizes = ((*image_size(width, height, side), texel) for width, height, texel in headers)
    return float(sum(np.prod(size, dtype=float) for size in sizes))
