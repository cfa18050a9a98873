"""paths, points -> holes.  What is held out: holes in the picture where the camera sees it.

They are cut only while the path has gone straight on, through what is transparent to the film.  A
surface may be held out by its shader, which then says how deep, or as a whole object: of that,
nothing is left but its transparency (Cycles).  To all other rays it is what it is.
"""

import numpy as np

from ..geometry.surface import Points
from ..plan import Plan
from ..shading import Arrival
from .radiance import Radiance
from .state import Paths


def add_holdout(
    plan: Plan, paths: Paths, points: Points, arrival: Arrival, radiance: Radiance
) -> None:
    """Cut the holes that shaders ask for."""
    if not plan.surfaces.has_holdout:
        return
    seen = paths.is_straight
    for index, depth in plan.surfaces.holdout(points, arrival):
        index = np.arange(points.size) if index is None else index
        some = np.flatnonzero(seen.take(index))
        if some.size:
            hole = np.broadcast_to(depth, index.size).take(some)
            index = index.take(some)
            radiance.add_hole(hole * paths.shows(index), paths.slots(index))


def hold_out(
    plan: Plan, paths: Paths, points: Points
) -> tuple[Paths, Points, tuple[Paths, Points] | None]:
    """Return the paths that are not at an object held out, and those that are, or None."""
    if not plan.has_held_out:
        return paths, points, None
    assert plan.triangles is not None and plan.triangles.objects is not None
    assert points.instance is not None
    is_held = plan.triangles.objects.holdout.take(points.instance) & paths.is_straight
    held = np.flatnonzero(is_held)
    if not held.size:
        return paths, points, None
    other = np.flatnonzero(~is_held)
    return paths.take(other), points.take(other), (paths.take(held), points.take(held))


def add_held_out(
    plan: Plan, paths: Paths, points: Points, arrival: Arrival, radiance: Radiance
) -> tuple[Paths, Points] | None:
    """Cut the holes of objects held out; return the paths that may pass straight, or None."""
    transparency = plan.surfaces.transparency(points, arrival)
    hole = 1 - transparency
    if paths.throughput is not None:
        hole *= paths.throughput
    every = np.arange(paths.size)
    radiance.add_hole(hole.mean(axis=0), paths.slots(every))
    passes = transparency.any(axis=0)
    if paths.passed is not None:
        passes &= paths.passed <= plan.transparent_passes
    through = np.flatnonzero(passes)
    return (paths.take(through), points.take(through)) if through.size else None
