"""camera paths -> radiance per slot.  THE LOOP.

Path tracing with next-event estimation; with splitting on, its first bounces are the ray tree of
recursive ray tracing.  Sources: Kajiya 1986, "The Rendering Equation"; Whitted 1980, "An Improved
Illumination Model for Shaded Display".
"""

import threading

import numpy as np

from ..arrays import F32, Index, Scalar, Vec
from ..geometry import surface
from ..geometry.accel import FAR, Hits
from ..geometry.surface import Points
from ..plan import Plan
from ..sampling.draws import Draws
from ..statistics import Tally
from . import direct, emission
from .radiance import Radiance
from .scatter import scatter
from .state import Paths, Rays


def trace(
    plan: Plan, rays: Rays, draws: Draws, tally: Tally, stop: threading.Event
) -> tuple[Vec, Scalar | None]:
    """Follow camera rays to their ends; return radiance (3, slots) and alpha (slots,) or None.

    Unbiased but for the bounce limits and clamps of the settings.  Once `stop` is set it returns
    before the next bounce, with what must then not be used.
    """
    paths = Paths(rays.size)
    radiance = Radiance(rays.size, plan.clamp_direct, plan.clamp_indirect)
    alpha = np.zeros(rays.size, F32) if plan.film_transparent else None
    bounce = 0
    while rays.size and not stop.is_set():
        hits = _closest(plan, rays, tally)  # rays -> hits
        found = np.flatnonzero(hits.triangle >= 0)
        if alpha is not None and bounce == 0:
            alpha[found] = 1
        emission.add_world(plan, paths, hits, found, bounce, radiance)
        emission.add_lamps(plan, rays, paths, hits, bounce, radiance, tally)
        if not found.size:
            break

        points = _resolve(plan, rays, hits, found)  # hits -> points
        if found.size < rays.size:
            paths = paths.take(found)
        tally.lap("surface")
        emission.add_emission(plan, paths, points, bounce, radiance)
        paths, points = _without_last(paths, points)
        if not paths.size:
            break

        closures = plan.surfaces.run(points)  # points -> closures
        closures.attenuate(paths.throughput)
        tally.vertices += paths.size
        tally.lap("shading")
        if plan.lights is not None:
            direct.add(plan, points, closures, paths, draws, bounce, radiance, tally)
            tally.lap("lights")
        rays, paths, draws = scatter(plan, paths, points, closures, draws, bounce, radiance, tally)
        tally.lap("scatter")
        bounce += 1
    return radiance.fold(), alpha


def _closest(plan: Plan, rays: Rays, tally: Tally) -> Hits:
    if plan.accel is None:
        nothing = np.full(rays.size, -1, np.int32)
        zero = np.zeros(rays.size, F32)
        return Hits(np.full(rays.size, FAR), nothing, zero, zero)
    return plan.accel.closest(rays.origin, rays.direction, rays.far, rays.left, tally)


def _resolve(plan: Plan, rays: Rays, hits: Hits, found: Index) -> Points:
    assert plan.triangles is not None
    some = None if found.size == rays.size else found
    return surface.resolve(plan.triangles, rays.origin, rays.direction, hits, some)


def _without_last(paths: Paths, points: Points) -> tuple[Paths, Points]:
    """Drop paths that have used up their bounces."""
    if paths.last is None:
        return paths, points
    going = np.flatnonzero(~paths.last)
    return paths.take(going), points.take(going)
