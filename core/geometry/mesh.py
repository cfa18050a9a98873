"""instances -> triangles.  All meshes of the scene as one triangle table about a local origin.

Embree and every hit address triangles by one number.  Positions are moved to the local origin
in float64 and rounded once; all that a hit needs of a flat triangle is one row of 32 bytes.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import EPSILON, F32, Ids, Index, Scalar, Vec, gather_rows
from ..scene import FARTHEST, Cancelled, Instance, Material, Mesh, Note, SceneError
from .embree import PADDING
from .motion import Movement, along_arcs
from .movers import Placed, compile_movement
from .objects import PLAIN, Objects, Traits, compile_objects, sort_into_parts

# Columns of a triangle's row; the last three are int32 in the bits of a float32.
NX, NY, NZ, PLANE, OFFSET, MATERIAL, SMOOTH, INSTANCE = range(8)
COLUMNS = 8

# `Triangles.ids`: how a triangle comes to its normals, if not by a row of its own.
FLAT, OF_VERTICES = -1, -2

# Rounding of a hit point and of Embree's own test, in units of EPSILON x the largest coordinate
# of the triangle: measured on tilted ground, 8 x (|point| + |vertex|) leaves no self-shadowing.
OFFSET_ULPS = 16

# Embree moves rays to an object's space and back, which rounds them once more: so many times that.
MOVING_OFFSET = F32(4)

CHUNK = 1 << 17  # triangles per step of the table's arithmetic: float64 that fits the caches


@dataclass(frozen=True, eq=False)
class Triangles:
    """The flattened triangles of a scene; F triangles, V vertices.

    vertices (V, 3) float32 and corners (F, 3) int32 go to Embree; ids (F, 3) int32 is the
    material, the first row of `normals` (N, 3) of a triangle with normals of its own at its
    three corners, -1 if it is flat, -2 if its normals are those of its vertices, in
    `vertex_normals` (V, 3), and the instance.  rows (F, 8) and corner_normals (F, 9) are what
    hits read, None where so few hits are expected that it is made for each of them.

    part (F,) counts into `traits`, None if all triangles have the first of them; objects are the
    flags of the instances; is_numbered: hits are told their instance; is_mapped: where on the
    triangle they are.  Of what moves, the above is where it is in the frame itself, and movement
    tells where it is at any time; None if everything rests.  frames: of what moves from frame to
    frame, where it is in the one before, at time 0, and after, at time 1; None if nobody asks.
    """

    vertices: NDArray[np.float32]
    corners: NDArray[np.int32]
    ids: NDArray[np.int32]
    vertex_normals: NDArray[np.float32] | None
    normals: NDArray[np.float32] | None
    rows: NDArray[np.float32] | None
    smooth_rows: NDArray[np.float32] | None
    objects: Objects | None = None
    traits: tuple[Traits, ...] = (PLAIN,)
    part: NDArray[np.uint16] | None = None
    is_numbered: bool = False
    is_mapped: bool = False
    movement: Movement | None = None
    frames: Movement | None = None

    @property
    def count(self) -> int:
        """The number of triangles."""
        return len(self.corners)

    @property
    def is_flat(self) -> bool:
        """Whether no triangle has smooth normals."""
        return self.vertex_normals is None and self.normals is None

    def columns(self, triangle: Ids, time: Scalar | None = None) -> NDArray[np.float32]:
        """Return the table's columns (8, N) for triangles (N,); see NX ... INSTANCE.

        Without the last two where all triangles are flat and nobody asks for instances.
        Of what moves, at times (N,), in this and all that follow; None is the frame itself.
        """
        if self.rows is not None:
            columns = gather_rows(self.rows, triangle, SMOOTH if self._is_plain else COLUMNS)
        else:
            rows = _planes(self.vertices, self.corners.take(triangle, axis=0))
            rows.view(np.int32)[:, MATERIAL:] = self.ids.take(triangle, axis=0)
            columns = np.ascontiguousarray(rows.T)
        some = self._moving(triangle, time)
        if some is not None:
            assert time is not None
            part, when = triangle.take(some), time.take(some)
            assert self.movement is not None
            instance, corners = self.ids[:, 2].take(part), self.corners.take(part, axis=0).T
            there = _planes_of(*self.movement.places(list(corners), instance, when))
            columns[:MATERIAL, some] = there.T[:MATERIAL]
            columns[OFFSET, some] *= MOVING_OFFSET
        return columns

    @property
    def _is_plain(self) -> bool:
        return self.is_flat and not self.is_numbered

    def places(self, triangle: Ids, time: Scalar | None = None) -> tuple[Vec, Vec, Vec]:
        """Return the corners (3, N) of triangles (N,) about the local origin [m]."""
        corners = self.corners.take(triangle, axis=0).T
        found = [np.ascontiguousarray(self.vertices.take(corner, axis=0).T) for corner in corners]
        some = self._moving(triangle, time)
        if some is not None:
            assert self.movement is not None and time is not None
            instance, when = self.ids[:, 2].take(triangle.take(some)), time.take(some)
            moved = self.movement.places([each.take(some) for each in corners], instance, when)
            for place, there in zip(found, moved, strict=True):
                place[:, some] = there
        return found[0], found[1], found[2]

    def _moving(self, triangle: Ids, time: Scalar | None) -> Index | None:
        """Return which of the triangles move, None if there are none."""
        if self.movement is None or time is None:
            return None
        some = np.flatnonzero(self.movement.moves.take(self.ids[:, 2].take(triangle)))
        return some if some.size else None

    def barycentric(
        self, triangle: Ids, way: NDArray[np.float32], time: Scalar | None = None
    ) -> NDArray[np.float32]:
        """Return how u and v (2, N) grow along ways (3, N) in the planes of triangles (N,)."""
        a, b, c = self.places(triangle, time)
        b, c = b - a, c - a
        bb, bc, cc = (b * b).sum(0), (b * c).sum(0), (c * c).sum(0)
        wb, wc = (way * b).sum(0), (way * c).sum(0)
        area = np.maximum(bb * cc - bc * bc, F32(1e-30))
        return np.stack([(cc * wb - bc * wc) / area, (bb * wc - bc * wb) / area])

    def corner_normals(self, triangle: Ids, time: Scalar | None = None) -> NDArray[np.float32]:
        """Return the three corner normals (9, N) of smooth triangles (N,)."""
        if self.smooth_rows is None:
            normals = np.ascontiguousarray(self._smooth_rows(triangle).T)
        else:
            normals = gather_rows(self.smooth_rows, triangle)
        some = self._moving(triangle, time)
        if some is not None:
            assert time is not None
            normals[:, some] = self._turned_normals(triangle.take(some), time.take(some))
        return normals

    def _turned_normals(self, triangle: Ids, time: Scalar) -> NDArray[np.float32]:
        movement, ids = self.movement, self.ids.take(triangle, axis=0).T
        assert movement is not None
        corners = self.corners.take(triangle, axis=0).T
        out = np.zeros((9, triangle.size), F32)
        for shapes, some in (
            (movement.vertex_normals, np.flatnonzero(ids[1] == OF_VERTICES)),
            (movement.corner_normals, np.flatnonzero(ids[1] >= 0)),
        ):
            if shapes is None or not some.size:
                continue
            numbers = [corner.take(some) for corner in corners]
            if shapes is movement.corner_normals:
                numbers = [ids[1].take(some) + np.int32(k) for k in range(3)]
            out[:, some] = movement.normals(shapes, numbers, ids[2].take(some), time.take(some))
        return out

    def _smooth_rows(self, triangle: Ids) -> NDArray[np.float32]:
        out = np.zeros((len(triangle), 9), F32)
        first = self.ids[:, 1].take(triangle)
        if self.vertex_normals is not None:
            some = np.flatnonzero(first == OF_VERTICES)
            corners = self.corners.take(triangle.take(some), axis=0)
            out[some] = self.vertex_normals.take(corners, axis=0).reshape(-1, 9)
        if self.normals is not None:
            some = np.flatnonzero(first >= 0)
            rows = np.add(first.take(some)[:, None], np.arange(3), dtype=np.int32)
            out[some] = self.normals.take(rows, axis=0).reshape(-1, 9)
        return out


def bare_triangles(vertices: NDArray[np.float32], corners: NDArray[np.int32]) -> Triangles:
    """Return a table of flat triangles (F, 3) without materials, for what only Embree must find."""
    padded = np.zeros(vertices.size + PADDING, F32)[:-PADDING].reshape(-1, 3)
    padded[:] = vertices
    ids = np.full((len(corners), 3), FLAT, np.int32)
    return Triangles(padded, np.ascontiguousarray(corners), ids, None, None, None, None)


def boxes_of(instances: tuple[Instance, ...]) -> NDArray[np.float64]:
    """Return the world-space boxes (N, 2, 3) [m] around the finite vertices of each instance.

    All the way of those that move; the box of an instance without vertices is (inf, -inf).
    """
    out = np.empty((len(instances), 2, 3))
    out[:, 0], out[:, 1] = np.inf, -np.inf
    boxes: dict[int, NDArray[np.float64] | None] = {}
    for instance, found in zip(instances, out, strict=True):
        mesh = instance.mesh
        if id(mesh) not in boxes:
            boxes[id(mesh)] = _box(mesh)
        box = boxes[id(mesh)]
        if box is None:
            continue
        middle, size = (box[0] + box[1]) / 2, (box[1] - box[0]) / 2
        keys = instance.to_world[None] if instance.motion is None else instance.motion
        for matrix in keys if len(keys) == 1 else along_arcs(keys):
            centre = matrix[:, :3] @ middle + matrix[:, 3]
            half = np.abs(matrix[:, :3]) @ size
            found[0] = np.minimum(found[0], centre - half)
            found[1] = np.maximum(found[1], centre + half)
    return out


def bounds(instances: tuple[Instance, ...]) -> NDArray[np.float64] | None:
    """Return the world-space box (2, 3) [m] around all finite vertices, None if there are none."""
    return enclosing(boxes_of(instances))


def enclosing(boxes: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the box (2, 3) [m] around boxes (N, 2, 3) of `boxes_of`, None if there is nothing."""
    if not len(boxes):
        return None
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    return np.stack([low, high]) if (low <= high).all() else None


