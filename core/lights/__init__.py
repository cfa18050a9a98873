"""points, u -> light.  Sources of light: sampled on purpose, or met by chance.

Lamps are sorted into groups of one kind, so that a call works on one formula.  The world will be
one more distant kind.  Lamps do not block rays: a ray that meets one goes on behind it (Cycles).
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec
from ..bsdf.kinds import CAMERA, DIFFUSE, GLOSSY, TRANSMISSION
from ..sampling.tables import AliasTable, compile_alias
from ..scene import Lamp, RayKinds
from . import area, distant, point
from .kind import AT_INFINITY, Kind, Rows

# Which kind a lamp is: one line per kind of Blender's
REGISTRY = {
    "POINT": point.classify,
    "SPOT": point.classify,
    "SUN": distant.classify,
    "AREA": area.classify,
}


def ray_mask(kinds: RayKinds) -> int:
    """Return the bits of the kinds of ray that see a lamp."""
    bits = (CAMERA, DIFFUSE, GLOSSY, TRANSMISSION)
    seen = (kinds.camera, kinds.diffuse, kinds.glossy, kinds.transmission)
    return sum(bit for bit, yes in zip(bits, seen, strict=True) if yes)


@dataclass(frozen=True, eq=False)
class Group:
    """Lights of one kind: `count` of them, numbered from `first`.

    rows (P, L) and colour (3, L) float32, seen_by (L,) mask bits and max_bounces (L,) int32.
    Paths with more than `max_bounces` bounces take no samples of a light; met by chance, it
    shines on them all the same (Cycles).
    """

    kind: Kind
    first: int
    rows: Rows
    colour: Vec
    seen_by: Ids
    max_bounces: Ids

    @property
    def count(self) -> int:
        """Return the number of lights."""
        return len(self.seen_by)

    def only(self, local: int) -> "Group":
        """Return the light number `local`, counted from `first`, as views of what this holds."""
        one = slice(local, local + 1)
        return Group(
            self.kind,
            self.first + local,
            self.rows[:, one],
            self.colour[:, one],
            self.seen_by[one],
            self.max_bounces[one],
        )

    def take(self, index: Index | Ids) -> "Group":
        """Return the lights of `index`, counted from `first`, one for each of N points."""
        return replace(
            self,
            rows=self.rows.take(index, axis=1),
            colour=self.colour.take(index, axis=1),
            seen_by=self.seen_by.take(index),
            max_bounces=self.max_bounces.take(index),
        )


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
    """All lights of a scene that shine; light l is number l - first of its group."""

    groups: tuple[Group, ...]
    lamps: tuple[tuple[Kind, Lamp], ...]
    table: AliasTable

    @property
    def count(self) -> int:
        """Return the number of lights."""
        return len(self.lamps)

    def single(self, light: int) -> Group:
        """Return light number `light` as a group of rows (P, 1): all points see the same."""
        for group in self.groups:
            local = light - group.first
            if 0 <= local < group.count:
                return group.only(local)
        raise IndexError(f"light {light} of {self.count}")

    @cached_property
    def distant(self) -> tuple[int, ...]:
        """The numbers of the lights that have no place."""
        return tuple(
            number
            for group in self.groups
            if group.kind.DISTANT
            for number in range(group.first, group.first + group.count)
        )

    def choose(self, u: Scalar) -> tuple[Ids, Scalar, Scalar]:
        """Choose a light (N,) for each point by power; return it, its pmf, and u made new."""
        return self.table.sample(u)

    def split(self, light: Ids) -> Iterator[tuple[Index, Group]]:
        """Sort points by the kind of their `light` (N,): which points, and their lights."""
        for group in self.groups:
            local = light - np.int32(group.first)
            where = np.flatnonzero((local >= 0) & (local < group.count))
            if where.size:
                yield where, group.take(local.take(where))


def compile_lights(
    lamps: tuple[Lamp, ...], origin: NDArray[np.float64], radius: float = 1.0
) -> Lights | None:
    """Compile the lamps that shine, None if none does; places are relative to `origin` (3,) [m].

    `radius` of the scene [m] ranks the power of distant lights against that of the others.
    """
    # Sort by kind, without those that are black or have no shape
    kinds: dict[Kind, list[Lamp]] = {}
    for lamp in lamps:
        kind = REGISTRY[lamp.kind](lamp) if any(lamp.strength) else None
        if kind is not None:
            kinds.setdefault(kind, []).append(lamp)
    if not kinds:
        return None

    groups: list[Group] = []
    first = 0
    for kind, members in kinds.items():
        rows = np.array([kind.compile(lamp, origin) for lamp in members]).T
        colour = np.array([lamp.strength for lamp in members]).T
        groups.append(
            Group(
                kind,
                first,
                np.ascontiguousarray(rows, F32),
                np.ascontiguousarray(colour, F32),
                np.array([ray_mask(lamp.seen_by) for lamp in members], np.int32),
                np.array([lamp.max_bounces for lamp in members], np.int32),
            )
        )
        first += len(members)

    # Choose half by power and half evenly: a weak lamp may be the near one (Owen & Zhou 2000)
    pairs = tuple((kind, lamp) for kind, members in kinds.items() for lamp in members)
    power = np.array([max(kind.power(lamp, radius), 0.0) for kind, lamp in pairs])
    weights = power / max(power.sum(), 1e-300) + 1.0 / len(pairs)
    return Lights(tuple(groups), pairs, compile_alias(weights))


def compile_hulls(lights: Lights, origin: NDArray[np.float64]) -> Hulls | None:
    """Return triangles that enclose the lights rays can meet at a place, None if there are none."""
    vertices, triangles, owners, start = [], [], [], 0
    for light, (kind, lamp) in enumerate(lights.lamps):
        hull = kind.hull(lamp, origin)
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
    counts = np.where(kind & TRANSMISSION, kind & (DIFFUSE | TRANSMISSION), kind)
    return (seen_by & counts) == counts


def meet(
    lights: Lights,
    origin: Vec,
    direction: Vec,
    t_max: Scalar,
    seen_by: int | NDArray[np.integer],
    numbers: Iterable[int] | None = None,
) -> Vec:
    """Return the radiance (3, M) of all lights, or `numbers`, that rays cross before `t_max` (M,).

    `t_max` is inf for rays that leave the scene, only these meet distant lights; `seen_by` is the
    bit of the kind of ray, one for all or (M,).  The sum is what Cycles shows, as lamps do not
    block; no MIS weight is applied: it is the whole light of rays that did not sample the lamps.
    """
    radiance = np.zeros(direction.shape, F32)
    for number in range(lights.count) if numbers is None else numbers:
        light = lights.single(number)
        sees = visible(light.seen_by, seen_by)
        if not sees.any():
            continue
        t, gain, _ = light.kind.intersect(light.rows, origin, direction)
        gain *= (t < t_max) & sees
        radiance += light.colour * gain
    return radiance


__all__ = [
    "AT_INFINITY",
    "CAMERA",
    "DIFFUSE",
    "GLOSSY",
    "REGISTRY",
    "TRANSMISSION",
    "Group",
    "Hulls",
    "Lights",
    "compile_hulls",
    "compile_lights",
    "meet",
    "ray_mask",
    "visible",
]
