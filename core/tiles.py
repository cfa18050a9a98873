"""pixels, sample -> Tiles.  Which pixel samples of a wave re-use each other's paths.

Tiles of neighbouring pixels see nearly the same, so what scattered rays of one have found is of
use to all of them.  From sample to sample the tiles lie elsewhere: no edge of theirs is seen.
"""

from dataclasses import dataclass

import numpy as np

from .arrays import Index, Scalar

WIDTH, HEIGHT = 4, 2
SIZE = WIDTH * HEIGHT
SHIFTS = ((0, 0), (2, 1), (1, 0), (3, 1), (0, 1), (2, 0), (1, 1), (3, 0))  # of samples, in turn


@dataclass(frozen=True, eq=False)
class Tiles:
    """The tiles of a wave: members (SIZE, T), the slots in them, -1 where there is none.

    place (slots,): where each slot stands in `members`, row by row, -1 outside of all tiles.
    """

    members: Index
    place: Index

    @property
    def count(self) -> int:
        """The number of tiles."""
        return self.members.shape[1]


class Tiling:
    """The tiles of pixels at raster positions x, y (n,), sample by sample."""

    def __init__(self, x: Scalar, y: Scalar, shifts: bool = True) -> None:
        self._x, self._y = x.astype(np.intp), y.astype(np.intp)
        self._shifts = SHIFTS if shifts else SHIFTS[:1]
        self._members: dict[tuple[int, int], Index] = {}

    def tiles(self, first: int, samples: int) -> Tiles:
        """Return the tiles of `samples` samples from `first`, whose slots stand in a row."""
        pixels = self._x.size
        each = []
        for sample in range(samples):
            members = self._of(self._shifts[(first + sample) % len(self._shifts)])
            each.append(np.where(members >= 0, members + sample * pixels, -1))
        members = each[0] if samples == 1 else np.concatenate(each, axis=1)
        place = np.full(samples * pixels, -1)
        there = np.flatnonzero(members.ravel() >= 0)
        place[members.ravel().take(there)] = there
        return Tiles(members, place)

    def _of(self, shift: tuple[int, int]) -> Index:
        """Return which pixels (SIZE, T) are in tiles shifted so, -1 where there is none."""
        found = self._members.get(shift)
        if found is not None:
            return found
        x, y = self._x + shift[0], self._y + shift[1]
        column, row = x // WIDTH, y // HEIGHT
        column -= column.min(initial=0)
        row -= row.min(initial=0)
        across = int(column.max(initial=0)) + 1
        members = np.full((SIZE, across * (int(row.max(initial=0)) + 1)), -1)
        members[x % WIDTH + y % HEIGHT * WIDTH, row * across + column] = np.arange(x.size)
        some = np.flatnonzero(np.count_nonzero(members >= 0, axis=0) > 1)
        if some.size < members.shape[1]:
            members = members.take(some, axis=1)
        self._members[shift] = members
        return members