def compile_triangles(
    instances: tuple[Instance, ...],
    materials: dict[int, int],
    origin: NDArray[np.float64],
    memory_limit: float,
    hits_expected: float,
    should_stop: Callable[[], bool],
    transparent: Collection[int] = (),
    links_shadows: bool = False,
    is_numbered: bool = False,
    is_mapped: bool = False,
    blurs: bool = True,
) -> tuple[Triangles | None, list[Note]]:
    """Flatten instances into one table about `origin` (3,) [m].

    `materials` maps id(material) to its number, with None's under id(None); `transparent` are
    the numbers of those that shadow rays may pass.  Blockers are told apart if `links_shadows`,
    hits are told their instance if `is_numbered` or an object's flags ask for it, and where on the
    triangle they are if `is_mapped`.  What moves is blurred, unless `blurs` says that its motion is
    that from frame to frame.  Triangles
    with a vertex that is not finite are left out and noted; so are, silently, those without
    area.  Tables are made in advance where more hits are expected than there are triangles.
    Raises: Cancelled; SceneError if the table would need more than `memory_limit` bytes.
    """
    notes: list[Note] = []
    clean: dict[int, Mesh] = {}
    for instance in instances:
        if id(instance.mesh) not in clean:
            clean[id(instance.mesh)] = without_broken(instance.mesh, notes)
    used = [(i, clean[id(i.mesh)]) for i in instances if i.seen_by.mask]
    used = [(instance, mesh) for instance, mesh in used if len(mesh.triangles)]
    _check_memory(used, memory_limit)
    if not used:
        return None, notes

    # Make room for all, then fill in instance by instance.
    vertex_count = sum(len(mesh.positions) for _, mesh in used)
    count = sum(len(mesh.triangles) for _, mesh in used)
    kinds = {0 if mesh.normals is None else mesh.normals.ndim for _, mesh in used}
    cornered = [mesh for _, mesh in used if mesh.normals is not None and mesh.normals.ndim == 3]
    vertices = np.zeros(vertex_count * 3 + PADDING, F32)[:-PADDING].reshape(-1, 3)
    corners = np.empty((count, 3), np.int32)
    ids = np.full((count, 3), FLAT, np.int32)
    vertex_normals = np.zeros((vertex_count, 3), F32) if 2 in kinds else None
    normals = np.empty((3 * sum(len(m.triangles) for m in cornered), 3), F32) if cornered else None
    first_vertex = first = first_normal = 0
    number = {id(instance): i for i, instance in enumerate(instances)}
    placed: list[Placed] = []
    for instance, mesh in used:
        if should_stop():
            raise Cancelled
        v = slice(first_vertex, first_vertex + len(mesh.positions))
        f = slice(first, first + len(mesh.triangles))
        linear, shift = instance.to_world[:, :3], instance.to_world[:, 3] - origin
        _place(mesh.positions, linear, shift, vertices[v])

        # A mirrored object keeps its outside: swap two corners of each triangle.
        order = (0, 2, 1) if np.linalg.det(linear) < 0 else (0, 1, 2)
        local = mesh.triangles[:, order] if order != (0, 1, 2) else mesh.triangles
        np.add(local, np.int32(first_vertex), out=corners[f])
        ids[f, 0] = _material_ids(instance, mesh, materials)
        ids[f, 2] = number[id(instance)]
        placed.append(Placed(number[id(instance)], instance, mesh, order, v.start, first_normal))
        if mesh.normals is not None and mesh.normals.ndim == 2 and vertex_normals is not None:
            vertex_normals[v] = _turn_normals(mesh.normals, linear)
            ids[f, 1] = OF_VERTICES
        elif mesh.normals is not None and normals is not None:
            n = slice(first_normal, first_normal + 3 * len(local))
            ordered = mesh.normals[:, order] if order != (0, 1, 2) else mesh.normals
            normals[n] = _turn_normals(ordered.reshape(-1, 3), linear)
            ids[f, 1] = np.arange(n.start, n.stop, 3, dtype=np.int32)
            first_normal = n.stop
        first_vertex, first = v.stop, f.stop

    objects = compile_objects(instances, blurs)
    traits, part = sort_into_parts(objects, ids[:, 2], ids[:, 0], transparent, links_shadows)
    is_numbered = is_numbered or objects.matter_to_hits
    own = vertices, corners, ids, vertex_normals, normals, None, None
    movement = compile_movement(instances, placed, origin)
    motions = (movement, None) if blurs else (None, movement)
    triangles = Triangles(*own, objects, traits, part, is_numbered, is_mapped, *motions)
    if count > hits_expected:
        return triangles, notes
    return _with_tables(triangles, should_stop), notes


