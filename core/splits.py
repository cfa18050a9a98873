"""plan -> plan.  How many rays pay where camera rays meet surfaces: measured before the render.

Of a sample's error some is the light's (penumbrae), some that of scattered rays, and the rest of
the pixel, the lens, the time; and each has its cost.  A few hundred pixels are rendered four
times: as they are, with more light samples, with more scattered rays, with paths that tiles of
pixels re-use.  Error and cost are then known for any numbers, e0 + eL / L + eS / S and
c0 + cL L + cS S, where re-use makes eS smaller and cS larger, and the least product wins (cf.
Bolin and Meyer 1997, "An Error Metric for Monte Carlo Ray Tracing", split so).  All is counted,
nothing is timed: the same plan gives the same numbers, whatever part of the picture is rendered.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from .arrays import F32, Index
from .batches import Batch, Block, Sums, Work
from .plan import Plan
from .sampling.draws import Numbers, pixel_keys
from .statistics import Tally
from .tiles import HEIGHT, SIZE, WIDTH

Places = tuple[Index, Index]  # columns and rows of pixels

# What is chosen, of a plan, and from what; the last is what is tried
LIGHT, SCATTER, REUSE = "light_samples", "scatter_samples", "path_reuse"
CHOSEN = {LIGHT: (1, 2, 4), SCATTER: (1, 2, 4), REUSE: (1, SIZE)}
TRIED = {LIGHT: 4, SCATTER: 4, REUSE: 3}  # and how long a try may take
SHARE = 0.015  # of the picture's samples, that measuring may take
FEWEST, MOST = 192, 4096  # pixels that are looked at; of a Cornell box 218 choose as 436 do
SAMPLES = 4  # of each of them, twice
SEQUENCES = 256  # of numbers, that they share
APART = 0x5B117000  # from the picture's own seed
ADAPTIVE_SAMPLES = 128  # that a pixel is thought to take where it may stop early
COSTLIEST = 2.0  # times a plain sample: who asks for 128 samples has an idea how long they take
GAIN = 0.95  # how much of the plain product another must be below: what is measured is noisy
BRIGHTEST = F32(1.0)  # squared relative error of one pixel: more are fireflies

# What rays and vertices take, compared with each other [ns of one thread]; measured on the
# benchmark scenes.
CAMERA_RAY, SHADOW_RAY, SCATTERED_RAY, VERTEX = 100.0, 100.0, 100.0, 130.0


def settled(
    plan: Plan,
    pool: Executor,
    sample: Work,
    stop: threading.Event,
    wait_for: Callable[[Future[Sums]], None],
) -> Plan:
    """Return the plan, which has one of each so far, with the numbers that it wants measured.

    `sample` renders a batch.  Small pictures take one of each, and so do those that are stopped.
    """
    pixels = _pixels(plan) if plan.measures else 0
    if not pixels:
        return replace(plan, measures=())
    plain = replace(plan, ledger=None)  # passes do not change what pays
    tries = {name: _with(plain, {name: CHOSEN[name][-1]}) for name in plan.measures}
    shared = tries.pop(REUSE, None)

    # Every pixel twice, by other numbers, none of which are those of the picture.  Whether paths
    # are shared is tried where neighbours are looked at: too alike to choose the others by
    groups = [(_spread, [plain, *tries.values()])]
    if shared is not None:
        groups.append((_tiles, [plain, shared]))
    numbers = Numbers("SOBOL", plan.seed ^ APART, 0, SAMPLES, SAMPLES, SEQUENCES, {})
    futures = []
    for places, plans in groups:
        blocks = [_block(plan, *places(plan, pixels), time) for time in (0, 1)]
        batches = [Batch(block, numbers, 0, SAMPLES, shifts=False) for block in blocks]
        futures += [pool.submit(sample, each, batch, stop) for each in plans for batch in batches]
    for future in futures:
        while not future.done():
            wait_for(future)
    sums = [future.result() for future in futures]
    if stop.is_set():
        return plan

    # What they cost, and how far the two are apart
    pairs = list(zip(sums[::2], sums[1::2], strict=True))
    names, count = tuple(tries), 1 + len(tries)
    errors, costs = _errors(pairs[:count]), _costs(pairs[:count])
    if shared is not None:
        names += (REUSE,)
        (own, less), (own_cost, more) = _errors(pairs[count:]), _costs(pairs[count:])
        errors.append(errors[0] * less / own if own else errors[0])
        costs.append(costs[0] * more / own_cost)
    return replace(_with(plan, choose(names, errors, costs)), measures=())


def splits_of(plan: Plan) -> dict[str, int]:
    """Return the numbers of a plan that can be measured."""
    return {name: getattr(plan, name) for name in CHOSEN}


def choose(names: tuple[str, ...], errors: list[float], costs: list[float]) -> dict[str, int]:
    """Return the number of each name whose product of error and cost is least.

    The first error and cost are those of one each; the others have the last of CHOSEN of one name.
    """
    tried = dict(zip(names, zip(errors[1:], costs[1:], strict=True), strict=True))
    plain = errors[0], costs[0]
    light_error, light_cost = _share_of(LIGHT, tried, plain)
    rays_error, rays_cost = _share_of(SCATTER, tried, plain)

    # Re-use takes a part of the error of scattered rays away
    shared_error = shared_cost = 0.0
    if REUSE in tried:
        shared_error = max(errors[0] - tried[REUSE][0], 0.0)
        shared_cost = max(tried[REUSE][1] - costs[0], 0.0)
        rays_error = max(rays_error, shared_error)
    total = light_error + rays_error
    if total > errors[0]:  # better than one over the number: patterns do that, and noise
        light_error, rays_error, shared_error = (
            each * errors[0] / total for each in (light_error, rays_error, shared_error)
        )
    fixed_error = errors[0] - light_error - rays_error
    fixed_cost = max(costs[0] - light_cost - rays_cost, 0.0)

    best = dict.fromkeys(names, 1)
    least = GAIN * errors[0] * costs[0]
    for counts in product(*(CHOSEN[name] for name in names)):
        numbers = dict(zip(names, counts, strict=True))
        light, rays = numbers.get(LIGHT, 1), numbers.get(SCATTER, 1)
        shares = numbers.get(REUSE, 1) > 1
        error = fixed_error + light_error / light + (rays_error - shares * shared_error) / rays
        cost = fixed_cost + light_cost * light + (rays_cost + shares * shared_cost) * rays
        if error * cost < least and cost <= COSTLIEST * costs[0]:
            best, least = numbers, error * cost
    return best


def _share_of(
    name: str, tried: dict[str, tuple[float, float]], plain: tuple[float, float]
) -> tuple[float, float]:
    """Return what of the plain error and cost changes with a number, each at least 0."""
    if name not in tried:
        return 0.0, 0.0
    most = CHOSEN[name][-1]
    error, cost = tried[name]
    return max(plain[0] - error, 0.0) / (1 - 1 / most), max(cost - plain[1], 0.0) / (most - 1)


def _pixels(plan: Plan) -> int:
    """Return how many pixels may be looked at: 0 are too few to tell."""
    samples = plan.total_samples
    if plan.adaptive is not None:
        samples = min(samples, ADAPTIVE_SAMPLES)
    whole = plan.frame_width * plan.frame_height
    tries = 2 * SAMPLES * (1 + sum(TRIED[name] for name in plan.measures))
    pixels = min(int(SHARE * whole * samples / tries), MOST, whole)
    return pixels if pixels >= FEWEST else 0


def _spread(plan: Plan, count: int) -> Places:
    """Return columns and rows of pixels spread evenly over the whole frame."""
    return _even(count, plan.frame_width, plan.frame_height)


def _tiles(plan: Plan, count: int) -> Places:
    """Return those of whole tiles of pixels, spread likewise."""
    across, down = max(plan.frame_width // WIDTH, 1), max(plan.frame_height // HEIGHT, 1)
    column, row = _even(max(count // SIZE, 1), across, down)
    inside = np.arange(SIZE)
    column = np.add.outer(column * WIDTH, inside % WIDTH).reshape(-1)
    row = np.add.outer(row * HEIGHT, inside // WIDTH).reshape(-1)
    return column, row


def _even(count: int, width: int, height: int) -> Places:
    """Return `count` places of a grid (Roberts 2018, the R2 sequence)."""
    number = np.arange(count) + 0.5
    column = (number * 0.7548776662466927 % 1.0 * width).astype(np.int64)
    row = (number * 0.5698402909980532 % 1.0 * height).astype(np.int64)
    return column, row


def _block(plan: Plan, column: Index, row: Index, time: int) -> Block:
    """Return pixels with the keys of the first or the second time."""
    key = pixel_keys(plan.seed ^ APART + time, row * plan.frame_width + column)
    return Block(slice(0, key.size), key, column.astype(F32), row.astype(F32))


def _errors(pairs: Sequence[tuple[Sums, Sums]]) -> list[float]:
    """Return the squared relative error of each try, of which there are two of the same pixels."""
    means = np.stack([[s.values[:3].astype(np.float64) / SAMPLES for s in pair] for pair in pairs])
    mean = means.mean(axis=(0, 1))
    squared = (means[:, 0] - means[:, 1]) ** 2 / (2 * (mean * mean + 0.01))
    return [float(each) for each in np.minimum(squared, BRIGHTEST).mean(axis=(1, 2))]


def _costs(pairs: Sequence[tuple[Sums, Sums]]) -> list[float]:
    """Return what each try costs [ns of one thread]."""
    return [_cost(one.tally) + _cost(other.tally) for one, other in pairs]


def _cost(tally: Tally) -> float:
    scattered = tally.rays_diffuse + tally.rays_reflection + tally.rays_transmission
    rays = CAMERA_RAY * tally.rays_camera + SHADOW_RAY * tally.rays_shadow
    return rays + SCATTERED_RAY * scattered + VERTEX * tally.vertices


def _with(plan: Plan, numbers: dict[str, int]) -> Plan:
    changed: dict[str, Any] = dict(numbers)
    if plan.alone is not None:
        changed["alone"] = _with(plan.alone, numbers)
    return replace(plan, **changed)
