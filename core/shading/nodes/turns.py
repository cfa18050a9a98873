"""node -> Value.  Mapping and Vector Rotate."""

from collections.abc import Callable

import numpy as np

from ...arrays import cross, dot
from ...scene import Node
from ..graph import Graph
from ..values import VECTOR, Array, Value, step
from .arithmetic import ONE, divide, nonzero
from .vectors import length, unit


def _mapping(graph: Graph, node: Node, output: str) -> Value:
    kind = graph.choice(node, "vector_type", "POINT")
    names = ("Vector", "Location", "Rotation")
    inputs = (*(graph.whole(node, name) for name in names), graph.whole(node, "Scale", 1.0))
    return step(mapped, *inputs, kind=VECTOR, static=(kind,))


def mapped(vector: Array, place: Array, turn: Array, scale: Array, kind: str) -> Array:
    """Return vectors moved as Blender's Mapping node does."""
    if kind == "TEXTURE":
        return divide(turned(vector - place, turn, True), scale)
    if kind == "NORMAL":
        return unit(turned(divide(vector, scale), turn, False))
    moved = turned(vector * scale, turn, False)
    return moved + place if kind == "POINT" else moved


def turned(vector: Array, turn: Array, is_inverse: bool) -> Array:
    """Return vectors turned by Euler angles, about x, then y, then z; or back."""
    cosine, sine = np.cos(turn), np.sin(turn)
    (cx, cy, cz), (sx, sy, sz) = cosine, sine
    rows = (
        (cy * cz, sy * sx * cz - cx * sz, sy * cx * cz + sx * sz),
        (cy * sz, sy * sx * sz + cx * cz, sy * cx * sz - sx * cz),
        (-sy, cy * sx, cy * cx),
    )
    if is_inverse:
        rows = tuple(zip(*rows, strict=True))  # type: ignore[assignment]
    x, y, z = vector
    return np.stack(np.broadcast_arrays(*(a * x + b * y + c * z for a, b, c in rows)))


# Kind -> the axis, where none is given
AXES = {"X_AXIS": (1.0, 0.0, 0.0), "Y_AXIS": (0.0, 1.0, 0.0), "Z_AXIS": (0.0, 0.0, 1.0)}


def _vector_rotate(graph: Graph, node: Node, output: str) -> Value:
    kind = graph.choice(node, "rotation_type", "AXIS_ANGLE")
    is_inverse = graph.choice(node, "invert", False)
    vector, middle = graph.whole(node, "Vector"), graph.whole(node, "Center")
    if kind == "EULER_XYZ":
        turn = graph.whole(node, "Rotation")
        return step(turned, vector - middle, turn, kind=VECTOR, static=(is_inverse,)) + middle
    axis: object = AXES[kind] if kind in AXES else graph.whole(node, "Axis")
    angle = graph.number(node, "Angle")
    if is_inverse:
        angle = angle * -1.0
    return step(_about_axis, vector - middle, axis, angle, kind=VECTOR) + middle  # type: ignore[arg-type]


def _about_axis(vector: Array, axis: Array, angle: Array) -> Array:
    """Return vectors turned about an axis (Rodrigues), as they were about one of length 0."""
    long = length(axis)
    n = axis / nonzero(long)
    cosine, sine = np.cos(angle), np.sin(angle)
    along = n * (dot(n, vector) * (ONE - cosine))
    return np.where(long != 0, vector * cosine + cross(n, vector) * sine + along, vector)


TURNS: dict[str, Callable[[Graph, Node, str], Value]] = {
    "Mapping": _mapping,
    "VectorRotate": _vector_rotate,
}