def _with_tables(triangles: Triangles, should_stop: Callable[[], bool]) -> Triangles:
    rows = np.zeros((triangles.count, COLUMNS), F32)
    smooth_rows = None if triangles.is_flat else np.empty((triangles.count, 9), F32)
    for start in range(0, triangles.count, CHUNK):
        if should_stop():
            raise Cancelled
        part = slice(start, start + CHUNK)
        rows[part] = _planes(triangles.vertices, triangles.corners[part])
        if smooth_rows is not None:
            stop = min(start + CHUNK, triangles.count)
            smooth_rows[part] = triangles._smooth_rows(np.arange(start, stop, dtype=np.int32))
    rows.view(np.int32)[:, MATERIAL:] = triangles.ids
    return replace(triangles, rows=rows, smooth_rows=smooth_rows)


def _box(mesh: Mesh) -> NDArray[np.float64] | None:
    if not len(mesh.triangles):
        return None
    if mesh.deformation is not None:
        steps = np.concatenate([mesh.positions[None], mesh.deformation.positions])
        return np.stack([np.nanmin(steps, axis=(0, 1)), np.nanmax(steps, axis=(0, 1))])
    low, high = _extent(mesh.positions)
    if not (_is_sound(low).all() and _is_sound(high).all()):
        finite = mesh.positions[_is_sound(mesh.positions).all(axis=1)]
        if not len(finite):
            return None
        low, high = finite.min(axis=0), finite.max(axis=0)
    return np.stack([low, high]).astype(np.float64)


