"""paths at shadow catchers -> radiance with all around them, and alone.

Where a path that has gone straight on meets a shadow catcher, it leaves the picture: the catcher is
a hole in it.  The path goes on twice instead: in the scene as it is, and in one where catchers and
their lights are alone, by the same random numbers.  The film compares the two.  All other rays meet
a catcher as any object.  Source: Cycles, integrator_split_shadow_catcher.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import F32, Scalar, Vec
from ..geometry.surface import Points
from ..plan import Plan
from ..sampling.draws import Draws
from .emission import add_background
from .radiance import Radiance
from .state import Paths


@dataclass(frozen=True, eq=False)
class Caught:
    """Paths at their first shadow catcher, after `depth` bounces, and where their light goes."""

    paths: Paths
    points: Points
    draws: Draws
    depth: int
    among_all: Radiance
    alone: Radiance


def catch(
    plan: Plan, paths: Paths, points: Points, draws: Draws, depth: int, radiance: Radiance
) -> tuple[Paths, Points, Caught | None]:
    """Return the paths that are not at a shadow catcher, and those that are, or None."""
    assert plan.triangles is not None and plan.triangles.objects is not None
    assert points.instance is not None
    is_caught = plan.triangles.objects.catches.take(points.instance) & paths.is_straight
    found = np.flatnonzero(is_caught)
    if not found.size:
        return paths, points, None
    other = np.flatnonzero(~is_caught)
    caught = Caught(
        paths.take(found),
        points.take(found),
        draws,
        depth,
        radiance.twin(keeps_book=True),
        radiance.twin(),
    )

    # A hole in the picture, which the catcher fills as far as opacity goes.
    shows, slots = paths.shows(found), paths.slots(found)
    radiance.add_hole(shows, slots)
    caught.among_all.add_hole(-shows, slots)
    if plan.has_background:
        add_background(plan, paths, found, points.arriving, radiance)
    return paths.take(other), points.take(other), caught


def gather(radiance: Radiance, caught: Sequence[Caught]) -> tuple[Vec | Scalar, ...]:
    """Return what the film asks of each sample, in the order of its passes."""
    picture, holes, background = radiance.fold()
    assert holes is not None
    all_holes = holes.copy()
    among_all, alone = np.zeros_like(picture), np.zeros_like(picture)
    for each in caught:
        for source, sum_ in ((each.among_all, among_all), (each.alone, alone)):
            light, more_holes, behind = source.fold()
            sum_ += light
            if more_holes is not None:
                all_holes += more_holes
            if background is not None and behind is not None:
                background += behind
            if source.book is not None and radiance.book is not None:
                radiance.book += source.book
                radiance.seen += source.seen
    found = picture, F32(1) - holes, among_all, F32(1) - all_holes, alone
    return found if background is None else (*found, background)
