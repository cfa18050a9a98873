"""points, u -> light.  Sources of light: sampled on purpose, or met by chance.

They are sorted into groups of one kind, so that a call works on one formula: lamps first, then the
triangles of meshes that glow.  A few lamps are sampled each; among many lamps, and always among
triangles, one is chosen at each point.  Lamps do not block rays: a ray that meets one goes on
behind it (Cycles).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec, take
from ..bsdf.kinds import CAMERA, DIFFUSE, EVERY_KIND, GLOSSY, TRANSMISSION
from ..geometry.mesh import Triangles
from ..geometry.motion import along_arcs, compile_tracks
from ..scene import Lamp, RayKinds, SceneError
from ..shading.lamps import LampShaders, compile_lamp_shaders
from ..shading.values import Value
from . import area, distant, point, triangle
from .cells import spread_over
from .choice import LightGrid, compile_grid
from .group import Group
from .kind import AT_INFINITY, LampKind
from .tree import lamp_sources
from .triangle import Emitters

# Which kind a lamp is: one line per kind of Blender's
REGISTRY = {
    "POINT": point.classify,
    "SPOT": point.classify,
    "SUN": distant.classify,
    "AREA": area.classify,
}

# Up to so many lamps are sampled each, with shadow rays of their own; of more, one is chosen
SAMPLED_EACH = 8
LAMP_STEPS = 32  # at least, of lamps that turn or grow: their numbers do not go quite straight
RECEIVERS = 1 << 15  # points of the scene's surfaces by which the choice is prepared
NO_LIMIT = 1 << 30  # of bounces: meshes have none
NO_EMISSIONS: Mapping[int, Value] = {}


def ray_mask(kinds: RayKinds) -> int:
    """Return the bits of the kinds of ray that see a lamp."""
    bits = (CAMERA, DIFFUSE, GLOSSY, TRANSMISSION)
    seen = (kinds.camera, kinds.diffuse, kinds.glossy, kinds.transmission)
    return sum(bit for bit, yes in zip(bits, seen, strict=True) if yes)


@dataclass(frozen=True, eq=False)
class Hulls:
    """Triangles around lamps, by which Embree finds those that rays meet.

    vertices (V, 3), corners (F, 3), light (F,) that a triangle belongs to, is_closed (F,): the
    triangle is part of a closed hull with normals outwards, else of a flat lamp.
    """

    vertices: NDArray[np.float32]
    corners: NDArray[np.int32]
    light: Ids
    is_closed: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Lights:
    """All lights of a scene that shine; light l is number l - first of its group.

    lamps, by their numbers: kind and lamp; `each`: at first hits the first so many lights are
    sampled each, the others, if any, are chosen from `first`; deeper, one of all lights is chosen
    from `deep`, None if there is only one lamp.  Triangles have the numbers from `first_triangle`
    on, and `of_triangle` (F,) says which of the scene's triangles are which lights, -1 if none;
    triangle_of is the inverse, from `first_triangle` on; shaders: of lamps, None if
    all of them are constant.
    """

    groups: tuple[Group, ...]
    lamps: tuple[tuple[LampKind, Lamp], ...]
    each: int
    first: LightGrid | None
    deep: LightGrid | None
    of_triangle: Ids | None
    triangle_of: Ids | None
    shaders: LampShaders | None = None

    @property
    def count(self) -> int:
        """Return the number of lights."""
        return self.groups[-1].first + self.groups[-1].count

    @property
    def first_triangle(self) -> int:
        """Return the number of the first triangle, which is that of lamps."""
        return len(self.lamps)

    def single(self, light: int, time: Scalar | None = None) -> Group:
        """Return light number `light` as a group of rows (P, 1): all points see the same.

        Of a lamp that moves, rows (P, N) at times (N,).
        """
        known = self._known.get(light)
        if known is not None:
            return known
        for group in self.groups:
            local = light - group.first
            if 0 <= local < group.count:
                single = group.only(local, time)
                if group.motion is None:
                    self._known[light] = single
                return single
        raise IndexError(f"light {light} of {self.count}")

    @cached_property
    def _known(self) -> dict[int, Group]:
        """Lights that were asked for as `single`, of those at rest."""
        return {}

    @cached_property
    def may_darken(self) -> bool:
        """Whether lights may shine with negative light, as Blender lets them."""
        darkest = min(float(group.colour.min(initial=0)) for group in self.groups)
        return self.shaders is not None or darkest < 0

    @cached_property
    def distant(self) -> tuple[int, ...]:
        """The numbers of the lights that have no place, or not always the same."""
        return tuple(
            group.first + local
            for group in self.groups
            for local in range(group.count)
            if group.kind.DISTANT or (group.motion is not None and group.motion.steps[local])
        )

    def switched(self, is_on: NDArray[np.bool_]) -> "Lights":
        """Return the lights with those off, seen by nothing, of which `is_on` (L,) is False."""
        groups = []
        for group in self.groups:
            keeps = is_on[group.first : group.first + group.count]
            groups.append(replace(group, seen_by=np.where(keeps, group.seen_by, np.int32(0))))
        return replace(self, groups=tuple(groups))

    @property
    def chooses(self) -> bool:
        """Whether lights are chosen anywhere."""
        return self.first is not None or self.deep is not None

    def each_at(self, depth: int) -> int:
        """Return how many lights are sampled each, `depth` surfaces after the camera."""
        return self.each if depth == 0 or self.deep is None else 0

    def chooses_at(self, depth: int) -> bool:
        """Tell whether one of the other lights is chosen there."""
        return (self.first if depth == 0 else self.deep) is not None

    def place(self, position: Vec, normal: Vec | None, depth: int) -> Ids:
        """Return what `choose` and `pmf` know points (3, N) by (N,): their row of the tables.

        With their normal (3, N), unit length, lights behind them are rarely chosen; None is for
        points that scatter light from all sides.  First hits have numbers below 0.
        """
        if depth > 0:
            if self.deep is None:
                return np.zeros(position.shape[1], np.int32)
            return self.deep.place(position, normal)
        if self.first is None:
            return np.full(position.shape[1], -1, np.int32)
        place = self.first.place(position, normal)
        return np.invert(place, out=place)

    def choose(self, place: Ids, u: Scalar, v: Scalar, depth: int) -> tuple[Ids, Scalar]:
        """Choose a light (N,) by u, v; return it with its pmf; unbiased.

        At first hits it is one beyond the first `each`.  Nothing is left of u and v.
        """
        if depth > 0:
            assert self.deep is not None
            return self.deep.choose(place, u, v)
        assert self.first is not None
        light, pmf = self.first.choose(np.invert(place), u, v)
        light += np.int32(self.each)
        return light, pmf

    def pmf(self, place: Ids, light: Ids) -> Scalar:
        """Return the probability (N,) with which lights (N,) are sampled at places (N,)."""
        pmf = np.ones(place.size, F32)
        if self.deep is not None:
            deep = np.flatnonzero(place >= 0)
            pmf[deep] = self.deep.pmf(place.take(deep), light.take(deep))
        if self.first is not None:
            chosen = np.flatnonzero((place < 0) & (light >= self.each))
            pmf[chosen] = self.first.pmf(
                np.invert(place.take(chosen)), light.take(chosen) - np.int32(self.each)
            )
        return pmf

    def split(self, light: Ids, time: Scalar | None = None) -> Iterator[tuple[Index | None, Group]]:
        """Sort points by the kind of their `light` (N,): which points, None is all; their lights.

        Those that move at times (N,).
        """
        for group in self.groups:
            local = light - np.int32(group.first)
            if len(self.groups) == 1:
                yield None, group.take(local, time)
                return
            where = np.flatnonzero((local >= 0) & (local < group.count))
            if where.size:
                yield where, group.take(local.take(where), take(time, where))


def compile_lights(
    lamps: tuple[Lamp, ...],
    origin: NDArray[np.float64],
    triangles: Triangles | None = None,
    emitters: Emitters | None = None,
    emissions: Mapping[int, Value] = NO_EMISSIONS,
) -> Lights | None:
    """Compile the lights that shine, None if none does; places are relative to `origin` (3,) [m].

    `triangles` of the scene, about that origin too, are where light falls, and what `emitters`
    are numbers of.  emissions: of lamps' shaders, see `shading.lamps.fold_lamps`.
    """
    # Sort by kind, without those that are black or have no shape
    kinds: dict[LampKind, list[Lamp]] = {}
    for lamp in lamps:
        kind = REGISTRY[lamp.kind](lamp) if any(lamp.strength) else None
        if kind is not None:
            kinds.setdefault(kind, []).append(lamp)
    groups: list[Group] = []
    for kind, members in kinds.items():
        groups.append(_lamp_group(kind, members, sum(group.count for group in groups), origin))
    pairs = tuple((kind, lamp) for kind, members in kinds.items() for lamp in members)
    shaders = compile_lamp_shaders([lamp for _, lamp in pairs], emissions, origin)
    of_triangle = None
    if emitters is not None and emitters.triangle.size:
        assert triangles is not None
        groups.append(_triangle_group(triangles, emitters, len(pairs)))
        of_triangle = np.full(triangles.count, -1, np.int32)
        of_triangle[emitters.triangle] = np.arange(len(pairs), len(pairs) + groups[-1].count)
    if not groups:
        return None

    # Make the tables for the choice, unless there is nothing to choose
    each = len(pairs) if len(pairs) <= SAMPLED_EACH else 0
    seen = [_as_seen(lamp, number, shaders) for number, (_, lamp) in enumerate(pairs)]
    sources = lamp_sources(
        kind.source(lamp, origin) for (kind, _), lamp in zip(pairs, seen, strict=True)
    )
    if of_triangle is not None:
        sources = sources.join(triangle.sources(groups[-1].rows, groups[-1].colour))
    distant = np.zeros(sources.count, bool)
    distant[: len(pairs)] = [kind.DISTANT for kind, _ in pairs]
    receivers = None
    is_only = sources.count == each == 1
    if triangles is not None and not is_only:
        receivers = spread_over(triangles.vertices, triangles.corners, RECEIVERS)
    deep = None if is_only else compile_grid(sources, distant, receivers)
    first = None
    if each < sources.count:
        rest = np.arange(each, sources.count)
        first = deep if each == 0 else compile_grid(sources.take(rest), distant[each:], receivers)
    return Lights(
        tuple(groups),
        pairs,
        each,
        first,
        deep,
        of_triangle,
        None if of_triangle is None or emitters is None else emitters.triangle,
        shaders,
    )


def _as_seen(lamp: Lamp, number: int, shaders: LampShaders | None) -> Lamp:
    """Return a lamp that is about as bright as its shader makes it."""
    if shaders is None:
        return lamp
    factor = shaders.typical(number)
    red, green, blue = lamp.strength
    return replace(lamp, strength=(factor * red, factor * green, factor * blue))


def _lamp_group(
    kind: LampKind, lamps: list[Lamp], first: int, origin: NDArray[np.float64]
) -> Group:
    moves = any(lamp.motion is not None for lamp in lamps)
    return Group(
        kind,
        first,
        np.ascontiguousarray(np.array([kind.compile(lamp, origin) for lamp in lamps]).T, F32),
        np.ascontiguousarray(np.array([lamp.strength for lamp in lamps]).T, F32),
        np.array([ray_mask(lamp.seen_by) for lamp in lamps], np.int32),
        np.array([lamp.max_bounces for lamp in lamps], np.int32),
        np.array([lamp.receivers for lamp in lamps], np.uint64),
        np.array([lamp.blockers for lamp in lamps], np.uint64),
        np.array([lamp.casts_shadow for lamp in lamps], bool),
        np.array([lamp.sampled for lamp in lamps], bool),
        compile_tracks([_rows_of(kind, lamp, origin) for lamp in lamps]) if moves else None,
    )


def _rows_of(kind: LampKind, lamp: Lamp, origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the numbers of a lamp at equal steps of time (steps + 1, P).

    Raises: SceneError if it is squeezed flat on its way.
    """
    if lamp.motion is None:
        return np.array([kind.compile(lamp, origin)])
    matrices = along_arcs(lamp.motion, LAMP_STEPS)
    steps = [replace(lamp, to_world=matrix, motion=None) for matrix in matrices]
    if any(REGISTRY[lamp.kind](step) is not kind for step in steps):
        raise SceneError(f"Light '{lamp.name}': it is squeezed flat while the shutter is open")
    return np.array([kind.compile(step, origin) for step in steps])


