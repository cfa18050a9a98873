"""plan, film -> batches.  Which pixels get which samples, in which order.

Samples go over the picture in chunks, and these over its blocks of neighbouring pixels.  With
adaptive sampling that is done in rounds, each of which doubles the samples of the pixels that go
on: they are decided by the sums of the film, at fixed counts and by nothing else, so that the
picture does not depend on threads.  Blocks of a round hold the pixels that go on, and no others.
"""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .arrays import F32, Index
from .film.adaptive import Judge
from .film.cryptomatte import Keys
from .film.film import Film
from .plan import Plan
from .sampling.draws import Numbers, pixel_keys
from .sampling.patterns import SEQUENCES
from .statistics import Tally

CHUNK = 16  # samples that share tables of random numbers; if few pixels are left, up to
LARGEST_CHUNK = 256  # of them
SHARE = 4  # of these at least in a batch, so that no thread is left alone for long at the end
MANY, LONG = 8, 1 << 19  # blocks of a large picture; its batches may be of so many pixel samples
EARLY = (1, 4, 8)  # samples at which the first chunks end: there is soon something to see


@dataclass(frozen=True, eq=False)
class Block:
    """Neighbouring pixels of the rectangle: their keys and raster positions (n,)."""

    pixels: slice | Index
    key: NDArray[np.uint32]
    x: NDArray[np.float32]
    y: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Batch:
    """The pixels of a block, for the samples first..end of those of `numbers`.

    keeps: what its pixels have so far is remembered, to be compared with what comes; shifts: tiles
    of pixels that share paths lie elsewhere from sample to sample.
    """

    block: Block
    numbers: Numbers
    first: int
    end: int
    keeps: bool = False
    shifts: bool = True


@dataclass(frozen=True, eq=False)
class Sums:
    """What a batch gives: sums (C, n) of `samples` samples of n pixels.

    middles (C, n) of the film and the keys and weights of parts, if the plan asks for these.
    """

    values: NDArray[np.float32]
    samples: int
    tally: Tally
    middles: NDArray[np.float32] | None = None
    parts: tuple[Keys, NDArray[np.float64]] | None = None

    def add_to(self, film: Film, pixels: slice | Index) -> None:
        """Add to the pixels of a film."""
        film.add(pixels, self.values, self.samples)
        if self.middles is not None and film.middles is not None:
            film.middles[:, pixels] = self.middles
        if self.parts is not None and film.parts is not None:
            film.parts.add(pixels, *self.parts)


Work = Callable[[Plan, Batch, threading.Event], Sums]  # renders a batch, until it is to stop


@dataclass(frozen=True)
class Pause:
    """Comes instead of a batch: the next one is decided when all before it are merged."""


