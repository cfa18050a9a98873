"""points, closures -> book.  What passes show of the surfaces that the eye sees straight on.

Colours, mist, occlusion and parts of pixels add up over transparent surfaces, by what each lets be
seen; normals, UV maps and the user's values are of the first surface that is opaque enough.
Source: Cycles, film_write_data_passes.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar, Vec, dot, take
from ..bsdf.diffuse import sample_about
from ..film.cryptomatte import Seen, owners
from ..film.ledger import LOBES, MATTE_NORMAL, Ledger
from ..geometry.accel import FAR, Hits
from ..geometry.attributes import OPACITY, VECTOR
from ..geometry.surface import Points
from ..plan import Plan
from ..sampling.dimensions import OCCLUSION_ITEM, WORLD, dimension
from ..sampling.draws import Draws
from ..scene import ACTIVE_UV
from ..shading import Arrival
from ..statistics import Tally
from .direct import starts
from .radiance import Radiance, weigh
from .receiver import Receiver, Sample
from .shadow import passed
from .state import Paths, Rays


def record(
    plan: Plan,
    paths: Paths,
    points: Points,
    arrival: Arrival,
    draws: Draws,
    depth: int,
    radiance: Radiance,
    tally: Tally,
) -> Paths:
    """Write down what is seen at points; return the paths, which remember that it is done."""
    ledger = plan.ledger
    if ledger is None or radiance.book is None:
        return paths
    index = np.flatnonzero(paths.is_straight)
    if not index.size:
        return paths
    slot = paths.slots(index)
    if index.size < paths.size:
        points, arrival = points.take(index), arrival.take(index)
    weight = take(paths.throughput, index)
    alpha = _alpha(plan, points, arrival)
    seen: Scalar | np.float32 = F32(1) if alpha is None else alpha.mean(axis=0)

    # Who has not shown a surface yet does so at the first that is opaque enough.
    is_fresh = np.ones(index.size, bool) if paths.shown is None else ~paths.shown.take(index)
    is_first = is_fresh & (seen >= ledger.alpha_threshold)
    normal = _show_facts(
        plan, ledger, points, arrival, weight, slot, is_fresh, is_first, seen, radiance
    )
    if (row := ledger.row("uv")) is not None:
        some = np.flatnonzero(is_first)
        radiance.enter(row, _uv(plan, points.take(some)), slot.take(some))
    if plan.speeds is not None and (row := ledger.row("speed")) is not None:
        assert plan.triangles is not None
        some = np.flatnonzero(is_first)
        speed = plan.speeds.at(plan.triangles, points.take(some))
        radiance.enter(row, _counted(speed), slot.take(some))
    if ledger.looks_once and plan.has_transparent:
        shown = np.zeros(paths.size, bool) if paths.shown is None else paths.shown.copy()
        shown[index] |= seen >= ledger.alpha_threshold
        paths = replace(paths, shown=shown)

    # What all surfaces behind each other share
    share = np.broadcast_to(seen, index.size)
    if weight is not None:
        both = weight if alpha is None else weight * alpha
        share = both.mean(axis=0)
    if (row := ledger.row("mist")) is not None:
        radiance.enter(row, (share * _clearness(plan, ledger, points))[None], slot)
    if (row := ledger.row("reach")) is not None:
        radiance.enter(row, (share * _distance(plan, points, arrival))[None], slot)
    if ledger.mattes:
        covered = seen if weight is None else seen * weight.mean(axis=0)
        covered = np.broadcast_to(covered, index.size)
        assert points.instance is not None
        owner = owners(points.instance, points.material, ledger.materials)
        radiance.seen.append(Seen(slot, owner, covered))
    if (row := ledger.row("occlusion")) is not None:
        before = take(paths.passed, index)
        light = _occlusion(plan, ledger, points, normal, slot, before, draws, depth, tally)
        light = np.broadcast_to(light, (3, index.size))
        light = light if alpha is None else light * alpha
        radiance.enter(row, light if weight is None else light * weight, slot)
    tally.lap("film")
    return paths


def record_far_away(plan: Plan, rays: Rays, paths: Paths, hits: Hits, radiance: Radiance) -> None:
    """Write down what is seen where rays met nothing."""
    if plan.speeds is None or plan.ledger is None or radiance.book is None:
        return
    row = plan.ledger.row("speed")
    is_first = paths.is_straight & (hits.triangle < 0)
    some = np.flatnonzero(is_first if paths.shown is None else is_first & ~paths.shown)
    if row is not None and some.size:
        speed = plan.speeds.far_away(rays.direction.take(some, axis=1))
        radiance.enter(row, _counted(speed), paths.slots(some))


def _alpha(plan: Plan, points: Points, arrival: Arrival) -> Vec | None:
    """Return how opaque points are (3, n), None if nothing in the scene is transparent."""
    if not plan.has_transparent:
        return None
    return np.clip(F32(1) - plan.surfaces.transparency(points, arrival), F32(0), F32(1))


def _show_facts(
    plan: Plan,
    ledger: Ledger,
    points: Points,
    arrival: Arrival,
    weight: Vec | None,
    slot: Index,
    is_fresh: NDArray[np.bool_],
    is_first: NDArray[np.bool_],
    seen: Scalar | np.float32,
    radiance: Radiance,
) -> Vec:
    """Write down what surfaces tell of themselves; return the normals (3, n) that occlusion has."""
    normal = points.normal
    for index, facts in plan.surfaces.facts(points, arrival) if ledger.shown else ():
        some = np.arange(points.size) if index is None else index
        for name, fact in facts.items():
            fact = np.atleast_2d(fact)
            fact = np.broadcast_to(fact, (len(fact), some.size))
            if name == MATTE_NORMAL:
                normal = normal.copy() if normal is points.normal else normal
                normal[:, some] = fact
                continue
            row = ledger.row(name)
            if row is None:
                continue
            if name == "bearing":
                assert plan.surfaces.place.view is not None
                opacity = np.broadcast_to(seen, points.size).take(some)
                fact = plan.surfaces.place.view.turn(fact) * opacity
            if name in (*LOBES, "albedo", "bearing"):
                colour = weigh(fact, take(weight, some))
                radiance.enter(row, colour, slot.take(some))
                continue

            # Values of the user are written before it is known how opaque a surface is (Cycles).
            kept = np.flatnonzero((is_first if name == "normal" else is_fresh).take(some))
            if name.startswith("aov_color"):
                alpha = facts[f"aov_alpha:{name.partition(':')[2]}"]
                fact = np.concatenate([fact, np.broadcast_to(alpha, (1, some.size))])
            radiance.enter(row, fact.take(kept, axis=1), slot.take(some.take(kept)))
    return normal


def _uv(plan: Plan, points: Points) -> Vec:
    """Return u, v and 1 of the UV map that the file renders with (3, n); 0 where there is none."""
    attributes = plan.surfaces.place.attributes
    assert points.instance is not None and points.u is not None and points.v is not None
    at = points.triangle, points.instance, points.u, points.v
    uv = attributes[ACTIVE_UV, VECTOR].at(*at)[:2]
    return np.concatenate([uv, attributes[ACTIVE_UV, OPACITY].at(*at)[:1]])


def _counted(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return values (C, n) and, for each, 1 (C + 1, n)."""
    return np.concatenate([values, np.ones((1, values.shape[1]), F32)])


