"""light, slots -> radiance per slot.  Where paths leave what they gather; branches are summed.

A slot that splits keeps one branch and gets a new slot for each other one.  Slots of one event are
unique, parents too, so every addition is a plain indexed one.
"""

import numpy as np

from ..arrays import F32, Index, Vec, check


class Radiance:
    """The light of one wave: total (3, slots) [W/(sr m2)], clamped as the settings say."""

    def __init__(self, slots: int, clamp_direct: float, clamp_indirect: float) -> None:
        self.total = np.zeros((3, slots), F32)
        self._roots = slots
        self._is_black = True
        self._limits = clamp_direct, clamp_indirect
        self._parents: list[Index] = []

    def add(self, light: Vec, slot: Index | None, bounce: int) -> None:
        """Add light (3, n) that reached the path after `bounce` bounces to slots (n,), unique.

        Biased where a clamp is set: light of more than limit / 3 a channel is scaled down.
        """
        check("radiance", light=light)
        limit = self._limits[bounce > 0]
        if limit > 0:
            brightness = np.abs(light).sum(axis=0)
            light = light * (F32(limit) / np.maximum(brightness, F32(limit)))
        if slot is None:
            self.total += light
            self._is_black = False
            return
        # Channel by channel: four times as fast as indexing all three at once.
        for channel, value in zip(self.total, light, strict=True):
            channel[slot] = value if self._is_black else channel.take(slot) + value
        self._is_black = False

    def branch(self, parent: Index) -> Index:
        """Return new slots, one for each of the slots `parent` (n,)."""
        first = self.total.shape[1]
        self._parents.append(parent)
        self.total = np.concatenate([self.total, np.zeros((3, parent.size), F32)], axis=1)
        return np.arange(first, first + parent.size)

    def fold(self) -> Vec:
        """Return the radiance (3, slots) of the first slots, with all their branches."""
        end = self.total.shape[1]
        for parent in reversed(self._parents):
            start = end - parent.size
            self.total[:, parent] += self.total[:, start:end]
            end = start
        return self.total[:, : self._roots]


def weigh(light: Vec, throughput: Vec | None) -> Vec:
    """Return light (3, n) times what of it reaches the viewer; None is all of it."""
    return light if throughput is None else light * throughput
