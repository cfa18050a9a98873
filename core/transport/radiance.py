"""light, slots -> radiance per slot.  Where paths leave what they gather; branches are summed.

A slot that splits keeps one branch and gets a new slot for each other one.  Slots of one event are
unique, parents too, so every addition is a plain indexed one.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar, Vec, check


class Radiance:
    """The light of one wave: total (3, slots) [W/(sr m2)], clamped as the settings say.

    holes (slots,) is how much of the background shows, and background (3, slots) what light it
    gives to the total; each is None if nobody asks.
    """

    def __init__(
        self,
        slots: int,
        clamp_direct: float,
        clamp_indirect: float,
        has_holes: bool,
        has_background: bool = False,
    ) -> None:
        self.total = np.zeros((3, slots), F32)
        self.holes = np.zeros(slots, F32) if has_holes else None
        self.background = np.zeros((3, slots), F32) if has_background else None
        self._roots = slots
        self._is_black = True
        self._limits = clamp_direct, clamp_indirect
        self._parents: list[Index] = []

    def twin(self) -> "Radiance":
        """Return one that is empty and has the same slots, for other light of the same paths."""
        has = self.holes is not None, self.background is not None
        twin = Radiance(self.total.shape[1], *self._limits, *has)
        twin._roots, twin._parents = self._roots, list(self._parents)
        return twin

    def add(
        self, light: Vec, slot: Index | None, depth: int, is_direct: NDArray[np.bool_] | None = None
    ) -> None:
        """Add light (3, n) that reached the path after `depth` bounces to slots (n,), unique.

        `is_direct` (n,) tells which is direct light where the depth does not.  Biased where a
        clamp is set: light of more than limit / 3 a channel is scaled down.
        """
        check("radiance", light=light)
        limit: float | NDArray[np.float64] = self._limits[depth > 0]
        if is_direct is not None and self._limits[0] != self._limits[1]:
            limit = np.where(is_direct, self._limits[0], self._limits[1])
        light = _clamped(light, limit)
        if slot is None:
            self.total += light
            self._is_black = False
            return
        # Channel by channel: four times as fast as indexing all three at once.
        for channel, value in zip(self.total, light, strict=True):
            channel[slot] = value if self._is_black else channel.take(slot) + value
        self._is_black = False

    def add_hole(self, depth: Scalar | np.float32, slot: Index) -> None:
        """Let the background show through slots (n,), unique, by so much."""
        assert self.holes is not None
        self.holes[slot] += depth

    def add_background(self, light: Vec, slot: Index) -> None:
        """Tell that this light (3, n) of slots (n,), unique, is that of the background."""
        assert self.background is not None
        self.background[:, slot] += _clamped(light, self._limits[0])

    def branch(self, parent: Index) -> Index:
        """Return new slots, one for each of the slots `parent` (n,)."""
        first = self.total.shape[1]
        self._parents.append(parent)
        self.total = np.concatenate([self.total, np.zeros((3, parent.size), F32)], axis=1)
        if self.holes is not None:
            self.holes = np.concatenate([self.holes, np.zeros(parent.size, F32)])
        if self.background is not None:
            none = np.zeros((3, parent.size), F32)
            self.background = np.concatenate([self.background, none], axis=1)
        return np.arange(first, first + parent.size)

    def fold(self) -> tuple[Vec, Scalar | None, Vec | None]:
        """Return total, holes and background of the first slots, with all their branches."""
        end = self.total.shape[1]
        for parent in reversed(self._parents):
            start = end - parent.size
            for array in (self.total, self.holes, self.background):
                if array is not None:
                    array[..., parent] += array[..., start:end]
            end = start
        holes = None if self.holes is None else self.holes[: self._roots]
        background = None if self.background is None else self.background[:, : self._roots]
        return self.total[:, : self._roots], holes, background


def _clamped(light: Vec, limit: float | NDArray[np.float64]) -> Vec:
    if not np.any(limit):
        return light
    brightness = np.abs(light).sum(axis=0)
    bound = np.where(limit, limit, np.inf).astype(F32)
    return light * np.minimum(bound / np.maximum(brightness, F32(1e-30)), F32(1))


def weigh(light: Vec, throughput: Vec | None) -> Vec:
    """Return light (3, n) times what of it reaches the viewer; None is all of it."""
    return light if throughput is None else light * throughput
