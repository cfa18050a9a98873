"""files -> images.  Texels that were read stay for the next picture, if their files stay the same.

A second render, and each frame of an animation, shows the same images as the one before.  So what
was read lies on a shelf, with when its file was written: what has changed is read anew.  What was
not asked for the longest goes first when all of it takes more than it may.
"""

from collections.abc import Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from numpy.typing import NDArray

from . import block_of

Stamp = tuple[int, int]  # when a file was written [ns], and how long it is [bytes]


class Kept(Protocol):
    """Something that takes memory, of its own or shared with others."""

    def blocks(self) -> dict[int, int]:
        """Return the size [bytes] of each block of memory that it holds, by its address."""


@dataclass(frozen=True, eq=False)
class Pixels:
    """Pixels (H, W, C) that are made into an image later."""

    pixels: NDArray[Any]

    def blocks(self) -> dict[int, int]:
        """Return what the block of memory takes [bytes], by its address."""
        return block_of(self.pixels)


class Shelf:
    """What is kept from one picture to the next, by what it is made from; at first nothing."""

    def __init__(self) -> None:
        self._known: dict[Hashable, Any] = {}  # the one that was asked for last is the last

    def find(self, key: Hashable) -> Any | None:
        """Return what is known by a key, None if there is nothing."""
        found = self._known.pop(key, None)
        if found is not None:
            self._known[key] = found
        return found

    def put(self, key: Hashable, made: Kept) -> None:
        """Keep something, as what was asked for last."""
        self._known.pop(key, None)
        self._known[key] = made

    def limit(self, memory: float) -> None:
        """Forget what was not asked for the longest, until the rest takes at most `memory`."""
        blocks: dict[int, int] = {}
        for key, item in reversed(list(self._known.items())):
            blocks |= item.blocks()
            if sum(blocks.values()) > memory:
                self._known.pop(key, None)

    def clear(self) -> None:
        """Forget all."""
        self._known.clear()


def stamp_of(path: str) -> Stamp | None:
    """Return what tells whether a file has changed, None if there is no such file."""
    try:
        found = Path(path).stat()
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size
