"""instances -> Movement.  What the triangle table has to know of objects that move."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32
from ..scene import Instance, Mesh
from .embree import PADDING
from .motion import Movement, Shapes, along_arcs, compile_tracks


class Placed(NamedTuple):
    """Where an instance's mesh went: its first vertex, and its first row of corner normals.

    order: in which the corners of triangles were taken.
    """

    number: int
    instance: Instance
    mesh: Mesh
    order: tuple[int, ...]
    vertex: int
    normal: int


def compile_movement(
    instances: Sequence[Instance], placed: Sequence[Placed], origin: NDArray[np.float64]
) -> Movement | None:
    """Return how instances move about `origin` (3,) [m]; None if all rest."""
    moving = [each for each in placed if each.instance.moves]
    if not moving:
        return None
    moves = np.zeros(len(instances), np.bool_)
    affines = [np.zeros((1, 12))] * len(instances)
    for each in moving:
        keys = (
            each.instance.to_world[None] if each.instance.motion is None else each.instance.motion
        )
        about = keys.copy()
        about[:, :, 3] -= origin
        affines[each.number] = along_arcs(about).reshape(-1, 12)
        moves[each.number] = True
    kinds = {0 if each.mesh.normals is None else each.mesh.normals.ndim for each in moving}
    size = len(instances)
    return Movement(
        moves,
        compile_tracks(affines),
        _compile_shapes(size, moving, "VERTICES"),
        _compile_shapes(size, moving, "VERTEX_NORMALS") if 2 in kinds else None,
        _compile_shapes(size, moving, "CORNER_NORMALS") if 3 in kinds else None,
    )


def _compile_shapes(size: int, moving: Sequence[Placed], kind: str) -> Shapes:
    """Return the vectors of one kind of all that moves; meshes that are shown twice once."""
    first, count, steps, base = (np.zeros(size, np.int32) for _ in range(4))
    known: dict[tuple[int, tuple[int, ...]], int] = {}
    blocks: list[NDArray[np.float32]] = []
    rows = 0
    for each in moving:
        vectors = _vectors(each, kind)
        if vectors is None:
            continue
        key = id(each.mesh), each.order if kind == "CORNER_NORMALS" else ()
        if key not in known:
            known[key] = rows
            blocks.append(vectors.reshape(-1, 3).astype(F32))
            rows += len(blocks[-1])
        number = each.number
        first[number], count[number] = known[key], vectors.shape[1]
        steps[number] = len(vectors) - 1
        base[number] = each.normal if kind == "CORNER_NORMALS" else each.vertex
    out = np.zeros(rows * 3 + PADDING, F32)[:-PADDING].reshape(-1, 3)
    np.concatenate(blocks, out=out)
    return Shapes(out, first, count, steps, base)


def _vectors(each: Placed, kind: str) -> NDArray[np.floating] | None:
    """Return vectors (steps + 1, n, 3), None if the mesh has none of this kind."""
    mesh, found = each.mesh, each.mesh.deformation
    if kind == "VERTICES":
        return mesh.positions[None] if found is None else found.positions
    normals = mesh.normals
    if normals is None or normals.ndim != (2 if kind == "VERTEX_NORMALS" else 3):
        return None
    steps = normals[None] if found is None or found.normals is None else found.normals
    if kind == "CORNER_NORMALS":
        steps = steps[:, :, list(each.order)].reshape(len(steps), -1, 3)
    return steps