def _extent(positions: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the least and greatest coordinates (2, 3), NaN where there is one."""
    # Rows of 64 points reduce ten times as fast as rows of three numbers.
    whole = len(positions) // 64 * 64
    parts = [positions[whole:]]
    if whole:
        wide = np.ascontiguousarray(positions[:whole]).reshape(-1, 192)
        parts += [wide.min(axis=0).reshape(64, 3), wide.max(axis=0).reshape(64, 3)]
    few = np.concatenate(parts)
    return np.stack([few.min(axis=0), few.max(axis=0)])


def _is_sound(positions: NDArray[np.floating]) -> NDArray[np.bool_]:
    # False for NaN, too
    return np.abs(positions) <= FARTHEST


def without_broken(mesh: Mesh, notes: list[Note]) -> Mesh:
    """Return a mesh without the triangles that have a vertex which is not finite, and note it."""
    # min and max pass NaN and infinity on, so two reductions tell a sound mesh.
    if not len(mesh.triangles) or _is_sound(_extent(mesh.positions)).all():
        return mesh
    sound = _is_sound(mesh.positions).all(axis=1)
    keep = np.flatnonzero(sound[mesh.triangles].all(axis=1))
    dropped = len(mesh.triangles) - len(keep)
    if dropped:
        bad = int(np.flatnonzero(~sound)[0])
        notes.append(
            Note(
                f"Mesh '{mesh.name}'",
                f"{dropped} triangles are left out: vertex {bad} and {int((~sound).sum()) - 1} "
                "others have a coordinate that is no finite number, or beyond 1e18 m",
            )
        )
    per_corner = mesh.normals is not None and mesh.normals.ndim == 3
    kept = {
        name: attribute
        if attribute.domain == "POINT"
        else replace(attribute, values=attribute.values[keep])
        for name, attribute in mesh.attributes.items()
    }
    return replace(
        mesh,
        positions=np.where(sound[:, None], mesh.positions, 0),
        triangles=mesh.triangles[keep],
        normals=mesh.normals[keep] if per_corner and mesh.normals is not None else mesh.normals,
        slots=None if mesh.slots is None else mesh.slots[keep],
        attributes=kept,
        deformation=None,
    )


def _check_memory(used: list[tuple[Instance, Mesh]], limit: float) -> None:
    # Embree's tree and copies: about 150 bytes a triangle, measured; our tables: 56 to 92.
    def need(mesh: Mesh) -> int:
        own = 24 + 4 * COLUMNS + (36 if mesh.normals is not None else 0)
        return len(mesh.triangles) * (150 + own) + len(mesh.positions) * 28

    total = sum(need(mesh) for _, mesh in used)
    if total <= limit:
        return
    by_name: dict[str, int] = {}
    for instance, mesh in used:
        by_name[instance.name] = by_name.get(instance.name, 0) + need(mesh)
    name = max(by_name, key=lambda key: by_name[key])
    raise SceneError(
        f"Object '{name}' with its instances needs {by_name[name] / 2**30:.1f} GB of the "
        f"{total / 2**30:.1f} GB that this scene needs when instances are flattened; "
        f"the limit (Instance Memory) is {limit / 2**30:.1f} GB"
    )


def _place(
    positions: NDArray[np.floating],
    linear: NDArray[np.float64],
    shift: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    if np.array_equal(linear, np.eye(3)) and not shift.any():
        out[:] = positions
        return
    for start in range(0, len(positions), CHUNK):
        part = slice(start, start + CHUNK)
        world = positions[part].astype(np.float64) @ linear.T
        world += shift
        out[part] = world


def _material_ids(
    instance: Instance, mesh: Mesh, materials: dict[int, int]
) -> NDArray[np.int32] | np.int32:
    slots: tuple[Material | None, ...] = instance.materials or (None,)
    table = np.array([materials[id(material)] for material in slots], np.int32)
    if mesh.slots is None:
        return np.int32(table[0])
    return table.take(np.clip(mesh.slots, 0, len(table) - 1))


def _turn_normals(normals: NDArray[np.float32], linear: NDArray[np.float64]) -> NDArray[np.float32]:
    # The cofactor matrix carries normals, has no division, and is exact for a flattened object;
    # it turns them inside out where the object is mirrored, so take that back.
    cofactor = np.cross(linear[[1, 2, 0]], linear[[2, 0, 1]])
    if np.linalg.det(linear) < 0:
        cofactor = -cofactor
    scale = np.abs(cofactor).max()
    if scale > 0:
        cofactor = cofactor / scale
    if np.array_equal(cofactor, np.eye(3)):
        return normals
    turned = normals @ cofactor.T.astype(F32)
    length = np.sqrt(turned[..., 0] ** 2 + turned[..., 1] ** 2 + turned[..., 2] ** 2)
    turned /= np.maximum(length, F32(1e-30))[..., None]
    return turned.astype(F32, copy=False)


def _planes(vertices: NDArray[np.float32], corners: NDArray[np.int32]) -> NDArray[np.float32]:
    """Return rows (n, 8) with the normal, plane and offset of triangles (n, 3)."""
    return _planes_of(*(vertices.take(corners[:, k], axis=0).T for k in range(3)))


def _planes_of(*places: Vec) -> NDArray[np.float32]:
    """Return the same of triangles by their three corners (3, n)."""
    # float64: the normal of a needle needs it, and it is the rounded vertices that Embree sees.
    a, b, c = (place.astype(np.float64) for place in places)
    e1, e2 = b - a, c - a
    nx = e1[1] * e2[2] - e1[2] * e2[1]
    ny = e1[2] * e2[0] - e1[0] * e2[2]
    nz = e1[0] * e2[1] - e1[1] * e2[0]
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    np.maximum(length, 1e-300, out=length)
    rows = np.zeros((a.shape[1], COLUMNS), F32)
    rows[:, NX], rows[:, NY], rows[:, NZ] = nx / length, ny / length, nz / length

    # The plane goes through the middle of the triangle, where float32 normals err least.
    middle = (a + b + c) / 3
    rows[:, PLANE] = rows[:, NX] * middle[0] + rows[:, NY] * middle[1] + rows[:, NZ] * middle[2]
    largest = np.abs(a).max(axis=0)
    for corner in (b, c):
        np.maximum(largest, np.abs(corner).max(axis=0), out=largest)
    rows[:, OFFSET] = largest * (OFFSET_ULPS * float(EPSILON))
    return rows
