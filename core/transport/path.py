"""camera paths -> radiance per slot.  THE LOOP.

Path tracing with next-event estimation; with splitting on, its first bounces are the ray tree of
recursive ray tracing.  Sources: Kajiya 1986, "The Rendering Equation"; Whitted 1980, "An Improved
Illumination Model for Shaded Display".
"""

import threading
from dataclasses import replace

import numpy as np

from ..arrays import F32, Index, Scalar, Vec
from ..film.cryptomatte import Seen
from ..geometry import surface
from ..geometry.accel import FAR, Hits
from ..geometry.surface import Points
from ..plan import Plan
from ..sampling.draws import Draws
from ..shading import Shaded
from ..statistics import Tally
from ..tiles import Tiles
from . import direct, emission
from .arrival import describe, retire
from .catcher import Caught, catch, gather
from .holdout import add_held_out, add_holdout, hold_out
from .radiance import Radiance
from .record import record, record_far_away
from .reuse import Reuse
from .scatter import NO_RAYS, pass_straight, scatter, splits_lobes
from .state import Paths, Rays


def trace(
    plan: Plan,
    rays: Rays,
    paths: Paths,
    draws: Draws,
    tally: Tally,
    stop: threading.Event,
    tiles: Tiles | None = None,
) -> tuple[tuple[Vec | Scalar, ...], list[Seen]]:
    """Follow camera rays to their ends; return what the film's passes ask for, (rows, slots).

    And, for cryptomattes, the parts of slots that were seen.  There may be fewer paths than slots;
    slots without one stay black and opaque (Cycles).
    Unbiased but for the bounce limits and clamps of the settings.  Once `stop` is set it returns
    before the next bounce, with what must then not be used.
    """
    radiance = Radiance(
        draws.key.size,
        plan.clamp_direct,
        plan.clamp_indirect,
        plan.has_alpha,
        plan.has_background,
        plan.ledger,
    )
    start = rays, paths, draws
    if plan.alone is None:
        reuse = None if tiles is None else Reuse(tiles, plan.scatter_samples, draws.key.size)
        _follow(plan, *start, 0, radiance, tally, stop, None, reuse)
        light, holes, _ = radiance.fold()
        found: tuple[Vec | Scalar, ...] = (light,)
        if holes is not None:
            found = light, F32(1) - holes
        return _with_book(found, radiance), radiance.seen

    # What shadow catchers show goes on in two scenes.
    caught: list[Caught] = []
    _follow(plan, *start, 0, radiance, tally, stop, caught)
    for each in caught:
        for scene, light_there in ((plan, each.among_all), (plan.alone, each.alone)):
            start = _bounce(
                scene, each.paths, each.points, each.draws, each.depth, light_there, tally
            )
            _follow(scene, *start, each.depth + 1, light_there, tally, stop, None)
    return _with_book(gather(radiance, caught), radiance), radiance.seen


def _with_book(found: tuple[Vec | Scalar, ...], radiance: Radiance) -> tuple[Vec | Scalar, ...]:
    return found if radiance.book is None else (*found, radiance.book)


def _follow(
    plan: Plan,
    rays: Rays,
    paths: Paths,
    draws: Draws,
    depth: int,
    radiance: Radiance,
    tally: Tally,
    stop: threading.Event,
    caught: list[Caught] | None,
    reuse: Reuse | None = None,
) -> None:
    """Follow paths to their ends, or to shadow catchers if `caught` collects what meets them."""
    while rays.size and not stop.is_set():
        if radiance.is_timed:
            radiance.charge(paths.slots(np.arange(paths.size)))
        hits = _closest(plan, rays, paths, tally)  # rays -> hits
        found = np.flatnonzero(hits.triangle >= 0)
        emission.add_world(plan, rays, paths, hits, found, depth, radiance)
        emission.add_lamps(plan, rays, paths, hits, depth, radiance, tally)
        record_far_away(plan, rays, paths, hits, radiance)
        if not found.size:
            break

        points = _resolve(plan, rays, paths, hits, found)  # hits -> points
        if found.size < rays.size:
            paths = paths.take(found)
        if caught is not None:
            paths, points, some = catch(plan, paths, points, draws, depth, radiance)
            caught += [] if some is None else [some]
        rays, paths, draws = _bounce(plan, paths, points, draws, depth, radiance, tally, reuse)
        depth += 1
    if radiance.is_timed:
        radiance.charge(None)


