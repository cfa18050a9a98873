"""points, rays -> Context.  All that a shading step may read of the points it runs on.

Nothing is gathered before it is asked for, and then once: a program that reads no normals costs
none.
"""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec, cross, dot, normalize, take
from ..bsdf.kinds import CAMERA, DIFFUSE
from ..geometry.attributes import VECTOR, Asked, Attributes
from ..geometry.mesh import Triangles
from ..geometry.silhouette import bent_normals
from ..geometry.spaces import LOCATION, Spaces
from ..geometry.surface import Points
from ..geometry.view import View
from ..scene import REST
from .tracing import Probe, Tracer

PIXEL_SHARE = F32(0.25)  # of the width of a pixel: what a camera ray stands for
MATTE_CONE = F32(0.03)  # how much rays from matte surfaces widen, per metre
NEVER = np.finfo(np.float32).max  # the length of rays that meet nothing, as in Cycles


@dataclass(frozen=True, eq=False)
class Arrival:
    """How rays came to N points.

    kind: bits of `bsdf.kinds` (N,) uint8, or one int for all; length (N,) [m] that rays came
    before they passed their last transparent surface, None is 0; count (3, N) int16 diffuse,
    glossy and transmission bounces before this point, None if all are `depth` diffuse ones;
    total (N,) all bounces, or one number for all, None is `depth`; passed (N,) transparent
    surfaces before this point, None is 0; blur (N,) least roughness that filter glossy asks for,
    None is 0; probe: what shaders need that trace rays, None where none does, or may.
    """

    kind: NDArray[np.uint8] | int = CAMERA
    depth: int = 0
    length: Scalar | None = None
    count: NDArray[np.int16] | None = None
    total: NDArray[np.int16] | int | None = None
    passed: NDArray[np.int16] | None = None
    blur: Scalar | None = None
    probe: Probe | None = None

    def take(self, index: Index) -> "Arrival":
        """Return how the rays at `index` (M,) came."""
        kind = self.kind if isinstance(self.kind, int) else self.kind.take(index)
        total = self.total if isinstance(self.total, int) else take(self.total, index)
        passed, blur = take(self.passed, index), take(self.blur, index)
        length, count = take(self.length, index), take(self.count, index)
        probe = None if self.probe is None else self.probe.take(index)
        return Arrival(kind, self.depth, length, count, total, passed, blur, probe)


@dataclass(frozen=True, eq=False)
class Place:
    """Where things are: origin (3, 1), of the local one in the world [m], and objects' spaces.

    `spaces` are None where no shader reads them, triangles where there are none; spread: how wide
    a pixel is at the camera [m], and what it gains per metre; attributes: what meshes carry, as
    far as asked.
    """

    origin: Vec
    spaces: Spaces | None = None
    view: View | None = None
    triangles: Triangles | None = None
    spread: tuple[float, float] = (0.0, 1e-3)
    attributes: Attributes = field(default_factory=dict)
    tracer: Tracer | None = None


NOWHERE = Place(np.zeros((3, 1), F32))