class Schedule:
    """The batches of a render, and the film that they are merged into.

    expected: pixel samples in all, as far as can be told.
    """

    def __init__(self, plan: Plan, film: Film) -> None:
        self.plan, self.film = plan, film
        self.judge = None
        if plan.adaptive is not None and film.counts.size:
            self.judge = Judge(film, plan.adaptive, plan.exposure)
        self.whole = _whole(plan)
        self.expected = float((plan.samples[1] - plan.samples[0]) * film.counts.size)

    def add(self, batch: Batch, sums: Sums) -> None:
        """Merge the sums of a batch; batches come in the order in which they began."""
        if batch.keeps:
            assert self.judge is not None
            self.judge.keep(batch.block.pixels)
        sums.add_to(self.film, batch.block.pixels)

    def batches(self) -> Iterator[Batch | Pause]:
        """Yield all batches."""
        first, end = self.plan.samples
        blocks = _cut(self.whole, self.plan.batch)
        if self.judge is None:
            yield from self._samples(blocks, first, end)
            return

        # All pixels get so many samples that there are two halves to compare, and two of the first
        count = self.judge.adaptive.first
        for stop in (count // 4, count // 2, count):
            yield from self._samples(blocks, first, stop, first > 0, stop == count)
            first = stop

        while True:
            # Decide who goes on, and what that will take
            yield Pause()
            for _ in self.judge.measure(count):
                yield Pause()  # the caller may wish to stop
            going, expected = self.judge.judge(count)
            counts = self.film.counts
            resting = int(counts.sum()) - int(counts.take(going).sum())
            self.expected = resting + min(expected, float(end * going.size))
            if not going.size:
                return

            # Those that had stopped catch up, then all go on together
            behind = counts.take(going)
            for level in np.unique(behind[behind < count]):
                late = _cut(_take(self.whole, going[behind == level]), self.plan.batch)
                while level < count:
                    yield from self._samples(late, int(level), 2 * int(level), True)
                    level *= 2
            stop = min(2 * count, end)
            blocks = _cut(_take(self.whole, going), self.plan.batch)
            yield from self._samples(blocks, count, stop, True, stop < end)
            if stop == end:
                return
            count = stop

    def _samples(
        self,
        blocks: list[Block],
        first: int,
        end: int,
        keeps: bool = False,
        pauses: bool = False,
    ) -> Iterator[Batch]:
        """Yield the batches that give samples first..end to blocks, sample by sample.

        keeps: what the pixels have before is remembered; pauses: nothing is under way after it.
        """
        plan = self.plan
        sequences = _sequences(plan.frame_width * plan.frame_height)  # a border changes no pixel
        wave = plan.batch // blocks[0].key.size if blocks else CHUNK  # samples in flight at once
        chunk = CHUNK
        most = min(wave, LARGEST_CHUNK, (end - first) // 4) if self.judge is not None else CHUNK
        while chunk < most:
            chunk *= 2
        share = min(max(wave, SHARE), chunk)
        if len(blocks) >= MANY:  # to hand a batch over takes a worker a millisecond or two
            share = min(max(share, LONG // blocks[0].key.size), chunk)
        stops = [stop for stop in EARLY if first < stop < end] if len(blocks) > 1 else []
        while first < end:
            # Chunks end at multiples of their own size: whole blocks of the sequence.
            stop = stops.pop(0) if stops else min((first // chunk + 1) * chunk, end)
            count = stop - first
            numbers = Numbers(
                plan.pattern, plan.seed, first, count, plan.total_samples, sequences, {}
            )
            if pauses and stop == end:
                share = min(max(wave, 1), chunk)  # threads shall end together
            for low in range(0, count, share):
                for block in blocks:
                    yield Batch(block, numbers, low, min(low + share, count), keeps and low == 0)
            first, keeps = stop, False


def _whole(plan: Plan) -> Block:
    """Return all pixels of the rectangle."""
    x0, y0, x1, y1 = plan.rectangle
    row, column = np.divmod(np.arange((x1 - x0) * (y1 - y0)), x1 - x0)
    row += y0
    column += x0
    key = pixel_keys(plan.seed, row * plan.frame_width + column)
    return Block(slice(0, key.size), key, column.astype(F32), row.astype(F32))


def _take(whole: Block, pixels: Index) -> Block:
    return Block(pixels, whole.key.take(pixels), whole.x.take(pixels), whole.y.take(pixels))


def _cut(block: Block, most: int) -> list[Block]:
    """Return blocks of equal size: a small one would pay the cost of calls for few slots."""
    pixels = block.key.size
    ends = np.linspace(0, pixels, -(-pixels // most) + 1).astype(int)
    parts = [slice(low, high) for low, high in pairwise(ends)]
    some = block.pixels
    return [
        Block(
            part if isinstance(some, slice) else some[part],
            block.key[part],
            block.x[part],
            block.y[part],
        )
        for part in parts
    ]


def _sequences(pixels: int) -> int:
    # A quarter as many sequences as pixels are enough to look independent; tables cost.
    return min(SEQUENCES, max(32, 1 << (pixels // 4).bit_length()))
