"""Surface -> Surface.  What several nodes or lobes compute alike is computed once."""

from collections.abc import Hashable

from .surface import Surface
from .values import Value, rewritten


def shared(surface: Surface) -> Surface:
    """Return a surface whose steps are each there once.

    Constants stay apart: they may be the same in one material and differ in another, and the two
    would not share a program any more.
    """
    alike: dict[Hashable, Value] = {}

    def first(item: Value, made: Value) -> Value:
        if item.constant is not None:
            return item
        key = made.kind, made.function, made.static, made.reads, tuple(map(id, made.args))
        return alike.setdefault(key, made)

    outputs = [part for part in surface.outputs() if part is not None]
    return surface.swapped(rewritten(outputs, first))
