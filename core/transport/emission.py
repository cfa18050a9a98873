"""paths, hits -> radiance.  Light that paths run into: the world, glowing surfaces, lamps.

What was also sampled on purpose where the path was scattered last is weighted against that.  Rays
from matte closures never look for lamps, which were sampled in full there; camera rays, mirrored
and refracted ones do, where the lamp lets itself be seen.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec, dot, take, unit
from ..bsdf import CAMERA, DIFFUSE, EVERY_KIND, GLOSSY, TRANSMISSION, sent_as
from ..geometry.accel import Hits
from ..geometry.surface import Points, resolve
from ..lights import Group as LampGroup
from ..lights import Lights, triangle, visible
from ..lights.kind import Sampled
from ..plan import LampHulls, Plan
from ..shading import Arrival, LampShaders
from ..statistics import Tally
from .arrival import at_lamps
from .book import Apart, enter_glow, enter_lamps, enter_world, has_groups
from .mis import power_weight
from .radiance import Radiance, weigh
from .state import Paths, Rays

# Lamps that one ray can cross; Blender counts those behind each other up to 8.
MOST_CROSSINGS = 64


def add_world(
    plan: Plan,
    rays: Rays,
    paths: Paths,
    hits: Hits,
    found: Index,
    depth: int,
    radiance: Radiance,
) -> None:
    """Add the world's light to the paths that have left the scene, all but `found` (M,)."""
    if found.size == paths.size or (plan.world is None and not plan.film_transparent):
        return
    escaped = np.flatnonzero(hits.triangle < 0)
    if plan.film_transparent:
        # Where the camera sees the world, directly or through transparent surfaces, is a hole.
        straight = paths.is_straight.take(escaped)
        hole = escaped.take(np.flatnonzero(straight))
        if hole.size:
            radiance.add_hole(paths.shows(hole), paths.slots(hole))
        escaped = escaped.take(np.flatnonzero(~straight))
    if plan.world is None or not escaped.size:
        return
    if radiance.background is not None:
        add_background(plan, paths, escaped, rays.direction, radiance)
    kinds = paths.kinds.take(escaped)
    if plan.world_seen_by != EVERY_KIND:
        # Who was sampled on purpose is seen by the kind that was lit.
        by_sender = plan.mixes_kinds and plan.environment is not None
        by = sent_as(kinds) if by_sender else kinds
        seen = np.flatnonzero(visible(plan.world_seen_by, by))
        escaped, kinds = escaped.take(seen), kinds.take(seen)
    direction = rays.direction.take(escaped, axis=1)
    light = plan.world.radiance(direction, kinds)
    if plan.environment is not None and paths.pdf is not None:
        assert paths.place is not None
        pdf = plan.environment.pdf(direction)
        pdf *= _samples_at(plan, paths.place.take(escaped))
        light = light * power_weight(paths.pdf.take(escaped), pdf)
    light = np.broadcast_to(light, (3, escaped.size))
    kept = _add(light, paths, escaped, depth, radiance)
    if radiance.sorts_light:
        enter_world(plan, light * kept, paths, escaped, depth, radiance)


def add_background(
    plan: Plan, paths: Paths, index: Index, direction: Vec, radiance: Radiance
) -> None:
    """Tell what of the world the camera sees straight on along paths `index` (M,).

    direction (3, N) is of all paths; what they meet is not asked.
    """
    if plan.world is None or not plan.world_seen_by & CAMERA:
        return
    index = index.take(np.flatnonzero(paths.is_straight.take(index)))
    if index.size:
        light = plan.world.radiance(direction.take(index, axis=1), CAMERA)
        light = np.broadcast_to(light, (3, index.size))
        light = weigh(light, take(paths.throughput, index))
        radiance.add_background(light, paths.slots(index))


