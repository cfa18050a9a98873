"""rays, hits -> points.  Where a ray met a surface: position, normals, side, material.

Precision is decided here.  The hit is put onto the triangle's plane, and rays leave it from a
distance along the geometric normal that is bounded by the rounding error of *that triangle*:
Embree's error grows with its vertices, not with the point (cf. Waechter and Binder 2019, "A
Fast and Robust Method for Avoiding Self-Intersection", whose constants fail on large tilted
triangles).
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec, add_scaled, check, dot, normalize, take
from .accel import Hits
from .mesh import FLAT, INSTANCE, MATERIAL, OFFSET, PLANE, SMOOTH, Triangles

Signs = NDArray[np.uint32]
SIGN = np.uint32(1 << 31)  # the bit of a float32


@dataclass(frozen=True, eq=False)
class Points:
    """Surface points of a batch, N of them.

    position (3, N) about the local origin [m]; arriving (3, N) unit, of the rays; geometric and
    shading normal (3, N), unit, turned to the viewer's side of the surface (the same array
    where nothing is smooth); back (N,) bool: seen from behind; offset (N,) [m]: how far along
    the geometric normal rays must start; triangle and material (N,) int32; distance (N,) [m]
    that the rays came.  smooth (N,) bool is None where nothing in the scene is smooth, the
    barycentrics u, v (N,) where nothing is smooth or carries attributes; instance (N,) int32, the
    object hit, and place (N,) int32, by which lights are chosen there, are None where nothing asks;
    time (N,), 0 to 1 while the shutter is open, is None where nothing moves.
    """

    position: Vec
    arriving: Vec
    geometric: Vec
    normal: Vec
    back: NDArray[np.bool_]
    offset: Scalar
    triangle: Ids
    material: Ids
    distance: Scalar
    smooth: NDArray[np.bool_] | None = None
    u: Scalar | None = None
    v: Scalar | None = None
    instance: Ids | None = None
    place: Ids | None = None
    time: Scalar | None = None

    @property
    def size(self) -> int:
        """The number of points."""
        return self.triangle.size

    @property
    def is_flat(self) -> bool:
        """Whether shading and geometric normals are the same everywhere."""
        return self.normal is self.geometric

    def take(self, index: Index) -> "Points":
        """Return the points at `index` (M,)."""
        geometric = self.geometric.take(index, axis=1)
        return Points(
            self.position.take(index, axis=1),
            self.arriving.take(index, axis=1),
            geometric,
            geometric if self.is_flat else self.normal.take(index, axis=1),
            self.back.take(index),
            self.offset.take(index),
            self.triangle.take(index),
            self.material.take(index),
            self.distance.take(index),
            take(self.smooth, index),
            take(self.u, index),
            take(self.v, index),
            take(self.instance, index),
            take(self.place, index),
            take(self.time, index),
        )

    @cached_property
    def above(self) -> Vec:
        """Where rays start that stay on the viewer's side (3, N)."""
        above = self.geometric * self.offset
        above += self.position
        return above


def resolve(
    triangles: Triangles,
    origin: Vec,
    direction: Vec,
    hits: Hits,
    found: Index | None,
    time: Scalar | None = None,
) -> Points:
    """Return the points at which rays met triangles; `found` are the rays that did.

    origin (3, N), or (3, 1) if all rays start at one point; direction (3, N); time (N,), None if
    nothing moves.
    """
    triangle, t = hits.triangle, hits.t
    if found is not None:
        triangle, t = triangle.take(found), t.take(found)
        direction = direction.take(found, axis=1)
        if origin.shape[1] > 1:
            origin = origin.take(found, axis=1)
        time = take(time, found)

    # One row of the table is one cache line; columns are what arithmetic wants.
    columns = triangles.columns(triangle, time)
    geometric, ids = columns[:3], columns.view(np.int32)

    # Walk to the hit, then step onto the plane: t errs along the ray, the plane does not.
    position = direction * t
    position += origin
    miss = dot(geometric, position)
    np.subtract(columns[PLANE], miss, out=miss)
    add_scaled(position, geometric, miss)

    # Turn the normal to the viewer: flip its signs where it has that of the direction.
    facing = dot(geometric, direction)
    back = facing > 0
    turn = np.bitwise_and(np.invert(facing.view(np.uint32)), SIGN)
    np.bitwise_xor(geometric.view(np.uint32), turn, out=geometric.view(np.uint32))

    check("surface", position=position, geometric=geometric)
    u, v = (hits.u, hits.v) if triangles.is_mapped or not triangles.is_flat else (None, None)
    if found is not None:
        u, v = take(u, found), take(v, found)
    flat = Points(
        position,
        direction,
        geometric,
        geometric,
        back,
        columns[OFFSET],
        triangle,
        ids[MATERIAL],
        t,
        u=u,
        v=v,
        instance=ids[INSTANCE] if triangles.is_numbered else None,
        time=time,
    )
    return flat if triangles.is_flat else _smooth(triangles, flat, ids[SMOOTH], turn)


def _smooth(triangles: Triangles, flat: Points, kind: Ids, turn: Signs) -> Points:
    """Return the points with their shading normals interpolated between corners.

    turn (N,): the sign bit where normals are turned to the viewer.
    """
    smooth = kind != FLAT
    index = np.flatnonzero(smooth)
    if not index.size:
        return flat
    everywhere = index.size == smooth.size
    u, v = flat.u, flat.v
    assert u is not None and v is not None
    some_u, some_v = (u, v) if everywhere else (u.take(index), v.take(index))
    some = (
        (flat.triangle, flat.time)
        if everywhere
        else (flat.triangle.take(index), take(flat.time, index))
    )
    corner = triangles.corner_normals(*some)
    normal = corner[:3] * (F32(1) - some_u - some_v)
    normal += corner[3:6] * some_u
    normal += corner[6:] * some_v
    normalize(normal)
    normal.view(np.uint32)[:] ^= turn.take(index)

    # Opposite corner normals can cancel, or be NaN: such a point keeps its flat normal.
    fallen = np.flatnonzero(~(dot(normal, normal) >= F32(0.5)))
    if fallen.size:
        normal[:, fallen] = flat.geometric[:, index[fallen]]
    if not everywhere:
        partly = normal
        normal = flat.geometric.copy()
        normal[:, index] = partly
    check("surface", normal=normal)
    return replace(flat, normal=normal, smooth=smooth)
