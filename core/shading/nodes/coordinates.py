"""node -> Value.  Where a point is: Texture Coordinate, Camera Data and Vector Transform."""

from collections.abc import Callable

import numpy as np

from ...arrays import F32, Vec, dot, normalize
from ...geometry.spaces import ORCO, UV
from ...scene import Node
from ..attributes import read_attribute, uv_map
from ..context import Context
from ..graph import Graph
from ..inputs import NORMAL
from ..values import FLOAT, VECTOR, Array, Value, read, step
from .vectors import length, unit

NodeFunction = Callable[[Graph, Node, str], Value | None]


def generated(context: Context) -> Vec:
    """Return where points are (3, n) in the boxes of their objects."""
    return context.generated


def into_object(context: Context, vector: Array, kind: str) -> Vec:
    """Return a POINT, VECTOR or NORMAL of the world in the spaces of the objects hit."""
    return context.into_object(vector, kind)


def out_of_object(context: Context, vector: Array, kind: str) -> Vec:
    """Return a POINT, VECTOR or NORMAL of the objects hit in the world."""
    return context.out_of_object(vector, kind)


def object_position(context: Context) -> Vec:
    """Return where points are (3, n) in the spaces of their objects."""
    return context.into_object(context.position, "POINT")


def instancer_fact(context: Context, row: int) -> Array:
    """Return what the instancer of the objects hit says of them."""
    return context.fact(row, is_vector=True)


def _reflection(context: Context) -> Vec:
    return context.reflection


def _seen_way(context: Context) -> Vec:
    return context.seen_way


def _window(context: Context) -> Vec:
    return context.view.window(context.seen_way)


# Output -> what it reads
COORDINATES: dict[str, Value] = {
    "Generated": read(generated, kind=VECTOR),
    "Normal": read(into_object, NORMAL, kind=VECTOR, static=("NORMAL",)),
    "Object": read(object_position, kind=VECTOR),
    "Camera": read(_seen_way, kind=VECTOR),
    "Window": read(_window, kind=VECTOR),
    "Reflection": read(_reflection, kind=VECTOR),
}
OF_INSTANCER: dict[str, Value] = {
    "Generated": read(instancer_fact, kind=VECTOR, static=(ORCO,)),
    "UV": read(instancer_fact, kind=VECTOR, static=(UV,)),
}


def _coordinates(graph: Graph, node: Node, output: str) -> Value | None:
    if output in OF_INSTANCER and graph.choice(node, "from_instancer", False):
        return OF_INSTANCER[output]
    if output == "UV":
        return read_attribute(uv_map(node))
    matrix = graph.choice(node, "object", None)
    if output == "Object" and matrix is not None:
        return read(_in_other, kind=VECTOR, static=(_inverse(matrix),))
    return COORDINATES.get(output)


def _inverse(matrix: tuple[float, ...]) -> tuple[float, ...]:
    """Return the inverse of an affine matrix of 12 numbers."""
    affine = np.array(matrix).reshape(3, 4)
    linear = np.linalg.pinv(affine[:, :3])
    return tuple(np.column_stack([linear, -linear @ affine[:, 3]]).ravel().tolist())


def _in_other(context: Context, matrix: tuple[float, ...]) -> Vec:
    rows = np.array(matrix, F32).reshape(3, 4)
    return np.stack([dot(row[:3, None], context.position) + row[3] for row in rows])


def _seen(context: Context) -> Vec:
    return context.seen


SEEN = read(_seen, kind=VECTOR)


def _row(whole: Array, row: int) -> Array:
    return whole[row]


# Output -> where the point is in the camera's space
CAMERA_DATA: dict[str, Value] = {
    "View Vector": step(unit, SEEN),
    "View Z Depth": step(_row, SEEN, kind=FLOAT, static=(2,)),
    "View Distance": step(length, SEEN, kind=FLOAT),
}


def _camera_data(graph: Graph, node: Node, output: str) -> Value | None:
    return CAMERA_DATA.get(output)


def _into_camera(context: Context, vector: Array, kind: str) -> Vec:
    if kind == "POINT":
        return context.view.point(vector - context.place.origin)
    turned = context.view.turn(vector)
    return turned if kind == "VECTOR" else normalize(turned)


def _out_of_camera(context: Context, vector: Array, kind: str) -> Vec:
    if kind == "POINT":
        return context.view.point_back(vector) + context.place.origin
    turned = context.view.turn_back(vector)
    return turned if kind == "VECTOR" else normalize(turned)


# Space -> how a vector comes out of it into the world, and from the world into it
TRANSFORMS: dict[str, tuple[Callable[..., Array], Callable[..., Array]]] = {
    "OBJECT": (out_of_object, into_object),
    "CAMERA": (_out_of_camera, _into_camera),
}


def _vector_transform(graph: Graph, node: Node, output: str) -> Value:
    kind = graph.choice(node, "vector_type", "VECTOR")
    start = graph.choice(node, "convert_from", "WORLD")
    end = graph.choice(node, "convert_to", "OBJECT")
    vector = graph.whole(node, "Vector")
    if start != end and start in TRANSFORMS:
        vector = read(TRANSFORMS[start][0], vector, kind=VECTOR, static=(kind,))
    if start != end and end in TRANSFORMS:
        vector = read(TRANSFORMS[end][1], vector, kind=VECTOR, static=(kind,))
    return vector


PLACES: dict[str, NodeFunction] = {
    "TexCoord": _coordinates,
    "CameraData": _camera_data,
    "VectorTransform": _vector_transform,
}
OF_VIEWER = (_reflection,)  # steps that depend on the viewer's direction
