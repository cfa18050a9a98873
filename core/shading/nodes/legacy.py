"""vector -> vector.  The mapping that texture nodes of old files hold in themselves."""

import numpy as np

from ...arrays import F32, dot
from ...scene import Node
from ..graph import Graph
from ..values import VECTOR, Array, Value, step


def mapped(graph: Graph, node: Node, vector: Value) -> Value:
    """Return where a texture node looks, by its own mapping if it has one."""
    own = node.properties.get("texture_mapping")
    if own is None:
        return vector
    matrix, is_normal = own
    rows = tuple(tuple(F32(number) for number in row) for row in matrix)
    return step(_moved, vector, static=(rows, bool(is_normal)), kind=VECTOR)


def _moved(vector: Array, rows: tuple[tuple[np.float32, ...], ...], is_normal: bool) -> Array:
    x, y, z = vector
    moved = np.stack([a * x + b * y + c * z + d for a, b, c, d in rows])
    if is_normal:
        length = np.sqrt(dot(moved, moved))
        moved = moved / np.where(length > 0, length, F32(1))
    return moved
