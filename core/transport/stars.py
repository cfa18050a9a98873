"""plan -> radiance of stars by pixel.  Each star's light, shared out to the pixels around it.

A star has the density of the pixel filter in each pixel, scaled so that all its pixels together
have all of its light, wherever between them it is: filters alone let it flicker by up to 3 % for
Blackman-Harris and 12 % for Gaussian ones, as they do not add up to 1.  A streak or a disk is the
sum of so many points that none can be told: evenly spread in time, on the lens by the sequence of
Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences".  Their number depends on
the size of the blur, not on the samples of the picture.
"""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, wait
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, ONE_BELOW, Index, Scalar
from ..camera import CompiledCamera
from ..film.film import Film
from ..plan import Plan
from ..stars import Cluster, StarPlan
from ..stars.places import Seen, copies, find
from ..statistics import Tally
from .veil import passed

TASK = 1 << 13  # stars that are looked at together
BATCH = 1 << 14  # points that are drawn together
MOST = 1 << 15  # points of one star
ALONG, WITHIN = 8, 8  # points in a pixel of a streak's length, and of a disk's area
LEAST = 64  # points where something might cover a part of the time or of the lens
STILL = 1e-2  # pixels: of what moves or blurs less, one point shows all
LOOKS = 9  # times at which the way of a star is looked at, and places on the lens

# Places on the lens (2, LOOKS), to its rim
_RIM = np.stack(np.meshgrid(*2 * [np.array([0.0, 0.5, ONE_BELOW], F32)])).reshape(2, LOOKS)

_ROBERTS = np.array([[0.7548776662466927], [0.5698402909980532]])

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Drawn:
    """What some stars of a cluster give: different pixels (n,), and their light (3, n)."""

    cluster: Cluster
    pieces: list[tuple[Index, Array]]
    tally: Tally


def add_stars(
    plan: Plan,
    film: Film,
    pool: Executor,
    workers: int,
    tally: Tally,
    stop: threading.Event,
    wait_for: Callable[[Future[Drawn]], None],
) -> None:
    """Draw all stars of a plan on a film; `wait_for` waits, and may set `stop`.

    Sums are added in one order, whatever the number of workers.
    """
    assert plan.stars is not None
    names = {name for cluster in plan.stars.clusters for name in cluster.sums}
    film.stars = {name: np.zeros((3, film.counts.size)) for name in sorted(names)}
    tasks = _tasks(plan.stars)
    queue: deque[Future[Drawn]] = deque()
    while not stop.is_set():
        while len(queue) < 2 * workers and (task := next(tasks, None)) is not None:
            queue.append(pool.submit(_draw, plan, *task, stop))
        if not queue:
            return
        wait_for(queue[0])
        while queue and queue[0].done():
            drawn = queue.popleft().result()
            tally.add(drawn.tally)
            for pixels, light in drawn.pieces:
                for name in drawn.cluster.sums:
                    for channel, values in zip(film.stars[name], light, strict=True):
                        channel[pixels] += values
    wait(queue)


def _tasks(stars: StarPlan) -> Iterator[tuple[Cluster, NDArray[np.intp]]]:
    for cluster in stars.clusters:
        for low in range(0, cluster.size, TASK):
            yield cluster, np.arange(low, min(low + TASK, cluster.size))