def _distance(plan: Plan, points: Points, arrival: Arrival) -> Scalar:
    """Return how far (n,) [m] points are behind the near clipping plane, along their rays."""
    far = points.distance if arrival.length is None else points.distance + arrival.length
    view = plan.surfaces.place.view
    assert view is not None
    if view.panorama is not None:
        return far - view.clip
    return far - view.clip / dot(view.axes[2][:, None], points.arriving)


def _clearness(plan: Plan, ledger: Ledger, points: Points) -> Scalar:
    """Return how much of points (n,) mist does not hide."""
    view, mist = plan.surfaces.place.view, ledger.mist
    assert view is not None
    place = view.point(points.position)
    is_parallel = not view.is_perspective and view.panorama is None
    far = np.abs(place[2]) if is_parallel else np.sqrt(dot(place, place))
    grown = (far - F32(mist.start)) / F32(mist.depth) if mist.depth > 0 else np.zeros_like(far)
    return F32(1) - np.clip(grown, F32(0), F32(1)) ** F32(mist.power)


def _occlusion(
    plan: Plan,
    ledger: Ledger,
    points: Points,
    normal: Vec,
    slot: Index,
    passed_before: NDArray[np.int16] | None,
    draws: Draws,
    depth: int,
    tally: Tally,
) -> Scalar | Vec:
    """Return whether nothing is near in a direction drawn about normals (3, n)."""
    assert plan.accel is not None
    u, v = draws.pair(dimension(WORLD, depth, OCCLUSION_ITEM), slot)
    direction = sample_about((), normal, u, v)[0]
    one = np.ones(points.size, F32)
    far = min(F32(ledger.occlusion_distance), FAR)
    sample = Sample(direction, one, np.ones((3, 1), F32), one, None, None, far, 0)
    to = Receiver(points, (), slot, None, passed=passed_before)
    tally.rays_shadow += points.size
    reach = np.full(points.size, far, F32)
    return passed(plan, to, starts(plan, to, sample), sample, reach, None, depth, tally)
