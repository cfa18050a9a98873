"""steps of `compile_plan` -> the same, made again only if what they are made from has changed.

For the viewport, where most of a scene stays as it is from one plan to the next.  A step is known
by its name; what it is made from is compared by `==`, which for the frozen descriptions of `scene`
means the very same object.  What is compared is held, so that no new object can be taken for it.
"""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from .images.shelf import Shelf

T = TypeVar("T")


class Kept:
    """What the last plan was made of; hand the same one to each `compile_plan` of a viewport.

    It belongs to one thread; the shelf, where texels of files stay that others use, too, does not.
    """

    def __init__(self, shelf: Shelf | None = None) -> None:
        self.shelf = shelf
        self._steps: dict[str, tuple[tuple[Any, ...], Any]] = {}
        self._items: dict[str, dict[Hashable, Any]] = {}

    def step(self, name: str, made_from: tuple[Any, ...], make: Callable[[], T]) -> T:
        """Return what `make` returns, or has returned for an equal `made_from` the last time."""
        known = self._steps.get(name)
        if known is None or known[0] != made_from:
            self._steps.pop(name, None)  # before the next one is made: they may be large
            known = self._steps[name] = made_from, make()
        return known[1]

    def each(self, name: str, keys: list[Any], make: Callable[[Any], T]) -> list[T]:
        """Return `make(key)` for each key; those of the last time are not made again."""
        before = self._items.get(name, {})
        now = {key: before[key] if key in before else make(key) for key in keys}
        self._items[name] = now
        return [now[key] for key in keys]


class KeepNothing(Kept):
    """Makes each step anew, for a plan that is compiled once; but for what lies on the shelf."""

    def step(self, name: str, made_from: tuple[Any, ...], make: Callable[[], T]) -> T:
        """Return what `make` returns."""
        return make()

    def each(self, name: str, keys: list[Any], make: Callable[[Any], T]) -> list[T]:
        """Return `make(key)` for each key."""
        return [make(key) for key in keys]


KEEP_NOTHING = KeepNothing()