def _draw(plan: Plan, cluster: Cluster, star: NDArray[np.intp], stop: threading.Event) -> Drawn:
    """Draw some stars (n,) of a cluster."""
    tally = Tally()
    tally.start()
    pieces = []
    counts = _counts(plan, cluster, star)
    for count in np.unique(counts[counts > 0]):
        some = star[counts == count]
        together = max(1, BATCH // int(count))
        for low in range(0, some.size, together):
            if stop.is_set():
                break
            piece = _points(plan, cluster, some[low : low + together], int(count), tally)
            pieces += [piece] if piece[0].size else []
    tally.lap("film")
    return Drawn(cluster, pieces, tally)


def _points(
    plan: Plan, cluster: Cluster, star: NDArray[np.intp], count: int, tally: Tally
) -> tuple[Index, Array]:
    """Return the pixels and the light of `count` points of each star."""
    stars = plan.stars
    assert stars is not None
    number = np.tile(np.arange(count), star.size)
    star = np.repeat(star, count)
    share, lens = ((number + 0.5) / count).astype(F32), None
    if cluster.starts is not None:
        lens = (_ROBERTS * number + cluster.starts[star].T) % 1.0
        lens = np.minimum(lens.astype(F32), ONE_BELOW)
    is_rolling = stars.shutter.rolling is not None and _moves(plan, cluster)
    time = share if is_rolling else stars.shutter.open(share, np.full(share.size, F32(0)))
    if not _moves(plan, cluster):
        time = np.full(share.size, F32(0.5))
    seen = find(_camera(plan, time), cluster.at(star, time), cluster.is_distant, lens, stars.clip)

    # Keep what is in the picture, twice at a seam
    index, x = _in_picture(plan, seen)
    if not index.size:
        return index, np.zeros((3, 0))
    y = seen.y[index]
    light = cluster.light[star[index]].T * (seen.density[index] / count)
    at = time[index]
    rays = seen.origin[:, index].astype(F32), seen.direction[:, index].astype(F32)
    far = np.minimum(seen.far[index], 1e37).astype(F32) * F32(1 - 1e-5)
    light = light * passed(plan, *rays, far, at if plan.shutter is not None else None, tally)

    # Share it out to the pixels around
    columns, across = footprint(x, stars)
    rows, up = footprint(y, stars)
    if is_rolling:
        up = up * _exposed(stars, rows, at)
    x0, y0, x1, y1 = plan.rectangle
    across = across * ((x0 <= columns) & (columns < x1))
    up = up * ((y0 <= rows) & (rows < y1))
    weight = (up[:, None] * across).reshape(-1)
    pixel = ((rows - y0)[:, None] * (x1 - x0) + (columns - x0)).reshape(-1)
    lit = np.flatnonzero(weight)
    values = light.take(lit % index.size, axis=1) * weight.take(lit)
    pixel, which = np.unique(pixel.take(lit), return_inverse=True)
    sums = [np.bincount(which.reshape(-1), row, pixel.size) for row in values]
    return pixel, np.stack(sums)


def footprint(x: Array, stars: StarPlan) -> tuple[NDArray[np.intp], Array]:
    """Return the numbers (n, N) of pixels around raster positions x (N,), and their shares of 1."""
    first = np.ceil(x - 0.5 - stars.reach)
    pixel = first + np.arange(int(2 * stars.reach) + 1)[:, None]
    off = x - (pixel + 0.5)
    weight = np.where(np.abs(off) <= stars.reach, stars.density(off), 0.0)
    total = weight.sum(axis=0)

    # A filter that is narrower than a pixel may miss it
    lost = np.flatnonzero(~(total > 0))
    pixel[0, lost], weight[:, lost], total[lost] = np.floor(x[lost]), 0.0, 1.0
    weight[0, lost] = 1.0
    return pixel.astype(np.intp), weight / total


def _exposed(stars: StarPlan, rows: NDArray[np.intp], time: Scalar) -> Array:
    """Return how much more than at even times rows (n, N) are exposed at times (N,)."""
    shutter = stars.shutter
    assert shutter.rolling is not None
    rolling = float(shutter.rolling)
    row = 1 - rows / float(shutter.height)
    middle = (row - 0.5) * (1 - rolling) + 0.5
    place = (time - middle) / rolling + 0.5
    steps = np.linspace(0, 1, stars.curve.size)
    return np.where((place >= 0) & (place < 1), np.interp(place, steps, stars.curve), 0) / rolling


def _in_picture(plan: Plan, seen: Seen) -> tuple[Index, Array]:
    """Return the points (n,) whose footprint touches the rectangle, and their raster x."""
    assert plan.stars is not None
    x0, y0, x1, y1 = plan.rectangle
    margin = plan.stars.reach + 0.5
    tall = seen.is_there & (seen.y > y0 - margin) & (seen.y < y1 + margin)
    found = []
    for shift in copies(plan.camera):
        x = seen.x + shift
        index = np.flatnonzero(tall & (x > x0 - margin) & (x < x1 + margin))
        found.append((index, x[index]))
    index, x = (np.concatenate(each) for each in zip(*found, strict=True))
    return index, x


def _moves(plan: Plan, cluster: Cluster) -> bool:
    return cluster.moves or plan.shutter is not None


def _camera(plan: Plan, time: Scalar) -> CompiledCamera:
    return plan.camera if plan.camera_motion is None else plan.camera_motion.at(time)


def _counts(plan: Plan, cluster: Cluster, star: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return to how many points, a power of two, each of some stars (n,) is shared out.

    0 for what is never in the picture.
    """
    moves, aperture, stars = _moves(plan, cluster), plan.camera.aperture, plan.stars
    if not moves and aperture is None:
        return np.ones(star.size, np.intp)
    assert stars is not None
    half = np.full(LOOKS * star.size, F32(0.5))
    centre = None if aperture is None else np.stack([half, half])

    def look(time: Scalar, lens: NDArray[np.float32] | None) -> Array:
        """Return places (2, LOOKS, n), NaN where there is none."""
        place = cluster.at(np.tile(star, LOOKS), time)
        seen = find(_camera(plan, time), place, cluster.is_distant, lens, stars.clip)
        found = np.where(seen.is_there, np.stack([seen.x, seen.y]), np.nan)
        return found.reshape(2, LOOKS, -1)

    # Follow the way of each, seen through the middle of the lens, and see how wide it gets
    length, radius, step = np.zeros((3, star.size))
    way = look(np.repeat(np.linspace(0, 1, LOOKS, dtype=F32), star.size) if moves else half, centre)
    known = np.isfinite(way).all(axis=0)
    if moves:
        steps = np.nan_to_num(np.hypot(*np.diff(way, axis=1)))
        pairs = (known[1:] & known[:-1]).sum(axis=0)
        length, step = steps.sum(axis=0) * (LOOKS - 1) / np.maximum(pairs, 1), steps.max(axis=0)
    if aperture is not None:
        rim = np.repeat(_RIM, star.size, axis=1)
        radius = np.nan_to_num(np.hypot(*(look(half, rim) - look(half, centre)))).max(axis=0)
    needed = np.maximum(ALONG * length, WITHIN * radius * (np.pi * radius + 2 * length))
    if moves and stars.shutter.rolling is not None:
        needed = needed / float(stars.shutter.rolling)
    is_sharp = np.maximum(length, radius) < STILL
    needed = np.where(is_sharp, 1, np.maximum(needed, 2))
    if plan.accel is not None:
        needed = np.maximum(needed, LEAST)
    counts = 1 << np.ceil(np.log2(np.clip(needed, 1, MOST))).astype(np.intp)

    # Leave out what comes nowhere near
    is_near = known.any(axis=0)
    if len(copies(plan.camera)) == 1:
        margin = radius + step + stars.reach + 1
        for places, low, high in zip(way, plan.rectangle[:2], plan.rectangle[2:], strict=True):
            least, most = (np.where(known, places, s * np.inf) for s in (1, -1))
            is_near &= (least.min(axis=0) < high + margin) & (most.max(axis=0) > low - margin)
    return np.where(is_near, counts, 0)