def _triangle_group(triangles: Triangles, emitters: Emitters, first: int) -> Group:
    return Group(
        triangle.TRIANGLE,
        first,
        triangle.compile_rows(triangles.vertices, triangles.corners, emitters),
        np.ascontiguousarray(emitters.radiance, F32),
        emitters.seen_by.astype(np.int32),
        np.full(emitters.triangle.size, NO_LIMIT, np.int32),
        emitters.receivers,
        emitters.blockers,
        np.ones(emitters.triangle.size, bool),
        np.ones(emitters.triangle.size, bool),
    )


def compile_hulls(lights: Lights, origin: NDArray[np.float64]) -> Hulls | None:
    """Return triangles that enclose the lights rays can meet at a place, None if there are none."""
    vertices, triangles, owners, start = [], [], [], 0
    for light, (kind, lamp) in enumerate(lights.lamps):
        hull = kind.hull(lamp, origin) if lamp.motion is None else None
        if hull is not None:
            vertices.append(hull[0])
            triangles.append(hull[1] + np.int32(start))
            owners.append(np.full(len(hull[1]), light, np.int32))
            start += len(hull[0])
    if not vertices:
        return None
    owner = np.concatenate(owners)
    return Hulls(
        np.concatenate(vertices).astype(F32),
        np.concatenate(triangles).astype(np.int32),
        owner,
        np.bincount(owner, minlength=lights.count).take(owner) > 2,
    )


def visible(seen_by: int | Ids, kind: int | NDArray[np.integer]) -> NDArray[np.bool_]:
    """Tell whether what has the mask `seen_by` shines on rays whose bits are `kind`.

    Rays through glass are glossy and transmitted, but only the latter counts (Cycles).
    """
    kind = kind & EVERY_KIND
    counts = np.where(kind & TRANSMISSION, kind & (DIFFUSE | TRANSMISSION), kind)
    return (seen_by & counts) == counts


__all__ = [
    "AT_INFINITY",
    "CAMERA",
    "DIFFUSE",
    "GLOSSY",
    "REGISTRY",
    "SAMPLED_EACH",
    "TRANSMISSION",
    "Emitters",
    "Group",
    "Hulls",
    "Lights",
    "compile_hulls",
    "compile_lights",
    "ray_mask",
    "visible",
]