def _bounce(
    plan: Plan,
    paths: Paths,
    points: Points,
    draws: Draws,
    depth: int,
    radiance: Radiance,
    tally: Tally,
    reuse: Reuse | None = None,
) -> tuple[Rays, Paths, Draws]:
    """Add the light that paths get at points; return how they go on."""
    arrival = describe(plan, paths, depth, draws, tally)
    points = plan.surfaces.bend(points, arrival)
    paths, points, held = hold_out(plan, paths, points)
    if held is not None:
        arrival = describe(plan, paths, depth, draws, tally)
    tally.lap("surface")
    emission.add_emission(plan, paths, points, arrival, depth, radiance)
    add_holdout(plan, paths, points, arrival, radiance)

    # Paths at the end of their bounces, or at objects held out, only look through what they meet.
    paths, points, ended = retire(plan, paths, points)
    if held is not None:
        held = add_held_out(plan, *held, describe(plan, held[0], depth, draws, tally), radiance)
    pieces = []
    for some in (ended, held):
        if some is not None:
            arrival = describe(plan, some[0], depth, draws, tally)
            piece = pass_straight(plan, *some, arrival, draws, depth, tally)
            pieces += [] if piece is None else [piece]
    if not paths.size and not pieces:
        return NO_RAYS, paths, draws

    shaded: tuple[Shaded, ...] = ()
    if paths.size:
        arrival = describe(plan, paths, depth, draws, tally)
        if radiance.book is not None:
            paths = record(plan, paths, points, arrival, draws, depth, radiance, tally)
        points = _placed(plan, points, depth)
        shaded = plan.surfaces.shade(  # points -> closures
            points, arrival, paths.throughput, not splits_lobes(plan, depth), plan.mixes_kinds
        )
        tally.vertices += paths.size
        tally.lap("shading")
        if reuse is not None and depth == 0:
            reuse.depart(points, shaded, paths)
        elif reuse is not None and depth == 1:
            paths, parents = reuse.meet(plan, paths, points, shaded, radiance, tally)
            draws = draws.twin(parents) if parents.size else draws
        if plan.has_lights:
            direct.add(plan, points, shaded, paths, draws, depth, radiance, tally)
            tally.lap("lights")
    way = draws, depth, radiance, tally, reuse
    scattered = scatter(plan, paths, points, shaded, pieces, *way)
    tally.lap("scatter")
    return scattered


def _closest(plan: Plan, rays: Rays, paths: Paths, tally: Tally) -> Hits:
    if plan.accel is None:
        nothing = np.full(rays.size, -1, np.int32)
        zero = np.zeros(rays.size, F32)
        return Hits(np.full(rays.size, FAR), nothing, zero, zero)
    way = rays.origin, rays.direction, rays.far, rays.left
    return plan.accel.closest(*way, paths.kind, tally, paths.time)


def _resolve(plan: Plan, rays: Rays, paths: Paths, hits: Hits, found: Index) -> Points:
    assert plan.triangles is not None
    some = None if found.size == rays.size else found
    way = rays.origin, rays.direction
    return surface.resolve(plan.triangles, *way, hits, some, paths.time)


def _placed(plan: Plan, points: Points, depth: int) -> Points:
    """Return the points with what lights are chosen by there, if any are."""
    if not plan.needs_place:
        return points
    if plan.lights is None:
        return replace(points, place=np.full(points.size, -1 if depth == 0 else 0, np.int32))
    normal = None if plan.surfaces.lights_both_sides else points.normal
    return replace(points, place=plan.lights.place(points.position, normal, depth))