def add_emission(
    plan: Plan,
    paths: Paths,
    points: Points,
    arrival: Arrival,
    depth: int,
    radiance: Radiance,
) -> None:
    """Add the light of glowing surfaces to the paths that have hit them."""
    if not plan.surfaces.glows.any():
        return
    for index, light in plan.surfaces.emission(points, arrival):
        index = np.arange(points.size) if index is None else index
        light = np.broadcast_to(light, (3, index.size))
        glowing = np.flatnonzero(light.any(axis=0))
        if not glowing.size:
            continue
        if glowing.size < index.size:
            index, light = index.take(glowing), light.take(glowing, axis=1)
        if plan.lights is not None and plan.lights.of_triangle is not None:
            light = light * _share(plan, plan.lights, paths, points, index, depth)
        kept = _add(light, paths, index, depth, radiance)
        if radiance.sorts_light:
            enter_glow(plan, light * kept, paths, points, index, depth, radiance)


def _share(
    plan: Plan, lights: Lights, paths: Paths, points: Points, index: Index, depth: int
) -> Scalar | np.float32:
    """Return the weight (n,) of glowing points `index` that were sampled on purpose as well."""
    if paths.pdf is None:
        return F32(1)
    assert lights.of_triangle is not None and paths.place is not None
    weight = np.ones(index.size, F32)
    light = lights.of_triangle.take(points.triangle.take(index))
    found = np.flatnonzero((light >= 0) & (paths.pdf.take(index) < np.inf))
    if not found.size:
        return weight
    light, index = light.take(found), index.take(found)

    # See the triangle from where the path was scattered last.
    group = lights.groups[-1].take(light - np.int32(lights.first_triangle))
    direction, t = points.arriving.take(index, axis=1), points.distance.take(index)
    if paths.travelled is not None:
        t = t + paths.travelled.take(index)
    origin = points.position.take(index, axis=1) - direction * t
    pdf = triangle.pdf(group.rows, origin, t)
    place = paths.place.take(index)
    pdf *= lights.pmf(place, light)
    pdf *= _samples_at(plan, place)
    if paths.kind is not None:
        kinds = paths.kind.take(index)
        pdf *= (group.seen_by & _lit_as(sent_as(kinds) if plan.mixes_kinds else kinds)) != 0
    if paths.receiver is not None:
        pdf *= _linked(group, paths.receiver.take(index))
    weight[found] = power_weight(paths.pdf.take(index), pdf)
    return weight


def _samples_at(plan: Plan, place: Ids) -> Scalar | np.float32:
    """Return how many samples each light got at places (N,): more at first hits."""
    if plan.light_samples == 1:
        return F32(1)
    return np.where(place < 0, F32(plan.light_samples), F32(1))


