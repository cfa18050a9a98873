"""points, closures -> radiance.  Shadow rays towards lights (next-event estimation).

Every lamp gets shadow rays of its own, each with its own length, while lamps are few; of many
lights one is chosen at each point.  A light that scattered rays may also meet by chance is
weighted against that, closure by closure.  Unbiased.
Source: Veach and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering".
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import F32, Index, Scalar, Vec, check, dot, take
from ..bsdf import DIFFUSE, GLOSSY, diffuse, lit_as, shown_as
from ..film import ledger
from ..geometry.accel import FAR
from ..geometry.surface import Points
from ..geometry.terminator import bump_shadow, raise_starts, shift
from ..plan import Plan
from ..sampling.dimensions import (
    ROULETTE,
    STRATIFIED_BOUNCES,
    dimension,
)
from ..sampling.draws import Draws
from ..scene import EVERY_SET
from ..shading import Arrival, LobeAt, Shaded
from ..statistics import Tally
from .arrival import at_lamps
from .book import enter_sampled
from .mis import power_weight
from .radiance import Radiance
from .receiver import Receiver, Sample
from .samples import samples
from .scatter import copies_at
from .shadow import passed
from .state import Paths

# Below this share of points that get light, the others are left out of the query.
WORTH_COMPACTING = 0.75


def add(
    plan: Plan,
    points: Points,
    shaded: Sequence[Shaded],
    paths: Paths,
    draws: Draws,
    depth: int,
    radiance: Radiance,
    tally: Tally,
) -> None:
    """Add the light that reaches `points` unblocked and is scattered to the viewer."""
    arrival = None
    if plan.lights is not None and plan.lights.shaders is not None:
        arrival = at_lamps(paths, depth)
    copies = copies_at(plan, depth)
    to = _receiver(points, shaded, paths, arrival, radiance.sorts_light, copies)
    if to is None:
        return
    only = to.only
    total: Vec | Scalar | None = None
    groups: list[tuple[Any, Vec]] = []
    for sample in samples(plan, to, draws, depth):
        light = _visible(plan, to, sample, draws, depth, tally)
        if light is not None:
            if to.is_sorted and plan.ledger is not None and plan.ledger.light_groups is not None:
                row = plan.ledger.light_groups[sample.light_number]
                groups.append((row, light.sum(axis=0)))
            total = light if total is None else _sum(total, light)
    if total is None:
        return
    if to.is_sorted:
        _add_sorted(plan, to, total, groups, depth, radiance)
        return
    if only is not None:
        total = only.weight * total
    is_direct = None if to.total is None else to.total == 0
    if total.ndim == 3:
        assert to.matte_slot is not None
        radiance.add(total[0], to.slot, depth, is_direct)
        radiance.add(total[1], to.matte_slot, depth, is_direct)
        return
    if total.shape != (3, to.points.size):
        total = np.broadcast_to(total, (3, to.points.size))
    # Where the slots differ, nothing but the matte closure is lit
    slot = to.slot if to.matte_slot is None else to.matte_slot
    radiance.add(total, slot, depth, is_direct)


def _add_sorted(
    plan: Plan,
    to: Receiver,
    by_lobe: np.ndarray,
    groups: Sequence[tuple[Any, Vec]],
    depth: int,
    radiance: Radiance,
) -> None:
    """Add light (lobes, 3, n) to the radiance and to its passes; groups: rows and their light."""
    assert plan.ledger is not None
    is_direct = None if to.total is None else to.total == 0
    kept = radiance.add(by_lobe.sum(axis=0), to.slot, depth, is_direct)
    enter_sampled(plan, to, by_lobe, kept, depth, radiance)
    for row, light in groups:
        radiance.enter(row, light * kept, to.slot)


def _sum(total: Vec | Scalar, light: Vec | Scalar) -> Vec | Scalar:
    if total.ndim >= light.ndim:
        total += light
        return total
    return total + light


def _receiver(
    points: Points,
    shaded: Sequence[Shaded],
    paths: Paths,
    arrival: Arrival | None,
    is_sorted: bool,
    copies: int,
) -> Receiver | None:
    """Return the points that have a closure which lamps can light, None if there are none."""
    lit = [each for each in shaded if each.scatters]
    if not lit:
        return None
    lit = [Shaded(s.index, s.size, tuple(x for x in s.lobes if not x.module.IS_DELTA)) for s in lit]
    count = sum(each.size for each in lit)
    lobe = paths.scattered_by if is_sorted else None
    if count > WORTH_COMPACTING * points.size:
        way = paths.slot, paths.total, arrival, paths.passed
        return Receiver(points, tuple(lit), *way, is_sorted, lobe, copies, paths.matte_slot)

    # Leave the others out; what is left stands in the order of the programs.
    index = np.concatenate([each.index for each in lit if each.index is not None])
    start = 0
    moved = []
    for each in lit:
        part = None if len(lit) == 1 else np.arange(start, start + each.size)
        moved.append(Shaded(part, each.size, each.lobes))
        start += each.size
    slot = index if paths.slot is None else paths.slot.take(index)
    total = None if paths.total is None else paths.total.take(index)
    arrival = None if arrival is None else arrival.take(index)
    passed = take(paths.passed, index)
    way = slot, total, arrival, passed
    lobe = take(lobe, index)
    matte = take(paths.matte_slot, index)
    return Receiver(points.take(index), tuple(moved), *way, is_sorted, lobe, copies, matte)


# --- Scattering and shadow ----------------------------------------------------------------------


def _visible(
    plan: Plan, to: Receiver, sample: Sample, draws: Draws, depth: int, tally: Tally
) -> Scalar | Vec | None:
    """Return the light (3, n) that is scattered to the viewer where nothing is in its way.

    Without the closure's weight if there is only one; then (n,) if the light is grey.  Sorted
    light is (lobes, 3, n).
    """
    assert plan.accel is not None and plan.triangles is not None
    scattered = _scattered(plan, to, sample)
    if scattered is None:
        return None
    check("direct", scattered=scattered)

    # What carries no light gets no ray.
    size = np.abs(scattered) if plan.may_darken else scattered
    size = size.sum(axis=0) if size.ndim == 3 else size
    arriving = size if size.ndim == 1 else size.max(axis=0)
    if plan.light_threshold > 0 and sample.casts_shadow is not False:
        scattered, arriving = _thinned(plan, to, sample, draws, depth, scattered, arriving)
    lit = np.flatnonzero(arriving > 0)
    if not lit.size:
        return None
    if sample.casts_shadow is False:
        return scattered
    start = starts(plan, to, sample)
    if start is not to.points.above:
        # Aim anew from there: else the ray would end behind a light nearby.
        moved = (start - to.points.above) * (sample.far < FAR)
        sample = replace(sample, to_light=sample.to_light - moved)
    visible: Scalar | Vec
    if lit.size > WORTH_COMPACTING * arriving.size:
        # Nearly all: cheaper to ask for all, those without light with a reach below zero.
        far = np.where(arriving > 0, sample.far, F32(-1))
        visible = passed(plan, to, start, sample, far, None, depth, tally)
    else:
        is_one = np.ndim(sample.far) == 0
        far = np.full(lit.size, sample.far) if is_one else sample.far.take(lit)
        some = passed(plan, to, start.take(lit, axis=1), sample, far, lit, depth, tally)
        visible = np.zeros((*some.shape[:-1], arriving.size), F32)
        for row, values in zip(np.atleast_2d(visible), np.atleast_2d(some), strict=True):
            row[lit] = values
    tally.rays_shadow += lit.size
    if sample.casts_shadow is not True:
        visible = np.where(sample.casts_shadow, visible, F32(1))
    return scattered * visible if visible.ndim > scattered.ndim else _product(scattered, visible)


def _thinned(
    plan: Plan,
    to: Receiver,
    sample: Sample,
    draws: Draws,
    depth: int,
    scattered: Scalar | Vec,
    arriving: Scalar,
) -> tuple[Scalar | Vec, Scalar]:
    """Return light, and its largest channel (n,), of which the faint is left out at random.

    What adds less than the threshold to the picture goes on with the probability of its share of
    it: unbiased.
    """
    seen = arriving if to.only is None else arriving * to.only.weight.max(axis=0)
    faint = np.flatnonzero((seen < F32(plan.light_threshold)) & (arriving > 0))
    if not faint.size:
        return scattered, arriving
    slot = faint if to.slot is None else to.slot.take(faint)
    key = dimension(ROULETTE, depth + STRATIFIED_BOUNCES, sample.item + 1)
    chance, _ = draws.pair(key, slot, *sample.part)
    survival = seen.take(faint) * F32(1 / plan.light_threshold)
    factor = np.ones(arriving.size, F32)
    factor[faint] = (chance < survival) / np.maximum(survival, F32(1e-30))
    return scattered * factor, arriving * factor


def _product(scattered: Scalar | Vec, visible: Scalar | Vec) -> Scalar | Vec:
    scattered *= visible
    return scattered


def _scattered(plan: Plan, to: Receiver, sample: Sample) -> Scalar | Vec | None:
    only = to.only
    if plan.links_lights:
        sample = _linked(plan, to.points, sample)
    if only is not None:
        value = _of_closure(to, only, None, sample)
        if value is None:
            return None
        if plan.shifts_terminators:
            value = _shifted(plan, to, value, only, None, sample)
        if sample.light.shape[1] == 1 and (sample.light == sample.light[0]).all():
            arriving = sample.gain * sample.light[0]
            return np.multiply(value, arriving, out=arriving if value.ndim == 1 else None)
        return value * sample.gain * sample.light
    if to.is_sorted:
        return _scattered_by_lobe(plan, to, sample)
    if to.matte_slot is not None and any(len(each.lobes) > 1 for each in to.shaded):
        return _scattered_apart(plan, to, sample)
    total = np.zeros((3, to.points.size), F32)
    for shaded in to.shaded:
        light: Vec | None = None
        for lobe, live, _, value in _by_closure(plan, to, shaded, sample):
            value = lobe.weight * value
            if live is not None:
                if light is None:
                    light = np.zeros((3, shaded.size), F32)
                for channel, values in zip(light, value, strict=True):
                    channel[live] += values
            else:
                light = value if light is None else np.add(light, value, out=light)
        if light is None:
            continue
        if shaded.index is None:
            total = light
        else:
            for channel, values in zip(total, light, strict=True):
                channel[shaded.index] = values
    total *= sample.gain
    total *= sample.light
    return total


def _by_closure(
    plan: Plan, to: Receiver, shaded: Shaded, sample: Sample
) -> Iterator[tuple[LobeAt, Index | None, Index | None, Scalar | Vec]]:
    """Yield closures that scatter light, where they have weight, and f cos before that weight.

    As the closure there, its points among those of `shaded` and among all, None is all of them.
    """
    for each in shaded.lobes:
        if not each.is_alive:
            continue
        live, lobe, index = each.live, each.there, shaded.index
        if live is not None:
            index = live if index is None else index.take(live)
        value = _of_closure(to, lobe, index, sample)
        if value is None:
            continue
        if plan.shifts_terminators:
            value = _shifted(plan, to, value, lobe, index, sample)
        yield lobe, live, index, value


def _scattered_apart(plan: Plan, to: Receiver, sample: Sample) -> np.ndarray:
    """Return light (2, 3, n): of all other closures, and of the matte ones."""
    total = np.zeros((2, 3, to.points.size), F32)
    for shaded in to.shaded:
        for lobe, _, index, value in _by_closure(plan, to, shaded, sample):
            columns = slice(None) if index is None else index
            for channel, values in zip(
                total[int(lobe.module is diffuse)], lobe.weight * value, strict=True
            ):
                channel[columns] += values
    total *= sample.gain
    total *= sample.light
    return total


def _scattered_by_lobe(plan: Plan, to: Receiver, sample: Sample) -> np.ndarray:
    """Return light (lobes, 3, n) sorted by what scatters it: glass reflects or transmits it."""
    total = np.zeros((len(ledger.LOBES), 3, to.points.size), F32)
    for shaded in to.shaded:
        for lobe, live, index, value in _by_closure(plan, to, shaded, sample):
            columns = slice(None) if index is None else index
            size = shaded.size if live is None else live.size
            value = np.broadcast_to(lobe.weight * value, (3, size))
            kind = shown_as(lobe.module)
            if lobe.module.TRANSMITS and kind == GLOSSY:
                through = dot(lobe.frame.normal, _part(sample.to_light, index)) < 0
                total[ledger.TRANSMISSION - 1][:, columns] += value * through
                value = value * ~through
            total[ledger.lobe_of(kind) - 1][:, columns] += value
    total *= sample.gain
    total *= sample.light
    return total


def _linked(plan: Plan, points: Points, sample: Sample) -> Sample:
    """Return the sample without what is not linked to the points."""
    if isinstance(sample.receivers, int) and sample.receivers == EVERY_SET:
        return sample
    assert plan.triangles is not None and plan.triangles.objects is not None
    assert points.instance is not None
    sets = plan.triangles.objects.receiver_set.take(points.instance)
    linked = (np.uint64(sample.receivers) >> sets.astype(np.uint64)) & np.uint64(1)
    return replace(sample, gain=sample.gain * (linked > 0))


def _of_closure(
    to: Receiver, lobe: LobeAt, index: Index | None, sample: Sample
) -> Scalar | Vec | None:
    """Return f cos times the weight against scattered rays, before the closure's own weight."""
    module = lobe.module
    kinds = lit_as(module)
    if isinstance(sample.seen_by, int) and not sample.seen_by & kinds:
        return None
    if module.WEIGHT_IN_WI_Z:
        z = dot(lobe.frame.normal, _part(sample.to_light, index))
        z /= np.maximum(_part(sample.distance, index), F32(1e-30))
        value, pdf = module.evaluate(lobe.parameters, None, (None, None, z))
    else:
        wi = lobe.frame.local(_part(sample.wi, index))
        value, pdf = module.evaluate(lobe.parameters, lobe.frame.wo, wi)

    if lobe.smooth is not None:
        way = lobe.smooth, lobe.frame.normal, _part(sample.wi, index), lobe.softening
        value = value * bump_shadow(*way, module.RAY_KIND == DIFFUSE, False)

    # Share the light with the scattered rays that meet it.
    light_pdf = sample.matte_pdf if module.RAY_KIND == DIFFUSE else sample.pdf
    if light_pdf is not None:
        own = pdf if lobe.share is None else pdf * lobe.share
        own = own if to.copies == 1 else own * F32(to.copies)
        value = value * power_weight(_part(light_pdf, index), own)
    if not isinstance(sample.seen_by, int):
        value = value * ((_part(sample.seen_by, index) & kinds) != 0)
    return value


