"""meshes, materials -> meshes.  Vertices moved to where materials displace them.

This happens before rays have anything to meet.  The rules are Blender's: a vertex moves once, by
the material of the first triangle around it that displaces; the graph sees it as a corner of that
triangle, with a smooth normal even where the surface is flat.  Then normals are made anew: those
of vertices from the triangles around them; those of corners turn as the vertex's normal does, so
that sharp edges stay sharp; where bump follows (BOTH) the vertices keep theirs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Vec
from ..geometry.attributes import compile_attributes
from ..geometry.mesh import OFFSET, Triangles, compile_triangles, without_broken
from ..geometry.spaces import compile_spaces
from ..geometry.surface import Points
from ..geometry.uv_tangents import corner_normals
from ..scene import (
    FARTHEST,
    REST,
    REST_NORMAL,
    SHARP,
    Attribute,
    Cancelled,
    Deformation,
    Instance,
    Material,
    Mesh,
    Note,
    RayKinds,
)
from .attributes import asked_by
from .context import Arrival, Context, Place
from .graph import Graph, Library, links_below, output_of
from .nodes import NODES
from .program import merge
from .values import Value, walk

CHUNK = 1 << 16  # vertices that are displaced at a time


@dataclass(frozen=True, eq=False)
class _Group:
    """Instances that show the same mesh with the same materials, by number."""

    mesh: Mesh
    materials: tuple[Material | None, ...]
    members: list[int]


def displace(
    instances: tuple[Instance, ...],
    origin: NDArray[np.float64],
    library: Library,
    notes: list[Note],
    should_stop: Callable[[], bool] = lambda: False,
) -> tuple[Instance, ...]:
    """Return instances whose meshes are displaced where their materials ask for it.

    Positions are computed about `origin` (3,) [m].  Displaced meshes have the attribute REST, the
    way back to where vertices were.  Instances of a mesh are displaced alike, as the first one is.
    Raises: Cancelled.
    """
    ways = _ways(instances, library, notes)
    if not ways:
        return instances
    groups: dict[tuple[int, ...], _Group] = {}
    for number, instance in enumerate(instances):
        materials = instance.materials or (None,)
        if any(id(material) in ways for material in materials):
            key = (id(instance.mesh), *map(id, materials))
            group = groups.setdefault(key, _Group(instance.mesh, materials, []))
            group.members.append(number)
    displaced = list(instances)
    for group in groups.values():
        first = instances[group.members[0]]
        mesh = _displaced(first, group, ways, origin, notes, should_stop)
        for number in group.members:
            displaced[number] = replace(instances[number], mesh=mesh)
    return tuple(displaced)


def _ways(instances: Sequence[Instance], library: Library, notes: list[Note]) -> dict[int, Value]:
    """Return by which way materials displace, by the id of the material."""
    ways: dict[int, Value] = {}
    for material in {id(m): m for i in instances for m in i.materials}.values():
        if material is None or material.displacement is None or not material.moves:
            continue
        root = output_of(material)
        graph = Graph(f"Material '{material.name}'", NODES, library, root)
        graph.material_index = material.index
        way = graph.whole(root, "Displacement")
        ways[id(material)] = way
        notes += graph.notes
    return ways


def _displaced(
    instance: Instance,
    group: _Group,
    ways: dict[int, Value],
    origin: NDArray[np.float64],
    notes: list[Note],
    should_stop: Callable[[], bool],
) -> Mesh:
    mesh = without_broken(group.mesh, notes)
    if not len(mesh.triangles):
        return mesh
    instance = replace(
        instance, mesh=mesh, motion=None, materials=group.materials, seen_by=RayKinds()
    )
    smooth = replace(mesh, deformation=None)
    if mesh.normals is None:
        smooth = replace(smooth, normals=smooth_normals(mesh))
    numbers = {id(material): number for number, material in enumerate(group.materials)}
    triangles, _ = compile_triangles(
        (replace(instance, mesh=smooth),), numbers, origin, np.inf, 0.0, should_stop,
        is_numbered=True, is_mapped=True,
    )  # fmt: skip
    if triangles is None:
        return mesh

    # Each vertex once, as a corner of the first triangle that displaces it
    moves = np.array([id(material) in ways for material in group.materials])
    moving = np.flatnonzero(moves.take(triangles.ids[:, 0]))
    vertices, first = np.unique(triangles.corners.take(moving, axis=0), return_index=True)
    triangle, corner = moving.take(first // 3).astype(np.int32), first % 3

    # Where materials send them, in the object's space
    position = mesh.positions.copy()
    back = np.linalg.pinv(instance.to_world[:, :3])
    place = Place(
        origin.astype(F32)[:, None],
        compile_spaces((instance,), origin),
        triangles=triangles,
    )
    slots = triangles.ids[:, 0].take(triangle)
    for number in np.unique(slots):
        way = ways[id(group.materials[number])]
        program, order = merge([(way,)]), tuple(walk([way]))
        asked = frozenset(asked_by(order))
        here = replace(place, attributes=compile_attributes((instance,), asked, triangles))
        of_slot = np.flatnonzero(slots == number)
        for start in range(0, of_slot.size, CHUNK):
            if should_stop():
                raise Cancelled
            some = of_slot[start : start + CHUNK]
            points = _points(triangles, vertices.take(some), triangle.take(some), corner.take(some))
            context = Context(points, Arrival(0), None, here)
            (moved,) = program.run((way,), order, context, None)
            # What is no number moves nothing, nor what is too far
            is_sound = (np.abs(moved) <= FARTHEST).all(axis=0)
            local = back @ np.where(is_sound, moved, 0).astype(np.float64)
            position[vertices.take(some)] += local.T.astype(position.dtype)

    methods = np.array([_method(material, ways) for material in group.materials])
    of_triangles = methods.take(triangles.ids[:, 0])
    rest = {REST: Attribute("POINT", (mesh.positions - position).astype(F32))}
    if mesh.normals is not None and any(map(_asks_for_normals, group.materials)):
        rest[REST_NORMAL] = Attribute("CORNER", corner_normals(mesh))
    deformation = mesh.deformation
    if deformation is not None:
        deformation = _deformed(mesh, deformation, position, of_triangles)
    return replace(
        mesh,
        positions=position,
        normals=_normals_after(mesh, position, of_triangles),
        attributes={**mesh.attributes, **rest},
        deformation=deformation,
    )


def _deformed(
    mesh: Mesh,
    deformation: Deformation,
    position: NDArray[np.floating],
    method: NDArray[np.int_],
) -> Deformation:
    """Return a deformation whose vertices are always displaced as the mesh's are (Cycles)."""
    after = deformation.positions + (position - mesh.positions)
    if mesh.normals is None:
        return Deformation(after)
    normals = []
    for step, (before, there) in enumerate(zip(deformation.positions, after, strict=True)):
        old = mesh.normals if deformation.normals is None else deformation.normals[step]
        shape = replace(mesh, positions=before, normals=old)
        normals.append(_normals_after(shape, there, method))
    return Deformation(after, np.stack([each for each in normals if each is not None]))


