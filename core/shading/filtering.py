"""Surface -> Surface.  An image is looked up smaller where that leaves the picture as it is.

What a ray of the camera stands for is part of a pixel; what one from a matte surface stands for is
a cone, of which there are many to a hemisphere.  There the mean of an image does as well as the
image if light depends on it linearly, and on nothing else that changes from texel to texel: the
converged picture is the same, with less noise on the way.  So surfaces stay as they are that have
another texture beside it, normals, roughness or heights from an image, or colours that are curved
(Color Ramp); so do lookups that ask for single texels (Closest) or for alpha, tiles, projections,
and those at places that do not grow evenly with a UV map.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import F32
from ..geometry.attributes import DENSITY, VECTOR
from ..images.levels import Levels, LevelTaps, mix_grey_levels, mix_levels
from ..scene import PROPERTIES
from . import inputs, normals
from .attributes import attribute, footprint
from .nodes.image import mixed, mixed_grey, taps_at
from .surface import Surface
from .values import FLOAT, SEVERAL, Array, Value, constant, read, rewritten, walk

# What shaders read of the hit themselves does not change from texel to texel, but for these
_EVEN = frozenset(module.__name__ for module in (inputs, normals))
_UNEVEN = frozenset((inputs.POSITION.function, normals.beside, normals.undisplaced))

BRIGHT = F32(8)  # colours of images that may shine are tried up to here

# Places at which coordinates are tried: the axes, and others that tell if they grow evenly
_PLACES = np.array([[0, 1, 0, 3.7, -2.3, 5.1], [0, 0, 1, -1.9, 4.3, 2.9], [0] * 6], F32)


def filtered(surface: Surface) -> Surface:
    """Return a surface whose image is looked up at the level that fits what rays stand for."""
    outputs = _light_of(surface)
    order = walk(outputs)
    lookups = [item for item in order if item.function in (mixed, mixed_grey)]
    if len(lookups) != 1:
        return surface
    (lookup,) = lookups
    new = _at_levels(surface, lookup)
    if new is None or not _is_linear(surface, lookup):
        return surface
    swap = rewritten(outputs, lambda item, made: new if item is lookup else made)
    lobes = [
        replace(lobe, weight=swap(lobe.weight), importance=swap(lobe.importance))
        for lobe in surface.lobes
    ]
    emission, transparency = (
        None if part is None else swap(part) for part in (surface.emission, surface.transparency)
    )
    return replace(surface, lobes=lobes, emission=emission, transparency=transparency)


def _light_of(surface: Surface) -> list[Value]:
    """Return all that light depends on; what passes show beside it is looked up as it is."""
    parts = [surface.emission, surface.transparency, surface.holdout, surface.bent]
    for lobe in surface.lobes:
        parts += [lobe.weight, *lobe.parameters, lobe.importance, lobe.normal, lobe.tangent]
    return [part for part in parts if part is not None]


def _at_levels(surface: Surface, lookup: Value) -> Value | None:
    """Return a lookup at levels, None if there are none, or it is not known how wide rays are."""
    image, (taps,) = lookup.static[0], lookup.args
    if taps.function is not taps_at:
        return None
    (where,), (project, width, height, interpolation, extension) = taps.args, taps.static
    is_separated = lookup.function is mixed and lookup.static[1] and image.has_alpha
    if project is not None or interpolation != "Linear" or extension == "CLIP" or is_separated:
        return None
    wide = _footprint_of(where)
    levels = None if wide is None else surface.graph.library.store.levels_of(image)
    if wide is None or levels is None:
        return None
    static = (width, height), interpolation, extension
    taps = Value(SEVERAL, None, _taps, (where, wide), static)
    function = _mixed_grey if lookup.function is mixed_grey else _mixed
    return Value(lookup.kind, None, function, (taps,), (levels,))


def _taps(where: Array, wide: Array, *choices: Any) -> LevelTaps:
    return LevelTaps(where[0], where[1], wide, *choices)


def _mixed(taps: LevelTaps, levels: Levels) -> Array:
    return mix_levels(levels, taps)


def _mixed_grey(taps: LevelTaps, levels: Levels) -> Array:
    return mix_grey_levels(levels, taps)


def _footprint_of(where: Value) -> Value | None:
    """Return how wide rays are in an image at `where`, None if that is not known."""
    order = walk([where])
    leaves = [item for item in order if item.reads]
    if len(leaves) != 1 or leaves[0].function is not attribute:
        return None
    name, output = leaves[0].static[0]
    if output != VECTOR or name.startswith(tuple(PROPERTIES.values())):
        return None
    found = _evaluated(order, {id(leaves[0]): _PLACES})[id(where)]
    place = np.broadcast_to(found, _PLACES.shape)[:2].astype(np.float64)

    # Does it grow evenly?  By how much, at least?
    steps = place[:, 1:3] - place[:, :1]
    expected = place[:, :1] + steps @ _PLACES[:2]
    if not np.isfinite(place).all():
        return None
    scale = float(np.linalg.norm(steps, -2))
    if not np.allclose(expected, place, rtol=1e-3, atol=1e-3 * max(scale, 1e-3)):
        return None
    return read(footprint, constant(scale), kind=FLOAT, static=((name, DENSITY),))


def _is_linear(surface: Surface, lookup: Value) -> bool:
    """Tell whether light depends linearly on a lookup, and on nothing else that changes as fast.

    Linear is what all pairs of many colours say: in the middle between them it is the mean.
    """
    outputs = _light_of(surface)
    stand_in = Value(lookup.kind, None, lookup.function)
    swap = rewritten(outputs, lambda item, made: stand_in if item is lookup else made)
    order = walk(map(swap, outputs))
    depends = {id(stand_in)}
    for item in order:
        if any(id(arg) in depends for arg in item.args):
            depends.add(id(item))

    # What is read besides must be even, and must not know of the image
    known: dict[int, Any] = {}
    for item in order:
        if not item.reads:
            continue
        assert item.function is not None
        is_even = item.function.__module__ in _EVEN and item.function not in _UNEVEN
        if not is_even or id(item) in depends or item.kind == SEVERAL:
            return False
        number = _spread(3, 1, len(known))
        known[id(item)] = number[0] if item.kind == FLOAT else number
    linear = [lobe.weight for lobe in surface.lobes]
    linear += [part for part in (surface.emission, surface.transparency) if part is not None]
    others = [surface.holdout, surface.bent]
    for lobe in surface.lobes:
        others += [*lobe.parameters, lobe.normal, lobe.tangent]
    if any(part is not None and id(swap(part)) in depends for part in others):
        return False

    # Colours on both sides, and in the middle
    one, other = _spread(8, 256, len(known)).reshape(2, 4, -1)
    if lookup.static[0].dtype.kind != "u":
        one, other = one * BRIGHT, other * BRIGHT
    colours = np.concatenate([one, other, (one + other) * F32(0.5)], axis=1)
    known[id(stand_in)] = colours[0] if lookup.kind == FLOAT else colours
    values = _evaluated(order, known)
    for part in map(swap, linear):
        found = values[id(part)]
        if id(part) in depends:
            low, high, middle = np.split(found, 3, axis=-1)
            if not np.allclose(middle, (low + high) * 0.5, rtol=1e-4, atol=1e-5):
                return False
    return True


def _spread(rows: int, count: int, start: int) -> Array:
    """Return numbers (rows, count) between 0 and 1, by steps that no two rows share."""
    steps = np.sqrt(np.arange(2, 2 + rows) + 0.5)
    return (steps[:, None] * np.arange(1 + start, 1 + start + count) % 1).astype(F32)


def _evaluated(order: list[Value], known: dict[int, Any]) -> dict[int, Any]:
    """Return what steps make of what is known, which is among them."""
    known = dict(known)
    with np.errstate(all="ignore"):
        for item in order:
            if id(item) in known:
                continue
            if item.constant is not None:
                known[id(item)] = item.constant
            else:
                assert item.function is not None
                args = (known[id(arg)] for arg in item.args)
                known[id(item)] = item.function(*args, *item.static)
    return known
