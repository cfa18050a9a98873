"""light, lobes -> book.  To which passes light goes: by what scattered it first, and its source.

Light that the eye sees directly is emission or the environment.  All other light is sorted by the
closure that scattered it first on its way from the eye: by light samples at the first surface,
closure by closure; farther on, by the path, which remembers.  Source: Cycles,
film_write_direct_light and film_write_emission_or_background_pass.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Ids, Index, Scalar, Vec, take
from ..film.ledger import UNSCATTERED, Ledger
from ..geometry.surface import Points
from ..plan import Plan
from .radiance import Radiance, weigh
from .receiver import Receiver
from .state import Paths

# Light of lamps one by one: their number or numbers (m,), rays (m,) or None for all, light (3, m)
Apart = list[tuple[int | Ids, Index | None, Vec]] | None


def has_groups(plan: Plan, radiance: Radiance) -> bool:
    """Tell whether light of each light group is wanted."""
    return radiance.sorts_light and _ledger(plan).light_groups is not None


def _ledger(plan: Plan) -> Ledger:
    assert plan.ledger is not None
    return plan.ledger


def _enter_met(
    plan: Plan,
    light: Vec,
    paths: Paths,
    index: Index,
    depth: int,
    radiance: Radiance,
    seen_as: int,
) -> Vec:
    """Sort light (3, n) that paths `index` (n,) met; the eye sees it as `seen_as`; return it."""
    light = weigh(light, take(paths.throughput, index))
    lobe = paths.scattered_by.take(index)
    total = np.full(index.size, depth) if paths.total is None else paths.total.take(index)
    row = _ledger(plan).lobes[lobe, (total > 1).astype(np.intp)]
    row = np.where(lobe == UNSCATTERED, seen_as, row)
    radiance.enter(row, light, paths.slots(index))
    return light


def enter_world(
    plan: Plan, light: Vec, paths: Paths, index: Index, depth: int, radiance: Radiance
) -> None:
    """Sort light (3, n) of the world that paths `index` (n,) ran into."""
    ledger = _ledger(plan)
    light = _enter_met(plan, light, paths, index, depth, radiance, ledger.environment)
    if ledger.light_groups is not None:
        radiance.enter(int(ledger.light_groups[-1]), light, paths.slots(index))


def enter_glow(
    plan: Plan,
    light: Vec,
    paths: Paths,
    points: Points,
    index: Index,
    depth: int,
    radiance: Radiance,
) -> None:
    """Sort light (3, n) of glowing `points` that paths `index` (n,) ran into."""
    ledger = _ledger(plan)
    light = _enter_met(plan, light, paths, index, depth, radiance, ledger.emission)
    if ledger.instance_groups is not None:
        assert points.instance is not None
        row = ledger.instance_groups.take(points.instance.take(index))
        radiance.enter(row, light, paths.slots(index))


def enter_lamps(
    plan: Plan,
    light: Vec,
    apart: Apart,
    kept: Scalar,
    paths: Paths,
    index: Index,
    depth: int,
    radiance: Radiance,
) -> None:
    """Sort light (3, n) of lamps that paths `index` (n,) crossed; `apart`, before clamping."""
    ledger = _ledger(plan)
    _enter_met(plan, light, paths, index, depth, radiance, ledger.emission)
    for number, some, part in apart or ():
        assert ledger.light_groups is not None
        path = index if some is None else index.take(some)
        part = part * (kept if some is None else kept.take(some))
        part = weigh(part, take(paths.throughput, path))
        radiance.enter(ledger.light_groups[number], part, paths.slots(path))


def enter_sampled(
    plan: Plan,
    to: Receiver,
    by_lobe: NDArray[np.float32],
    kept: Scalar | np.float32,
    depth: int,
    radiance: Radiance,
) -> None:
    """Sort sampled light (lobes, 3, n), less what clamping took, at points."""
    ledger, size = _ledger(plan), by_lobe.shape[-1]
    slot = np.arange(size) if to.slot is None else to.slot
    indirect = np.full(size, depth > 0) if to.total is None else to.total > 0
    lobe = np.zeros(size, np.uint8) if to.scattered_by is None else to.scattered_by
    first = np.flatnonzero(lobe == UNSCATTERED)
    for number, light in enumerate(by_lobe * kept, 1):
        if first.size:
            row = ledger.lobes[number, indirect.take(first).astype(np.intp)]
            radiance.enter(row, light.take(first, axis=1), slot.take(first))
    later = np.flatnonzero(lobe != UNSCATTERED)
    if later.size:
        light = (by_lobe.sum(axis=0) * kept).take(later, axis=1)
        row = ledger.lobes[lobe.take(later), indirect.take(later).astype(np.intp)]
        radiance.enter(row, light, slot.take(later))
