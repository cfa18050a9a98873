"""meshes, names -> tables.  What meshes carry besides their shape, interpolated at hits.

One row holds the three corners of a triangle, so that a hit costs one gather.  Instances of a mesh
share their rows; what shaders do not ask for has no table.  Points of a mesh without the attribute
get what Blender gives them, mostly zeros.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Scalar, Vec, gather_rows
from ..scene import ACTIVE_UV, REST, REST_NORMAL, Attribute, Instance, Mesh
from .mesh import Triangles, without_broken
from .uv_tangents import around_sphere, corner_normals, uv_tangents

# What is asked of an attribute: the name, and one of
# VECTOR   up to three numbers; FACTOR  their mean;
# ALPHA    the fourth, 1 where there is none; OPACITY  the same, but 0 without the attribute;
# FRAME    of a UV map: normal, tangent along u and the side of v, all of the object
# REST_FRAME  the same of meshes as they were before they were displaced, and 1 where that counts
# DENSITY  of a UV map: by how much it grows per metre, at least
VECTOR, FACTOR, ALPHA, OPACITY, FRAME = "vector", "factor", "alpha", "opacity", "frame"
REST_FRAME, DENSITY = "frame at rest", "density"
_FRAMES = {FRAME: 7, REST_FRAME: 8}
Asked = tuple[str, str]
CHUNK = 1 << 14  # triangles whose arithmetic stays in the caches


@dataclass(frozen=True, eq=False)
class Table:
    """Rows (R, 3 C) of triangles, corner after corner; C numbers to a corner.

    The row of a triangle is its number x stride (I,) + base (I,) int32 of its instance.
    """

    rows: NDArray[np.float32]
    base: Ids
    stride: Ids | None

    def at(self, triangle: Ids, instance: Ids, u: Scalar, v: Scalar) -> Vec:
        """Return the numbers (C, N) at barycentrics u, v (N,) of triangles (N,)."""
        row = self.base.take(instance)
        row += triangle if self.stride is None else triangle * self.stride.take(instance)
        corners = gather_rows(self.rows, row)
        width = len(corners) // 3
        out = corners[:width] * (F32(1) - u - v)
        out += corners[width : 2 * width] * u
        out += corners[2 * width :] * v
        return out


@dataclass(frozen=True, eq=False)
class Constants:
    """Rows (I, C) of instances."""

    rows: NDArray[np.float32]

    def at(self, triangle: Ids, instance: Ids, u: Scalar, v: Scalar) -> Vec:
        """Return the numbers (C, N) of instances (N,)."""
        return np.ascontiguousarray(self.rows.take(instance, axis=0).T)


@dataclass(frozen=True, eq=False)
class Densities:
    """A number for each triangle, in rows (R,) as in `Table`, times one (I,) of its instance."""

    rows: NDArray[np.float32]
    base: Ids
    stride: Ids | None
    scale: NDArray[np.float32]

    def at(self, triangle: Ids, instance: Ids, u: Scalar, v: Scalar) -> Vec:
        """Return the numbers (1, N) of triangles (N,)."""
        row = self.base.take(instance)
        row += triangle if self.stride is None else triangle * self.stride.take(instance)
        density = self.rows.take(row)
        density *= self.scale.take(instance)
        return density[None]


Attributes = dict[Asked, Table | Constants | Densities]


def compile_attributes(
    instances: Sequence[Instance], asked: Collection[Asked], triangles: Triangles
) -> Attributes:
    """Return the tables that are asked for."""
    numbers = np.ascontiguousarray(triangles.ids[:, 2])
    first = np.searchsorted(numbers, np.arange(len(instances) + 1)).astype(np.int32)
    used = [i for i in range(len(instances)) if first[i + 1] > first[i]]
    meshes: dict[int, Mesh] = {}
    for i in used:
        mesh = instances[i].mesh
        if id(mesh) not in meshes:
            meshes[id(mesh)] = without_broken(mesh, [])
    tables: Attributes = {}
    for name, output in sorted(asked):
        if any(name in instance.attributes for instance in instances):
            tables[name, output] = _constants(instances, name, output)
        else:
            table = _table(instances, used, meshes, first, name, output)
            tables[name, output] = table
            if output == DENSITY:
                scales = [1 / max(_largest_scale(instance), 1e-30) for instance in instances]
                rows = np.ascontiguousarray(table.rows[:, 0])
                tables[name, output] = Densities(
                    rows, table.base, table.stride, np.array(scales, F32)
                )
    return tables


def _largest_scale(instance: Instance) -> float:
    return float(np.linalg.norm(instance.to_world[:, :3], 2))


def _constants(instances: Sequence[Instance], name: str, output: str) -> Constants:
    rows = [instance.attributes.get(name, (0.0, 0.0, 0.0, 0.0)) for instance in instances]
    return Constants(np.stack([_part(np.array(row, F32)[None], output, 3)[0] for row in rows]))


def _table(
    instances: Sequence[Instance],
    used: Sequence[int],
    meshes: dict[int, Mesh],
    first: Ids,
    name: str,
    output: str,
) -> Table:
    """Return the table of one attribute; its row 0 is that of meshes without it."""
    widths = [m.attributes[name].values.shape[-1] for m in meshes.values() if name in m.attributes]
    width = 2 if all(w == 2 for w in widths) else 3
    base, stride = np.zeros((2, len(instances)), np.int32)
    blocks: list[NDArray[np.float32]] = []
    known: dict[tuple[int, bool], int] = {}
    end = 1
    for i in used:
        instance = instances[i]
        mesh = meshes[id(instance.mesh)]
        is_mirrored = bool(np.linalg.det(instance.to_world[:, :3]) < 0)
        key = id(mesh), is_mirrored
        if key not in known:
            corners = _corners(mesh, name, output, width)
            if corners is None:
                continue
            # Mirrored triangles have their corners in the other order.
            corners = corners[:, (0, 2, 1)] if is_mirrored else corners
            blocks.append(corners.reshape(len(corners), -1))
            known[key], end = end, end + len(corners)
        base[i], stride[i] = known[key] - first[i], 1
    columns = blocks[0].shape[1] if blocks else 3 * _FRAMES.get(output, width)
    columns = columns if output == VECTOR or output in _FRAMES else 3
    rows = np.concatenate([np.full((1, columns), output == ALPHA, F32), *blocks])
    return Table(rows, base, None if stride[list(used)].all() else stride)


def _corners(mesh: Mesh, name: str, output: str, width: int) -> NDArray[np.float32] | None:
    """Return the numbers (F, 3, C) of all corners, None if the mesh does not have them."""
    attribute = mesh.attributes.get(name)
    if output == DENSITY:
        if attribute is None:
            return None
        least = _least_growth(mesh, _spread(mesh, attribute)[..., :2])
        return np.broadcast_to(least[:, None, None], (len(least), 3, 1))
    if output in _FRAMES:
        if attribute is None and name != ACTIVE_UV:
            return None
        return _frames(mesh, attribute) if output == FRAME else _rest_frames(mesh, attribute)
    return None if attribute is None else _part(_spread(mesh, attribute), output, width)


def _frames(mesh: Mesh, uv_map: Attribute | None) -> NDArray[np.float32]:
    """Return normals, tangents and sides (F, 3, 7) of all corners."""
    uv = around_sphere(mesh) if uv_map is None else _spread(mesh, uv_map)[..., :2]
    normals = corner_normals(mesh)
    tangents, sign = uv_tangents(mesh, normals, uv)
    return np.concatenate([normals, tangents, sign[..., None]], axis=2)


def _rest_frames(mesh: Mesh, uv_map: Attribute | None) -> NDArray[np.float32]:
    """Return the same of a mesh as it was before it was displaced, and 1 where it is smooth.

    Flat meshes have the normals that they have now.
    """
    rest, normals = mesh.attributes.get(REST), mesh.attributes.get(REST_NORMAL)
    if rest is None:
        now = np.zeros((len(mesh.triangles), 3, 1), F32)
        return np.concatenate([_frames(mesh, uv_map), now], axis=2)
    was = None if normals is None else normals.values
    frames = _frames(replace(mesh, positions=mesh.positions + rest.values, normals=was), uv_map)
    if was is None:
        frames[..., :3] = corner_normals(mesh)
    is_smooth = np.full((len(mesh.triangles), 3, 1), was is not None, F32)
    return np.concatenate([frames, is_smooth], axis=2)


def _least_growth(mesh: Mesh, uv: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return by how much a UV map (F, 3, 2) of triangles (F,) grows along them, at least."""
    least = np.empty(len(uv), F32)
    for start in range(0, len(uv), CHUNK):
        some = slice(start, start + CHUNK)
        place = mesh.positions.take(mesh.triangles[some], axis=0).astype(np.float64)
        ax, ay, az, bx, by, bz = (place[:, 1:] - place[:, :1]).reshape(-1, 6).T
        s, t, p, q = (uv[some, 1:] - uv[some, :1]).reshape(-1, 4).astype(np.float64).T

        # Along orthonormal axes of the triangle, a on the first of them
        long = np.sqrt(ax * ax + ay * ay + az * az)
        along = (ax * bx + ay * by + az * bz) / np.maximum(long, 1e-30)
        high = np.sqrt(np.maximum(bx * bx + by * by + bz * bz - along * along, 0))
        s, t = s / np.maximum(long, 1e-30), t / np.maximum(long, 1e-30)
        p, q = (p - s * along) / np.maximum(high, 1e-30), (q - t * along) / np.maximum(high, 1e-30)

        # The smaller singular value of these two columns
        area, total = np.abs(s * q - t * p), s * s + t * t + p * p + q * q
        larger = np.sqrt(0.5 * (total + np.sqrt(np.maximum(total * total - 4 * area * area, 0))))
        is_sound = (long > 0) & (high > 0)
        least[some] = np.where(is_sound, area / np.maximum(larger, 1e-30), 0)
    return least


def _spread(mesh: Mesh, attribute: Attribute) -> NDArray[np.float32]:
    """Return an attribute's values at all corners (F, 3, C)."""
    values = attribute.values
    if attribute.domain == "POINT":
        return values.take(mesh.triangles, axis=0)
    return np.repeat(values[:, None], 3, axis=1) if attribute.domain == "FACE" else values


def _part(values: NDArray[np.float32], output: str, width: int) -> NDArray[np.float32]:
    """Return of numbers (..., C) what is asked for; two are a vector in a plane (Blender)."""
    count = values.shape[-1]
    if output in (ALPHA, OPACITY):
        return values[..., 3:] if count == 4 else np.ones_like(values[..., :1])
    if output == FACTOR:
        return values[..., :3].mean(-1, keepdims=True) if count > 2 else values[..., :1]
    if count == 1:
        return np.repeat(values, width, axis=-1)
    if count < width:
        return np.concatenate([values, np.zeros_like(values[..., :1])], axis=-1)
    return values[..., :width]
