"""plan -> Picture.  Batches of pixels and samples, shared out to workers, merged in a fixed order.

A batch is a pure function of (plan, pixels, samples): the picture has the same bits whatever the
number of workers, threads or processes.  The calling thread merges, shows progress and may stop
the render at any time.
"""

import os
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import F32, Index, Scalar, check, take
from .batches import Batch, Block, Pause, Schedule, Sums
from .film.cryptomatte import Keys, Parts, summed
from .film.denoise import DenoiseError, Denoising, denoise
from .film.film import MIDDLES, Film, drop_not_finite, new_film, rows
from .film.passes import Pass
from .pages import keep_pages, release_pages
from .plan import Plan
from .sampling.dimensions import LENS, PIXEL, TIME
from .sampling.draws import Draws, Numbers
from .scene import Note
from .splits import settled, splits_of
from .statistics import Tally, peak_memory, summary
from .tiles import Tiling
from .transport.middle import look
from .transport.path import trace
from .transport.stars import add_stars
from .transport.state import Paths, Rays
from .workers import hire

TICK = 0.05  # seconds between two looks at the caller


@dataclass(frozen=True, eq=False)
class Picture:
    """What has been rendered: a film, the least samples of a pixel, and the statistics.

    notes: what went wrong on the way and left the picture less than was asked for.
    """

    film: Film
    exposure: float
    samples: int
    complete: bool
    statistics: dict[str, Any]
    plan: Plan | None = None
    notes: tuple[Note, ...] = ()

    def passes(self) -> Iterator[tuple[Pass, NDArray[np.float32]]]:
        """Yield the other passes that were asked for, (H, W, C) float32."""
        for each in self.plan.outputs if self.plan is not None else ():
            yield each, self.film.shaped(each.pixels(self.film, self.exposure))

    def mattes(self) -> Iterator[tuple[str, NDArray[np.float32]]]:
        """Yield the pictures of the cryptomattes (H, W, 4) with their names: ID, weight, twice."""
        if self.plan is None or self.plan.ledger is None or self.film.parts is None:
            return
        scale = 1.0 / np.maximum(self.film.counts, 1)
        for matte in self.plan.ledger.mattes:
            ranked = self.film.parts.ranked(matte, 2 * self.plan.matte_pairs)
            ranked[1::2] *= scale
            for place in range(self.plan.matte_pairs):
                yield f"{matte.kind}{place:02}", self.film.shaped(ranked[4 * place : 4 * place + 4])

    def combined(self) -> NDArray[np.float32]:
        """Return (H, W, 4) float32, row 0 at the bottom, premultiplied alpha."""
        return self.film.combined(self.exposure)


@dataclass(frozen=True, eq=False)
class Progress:
    """How far a render is; `remaining` [s] is None until it can be told.

    sample is the mean of the pixels' samples, fraction the share of the work that is done: less is
    to do where adaptive sampling stops.  memory is the largest so far, of all workers [bytes].
    """

    sample: float
    samples: int
    fraction: float
    seconds: float
    rays: int
    memory: int
    _film: Film
    _exposure: float
    _plan: Plan | None = None

    @property
    def remaining(self) -> float | None:
        """The seconds that the rest will take at the speed so far."""
        return self.seconds * (1 / self.fraction - 1) if self.fraction > 0 else None

    @property
    def rays_per_second(self) -> float:
        """Rays of all kinds in a second."""
        return self.rays / self.seconds if self.seconds > 0 else 0.0

    def picture(self) -> Picture:
        """Return the picture so far, without statistics."""
        return Picture(self._film, self._exposure, int(self.sample), False, {}, self._plan)


