"""paths -> Arrival.  What shading may know of how paths came to points, and who ends there."""

import numpy as np

from ..arrays import F32
from ..bsdf import CAMERA
from ..geometry.surface import Points
from ..plan import Plan
from ..sampling.draws import Draws
from ..shading import SHARP, Arrival, Probe
from ..statistics import Tally
from .state import Paths


def describe(
    plan: Plan,
    paths: Paths,
    depth: int,
    draws: Draws | None = None,
    tally: Tally | None = None,
) -> Arrival:
    """Return how paths arrive, `depth` surfaces after the camera.

    With `draws` and `tally` shaders may trace rays of their own.
    """
    blur = None
    if plan.blur_glossy > 0 and paths.least_pdf is not None:
        # Blender's measure: the less likely the path so far, the rougher what it meets.
        likely = np.minimum(paths.least_pdf * F32(1 / plan.blur_glossy), F32(1))
        blur = F32(0.5) * np.sqrt(F32(1) - likely)
    return Arrival(
        CAMERA if paths.kind is None else paths.kind,
        depth,
        paths.travelled,
        paths.count,
        paths.total,
        paths.passed,
        blur,
        None if plan.surfaces.reach is None else _probe(paths, depth, draws, tally),
    )


def _probe(paths: Paths, depth: int, draws: Draws | None, tally: Tally | None) -> Probe | None:
    if draws is None or tally is None:
        return None
    least = paths.least_pdf
    return Probe(draws, paths.slot, depth, tally, None if least is None else least >= SHARP)


def at_lamps(paths: Paths, depth: int) -> Arrival:
    """Return how lamps see rays to them: as of no kind, and one bounce further (Cycles)."""
    total = depth + 1 if paths.total is None else paths.total + np.int16(1)
    return Arrival(0, depth, None, paths.count, total, paths.passed)


def retire(
    plan: Plan, paths: Paths, points: Points
) -> tuple[Paths, Points, tuple[Paths, Points] | None]:
    """Return the paths that go on scattering, and those that may only pass straight, or None."""
    if paths.last is None:
        return paths, points, None
    ends = paths.last
    if paths.passed is not None:
        # Blender stops at the surface after the last that may be passed; one always may.
        is_over = (paths.passed > 0) & (paths.passed >= plan.transparent_passes)
        ends = ends | is_over
    going = np.flatnonzero(~ends)
    ended = None
    if plan.has_transparent:
        sees = plan.surfaces.is_transparent.take(points.material) & ends & ~is_over
        through = np.flatnonzero(sees)
        if through.size:
            ended = paths.take(through), points.take(through)
    if going.size == ends.size:
        return paths, points, ended
    return paths.take(going), points.take(going), ended