class Context:
    """The points of `index` (n,) among all of `points`, None for all of them."""

    with_discs = True  # whether skies show their suns

    def __init__(
        self, points: Points, arrival: Arrival, index: Index | None, place: Place = NOWHERE
    ) -> None:
        self.points, self.arrival, self.index = points, arrival, index
        self.place = place
        self._attributes: dict[Asked, Vec | None] = {}
        self._beside: dict[tuple[int, np.float32], Context] = {}

    @property
    def size(self) -> int:
        """The number of points."""
        return self.points.size if self.index is None else self.index.size

    def of(self, array: Any) -> Any:
        """Return the columns of this context of an array over all points, or None."""
        return array if self.index is None else take(array, self.index)

    @cached_property
    def normal(self) -> Vec:
        """Shading normals (3, n) on the viewer's side."""
        return self.of(self.points.normal)

    @cached_property
    def geometric(self) -> Vec:
        """Normals (3, n) of the triangles, on the viewer's side."""
        return self.normal if self.points.is_flat else self.of(self.points.geometric)

    @cached_property
    def wo(self) -> Vec:
        """Unit directions (3, n) to the viewer."""
        return np.negative(self.of(self.points.arriving))

    def seen_from(self, wo: Vec) -> "Context":
        """Return the context of the same points, seen from unit directions (3, n)."""
        other = copy(self)
        vars(other).update(wo=wo, _beside={})
        for name in ("valid_normal", "cosine", "reflection"):
            vars(other).pop(name, None)
        return other

    @cached_property
    def valid_normal(self) -> Vec:
        """Shading normals (3, n), bent where a mirrored ray would enter the surface."""
        if self.points.is_flat:
            return self.normal
        return bent_normals(self.geometric, self.normal, self.wo)

    @cached_property
    def cosine(self) -> Scalar:
        """Cosines (n,) of the viewer's direction at the valid normal, at least 0."""
        return np.maximum(dot(self.valid_normal, self.wo), F32(0))

    @cached_property
    def back(self) -> NDArray[np.bool_]:
        """Which points are seen from behind (n,)."""
        return self.of(self.points.back)

    @cached_property
    def position(self) -> Vec:
        """Places (3, n) in the world [m]."""
        position: Vec = self.local + self.place.origin
        return position

    @cached_property
    def local(self) -> Vec:
        """Places (3, n) about the local origin [m]."""
        return self.of(self.points.position)

    @cached_property
    def instance(self) -> Ids:
        """The numbers (n,) of the objects that were hit."""
        return self.of(self.points.instance)

    @cached_property
    def spaces(self) -> Spaces:
        """The spaces of objects, which a step of the program asks for."""
        spaces, triangles = self.place.spaces, self.place.triangles
        assert spaces is not None
        if triangles is None or triangles.movement is None or self.points.time is None:
            return spaces
        return spaces.at(triangles.movement, self.of(self.points.time))

    @cached_property
    def _moves(self) -> Index | None:
        """Which points are on something that moves, None if there are none."""
        triangles = self.place.triangles
        if triangles is None or triangles.movement is None or self.points.time is None:
            return None
        some = np.flatnonzero(triangles.movement.moves.take(self.instance))
        return some if some.size else None

    @property
    def view(self) -> View:
        """The camera's space."""
        assert self.place.view is not None
        return self.place.view

    def fact(self, row: int, is_vector: bool = False) -> NDArray[np.float32]:
        """Return what is known of the objects, (n,) or (3, n), see `geometry.spaces`."""
        facts = self.spaces.facts
        if row == LOCATION and self._moves is not None:
            return self.spaces.location(self.instance) + self.place.origin
        return (facts[row : row + 3] if is_vector else facts[row]).take(self.instance, axis=-1)

    def particle(self, row: int, is_vector: bool = False) -> NDArray[np.float32]:
        """Return what is known of the particles that show the objects, (n,) or (3, n); else 0."""
        particles = self.spaces.particles
        if particles is None:
            return np.zeros((3, 1) if is_vector else 1, F32)
        rows = particles[row : row + 3] if is_vector else particles[row]
        return rows.take(self.instance, axis=-1)

    @cached_property
    def seen(self) -> Vec:
        """Places (3, n) in the camera's space, z along the view [m]."""
        return self.view.point(self.local)

    @property
    def seen_way(self) -> Vec:
        """The same (3, n); of the surroundings, directions."""
        return self.seen

    @cached_property
    def corners(self) -> tuple[Vec, Vec, Vec]:
        """The corners (3, n) of the triangles about the local origin [m]."""
        assert self.place.triangles is not None
        return self.place.triangles.places(self.triangle, self.of(self.points.time))

    @cached_property
    def rest(self) -> Vec:
        """Places (3, n) about the local origin [m] as they were before meshes were displaced."""
        if (REST, VECTOR) not in self.place.attributes:
            return self.local
        u, v = self.of(self.points.u), self.of(self.points.v)
        a, b, c = self.rest_corners
        rest: Vec = a * (F32(1) - u - v)
        rest += b * u
        rest += c * v
        return rest

    @cached_property
    def rest_corners(self) -> tuple[Vec, Vec, Vec]:
        """The corners (3, n) of the triangles before meshes were displaced [m]."""
        table = self.place.attributes.get((REST, VECTOR))
        if table is None:
            return self.corners
        zero, one = np.zeros(self.size, F32), np.ones(self.size, F32)
        places = ((zero, zero), (one, zero), (zero, one))
        ways = (table.at(self.triangle, self.instance, u, v) for u, v in places)
        a, b, c = (
            corner + self.out_of_object(way, "VECTOR")
            for corner, way in zip(self.corners, ways, strict=True)
        )
        return a, b, c

    @cached_property
    def undisplaced(self) -> "Context":
        """The context of the same points where they were before meshes were displaced.

        Smooth normals are the mesh's, which has kept them; flat ones are those that were.
        """
        points = self.points if self.index is None else self.points.take(self.index)
        a, b, c = self.rest_corners
        normal = points.normal
        if points.smooth is None or not points.smooth.all():
            flat = normalize(cross(b - a, c - a))
            flat = np.where(points.back, np.negative(flat), flat)
            normal = flat if points.smooth is None else np.where(points.smooth, normal, flat)
        moved = replace(points, position=self.rest, normal=normal)
        return Context(moved, self.arrival, None, self.place)

    @cached_property
    def moved_back(self) -> "Context":
        """The context of the same points where they were, with the normals that they have now."""
        return _MovedBack(self)

    def rest_way(self, axis: int) -> Vec:
        """Return the ways (3, n) on the surfaces as they were of a pixel along an axis."""
        assert self.place.triangles is not None
        way = self.sideways[axis] * self.pixel
        du, dv = self.place.triangles.barycentric(
            self.triangle, np.where(self.back, np.negative(way), way)
        )
        a, b, c = self.rest_corners
        way = (b - a) * du
        way += (c - a) * dv
        return way

    @cached_property
    def in_texture_space(self) -> Vec:
        """Places (3, n) in the box of the object: -1 to 1 in each direction."""
        if self._moves is not None:
            return self.in_frame.in_texture_space
        return self.spaces.in_texture_space(self.rest, self.instance)

    @cached_property
    def in_frame(self) -> "Context":
        """The context of the same points where they are in the frame itself: textures stay on."""
        points, some = self.points, self._moves
        points = points if self.index is None else points.take(self.index)
        assert self.place.triangles is not None and some is not None
        assert points.u is not None and points.v is not None
        a, b, c = self.place.triangles.places(points.triangle.take(some))
        u, v = points.u.take(some), points.v.take(some)
        position = points.position.copy()
        position[:, some] = a * (F32(1) - u - v) + b * u + c * v
        return Context(
            replace(points, position=position, time=None), self.arrival, None, self.place
        )

    @cached_property
    def generated(self) -> Vec:
        """Places (3, n) in the box of the object: 0 to 1 in each direction."""
        where = self.in_texture_space * F32(0.5)
        where += F32(0.5)
        return where

    def attribute(self, asked: Asked) -> Vec | None:
        """Return numbers (C, n) that the meshes carry, None if these points are on no mesh."""
        if asked not in self._attributes:
            table, points = self.place.attributes.get(asked), self.points
            found = None
            if table is not None and points.u is not None and points.instance is not None:
                parts = points.triangle, points.instance, points.u, points.v
                found = table.at(*(self.of(part) for part in parts))
            self._attributes[asked] = found
        return self._attributes[asked]

    @cached_property
    def pixel(self) -> Scalar:
        """How wide (n,) a pixel is here [m]."""
        wide, wider = self.place.spread
        return np.maximum(F32(wide) + F32(wider) * self.travelled, F32(1e-7))

    @cached_property
    def cone(self) -> Scalar:
        """How wide (n,) what a ray stands for is here [m]: a part of a pixel, or a cone.

        0 after mirrors and glass, which may make things larger.
        """
        seen: Scalar = (PIXEL_SHARE * self.has_kind(CAMERA)) * self.pixel
        seen += (MATTE_CONE * self.is_after_matte) * self.travelled
        return seen

    @cached_property
    def sideways(self) -> tuple[Vec, Vec]:
        """Two unit vectors (3, n) along the triangles, Blender's choice."""
        x, y, z = self.geometric
        first = np.stack([z - y, x - z, y - x])
        even = np.flatnonzero((x == y) & (x == z))
        if even.size:
            first[:, even] = np.stack([z - y, x + z, -y - x])[:, even]
        normalize(first)
        return first, cross(self.geometric, first)

    def beside(self, axis: int, width: np.float32) -> "Context":
        """Return the context so many pixels beside, along an axis (0, 1) of the triangles."""
        key = axis, width
        if key not in self._beside:
            points = self.points if self.index is None else self.points.take(self.index)
            way = self.sideways[axis] * (self.pixel * width)
            u, v = points.u, points.v
            if u is not None and v is not None and self.place.triangles is not None:
                # Seen from behind, Cycles takes what is interpolated from the other side.
                back = np.where(points.back, np.negative(way), way)
                du, dv = self.place.triangles.barycentric(points.triangle, back, points.time)
                u, v = u + du, v + dv
            moved = replace(points, position=points.position + way, u=u, v=v)
            arrival = self.arrival if self.index is None else self.arrival.take(self.index)
            self._beside[key] = Context(moved, arrival, None, self.place)
        return self._beside[key]

    def around(self, axis: int) -> Vec:
        """Return the way (3, n) around an axis of the objects that were hit, of any length.

        Blender's: (-y, x, 0) for z, (-z, 0, x) for y, (0, -z, y) for x, in the object's texture
        space, carried as normals are.
        """
        where = self.in_texture_space
        first, second = (row for row in range(3) if row != axis)
        around = np.zeros_like(where)
        around[first], around[second] = -where[second], where[first]
        return self.spaces.carry_normals(around, self.instance)

    def into_object(self, vector: Vec, kind: str) -> Vec:
        """Return a POINT, VECTOR or NORMAL (3, n) or (3, 1) of the world in the objects' spaces."""
        if kind == "POINT":
            return self.spaces.in_object(vector - self.place.origin, self.instance)
        if kind == "VECTOR":
            return self.spaces.turn_in(vector, self.instance)
        return normalize(self.spaces.bring_normals(vector, self.instance))

    def out_of_object(self, vector: Vec, kind: str) -> Vec:
        """Return a POINT, VECTOR or NORMAL (3, n) or (3, 1) of the objects' in the world."""
        if kind == "POINT":
            return self.spaces.out_of_object(vector, self.instance) + self.place.origin
        if kind == "VECTOR":
            return self.spaces.turn_out(vector, self.instance)
        return normalize(self.spaces.carry_normals(vector, self.instance))

    @cached_property
    def reflection(self) -> Vec:
        """Directions (3, n) of the mirrored viewer's rays."""
        twice = F32(2) * dot(self.normal, self.wo)
        mirrored: Vec = self.normal * twice
        mirrored -= self.wo
        return mirrored

    @cached_property
    def travelled(self) -> Scalar:
        """How far (n,) the rays came from where they were scattered last, or the camera [m]."""
        way: Scalar = self.of(self.points.distance)
        return way if self.arrival.length is None else way + self.of(self.arrival.length)

    @cached_property
    def length(self) -> Scalar:
        """The same (n,), but from where rays count as begun [m]."""
        length: Scalar = self.travelled
        view = self.place.view
        if view is not None and view.clip > 0:
            along = np.maximum(dot(view.axes[2][:, None], np.negative(self.wo)), F32(1e-6))
            begun: Scalar = np.reciprocal(along)
            begun *= view.clip
            length = length - begun * self.has_kind(CAMERA)
        return length

    @cached_property
    def triangle(self) -> Ids:
        """The numbers of the triangles (n,)."""
        return self.of(self.points.triangle)

    @cached_property
    def is_after_matte(self) -> Scalar:
        """1 (n,) or (1,) where the ray comes from a matte surface, else 0."""
        return self.has_kind(DIFFUSE)

    def has_kind(self, bits: int) -> Scalar:
        """Return 1 (n,) or (1,) where the ray's kind has one of these bits, else 0."""
        kind = self.arrival.kind
        if isinstance(kind, int):
            return np.full(1, F32(bool(kind & bits)))
        return ((self.of(kind) & np.uint8(bits)) != 0).astype(F32)

    def counted(self, choose: Callable[[Arrival], Any]) -> Scalar:
        """Return a number of the arrival, (n,) or (1,), as float32; None is 0."""
        found = choose(self.arrival)
        if found is None or isinstance(found, int):
            return np.full(1, F32(found or 0))
        return self.of(found).astype(F32)


class _MovedBack(Context):
    """Where a displaced surface was, as bump saw it in Cycles before Blender 5.0.

    Normals are those that it has.  Pixels are as wide as in the mean on the surface as it was, but
    lie on the surface as it is.
    """

    def __init__(self, there: Context) -> None:
        points = there.points if there.index is None else there.points.take(there.index)
        super().__init__(replace(points, position=there.rest), there.arrival, None, there.place)
        lengths = [np.sqrt(dot(way, way)) for way in map(there.rest_way, (0, 1))]
        self._wide = (lengths[0] + lengths[1]) * F32(0.5)

    def beside(self, axis: int, width: np.float32) -> Context:
        """Return the context so many pixels beside, along an axis (0, 1) of the triangles."""
        key = axis, width
        if key not in self._beside:
            beside = super().beside(axis, width)
            way = self.sideways[axis] * (self._wide * width)
            moved = replace(beside.points, position=self.points.position + way)
            self._beside[key] = Context(moved, self.arrival, None, self.place)
        return self._beside[key]