def render(
    plan: Plan,
    threads: int = 0,
    on_tick: Callable[[Progress], bool | None] | None = None,
    stop: threading.Event | None = None,
    lingers: bool = True,
) -> Picture:
    """Sample a plan; `on_tick` is called every 50 ms on the caller's thread, True stops.

    threads = 0 uses all cores; where processes pay, as many of them do the work.  `stop` stops
    from another thread, at once; it is set when this one has stopped.  A stopped render keeps what
    it has; unless it `lingers`, it returns while the batches under way, which are lost, still end,
    in a bounce's time.
    """
    start = perf_counter()
    keep_pages()
    x0, y0, x1, y1 = plan.rectangle
    film = _film(plan, x1 - x0, y1 - y0)
    pixels = film.counts.size
    count = threads or os.cpu_count() or 1
    total = Tally()
    stop = stop or threading.Event()
    queue: deque[tuple[Batch, Future[Sums]]] = deque()
    schedule = Schedule(plan, film)
    batches = schedule.batches()
    more, pauses, timed_out = True, False, False
    begun, fraction = 0, 0.0

    workers = hire(plan, _sample, count, pixels)

    def progress() -> Progress:
        return Progress(
            total.samples / max(pixels, 1),
            plan.samples[1] - plan.samples[0],
            fraction,
            perf_counter() - start,
            total.rays,
            peak_memory() + workers.memory,
            film,
            plan.exposure,
            plan,
        )

    def has_given_up() -> bool:
        if on_tick is None or not on_tick(progress()):
            return False
        stop.set()
        return True

    def wait_for(future: Future[Any]) -> None:
        wait([future], timeout=TICK)
        has_given_up()

    pool = ThreadPoolExecutor(count, thread_name_prefix="penumbra")
    is_leaving = False
    try:
        plan = settled(plan, pool, workers.sample, stop, wait_for)
        if plan.stars is not None:
            add_stars(plan, film, pool, count, total, stop, wait_for)
        while (more and not stop.is_set() or queue) and not is_leaving:
            # Keep every worker busy, with a little in store.
            while more and len(queue) < 2 * count and not stop.is_set():
                if pauses and queue:
                    break
                batch = next(batches, None)
                more, pauses = batch is not None, isinstance(batch, Pause)
                if isinstance(batch, Batch):
                    queue.append((batch, pool.submit(workers.sample, plan, batch, stop)))
                    begun += batch.block.key.size * (batch.end - batch.first)
            if queue:
                wait([queue[0][1]], timeout=TICK)

            # Merge in the order of submission, so that sums do not depend on scheduling.
            while queue and queue[0][1].done():
                batch, future = queue.popleft()
                sums = future.result()
                schedule.add(batch, sums)
                total.add(sums.tally)

            seconds = perf_counter() - start
            timed_out = 0 < plan.time_limit <= seconds and bool(film.counts.all())
            fraction = max(fraction, total.samples / max(schedule.expected, 1))
            is_leaving = has_given_up() and not lingers
            if timed_out:
                stop.set()
    except BaseException:
        stop.set()
        raise
    finally:
        workers.close()
        pool.shutdown(wait=not is_leaving, cancel_futures=True)
    release_pages()
    complete = (timed_out and not is_leaving) or (not more and total.samples == begun)
    notes = workers.notes()
    if plan.denoising is not None and complete:
        notes += _denoise(plan.denoising, film, threads)
    seconds = perf_counter() - start
    return Picture(
        film,
        plan.exposure,
        int(film.counts.min()) if pixels else 0,
        complete,
        summary(total, plan.prepared, splits_of(plan), workers, pixels, seconds),
        plan,
        notes,
    )


def _denoise(how: Denoising, film: Film, threads: int) -> tuple[Note, ...]:
    """Denoise a film; where that fails, say why and leave the picture as it is."""
    albedo = film.shaped(film.mean("albedo").clip(0, 1)) if how.has_albedo else None
    normal = film.shaped(film.mean("bearing")) if how.has_normal else None
    try:
        film.denoised = denoise(film.sampled(1.0)[..., :3], albedo, normal, how, threads)
    except DenoiseError as error:
        return (Note("Render settings", f"Use Denoising: {error}: the picture keeps its noise"),)
    return ()