# What becomes of the normals of a triangle
AS_OTHERS, RENEWED, KEPT = 0, 1, 2


def _method(material: Material | None, ways: dict[int, Value]) -> int:
    if material is None or id(material) not in ways:
        return AS_OTHERS
    return KEPT if material.bumps else RENEWED


def _asks_for_normals(material: Material | None) -> bool:
    """Tell whether normal maps of a material lie on the surface as it was."""
    return material is not None and any(
        link.node.kind == "NormalMap" and link.node.properties.get("base") == "ORIGINAL"
        for link in links_below(output_of(material))
    )


def _points(triangles: Triangles, vertex: Ids, triangle: Ids, corner: Index) -> Points:
    """Return vertices (N,) as points, corners (N,) of triangles (N,), seen along the normal."""
    size = vertex.size
    columns = triangles.columns(triangle)
    normals = triangles.corner_normals(triangle).reshape(3, 3, size)
    normal: Vec = np.ascontiguousarray(normals[corner, :, np.arange(size)].T)
    zero, none = np.zeros(size, F32), np.zeros(size, np.int32)
    return Points(
        np.ascontiguousarray(triangles.vertices.take(vertex, axis=0).T),
        np.negative(normal),
        columns[:3].copy(),
        normal,
        np.zeros(size, bool),
        columns[OFFSET],
        triangle,
        none,
        zero,
        u=(corner == 1).astype(F32),
        v=(corner == 2).astype(F32),
        instance=none,
    )


