"""plan -> Picture.  Batches of pixels and samples on a pool of threads, merged in a fixed order.

A batch is a pure function of (plan, pixels, samples): the picture has the same bits whatever the
number of threads.  The calling thread merges, shows progress and may stop the render at any time.
"""

import os
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import F32, Scalar
from .film.film import Film, drop_not_finite, new_film, rows
from .pages import keep_pages, release_pages
from .plan import Plan
from .sampling.dimensions import LENS, PIXEL
from .sampling.draws import Draws, Numbers, pixel_keys
from .sampling.patterns import SEQUENCES
from .statistics import Tally, peak_memory, summary
from .transport.path import trace
from .transport.state import Paths, Rays

CHUNK = 16  # samples that share tables of random numbers
SHARE = 4  # of these at least in a batch, so that no thread is left alone for long at the end
EARLY = (1, 4, 8)  # samples at which the first chunks end: there is soon something to see
TICK = 0.05  # seconds between two looks at the caller


@dataclass(frozen=True, eq=False)
class Picture:
    """What has been rendered: a film, how many samples of how many, and the statistics."""

    film: Film
    exposure: float
    samples: int
    complete: bool
    statistics: dict[str, Any]

    def combined(self) -> NDArray[np.float32]:
        """Return (H, W, 4) float32, row 0 at the bottom, premultiplied alpha."""
        return self.film.combined(self.exposure)


@dataclass(frozen=True, eq=False)
class Progress:
    """How far a render is; `remaining` [s] is None until it can be told."""

    sample: float
    samples: int
    seconds: float
    rays: int
    _film: Film
    _exposure: float

    @property
    def fraction(self) -> float:
        """The share of the work that is done."""
        return self.sample / max(self.samples, 1)

    @property
    def remaining(self) -> float | None:
        """The seconds that the rest will take at the speed so far."""
        return self.seconds * (1 / self.fraction - 1) if self.fraction > 0 else None

    @property
    def rays_per_second(self) -> float:
        """Rays of all kinds in a second."""
        return self.rays / self.seconds if self.seconds > 0 else 0.0

    @property
    def memory(self) -> int:
        """The largest memory the process has had [bytes]."""
        return peak_memory()

    def picture(self) -> Picture:
        """Return the picture so far, without statistics."""
        return Picture(self._film, self._exposure, int(self.sample), False, {})


@dataclass(frozen=True, eq=False)
class Block:
    """Neighbouring pixels, first.. of the rectangle: their keys and raster positions (n,)."""

    first: int
    key: NDArray[np.uint32]
    x: NDArray[np.float32]
    y: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Batch:
    """The pixels of a block, for the samples first..end of those of `numbers`."""

    block: Block
    numbers: Numbers
    first: int
    end: int


def render(
    plan: Plan,
    threads: int = 0,
    on_tick: Callable[[Progress], bool | None] | None = None,
) -> Picture:
    """Sample a plan; `on_tick` is called every 50 ms on the caller's thread, True stops.

    threads = 0 uses all cores.  A stopped render keeps what it has.
    """
    start = perf_counter()
    keep_pages()
    x0, y0, x1, y1 = plan.rectangle
    film = new_film(x1 - x0, y1 - y0, plan.passes)
    pixels = film.counts.size
    work = (plan.samples[1] - plan.samples[0]) * pixels
    workers = threads or os.cpu_count() or 1
    total = Tally()
    stop = threading.Event()
    queue: deque[tuple[Batch, Future[tuple[NDArray[np.float32], int, Tally]]]] = deque()
    batches = _batches(plan)
    timed_out = False
    with ThreadPoolExecutor(workers, thread_name_prefix="penumbra") as pool:
        try:
            more = True
            while more or queue:
                # Keep every worker busy, with a little in store.
                while more and len(queue) < 2 * workers and not stop.is_set():
                    batch = next(batches, None)
                    more = batch is not None
                    if batch is not None:
                        queue.append((batch, pool.submit(_sample, plan, batch, stop)))
                if stop.is_set():
                    more = False
                if queue:
                    wait([queue[0][1]], timeout=TICK)

                # Merge in the order of submission, so that sums do not depend on scheduling.
                while queue and queue[0][1].done():
                    batch, future = queue.popleft()
                    sums, samples, tally = future.result()
                    film.add(batch.block.first, sums, samples)
                    total.add(tally)

                seconds = perf_counter() - start
                timed_out = 0 < plan.time_limit <= seconds and bool(film.counts.all())
                done = total.samples / max(pixels, 1)
                progress = Progress(
                    done,
                    plan.samples[1] - plan.samples[0],
                    seconds,
                    total.rays,
                    film,
                    plan.exposure,
                )
                if timed_out or (on_tick is not None and on_tick(progress)):
                    stop.set()
        except BaseException:
            stop.set()
            raise
    release_pages()
    seconds = perf_counter() - start
    return Picture(
        film,
        plan.exposure,
        int(film.counts.min()) if pixels else 0,
        total.samples == work or timed_out,
        summary(total, plan.prepared, pixels, seconds),
    )