def _shifted(
    plan: Plan, to: Receiver, value: Scalar | Vec, lobe: LobeAt, index: Index | None, sample: Sample
) -> Scalar | Vec:
    """Return the light of a closure as objects with a shading offset dim it."""
    assert plan.triangles is not None
    normal = lobe.frame.normal
    instance = take(to.points.instance, index) if index is not None else to.points.instance
    factor = shift(plan.triangles, instance, normal, _part(sample.wi, index))
    return value if factor is None else value * factor


def _part(array: Any, index: Index | None) -> Any:
    return array if index is None else array.take(index, axis=-1)


def starts(plan: Plan, to: Receiver, sample: Sample) -> Vec:
    """Return where shadow rays (3, N) leave: on the light's side of surfaces it may shine through.

    Near the terminator of smooth surfaces they are raised.
    """
    points, start = to.points, to.points.above
    if points.smooth is not None:
        cosine = dot(points.normal, sample.to_light)
        cosine /= np.maximum(sample.distance, F32(1e-30))
        assert plan.triangles is not None
        start = raise_starts(plan.triangles, points, start, sample.to_light, cosine)
    if any(lobe.module.TRANSMITS for shaded in to.shaded for lobe in shaded.lobes):
        behind = dot(points.geometric, sample.to_light) < 0
        start = start - points.geometric * (behind * (F32(2) * points.offset))
    return start
