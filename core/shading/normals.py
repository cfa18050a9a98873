"""values -> Values.  Normals that materials bend: made unit, made valid, bumped by a height.

A bump needs its height at two points beside each hit.  As in Cycles, the graph that feeds it is
there three times: once as it is, and twice with all that is read of the hit read a little beside.
Source: Mikkelsen 2010, "Bump Mapping Unparametrized Surfaces on the GPU".
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import F32, Vec, cross, dot, normalize
from ..geometry.silhouette import bent_normals
from .context import Context
from .values import FLOAT, VECTOR, Array, Value, read, rewritten


def unit_normal(context: Context, normal: Array) -> Vec:
    """Return unit vectors (3, n) along vectors of any length; the shading normal for zero."""
    normal = normalize(np.array(np.broadcast_to(normal, (3, context.size)), F32))
    lost = ~(dot(normal, normal) > F32(0.5))
    return np.where(lost, context.normal, normal) if lost.any() else normal


def _valid(context: Context, normal: Array) -> Vec:
    return bent_normals(context.geometric, normal, context.wo)


def _cosine_at(context: Context, normal: Array) -> Array:
    return np.maximum(dot(normal, context.wo), F32(0))


def valid(normal: Value) -> Value:
    """Return unit normals bent where a mirrored ray would enter the surface."""
    return read(_valid, normal, kind=VECTOR)


def cosine_at(normal: Value) -> Value:
    """Return the cosine of the viewer's direction at unit normals, at least 0."""
    return read(_cosine_at, normal, kind=FLOAT)


OF_VIEWER = _valid, _cosine_at  # steps that depend on the viewer's direction


# --- Bump ---------------------------------------------------------------------------------------


def bump(
    height: Value,
    strength: Value,
    distance: Value,
    normal: Value,
    width: float,
    is_inverted: bool = False,
) -> Value:
    """Return unit normals bent by a height [m / distance].

    `width` is how far beside the point the height is looked at, in pixels; `normal` unit.
    """
    if height.is_constant:
        return normal
    beside = [beside_of(height, axis, width) for axis in (0, 1)]
    static = (F32(width), F32(-1 if is_inverted else 1))
    return read(_bumped, height, *beside, strength, distance, normal, kind=VECTOR, static=static)


def bump_undisplaced(height: Value, normal: Value, width: float, at_rest: bool = True) -> Value:
    """Return unit normals that a height [m] bends, of a surface that is displaced as well.

    All is looked at where the surface was, but for normals if not `at_rest`; the slope is taken in
    the space of the object (Cycles).
    """
    if height.is_constant:
        return normal
    heights = (height, *(beside_of(height, axis, width) for axis in (0, 1)))
    heights = tuple(undisplaced_of(height, at_rest) for height in heights)
    normal = undisplaced_of(normal, at_rest)
    return read(bumped_in_object, *heights, normal, kind=VECTOR, static=(F32(width),))


def _bumped(
    context: Context,
    middle: Array,
    along: Array,
    across: Array,
    strength: Array,
    distance: Array,
    normal: Array,
    width: np.float32,
    sign: np.float32,
) -> Vec:
    # The slope of the height in the plane of the normal
    step = width * context.pixel
    x, y = context.sideways
    across_x, across_y = cross(y, normal), cross(normal, x)
    area = dot(x, across_x)
    slope = across_x * ((along - middle) / step)
    slope += across_y * ((across - middle) / step)

    # The normal of the raised surface, and as much of it as is wanted
    bent = normal * np.abs(area)
    bent -= slope * (distance * sign * np.sign(area))
    normalize(bent)
    strength = np.maximum(strength, F32(0))
    bent = np.where(dot(bent, bent) > F32(0.5), bent, normal)
    mixed = normalize(bent * strength + normal * (F32(1) - strength))
    return np.where(dot(mixed, mixed) > F32(0.5), mixed, normal)


def bumped_in_object(
    context: Context, middle: Array, along: Array, across: Array, normal: Array, width: np.float32
) -> Vec:
    """Return unit normals (3, n) of heights where the surface was, in the middle and beside."""
    # Two ways on the surface as it was, and its normal, in the space of the object
    x, y = (context.into_object(context.rest_way(axis), "VECTOR") for axis in (0, 1))
    n = context.into_object(normal, "NORMAL")

    # The normal of the raised surface
    across_x, across_y = cross(y, n), cross(n, x)
    area = dot(x, across_x)
    slope = across_x * (along - middle)
    slope += across_y * (across - middle)
    bent: Vec = (n * (np.abs(area) * width)).astype(F32, copy=False)
    bent -= slope * np.sign(area)
    bent = normalize(context.out_of_object(normalize(bent), "NORMAL"))
    return np.where(dot(bent, bent) > F32(0.5), bent, normal)


def beside_of(output: Value, axis: int, width: float) -> Value:
    """Return a value as it is `width` pixels beside the hit, along one of two axes."""
    return _looked_at(output, beside, (axis, F32(width)))


def undisplaced_of(output: Value, at_rest: bool = True) -> Value:
    """Return a value as it is where the surface was before it was displaced.

    at_rest: with the normals that it had.
    """
    return _looked_at(output, undisplaced, (at_rest,))


def _looked_at(output: Value, elsewhere: Callable[..., Any], where: tuple[Any, ...]) -> Value:
    """Return a value whose steps read the context through a function, `elsewhere`."""

    def change(item: Value, made: Value) -> Value:
        if not item.reads or item.function is elsewhere:
            return made
        static = *where, item.function, item.static
        return Value(item.kind, None, elsewhere, made.args, static, reads=True)

    return rewritten([output], change)(output)


def beside(context: Context, *args: Any) -> Any:
    """Return what a step reads a little beside the hit: args, axis, width, function, static."""
    *values, axis, width, function, static = args
    return function(context.beside(axis, width), *values, *static)


def undisplaced(context: Context, *args: Any) -> Any:
    """Return what a step reads where the surface was: args, at_rest, function, static."""
    *values, at_rest, function, static = args
    return function(context.undisplaced if at_rest else context.moved_back, *values, *static)


def reader(item: Value) -> tuple[Callable[..., Any] | None, tuple[Any, ...]]:
    """Return what a step reads the context with, and its static arguments, also of those beside."""
    function, static = item.function, item.static
    while function in (beside, undisplaced):
        function, static = static[-2:]
    return function, static
