"""Surface -> Surface.  What several nodes or lobes compute alike is computed once."""

from collections.abc import Hashable

from .surface import Surface
from .values import Value, walk


def shared(surface: Surface) -> Surface:
    """Return a surface whose steps are each there once.

    Constants stay apart: they may be the same in one material and differ in another, and the two
    would not share a program any more.
    """
    alike: dict[Hashable, Value] = {}
    copies: dict[int, Value] = {}
    for item in walk(part for part in surface.outputs() if part is not None):
        if item.constant is not None:
            copies[id(item)] = item
            continue
        args = tuple(copies[id(arg)] for arg in item.args)
        if any(a is not b for a, b in zip(args, item.args, strict=True)):
            made = Value(item.kind, None, item.function, args, item.static, item.reads)
        else:
            made = item
        key = item.kind, item.function, item.static, item.reads, tuple(map(id, args))
        copies[id(item)] = alike.setdefault(key, made)
    return surface.swapped(lambda value: copies[id(value)])
