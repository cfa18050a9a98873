"""mesh, UV map -> tangents.  The axes of tangent-space normal maps at the corners of triangles.

The tangent of a corner is that of the triangles around its vertex, weighed by their angles; they
stay apart where position, normal or UV differ, and where one is a mirror image of the other.
Source: Mikkelsen 2008, "Simulation of Wrinkled Surfaces Revisited", chapter 3 (MikkTSpace).
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32
from ..scene import Mesh

Corners = NDArray[np.float64]  # (F, 3, 3): triangle, corner, axis


def corner_normals(mesh: Mesh) -> NDArray[np.float32]:
    """Return the shading normals of all corners (F, 3, 3), those of flat triangles unit."""
    if mesh.normals is None:
        p = mesh.positions.astype(np.float64).take(mesh.triangles, axis=0)
        flat = _unit(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))
        return np.repeat(flat[:, None].astype(F32), 3, axis=1)
    if mesh.normals.ndim == 3:
        return mesh.normals
    return mesh.normals.take(mesh.triangles, axis=0)


def uv_tangents(
    mesh: Mesh, normals: NDArray[np.float32], uv: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return tangents (F, 3, 3) along u, across the normals, and the sign (F, 3) of v's side.

    normals (F, 3, 3) and uv (F, 3, 2) are of the corners.
    """
    position = mesh.positions.take(mesh.triangles, axis=0).astype(F32)
    p, n = position.astype(np.float64), normals.astype(np.float64)
    t = uv.astype(np.float64)

    # The direction in which u grows, triangle by triangle
    edge, t_edge = p[:, 1:] - p[:, :1], t[:, 1:] - t[:, :1]
    area = t_edge[:, 0, 0] * t_edge[:, 1, 1] - t_edge[:, 0, 1] * t_edge[:, 1, 0]
    along = edge[:, 0] * t_edge[:, 1, 1, None] - edge[:, 1] * t_edge[:, 0, 1, None]
    along = _unit(along) * np.sign(area)[:, None]
    is_degenerate = np.abs(area) <= np.finfo(F32).tiny
    along[is_degenerate] = 0

    # Corners at the same place, with the same normal and UV, are one vertex
    key = np.concatenate([position, normals, uv.astype(F32)], axis=2).reshape(-1, 8) + F32(0)
    words = np.ascontiguousarray(key).view(np.dtype((np.void, 32))).reshape(-1)
    _, vertex = np.unique(words, return_inverse=True)
    side = np.repeat(area > 0, 3)
    group = vertex.reshape(-1) * 2 + side

    # Weigh the direction by the triangle's angle at the corner, within the plane of the normal
    projected = _unit(along[:, None] - n * _dot(n, along[:, None]))
    arms = [_unit(a - n * _dot(n, a)) for a in (np.roll(p, k, axis=1) - p for k in (1, -1))]
    angle = np.arccos(np.clip(_dot(*arms), -1, 1))
    weighed = (projected * angle).reshape(-1, 3)
    count = 2 * (int(vertex.max(initial=0)) + 1)
    total = np.stack([np.bincount(group, row, count) for row in weighed.T], axis=1)

    # Triangles without an area in the UV map take what their neighbours have
    is_alone = ~total.any(axis=1).take(group) & np.repeat(is_degenerate, 3)
    group = np.where(is_alone, group ^ 1, group)
    tangents = _unit(total.take(group, axis=0))
    tangents[~tangents.any(axis=1)] = (1, 0, 0)
    sign = np.where(group & 1, 1, -1)
    return tangents.reshape(-1, 3, 3).astype(F32), sign.reshape(-1, 3).astype(F32)


def around_sphere(mesh: Mesh) -> NDArray[np.float32]:
    """Return the UV (F, 3, 2) of meshes without any: where corners lie on a globe."""
    x, y, z = mesh.positions.astype(np.float64).T
    length = np.sqrt(x * x + y * y + z * z)
    cosine = np.clip(z / np.where(length > 0, length, 1), -1, 1)
    u = np.where((x == 0) & (y == 0), 0, 0.5 - np.arctan2(x, y) / (2 * np.pi))
    v = 1 - np.arccos(cosine) / np.pi
    uv = np.where(length > 0, np.stack([u, v]), 0).T.astype(F32)
    return uv.take(mesh.triangles, axis=0)


def _dot(a: Corners, b: Corners) -> Corners:
    return np.sum(a * b, axis=-1, keepdims=True)


def _unit(a: Corners) -> Corners:
    length = np.sqrt(_dot(a, a))
    return np.where(length > 0, a / np.where(length > 0, length, 1), 0)
