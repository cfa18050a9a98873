"""light, slots -> radiance per slot.  Where paths leave what they gather; branches are summed.

A slot that splits keeps one branch and gets a new slot for each other one.  Slots of one event are
unique, parents too, so every addition is a plain indexed one.
"""

from collections.abc import Callable
from time import thread_time

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar, Vec, check
from ..film.cryptomatte import Seen
from ..film.ledger import Ledger

Spread = Callable[[Vec, int, int], None]  # of light (3, slots), from the first slot to the last


class Radiance:
    """The light of one wave: total (3, slots) [W/(sr m2)], clamped as the settings say.

    holes (slots,) is how much of the background shows, and background (3, slots) what light it
    gives to the total; book (rows, slots) are the rows of the ledger, with three to spare; each is
    None if nobody asks.  sorts_light: whether light goes to the book, too; seen: parts of slots.
    """

    def __init__(
        self,
        slots: int,
        clamp_direct: float,
        clamp_indirect: float,
        has_holes: bool,
        has_background: bool = False,
        ledger: Ledger | None = None,
        sorts_light: bool = True,
    ) -> None:
        self.total = np.zeros((3, slots), F32)
        self.holes = np.zeros(slots, F32) if has_holes else None
        self.background = np.zeros((3, slots), F32) if has_background else None
        self.book = None if ledger is None else np.zeros((ledger.size + 3, slots), F32)
        self.sorts_light = ledger is not None and ledger.sorts_light and sorts_light
        self.seen: list[Seen] = []
        self._ledger = ledger
        self._seconds = None if ledger is None else ledger.row("seconds")
        self._charged: tuple[float, Index | None] = 0.0, None
        self._roots = slots
        self._is_black = True
        self._limits = clamp_direct, clamp_indirect
        self._parents: list[Index] = []
        self._spreads: dict[int, Spread] = {}

    def twin(self, keeps_book: bool = False) -> "Radiance":
        """Return one that is empty and has the same slots, for other light of the same paths.

        It has a book for data, but not for light, if it `keeps_book`.
        """
        has = self.holes is not None, self.background is not None
        ledger = self._ledger if keeps_book else None
        twin = Radiance(self.total.shape[1], *self._limits, *has, ledger, False)
        twin._roots, twin._parents = self._roots, list(self._parents)
        return twin

    def add(
        self, light: Vec, slot: Index | None, depth: int, is_direct: NDArray[np.bool_] | None = None
    ) -> Scalar | np.float32:
        """Add light (3, n) that reached the path after `depth` bounces to slots (n,), unique.

        `is_direct` (n,) tells which is direct light where the depth does not.  Biased where a
        clamp is set: light of more than limit / 3 a channel is scaled down; returns by what.
        """
        check("radiance", light=light)
        limit: float | NDArray[np.float64] = self._limits[depth > 0]
        if is_direct is not None and self._limits[0] != self._limits[1]:
            limit = np.where(is_direct, self._limits[0], self._limits[1])
        kept = _kept(light, limit)
        light = light if np.ndim(kept) == 0 else light * kept
        if slot is None:
            self.total += light
            self._is_black = False
            return kept
        # Channel by channel: four times as fast as indexing all three at once.
        for channel, value in zip(self.total, light, strict=True):
            channel[slot] = value if self._is_black else channel.take(slot) + value
        self._is_black = False
        return kept

    def enter(
        self, row: NDArray[np.integer] | int, values: NDArray[np.float32], slot: Index | None
    ) -> None:
        """Add values (C, n) to the rows from `row`, a number or (n,), on of slots (n,), unique."""
        assert self.book is not None
        if slot is None:
            slot = np.arange(values.shape[1])
        for channel, value in enumerate(values):
            self.book[row + channel, slot] += value

    @property
    def is_timed(self) -> bool:
        """Whether slots are charged with the time they take."""
        return self._seconds is not None

    def charge(self, slot: Index | None) -> None:
        """Charge the slots of the last call with the time since then; those `slot` are next.

        All paths of a wave take the same time, as far as anybody can tell.
        """
        assert self.book is not None and self._seconds is not None
        now = thread_time()
        began, before = self._charged
        if before is not None and before.size:
            self.book[self._seconds, before] += F32((now - began) / before.size)
        self._charged = now, slot

    def add_hole(self, depth: Scalar | np.float32, slot: Index) -> None:
        """Let the background show through slots (n,), unique, by so much."""
        assert self.holes is not None
        self.holes[slot] += depth

    def add_background(self, light: Vec, slot: Index) -> None:
        """Tell that this light (3, n) of slots (n,), unique, is that of the background."""
        assert self.background is not None
        self.background[:, slot] += light * _kept(light, self._limits[0])

    def branch(self, parent: Index, spread: Spread | None = None) -> Index:
        """Return new slots, one for each of the slots `parent` (n,).

        `spread` shares out their light at the end; None adds it to that of the parents.
        """
        first = self.total.shape[1]
        if spread is not None:
            self._spreads[len(self._parents)] = spread
        self._parents.append(parent)
        self.total = np.concatenate([self.total, np.zeros((3, parent.size), F32)], axis=1)
        if self.holes is not None:
            self.holes = np.concatenate([self.holes, np.zeros(parent.size, F32)])
        if self.background is not None:
            none = np.zeros((3, parent.size), F32)
            self.background = np.concatenate([self.background, none], axis=1)
        if self.book is not None:
            blank = np.zeros((len(self.book), parent.size), F32)
            self.book = np.concatenate([self.book, blank], axis=1)
        return np.arange(first, first + parent.size)

    def fold(self) -> tuple[Vec, Scalar | None, Vec | None]:
        """Return total, holes and background of the first slots, with all their branches.

        The book and what was seen are then of the first slots, too.
        """
        end = self.total.shape[1]
        for number, parent in reversed(list(enumerate(self._parents))):
            start = end - parent.size
            if number in self._spreads:
                self._spreads[number](self.total, start, end)
                self.total[:, start:end] = 0
            for array in (self.total, self.holes, self.background, self.book):
                if array is not None:
                    array[..., parent] += array[..., start:end]
            end = start
        if self.book is not None:
            self.book = self.book[:-3, : self._roots]
            self._trace_back()
        holes = None if self.holes is None else self.holes[: self._roots]
        background = None if self.background is None else self.background[:, : self._roots]
        return self.total[:, : self._roots], holes, background

    def _trace_back(self) -> None:
        """Make what was seen of branches that of the slots they come from."""
        root = np.arange(self.total.shape[1])
        start = self.total.shape[1] - sum(parent.size for parent in self._parents)
        for parent in self._parents:
            root[start : start + parent.size] = root.take(parent)
            start += parent.size
        self.seen = [Seen(root.take(each.slot), each.owner, each.weight) for each in self.seen]


def _kept(light: Vec, limit: float | NDArray[np.float64]) -> Scalar | np.float32:
    """Return what of light (3, n) a limit of the sum of its channels leaves, (n,) or 1."""
    if not isinstance(limit, np.ndarray) and not limit:
        return F32(1)
    brightness = np.abs(light).sum(axis=0)
    bound = np.where(limit, limit, np.inf).astype(F32)
    kept: Scalar = np.minimum(bound / np.maximum(brightness, F32(1e-30)), F32(1))
    return kept


def weigh(light: Vec, throughput: Vec | None) -> Vec:
    """Return light (3, n) times what of it reaches the viewer; None is all of it."""
    return light if throughput is None else light * throughput