def _film(plan: Plan, width: int, height: int) -> Film:
    film = new_film(width, height, plan.passes)
    film.keeps_shadows = plan.keeps_shadows
    if plan.ledger is not None and plan.ledger.has_middles:
        film.middles = np.zeros((sum(MIDDLES.values()), width * height), F32)
    if plan.ledger is not None and plan.ledger.mattes:
        film.parts = Parts(plan.ledger.owners, width * height)
    return film


def _sample(plan: Plan, batch: Batch, stop: threading.Event) -> Sums:
    """Return the sums of a batch.

    Sums of so few samples may be float32; the film's are float64.
    """
    tally = Tally()
    tally.start()
    block, numbers = batch.block, batch.numbers
    pixels = block.key.size
    sums = np.zeros((rows(plan.passes), pixels), F32)
    if stop.is_set():
        return Sums(sums, 0, tally)

    # Small pictures take several samples at once: a wave is about a batch of slots.
    together = max(1, min(batch.end - batch.first, plan.batch // pixels))
    parts: list[tuple[Keys, Scalar]] = []
    owners = 0 if plan.ledger is None else plan.ledger.owners
    done = 0
    sequences: dict[int, Index] = {}
    tiling = Tiling(block.x, block.y, batch.shifts) if plan.path_reuse > 1 else None
    for first in range(batch.first, batch.end, together):
        samples = min(together, batch.end - first)
        draws, x, y = _draws(numbers, block, first, samples, sequences)
        px, py = draws.pair(PIXEL, None, warp=plan.camera.placed)
        px += x
        py += y
        lens = (None, None) if plan.camera.aperture is None else draws.pair(LENS, None)
        time, camera = None, plan.camera
        if plan.shutter is not None:
            time = plan.shutter.open(draws.pair(TIME, None)[0], y)
            if plan.camera_motion is not None:
                camera = plan.camera_motion.at(time)
        origin, direction, far, slot = camera.through(px, py, *lens)
        check("camera", origin=origin, direction=direction)
        rays = Rays(origin, direction, far)
        paths = Paths(rays.size, slot=slot, time=time if slot is None else take(time, slot))
        tally.rays_camera += rays.size
        tally.lap("camera")
        tiles = None if tiling is None else tiling.tiles(numbers.first + first, samples)
        found, seen = trace(plan, rays, paths, draws, tally, stop, tiles)
        if stop.is_set():
            break
        row = 0
        for each in found:
            tally.not_finite += drop_not_finite(each)
            each = each.reshape(len(each) if each.ndim > 1 else 1, samples, pixels)
            sums[row : row + len(each)] += each[:, 0] if samples == 1 else each.sum(axis=1)
            row += len(each)
        tally.samples += draws.key.size
        parts += [(s.slot % pixels * owners + s.owner, s.weight) for s in seen]
        tally.lap("film")
        done += samples
    return Sums(sums, done, tally, _middles(plan, batch), _summed(parts))


def _middles(plan: Plan, batch: Batch) -> NDArray[np.float32] | None:
    """Return what the middles of pixels show, with the first batch of each block."""
    if plan.ledger is None or not plan.ledger.has_middles:
        return None
    if batch.first > 0 or batch.numbers.first != plan.samples[0]:
        return None
    return look(plan, batch.block.x, batch.block.y)


def _summed(parts: list[tuple[Keys, Scalar]]) -> tuple[Keys, NDArray[np.float64]] | None:
    if not parts:
        return None
    return summed(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _draws(
    numbers: Numbers, block: Block, first: int, samples: int, sequences: dict[int, Index]
) -> tuple[Draws, Scalar, Scalar]:
    """Return the draws and raster positions of `samples` samples of each pixel, by sample.

    `sequences` are those of the pixels, kept from sample to sample; see `Draws`.
    """
    if samples == 1:
        return Draws(numbers, block.key, first, sequences), block.x, block.y
    rows = np.repeat(np.arange(first, first + samples, dtype=np.int32), block.key.size)
    x, y = np.tile(block.x, samples), np.tile(block.y, samples)
    return Draws(numbers, np.tile(block.key, samples), rows), x, y
