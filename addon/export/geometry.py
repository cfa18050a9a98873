"""evaluated bpy meshes -> core.scene.Mesh.  Bulk reads only: nothing loops over elements.

Blender keeps corners of faces one after the other, and cuts faces into triangles on demand.
Reading that triangulation (`loop_triangles`) goes element by element and costs about 85 ns a
triangle, which is more than all the rest.  Triangles and quads, that is nearly all big meshes,
are cut here instead by Blender's own rule, from arrays that come in one block; only meshes
with larger faces read `loop_triangles`.
"""

from collections.abc import Collection
from typing import NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.scene import Mesh
from .attributes import export_attributes, has_corner_attributes, read_items

Corners = NDArray[np.int32]  # (F, 3), indices of face corners

# The two ways to cut a quad: as a fan from its first corner, or along the other diagonal
_FAN = np.array([0, 1, 2, 0, 2, 3], np.int32)
_OTHER = np.array([0, 1, 3, 1, 2, 3], np.int32)
_CHUNK = 1 << 15  # quads whose arithmetic stays in the caches


NO_CORNERS: Corners = np.empty((0, 3), np.int32)  # of meshes that rest: nobody asks


class Exported(NamedTuple):
    """A mesh, and which of Blender's corners are those of its triangles (F, 3)."""

    mesh: Mesh
    corners: Corners


def export_mesh(mesh: bpy.types.Mesh, names: Collection[str] = ()) -> Mesh:
    """Return the triangles of an evaluated mesh, in object space [m], and attributes by name."""
    return _export(mesh, names, False)[0]


def export_mesh_with_corners(mesh: bpy.types.Mesh, names: Collection[str] = ()) -> Exported:
    """Return the same, of a mesh that may deform."""
    exported, corners = _export(mesh, names, True)
    if corners is None:
        corners = np.arange(3 * len(exported.triangles), dtype=np.int32).reshape(-1, 3)
    return Exported(exported, corners)


def export_shape(
    mesh: bpy.types.Mesh, like: Exported
) -> tuple[NDArray[np.float32], NDArray[np.float32] | None] | None:
    """Return positions and normals of a mesh at another time; None if its faces are others.

    Of points without faces, see `stars`, positions alone.
    """
    before, corners = like
    if not len(before.triangles):
        return _points(mesh, before)
    if len(mesh.vertices) != len(before.positions) or not len(mesh.polygons):
        return None
    corner_vertex = read_items(mesh.attributes[".corner_vert"].data, "value", np.int32)
    if corners.max(initial=0) >= len(corner_vertex):
        return None
    if not np.array_equal(corner_vertex.take(corners), before.triangles):
        return None
    positions = read_items(mesh.attributes["position"].data, "vector", np.float32, 3)
    normals = _normals(mesh, corners)
    same = (None if each is None else each.shape for each in (normals, before.normals))
    if len(set(same)) > 1:
        normals = None
    return positions, normals


def _points(
    data: bpy.types.Mesh | bpy.types.PointCloud, before: Mesh
) -> tuple[NDArray[np.float32], None] | None:
    """Return the positions of points at another time; None if there are others."""
    attribute = data.attributes.get("position")
    if attribute is None or len(attribute.data) != len(before.positions):
        return None
    return read_items(attribute.data, "vector", np.float32, 3), None


def _export(
    mesh: bpy.types.Mesh, names: Collection[str], keeps_corners: bool
) -> tuple[Mesh, Corners | None]:
    if len(mesh.polygons) == 0:
        return Mesh(mesh.name, np.empty((0, 3), np.float32), np.empty((0, 3), np.int32)), None
    positions = read_items(mesh.attributes["position"].data, "vector", np.float32, 3)
    corner_vertex = read_items(mesh.attributes[".corner_vert"].data, "value", np.int32)
    faces = corners = None
    if len(corner_vertex) == 3 * len(mesh.polygons):
        triangles = corner_vertex.reshape(-1, 3)
    else:
        mesh.calc_loop_triangles()
        faces = read_items(mesh.loop_triangle_polygons, "value", np.int32)
        if _are_quads(mesh, faces):
            by_corner = mesh.normals_domain == "CORNER" or has_corner_attributes(mesh, names)
            by_corner = by_corner or keeps_corners
            triangles, corners = _cut_quads(positions, corner_vertex, by_corner)
        else:
            corners = _triangulate(mesh, positions, corner_vertex, faces)
            triangles = corner_vertex.take(corners)
    exported = Mesh(
        name=mesh.name,
        positions=positions,
        triangles=triangles,
        normals=_normals(mesh, corners),
        slots=_slots(mesh, faces),
        texture_space=(np.array(mesh.texspace_location), np.array(mesh.texspace_size)),
        attributes=export_attributes(mesh, names, corners, faces) if names else {},
    )
    return exported, corners


