"""paths, hits -> radiance.  Light that paths run into: the world, glowing surfaces, lamps.

Lamps were already sampled on purpose at rough surfaces, so rays from those do not count them
again; camera rays and mirrored or refracted rays do, where the lamp lets itself be seen.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar, Vec, dot, take
from ..bsdf import CAMERA, DIFFUSE, EVERY_KIND
from ..geometry.accel import Hits
from ..geometry.surface import Points
from ..lights import Lights, meet, visible
from ..plan import LampHulls, Plan
from ..statistics import Tally
from .radiance import Radiance, weigh
from .state import Paths, Rays

# Lamps that one ray can cross; Blender counts those behind each other up to 8.
MOST_CROSSINGS = 64


def add_world(
    plan: Plan, paths: Paths, hits: Hits, found: Index, bounce: int, radiance: Radiance
) -> None:
    """Add the world's light to the paths that have left the scene, all but `found` (M,)."""
    if plan.world is None or found.size == paths.size or (plan.film_transparent and bounce == 0):
        return
    escaped = np.flatnonzero(hits.triangle < 0)
    if plan.world_seen_by != EVERY_KIND:
        seen = visible(plan.world_seen_by, _kinds(paths).take(escaped))
        escaped = escaped.take(np.flatnonzero(seen))
    light = np.broadcast_to(plan.world, (3, escaped.size))
    _add(light, paths, escaped, bounce, radiance)


def add_emission(plan: Plan, paths: Paths, points: Points, bounce: int, radiance: Radiance) -> None:
    """Add the light of glowing surfaces to the paths that have hit them."""
    if plan.surfaces.emission is None:
        return
    light = plan.surfaces.emission.take(points.material, axis=1)
    glowing = np.flatnonzero(light.any(axis=0))
    if glowing.size:
        _add(light.take(glowing, axis=1), paths, glowing, bounce, radiance)


def add_lamps(
    plan: Plan,
    rays: Rays,
    paths: Paths,
    hits: Hits,
    bounce: int,
    radiance: Radiance,
    tally: Tally,
) -> None:
    """Add the light of lamps that paths cross before their hit; lamps do not block."""
    if plan.lights is None or not plan.lamps_seen_by:
        return
    kinds = _kinds(paths)
    met = (kinds & plan.lamps_seen_by) != 0
    index = np.flatnonzero(met & ((kinds & DIFFUSE) == 0))
    kinds = kinds.take(index)
    if not index.size:
        return

    # Distant lamps are only met by rays that leave the scene: those reach to infinity.
    reach = hits.t.take(index)
    reach[np.flatnonzero(hits.triangle.take(index) < 0)] = np.inf
    origins = np.broadcast_to(rays.origin, rays.direction.shape)
    origin, direction = origins.take(index, axis=1), rays.direction.take(index, axis=1)
    if plan.lamp_hulls is None:
        light = meet(plan.lights, origin, direction, reach, kinds)
    else:
        light = _meet_by_hulls(plan.lamp_hulls, plan.lights, origin, direction, reach, kinds, tally)
    lit = np.flatnonzero(light.any(axis=0))
    if lit.size:
        _add(light.take(lit, axis=1), paths, index.take(lit), bounce, radiance)


def _kinds(paths: Paths) -> NDArray[np.uint8]:
    return np.full(paths.size, CAMERA, np.uint8) if paths.kind is None else paths.kind


def _meet_by_hulls(
    lamp_hulls: LampHulls,
    lights: Lights,
    origin: Vec,
    direction: Vec,
    reach: Scalar,
    kinds: NDArray[np.uint8],
    tally: Tally,
) -> Vec:
    """Return what `lights.meet` does, at a cost that does not grow with the number of lamps.

    Walks from hull to hull; a lamp counts where the ray leaves its hull, which it does once.
    """
    light = meet(lights, origin, direction, reach, kinds, lights.distant)
    index = np.arange(reach.size)
    start = origin
    for _ in range(MOST_CROSSINGS):
        hits = lamp_hulls.accel.closest(start, direction, None, None, tally)
        found = np.flatnonzero(hits.triangle >= 0)
        if not found.size:
            break
        index, direction = index.take(found), direction.take(found, axis=1)
        origin, start = origin.take(found, axis=1), start.take(found, axis=1)
        triangle, t = hits.triangle.take(found), hits.t.take(found)

        # Shine where the ray leaves a lamp, before its own end.
        normal = lamp_hulls.triangles.columns(triangle)[:3]
        closed = lamp_hulls.hulls.is_closed.take(triangle)
        leaving = np.flatnonzero(~closed | (dot(normal, direction) > 0))
        owner = lamp_hulls.hulls.light.take(triangle.take(leaving))
        for where, lamps in lights.split(owner):
            some = leaving.take(where)
            ray = index.take(some)
            distance, gain, _ = lamps.kind.intersect(
                lamps.rows, origin.take(some, axis=1), direction.take(some, axis=1)
            )
            gain *= (distance < reach.take(ray)) & visible(lamps.seen_by, kinds.take(ray))
            for channel, value in zip(light, lamps.colour * gain, strict=True):
                channel[ray] += value

        # Go on just behind this hull.
        size = np.abs(start).max(axis=0) + t
        start = start + direction * (t + size * F32(2.0**-20))
    return light


def _add(light: np.ndarray, paths: Paths, index: Index, bounce: int, radiance: Radiance) -> None:
    # What a first bounce finds is still direct light, of a mesh or of the sky.
    slot = index if paths.slot is None else paths.slot.take(index)
    radiance.add(weigh(light, take(paths.throughput, index)), slot, bounce - 1)