# --- Normals ------------------------------------------------------------------------------------


def smooth_normals(mesh: Mesh) -> NDArray[np.float32]:
    """Return normals of vertices (V, 3), the mean of the triangles' weighed by their angles."""
    corners = mesh.positions.astype(np.float64).take(mesh.triangles, axis=0)
    edges = _unit(np.roll(corners, -1, axis=1) - corners)
    cosine = -np.sum(edges * np.roll(edges, 1, axis=1), axis=2)
    angle = np.arccos(np.clip(cosine, -1, 1))
    return _unit(_summed(mesh, _faces(mesh, mesh.positions)[:, None] * angle[..., None])).astype(
        F32
    )


def _normals_after(
    mesh: Mesh,
    position: NDArray[np.floating],
    method: NDArray[np.int_],
) -> NDArray[np.float32] | None:
    """Return the normals of a mesh whose vertices are now at `position` (V, 3).

    method (F,): AS_OTHERS ... KEPT of the triangles.  Normals are made in the object's space.
    """
    if mesh.normals is None:
        return None
    is_of_corners = mesh.normals.ndim == 3
    renews = method == RENEWED
    if not is_of_corners and not renews.any():
        return mesh.normals

    def made(at: NDArray[np.floating], some: NDArray[np.bool_]) -> NDArray[np.float64]:
        return _unit(_summed(mesh, np.where(some[:, None], _faces(mesh, at), 0)[:, None]))

    if not is_of_corners:
        new = made(position, renews)
        touched = np.unique(mesh.triangles[renews])
        normals = mesh.normals.copy()
        normals[touched] = new[touched]
        return normals

    # Corners turn by as much as their vertices; flat triangles have their own again
    every = np.ones(len(mesh.triangles), bool)
    turn = made(position, every) - made(mesh.positions, every)
    new = _unit(mesh.normals.astype(np.float64) + turn.take(mesh.triangles, axis=0))
    sharp = mesh.attributes.get(SHARP)
    if sharp is not None:
        flat = np.flatnonzero(sharp.values[:, 0])
        new[flat] = _faces(mesh, position)[flat, None]
    lost = ~new.any(axis=2) | (method == KEPT)[:, None]
    new[lost] = mesh.normals[lost]
    return new.astype(F32)


def _faces(mesh: Mesh, position: NDArray[np.floating]) -> NDArray[np.float64]:
    a, b, c = (position.take(row, axis=0).astype(np.float64) for row in mesh.triangles.T)
    return _unit(np.cross(b - a, c - a))


def _summed(mesh: Mesh, parts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sums (V, 3) at the vertices of what corners bring, (F, 3, 3) or (F, 1, 3)."""
    count, corner = len(mesh.positions), mesh.triangles.reshape(-1)
    rows = np.broadcast_to(parts, (len(parts), 3, 3)).reshape(-1, 3).T
    return np.stack([np.bincount(corner, row, count) for row in rows], axis=1)


def _unit(a: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.sqrt(np.sum(a * a, axis=-1, keepdims=True))
    unit: NDArray[np.float64] = a / np.where(length > 0, length, 1)
    return unit