def _are_quads(mesh: bpy.types.Mesh, faces: NDArray[np.int32]) -> bool:
    # Two triangles for each face, one face after the other.
    if len(faces) != 2 * len(mesh.polygons):
        return False
    return bool(np.array_equal(faces, np.arange(len(faces), dtype=np.int32) >> 1))


def _cut_quads(
    positions: NDArray[np.float32], corner_vertex: NDArray[np.int32], by_corner: bool
) -> tuple[NDArray[np.int32], Corners | None]:
    """Return the triangles (F, 3) of a mesh of quads and, if they are needed, their corners."""
    quads = corner_vertex.reshape(-1, 4)
    first = np.arange(0, corner_vertex.size, 4, dtype=np.int32)
    flipped = np.flatnonzero(_is_concave_at_ends(positions, corner_vertex, first))
    triangles = quads.take(_FAN, axis=1)
    triangles[flipped] = quads.take(flipped, axis=0).take(_OTHER, axis=1)
    if not by_corner:
        return triangles.reshape(-1, 3), None
    corners = first[:, None] + _FAN
    corners[flipped] = first.take(flipped)[:, None] + _OTHER
    return triangles.reshape(-1, 3), corners.reshape(-1, 3)


def _triangulate(
    mesh: bpy.types.Mesh,
    positions: NDArray[np.float32],
    corner_vertex: NDArray[np.int32],
    faces: NDArray[np.int32],
) -> Corners:
    """Return the corners (F, 3) of the triangles cut from `faces` (F,), as Blender cuts them."""
    sizes = np.bincount(faces, minlength=len(mesh.polygons)) + 2
    if sizes.max(initial=0) > 4 or int(sizes.sum()) != len(corner_vertex):
        return read_items(mesh.loop_triangles, "loops", np.int32, 3)

    # Cut every face as a fan from its first corner
    starts = (np.cumsum(sizes) - sizes).astype(np.int32)
    second = np.zeros(len(faces), np.int32)
    second[1:] = faces[1:] == faces[:-1]
    corners = starts.take(faces)[:, None] + np.array([0, 1, 2], np.int32)
    corners[:, 1:] += second[:, None]

    # Cut along the other diagonal where the first one runs outside of a concave quad
    quads = np.flatnonzero(sizes == 4)
    first = starts.take(quads)
    flipped = np.flatnonzero(_is_concave_at_ends(positions, corner_vertex, first))
    rows = np.flatnonzero(second).take(flipped)
    base = first.take(flipped)[:, None]
    corners[rows - 1] = base + _OTHER[:3]
    corners[rows] = base + _OTHER[3:]
    return corners


def _is_concave_at_ends(
    positions: NDArray[np.float32],
    corner_vertex: NDArray[np.int32],
    first: NDArray[np.int32],
) -> NDArray[np.bool_]:
    """Do the second and the fourth corner (Q,) lie on the same side of the quad's diagonal 0-2?"""
    concave = np.empty(len(first), bool)
    for start in range(0, len(first), _CHUNK):
        part = slice(start, start + _CHUNK)
        corners = (corner_vertex.take(first[part] + i) for i in range(4))
        a, b, c, d = (np.ascontiguousarray(positions.take(i, axis=0).T) for i in corners)
        ab, ac, ad = b - a, c - a, d - a
        side_b = _cross(ab, ac)
        side_d = _cross(ad, ac)
        product = side_b[0] * side_d[0] + side_b[1] * side_d[1] + side_b[2] * side_d[2]
        concave[part] = product > 0
    return concave


def _cross(u: NDArray[np.float32], v: NDArray[np.float32]) -> tuple[NDArray[np.float32], ...]:
    return (
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    )


# Below, None for faces is the whole range: the mesh has nothing but triangles; so it is for
# corners, or nobody needs them


def _normals(mesh: bpy.types.Mesh, corners: Corners | None) -> NDArray[np.float32] | None:
    """Return shading normals: None (all flat), (V, 3) or (F, 3, 3), whichever is the smallest."""
    if mesh.normals_domain == "FACE":
        return None
    if mesh.normals_domain == "POINT":
        return read_items(mesh.vertex_normals, "vector", np.float32, 3)
    normals = read_items(mesh.corner_normals, "vector", np.float32, 3)
    return normals.reshape(-1, 3, 3) if corners is None else normals.take(corners, axis=0)


def _slots(mesh: bpy.types.Mesh, faces: NDArray[np.int32] | None) -> NDArray[np.int32] | None:
    """Return the material slot of each triangle (F,); None if it is the first one for all."""
    attribute = mesh.attributes.get("material_index")
    if attribute is None or attribute.domain != "FACE" or attribute.data_type != "INT":
        return None
    slots = read_items(attribute.data, "value", np.int32)
    np.maximum(slots, 0, out=slots)
    if not slots.any():
        return None
    return slots if faces is None else slots.take(faces)