def _lit_as(kinds: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the kinds by which a light had to be seen to be sampled where rays come from."""
    return np.where(kinds & DIFFUSE, np.uint8(DIFFUSE), kinds & np.uint8(GLOSSY | TRANSMISSION))


def _linked(group: LampGroup, receiver: NDArray[np.uint8]) -> NDArray[np.bool_]:
    return ((group.receivers >> receiver.astype(np.uint64)) & np.uint64(1)) > 0


def emitted(plan: Plan, number: Ids, origin: Vec, sampled: Sampled, place: Vec, depth: int) -> Vec:
    """Return the radiance (3, N) of points of the triangles `number` (N,) that were sampled.

    place (2, N) are their barycentrics; they are seen from `origin` (3, N).
    """
    assert plan.triangles is not None
    direction = unit(sampled.to_light, sampled.distance)
    hits = Hits(sampled.distance, number, place[0], place[1])
    points = resolve(plan.triangles, origin, direction, hits, None)
    light = np.zeros((3, number.size), F32)
    for index, some in plan.surfaces.emission(points, Arrival(0, depth + 1)):
        light[:, slice(None) if index is None else index] = some
    return light


def shone(
    shaders: LampShaders,
    number: int | Ids,
    origin: Vec,
    to_light: Vec,
    distance: Scalar,
    arrival: Arrival,
) -> Vec | np.float32:
    """Return what multiplies the colours of lamps `number` along the ways to them (3, N)."""
    direction = unit(to_light, distance)
    colour = shaders.colour(number, origin + to_light, direction, distance, arrival)
    return F32(1) if colour is None else colour


def add_lamps(
    plan: Plan,
    rays: Rays,
    paths: Paths,
    hits: Hits,
    depth: int,
    radiance: Radiance,
    tally: Tally,
) -> None:
    """Add the light of lamps that paths cross before their hit; lamps do not block."""
    if plan.lights is None or not plan.lamps_seen_by:
        return
    kinds = sent_as(paths.kinds) if plan.mixes_kinds else paths.kinds
    met = (kinds & plan.lamps_seen_by) != 0
    index = np.flatnonzero(met & ((kinds & DIFFUSE) == 0))
    if not index.size:
        return

    # Rays that passed surfaces straight come from where they were scattered.  Distant lamps are
    # only met by rays that leave the scene: those reach to infinity.
    origin = np.broadcast_to(rays.origin, rays.direction.shape).take(index, axis=1)
    direction, reach = rays.direction.take(index, axis=1), hits.t.take(index)
    travelled = take(paths.travelled, index)
    if travelled is not None:
        origin, reach = origin - direction * travelled, reach + travelled
    reach[np.flatnonzero(hits.triangle.take(index) < 0)] = np.inf
    met_rays = Crossing(
        origin,
        direction,
        travelled,
        reach,
        kinds.take(index),
        take(paths.pdf, index),
        take(paths.place, index),
        take(paths.receiver, index),
        None if plan.lights.shaders is None else at_lamps(paths, depth).take(index),
        take(paths.time, index),
    )
    apart: Apart = [] if has_groups(plan, radiance) else None
    if plan.lamp_hulls is None:
        light = _meet_all(plan, met_rays, apart)
    else:
        light = _meet_by_hulls(plan, plan.lamp_hulls, met_rays, tally, apart)
    lit = np.flatnonzero(light.any(axis=0))
    if not lit.size:
        return
    kept = _add(light.take(lit, axis=1), paths, index.take(lit), depth, radiance)
    if radiance.sorts_light:
        factor = np.ones(index.size, F32)
        factor[lit] = kept
        enter_lamps(plan, light * factor, apart, factor, paths, index, depth, radiance)


@dataclass(frozen=True, eq=False)
class Crossing:
    """N rays that may cross lamps, from `near` (N,) or None, which is 0, to `reach` (N,) [m].

    origin, direction (3, N); kinds (N,) bits; pdf (N,) of the scattered direction, None is
    infinite; place, receiver and time (N,) as in `Paths`; arrival: as lamps see it, None where none
    asks.
    """

    origin: Vec
    direction: Vec
    near: Scalar | None
    reach: Scalar
    kinds: NDArray[np.uint8]
    pdf: Scalar | None
    place: Ids | None
    receiver: NDArray[np.uint8] | None
    arrival: Arrival | None
    time: Scalar | None

    def take(self, index: Index) -> "Crossing":
        """Return the rays at `index`."""
        return Crossing(
            self.origin.take(index, axis=1),
            self.direction.take(index, axis=1),
            take(self.near, index),
            self.reach.take(index),
            self.kinds.take(index),
            take(self.pdf, index),
            take(self.place, index),
            take(self.receiver, index),
            None if self.arrival is None else self.arrival.take(index),
            take(self.time, index),
        )


def _light_of(plan: Plan, lamps: LampGroup, rays: Crossing, light: int | Ids) -> Vec | None:
    """Return the light (3, N) that rays get from lamp `light`, or from lamp `light` (N,) each.

    What was sampled as well counts by its weight; `is_chosen`: among others.
    """
    assert plan.lights is not None
    sees = visible(lamps.seen_by, rays.kinds) & lamps.is_met
    if rays.receiver is not None:
        sees &= _linked(lamps, rays.receiver)
    if not sees.any():
        return None
    t, gain, pdf = lamps.kind.intersect(lamps.rows, rays.origin, rays.direction)
    gain *= (t < rays.reach) & sees
    if rays.near is not None:
        gain *= t > rays.near
    if rays.pdf is not None:
        assert rays.place is not None
        pdf = pdf * plan.lights.pmf(rays.place, np.broadcast_to(light, rays.place.shape))
        gain *= power_weight(rays.pdf, pdf * _samples_at(plan, rays.place))
    seen: Vec = lamps.colour * gain
    shaders = plan.lights.shaders
    if shaders is None or rays.arrival is None:
        return seen
    some = np.flatnonzero(gain)
    if some.size:
        number = light if isinstance(light, int) else light.take(some)
        origin, direction = rays.origin.take(some, axis=1), rays.direction.take(some, axis=1)
        way, arrival = np.broadcast_to(t, gain.shape).take(some), rays.arrival.take(some)
        with np.errstate(over="ignore"):
            where = origin + direction * way
        colour = shaders.colour(number, where, direction, way, arrival)
        if colour is not None:
            seen[:, some] *= colour
    return seen


def _meet_all(
    plan: Plan, rays: Crossing, apart: Apart, numbers: Iterable[int] | None = None
) -> Vec:
    """Return the light (3, N) of all lamps, or `numbers`, that rays cross; lamps do not block.

    `apart` gets that of each lamp, if it is a list.
    """
    lights = plan.lights
    assert lights is not None
    light = np.zeros(rays.direction.shape, F32)
    for number in range(lights.first_triangle) if numbers is None else numbers:
        found = _light_of(plan, lights.single(number, rays.time), rays, number)
        if found is not None:
            light += found
            if apart is not None:
                apart.append((number, None, found))
    return light


def _meet_by_hulls(
    plan: Plan, lamp_hulls: LampHulls, rays: Crossing, tally: Tally, apart: Apart
) -> Vec:
    """Return what `_meet_all` does, at a cost that does not grow with the number of lamps.

    Walks from hull to hull; a lamp counts where the ray leaves its hull, which it does once.
    """
    lights = plan.lights
    assert lights is not None
    light = _meet_all(plan, rays, apart, lights.distant)
    index = np.arange(rays.reach.size)
    start, direction = rays.origin, rays.direction
    for _ in range(MOST_CROSSINGS):
        hits = lamp_hulls.accel.closest(start, direction, None, None, None, tally)
        found = np.flatnonzero(hits.triangle >= 0)
        if not found.size:
            break
        index, direction = index.take(found), direction.take(found, axis=1)
        start = start.take(found, axis=1)
        triangle, t = hits.triangle.take(found), hits.t.take(found)

        # Shine where the ray leaves a lamp, before its own end.
        normal = lamp_hulls.triangles.columns(triangle)[:3]
        closed = lamp_hulls.hulls.is_closed.take(triangle)
        leaving = np.flatnonzero(~closed | (dot(normal, direction) > 0))
        owner = lamp_hulls.hulls.light.take(triangle.take(leaving))
        for where, lamps in lights.split(owner):
            some = leaving if where is None else leaving.take(where)
            light_there = owner if where is None else owner.take(where)
            ray = index.take(some)
            seen = _light_of(plan, lamps, rays.take(ray), light_there)
            if seen is not None:
                if apart is not None:
                    apart.append((light_there, ray, seen))
                for channel, value in zip(light, seen, strict=True):
                    channel[ray] += value

        # Go on just behind this hull.
        size = np.abs(start).max(axis=0) + t
        start = start + direction * (t + size * F32(2.0**-20))
    return light


def _add(
    light: np.ndarray, paths: Paths, index: Index, depth: int, radiance: Radiance
) -> Scalar | np.float32:
    # What a first bounce finds is still direct light, of a mesh or of the sky.
    is_direct = None if paths.total is None else paths.total.take(index) <= 1
    light = weigh(light, take(paths.throughput, index))
    return radiance.add(light, paths.slots(index), depth - 1, is_direct)