def _blocks(plan: Plan) -> list[Block]:
    x0, y0, x1, y1 = plan.rectangle
    row, column = np.divmod(np.arange((x1 - x0) * (y1 - y0)), x1 - x0)
    row += y0
    column += x0
    key = pixel_keys(plan.seed, row * plan.frame_width + column)
    x, y = column.astype(F32), row.astype(F32)
    # Of equal size: a small one at the end would pay the cost of calls for few slots.
    ends = np.linspace(0, key.size, -(-key.size // plan.batch) + 1).astype(int)
    parts = [slice(low, high) for low, high in pairwise(ends)]
    return [Block(part.start, key[part], x[part], y[part]) for part in parts]


def _batches(plan: Plan) -> Iterator[Batch]:
    """Yield all batches, sample by sample over the picture."""
    blocks = _blocks(plan)
    first, end = plan.samples
    sequences = _sequences(plan.frame_width * plan.frame_height)  # a border changes no pixel
    share = min(max(plan.batch // blocks[0].key.size, SHARE), CHUNK) if blocks else CHUNK
    stops = [stop for stop in EARLY if first < stop < end] if len(blocks) > 1 else []
    while first < end:
        # Chunks end at multiples of their own size: whole blocks of the sequence.
        stop = stops.pop(0) if stops else min((first // CHUNK + 1) * CHUNK, end)
        count = stop - first
        numbers = Numbers(plan.pattern, plan.seed, first, count, plan.total_samples, sequences, {})
        for low in range(0, count, share):
            for block in blocks:
                yield Batch(block, numbers, low, min(low + share, count))
        first = stop


def _sequences(pixels: int) -> int:
    # A quarter as many sequences as pixels are enough to look independent; tables cost.
    return min(SEQUENCES, max(32, 1 << (pixels // 4).bit_length()))


def _sample(
    plan: Plan, batch: Batch, stop: threading.Event
) -> tuple[NDArray[np.float32], int, Tally]:
    """Return the sums (C, pixels) of a batch, the samples in them, and what they took.

    Sums of so few samples may be float32; the film's are float64.
    """
    tally = Tally()
    tally.start()
    block, numbers = batch.block, batch.numbers
    pixels = block.key.size
    sums = np.zeros((rows(plan.passes), pixels), F32)

    # Small pictures take several samples at once: a wave is about a batch of slots.
    together = max(1, min(batch.end - batch.first, plan.batch // pixels))
    done = 0
    for first in range(batch.first, batch.end, together):
        samples = min(together, batch.end - first)
        draws, x, y = _draws(numbers, block, first, samples)
        u, v = draws.pair(PIXEL, None)
        lens = (None, None) if plan.camera.aperture is None else draws.pair(LENS, None)
        origin, direction, far, slot = plan.camera.rays(x, y, u, v, *lens)
        rays = Rays(origin, direction, far)
        tally.rays_camera += rays.size
        tally.lap("camera")
        found = trace(plan, rays, Paths(rays.size, slot=slot), draws, tally, stop)
        if stop.is_set():
            break
        row = 0
        for each in found:
            tally.not_finite += drop_not_finite(each)
            each = each.reshape(-1, samples, pixels)
            sums[row : row + len(each)] += each[:, 0] if samples == 1 else each.sum(axis=1)
            row += len(each)
        tally.samples += u.size
        tally.lap("film")
        done += samples
    return sums, done, tally


def _draws(
    numbers: Numbers, block: Block, first: int, samples: int
) -> tuple[Draws, Scalar, Scalar]:
    """Return the draws and raster positions of `samples` samples of each pixel, by sample."""
    if samples == 1:
        return Draws(numbers, block.key, first), block.x, block.y
    rows = np.repeat(np.arange(first, first + samples, dtype=np.int32), block.key.size)
    x, y = np.tile(block.x, samples), np.tile(block.y, samples)
    return Draws(numbers, np.tile(block.key, samples), rows), x, y
