"""Surfaces -> Surfaces.  Images that are looked up together are fetched together.

Lookups of images of one size at the same places, a material's set of maps, become one fetch from
a `Sheet`.  Which set a material has is a constant: so materials that differ in their images only
share a program.  Pictures stay the same to the last bit.
"""

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from ..images import Image
from ..images.lookup import decode_srgb
from ..images.sheet import Sheet
from .graph import Library
from .nodes.image import mixed, mixed_grey, taps_at
from .surface import Surface
from .values import FLOAT, SEVERAL, Array, Value, constant, rewritten, walk

Layout = tuple[Any, ...]  # size, number format, channels of each image
Part = tuple[Sheet, int, int]  # of a lookup: the sheet, the set on it, its first channel


def on_sheets(surfaces: Sequence[Surface], library: Library) -> list[Surface]:
    """Return surfaces with the lookups of their images joined, as far as the library has room."""
    graphs = [_groups(surface) for surface in surfaces]
    layouts: dict[Layout, dict[Hashable, tuple[Image, ...]]] = {}
    for groups in graphs:
        for lookups in groups:
            images = _images(lookups)
            layouts.setdefault(_layout(lookups), {})[_key(images)] = images
    sheets = {layout: _sheet(layout, sets, library) for layout, sets in layouts.items()}
    places = {
        layout: {key: place for place, key in enumerate(sets)} for layout, sets in layouts.items()
    }

    made = []
    for surface, groups in zip(surfaces, graphs, strict=True):
        joined: dict[int, Part] = {}
        for lookups in groups:
            layout = _layout(lookups)
            sheet, first = sheets[layout], 0
            if sheet is None:
                continue
            number = places[layout][_key(_images(lookups))]
            for lookup in lookups:
                joined[id(lookup)] = sheet, number, first
                first += _channels(lookup)
        made.append(_replaced(surface, joined) if joined else surface)
    return made


def keep_used(surfaces: Sequence[Surface], library: Library) -> None:
    """Let a library forget sheets that surfaces do not use; make those that they do."""
    values = (part for surface in surfaces for part in surface.outputs() if part is not None)
    used = {item.static[0] for item in walk(values) if item.function is _fetch}
    library.keep_sheets(used)


def _groups(surface: Surface) -> list[list[Value]]:
    """Return lookups of images that take the same texels."""
    found: dict[tuple[int, Any], list[Value]] = {}
    for item in walk(part for part in surface.outputs() if part is not None):
        if item.function not in (mixed, mixed_grey):
            continue
        taps, image = item.args[0], item.static[0]
        if taps.function is taps_at and taps.static[-1] != "CLIP":
            found.setdefault((id(taps), image.dtype), []).append(item)
    return list(found.values())


def _images(lookups: list[Value]) -> tuple[Image, ...]:
    return tuple(lookup.static[0] for lookup in lookups)


def _key(images: tuple[Image, ...]) -> Hashable:
    return tuple(id(image.texels) for image in images)


def _channels(lookup: Value) -> int:
    """Return how many channels of an image are read: alpha only where somebody asks for it."""
    if lookup.function is mixed_grey:
        return 1
    return 4 if lookup.static[1] else 3


def _layout(lookups: list[Value]) -> Layout:
    image = lookups[0].static[0]
    return image.width, image.height, image.dtype, *map(_channels, lookups)


def _sheet(
    layout: Layout, sets: dict[Hashable, tuple[Image, ...]], library: Library
) -> Sheet | None:
    """Return a sheet of all sets of a layout, None if it has no room or no use."""
    if len(sets) == 1 and len(layout) == 4:
        return None
    return library.sheet((layout, *sets), lambda: Sheet(list(sets.values()), layout[3:]))


def _replaced(surface: Surface, joined: dict[int, Part]) -> Surface:
    """Return a surface whose lookups take their parts, by id, of what is fetched together."""
    fetched: dict[tuple[int, int], Value] = {}

    def change(item: Value, made: Value) -> Value:
        if id(item) not in joined:
            return made
        (sheet, number, first), (taps,) = joined[id(item)], made.args
        texels = Value(SEVERAL, None, _fetch, (taps, constant(float(number))), (sheet,))
        return _part_of(item, fetched.setdefault((id(taps), id(sheet)), texels), first)

    outputs = [part for part in surface.outputs() if part is not None]
    return surface.swapped(rewritten(outputs, change))


def _part_of(lookup: Value, texels: Value, first: int) -> Value:
    """Return what stands for a lookup, from channel `first` of the texels on."""
    image = lookup.static[0]
    if lookup.function is mixed_grey:
        return Value(FLOAT, None, _grey, (texels,), (first, image.is_srgb))
    straight = lookup.static[1] and image.has_alpha and image.can_unassociate
    static = first, _channels(lookup), image.is_srgb, straight
    return Value(SEVERAL, None, _colour, (texels,), static)


def _fetch(taps: Any, number: Array, sheet: Sheet) -> Array:
    return sheet.fetch(taps, number)


def _grey(texels: Array, row: int, is_srgb: bool) -> Array:
    return decode_srgb(texels[row]) if is_srgb else texels[row]


def _colour(texels: Array, first: int, count: int, is_srgb: bool, is_straight: bool) -> Array:
    """Return colour, and alpha if there is one, (3, n) or (4, n)."""
    colour = texels[first : first + count]
    if is_straight:
        alpha = colour[3]
        straight = colour[:3] / np.where(alpha == 0, np.float32(1), alpha)
        colour = np.concatenate([straight, alpha[None]])
    if is_srgb:
        decoded = decode_srgb(colour[:3])
        colour = decoded if count == 3 else np.concatenate([decoded, colour[3:]])
    return colour
