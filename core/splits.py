"""plan -> plan.  How many rays pay where camera rays meet surfaces: measured before the render.

Of a sample's error some is the light's (penumbrae), some that of scattered rays, and the rest of
the pixel, the lens, the time; and each has its cost.  A few hundred pixels are rendered three
times: as they are, with more light samples, with more scattered rays.  Error and cost are then
known for any numbers, e0 + eL / L + eS / S and c0 + cL L + cS S, and the least product wins (cf.
Bolin and Meyer 1997, "An Error Metric for Monte Carlo Ray Tracing", split so).  All is counted,
nothing is timed: the same plan gives the same numbers, whatever part of the picture is rendered.
"""

import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import F32
from .batches import Batch, Block, Sums, Work
from .plan import Plan
from .sampling.draws import Numbers, pixel_keys
from .statistics import Tally

CHOSEN = ("light_samples", "scatter_samples")  # of a plan
COUNTS = (1, 2, 4)  # that are chosen from; the last is what is tried
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
    tries = [plain] + [_with(plain, {name: COUNTS[-1]}) for name in plan.measures]

    # Every pixel twice, by other numbers, none of which are those of the picture
    numbers = Numbers("SOBOL", plan.seed ^ APART, 0, SAMPLES, SAMPLES, SEQUENCES, {})
    batch = Batch(_spread(plan, pixels), numbers, 0, SAMPLES)
    futures = [pool.submit(sample, each, batch, stop) for each in tries]
    for future in futures:
        while not future.done():
            wait_for(future)
    sums = [future.result() for future in futures]
    if stop.is_set():
        return plan

    # What they cost, and how far the two are apart
    means = np.stack([each.values[:3].astype(np.float64) / SAMPLES for each in sums])
    errors = _errors(means.reshape(len(tries), 3, 2, pixels))
    best = choose(plan.measures, errors, [_cost(each.tally) for each in sums])
    return replace(_with(plan, best), measures=())


def splits_of(plan: Plan) -> dict[str, int]:
    """Return the numbers of a plan that can be measured."""
    return {name: getattr(plan, name) for name in CHOSEN}


def choose(names: tuple[str, ...], errors: list[float], costs: list[float]) -> dict[str, int]:
    """Return the number of each name whose product of error and cost is least.

    The first error and cost are those of one each; the others have the last of COUNTS of one name.
    """
    most = COUNTS[-1]
    shares = [max(errors[0] - error, 0.0) / (1 - 1 / most) for error in errors[1:]]
    steps = [max(cost - costs[0], 0.0) / (most - 1) for cost in costs[1:]]
    if sum(shares) > errors[0]:  # better than one over the number: patterns do that, and noise
        shares = [share * errors[0] / sum(shares) for share in shares]
    fixed_error = errors[0] - sum(shares)
    fixed_cost = max(costs[0] - sum(steps), 0.0)
    best, least = (1,) * len(names), GAIN * errors[0] * costs[0]
    for counts in product(COUNTS, repeat=len(names)):
        error = fixed_error + sum(e / n for e, n in zip(shares, counts, strict=True))
        cost = fixed_cost + sum(c * n for c, n in zip(steps, counts, strict=True))
        if error * cost < least and cost <= COSTLIEST * costs[0]:
            best, least = counts, error * cost
    return dict(zip(names, best, strict=True))


def _pixels(plan: Plan) -> int:
    """Return how many pixels may be looked at: 0 are too few to tell."""
    samples = plan.total_samples
    if plan.adaptive is not None:
        samples = min(samples, ADAPTIVE_SAMPLES)
    whole = plan.frame_width * plan.frame_height
    tries = 2 * SAMPLES * (1 + COUNTS[-1] * len(plan.measures))
    pixels = min(int(SHARE * whole * samples / tries), MOST, whole)
    return pixels if pixels >= FEWEST else 0


def _spread(plan: Plan, count: int) -> Block:
    """Return pixels spread evenly over the whole frame, twice (Roberts 2018, the R2 sequence)."""
    number = np.arange(count) + 0.5
    column = (number * 0.7548776662466927 % 1.0 * plan.frame_width).astype(np.int64)
    row = (number * 0.5698402909980532 % 1.0 * plan.frame_height).astype(np.int64)
    pixel = row * plan.frame_width + column
    key = np.concatenate([pixel_keys(plan.seed ^ APART + time, pixel) for time in (0, 1)])
    x, y = np.tile(column, 2).astype(F32), np.tile(row, 2).astype(F32)
    return Block(slice(0, 2 * count), key, x, y)


def _errors(means: NDArray[np.float64]) -> list[float]:
    """Return the squared relative error of each try; means (tries, 3, 2, pixels)."""
    mean = means.mean(axis=(0, 2))
    squared = (means[:, :, 0] - means[:, :, 1]) ** 2 / (2 * (mean * mean + 0.01))
    return [float(each) for each in np.minimum(squared, BRIGHTEST).mean(axis=(1, 2))]


def _cost(tally: Tally) -> float:
    scattered = tally.rays_diffuse + tally.rays_reflection + tally.rays_transmission
    rays = CAMERA_RAY * tally.rays_camera + SHADOW_RAY * tally.rays_shadow
    return rays + SCATTERED_RAY * scattered + VERTEX * tally.vertices


def _with(plan: Plan, numbers: dict[str, int]) -> Plan:
    changed: dict[str, Any] = dict(numbers)
    if plan.alone is not None:
        changed["alone"] = _with(plan.alone, numbers)
    return replace(plan, **changed)
