"""lights -> groups of one kind.  Lights that share a formula, as arrays of their numbers."""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Ids, Index, Scalar, Vec, gather_rows
from ..geometry.motion import Tracks
from .kind import Kind, Rows


@dataclass(frozen=True, eq=False)
class Group:
    """Lights of one kind: `count` of them, numbered from `first`.

    rows (P, L) and colour (3, L) float32, seen_by (L,) mask bits and max_bounces (L,) int32.
    Paths with more than `max_bounces` bounces take no samples of a light; met by chance, it
    shines on them all the same (Cycles).  receivers and blockers (L,) uint64, masks of the light
    linking sets; casts_shadow, and is_met: rays may run into it, (L,) bool.

    motion: the rows of each at any time, None if all rest.
    """

    kind: Kind
    first: int
    rows: Rows
    colour: Vec
    seen_by: Ids
    max_bounces: Ids
    receivers: NDArray[np.uint64]
    blockers: NDArray[np.uint64]
    casts_shadow: NDArray[np.bool_]
    is_met: NDArray[np.bool_]
    motion: Tracks | None = None

    @property
    def count(self) -> int:
        """Return the number of lights."""
        return len(self.seen_by)

    def only(self, local: int, time: Scalar | None = None) -> "Group":
        """Return the light number `local`, counted from `first`, as views of what this holds.

        If it moves, with its rows (P, N) at times (N,).
        """
        one = slice(local, local + 1)
        rows, *rest = (each[..., one] for each in self._arrays())
        if self.motion is not None and time is not None and self.motion.steps[local]:
            rows = self.motion.at(np.full(time.size, local, np.int32), time)
        return Group(self.kind, self.first + local, rows, *rest)

    def take(self, index: Index | Ids, time: Scalar | None = None) -> "Group":
        """Return the lights of `index`, counted from `first`, one for each of N points.

        Those that move at times (N,).  What all lights have in common stays (1,).
        """
        table = gather_rows(self._table, index)
        rows, colour = table[: len(self.rows)], table[len(self.rows) :]
        rest = [each if each.size == 1 else each.take(index) for each in self._told_apart]
        if self.motion is not None and time is not None:
            some = np.flatnonzero(self.motion.steps.take(index))
            if some.size:
                rows[:, some] = self.motion.at(index.take(some).astype(np.int32), time.take(some))
        return Group(self.kind, self.first, rows, colour, *rest)

    @cached_property
    def _table(self) -> NDArray[np.float32]:
        """Rows and colours (L, P + 3): what is asked of a light stands together."""
        return np.ascontiguousarray(np.concatenate([self.rows, self.colour]).T)

    @cached_property
    def _told_apart(self) -> list[Any]:
        """What else there is of each light (L,); (1,) if it is the same of all."""
        rest = self._arrays()[2:]
        return [each[:1] if (each == each[0]).all() else each for each in rest]

    def _arrays(self) -> list[Any]:
        return [getattr(self, item.name) for item in fields(self)[2:-1]]
