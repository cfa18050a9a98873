"""node -> Value.  Vector Math, Normal, and the parts of vectors."""

from collections.abc import Callable

import numpy as np

from ...arrays import cross, dot
from ...scene import Node
from ..graph import Graph
from ..values import FLOAT, VECTOR, Array, Value, constant, step
from . import arithmetic as a
from .arithmetic import ONE, TWO, ZERO

NodeFunction = Callable[[Graph, Node, str], Value | None]


def length(v: Array) -> Array:
    """Return the lengths (N,) of vectors."""
    return a.limited(np.sqrt(dot(v, v)))


def inner(v: Array, w: Array) -> Array:
    """Return the dot products (N,) of vectors."""
    x, y, z = (a.multiply(*rows) for rows in zip(v, w, strict=True))
    total: Array = x + y + z
    return total


def _cross(v: Array, w: Array) -> Array:
    return a.limited(np.nan_to_num(cross(v, w)))


def unit(v: Array) -> Array:
    """Return vectors of length 1, 0 of a zero vector."""
    return v * (ONE / a.nonzero(length(v)))


def _project(v: Array, on: Array) -> Array:
    return a.multiply(a.divide(inner(v, on), inner(on, on)), on)


def _reflect(v: Array, normal: Array) -> Array:
    n = unit(normal)
    return v - TWO * n * dot(v, n)


def _refract(v: Array, normal: Array, eta: Array) -> Array:
    n = unit(normal)
    cosine = inner(n, v)
    k = ONE - a.multiply(a.multiply(eta, eta), ONE - a.multiply(cosine, cosine))
    along = a.multiply(eta, cosine) + np.sqrt(np.maximum(k, ZERO))
    bent = a.multiply(eta, v) - along * n
    return np.where(k < 0, ZERO, bent)


def _face_forward(v: Array, incident: Array, reference: Array) -> Array:
    return np.where(dot(reference, incident) < 0, v, -v)


def _distance(v: Array, w: Array) -> Array:
    return length(v - w)


def _wrap(v: Array, high: Array, low: Array) -> Array:
    return a.floored_modulo(v - low, high - low) + low


V, W, X, SCALE = "Vector", "Vector_001", "Vector_002", "Scale"

# Operation -> its inputs and the function; what gives numbers, not vectors
VECTOR_MATH: dict[str, tuple[tuple[str, ...], Callable[..., Array]]] = {
    "ADD": ((V, W), np.add),
    "SUBTRACT": ((V, W), np.subtract),
    "MULTIPLY": ((V, W), a.multiply),
    "DIVIDE": ((V, W), a.divide),
    "MULTIPLY_ADD": ((V, W, X), a.multiply_add),
    "CROSS_PRODUCT": ((V, W), _cross),
    "PROJECT": ((V, W), _project),
    "REFLECT": ((V, W), _reflect),
    "REFRACT": ((V, W, SCALE), _refract),
    "FACEFORWARD": ((V, W, X), _face_forward),
    "DOT_PRODUCT": ((V, W), inner),
    "DISTANCE": ((V, W), _distance),
    "LENGTH": ((V,), length),
    "SCALE": ((V, SCALE), a.multiply),
    "NORMALIZE": ((V,), unit),
    "ABSOLUTE": ((V,), np.abs),
    "POWER": ((V, W), a.power),
    "SIGN": ((V,), np.sign),
    "MINIMUM": ((V, W), np.minimum),
    "MAXIMUM": ((V, W), np.maximum),
    "ROUND": ((V,), a.round_half_up),
    "FLOOR": ((V,), np.floor),
    "CEIL": ((V,), np.ceil),
    "FRACTION": ((V,), a.fraction),
    "MODULO": ((V, W), a.modulo),
    "WRAP": ((V, W, X), _wrap),
    "SNAP": ((V, W), a.snap),
    "SINE": ((V,), np.sin),
    "COSINE": ((V,), np.cos),
    "TANGENT": ((V,), np.tan),
}
NUMBERS = ("DOT_PRODUCT", "DISTANCE", "LENGTH")


def _vector_math(graph: Graph, node: Node, output: str) -> Value:
    operation = graph.choice(node, "operation", "ADD")
    sockets, function = VECTOR_MATH[operation]
    kind = FLOAT if operation in NUMBERS else VECTOR
    if (output == "Value") != (kind == FLOAT):
        return constant(0.0, FLOAT if output == "Value" else VECTOR)
    inputs = (
        graph.number(node, name, 1.0) if name == SCALE else graph.whole(node, name)
        for name in sockets
    )
    return step(function, *inputs, kind=kind)


def _normal(graph: Graph, node: Node, output: str) -> Value:
    held = constant(node.properties.get("Normal", (0.0, 0.0, 1.0)), VECTOR)
    direction = step(unit, held)
    if output == "Normal":
        return direction
    return step(_dot_unit, direction, graph.whole(node, "Normal"), kind=FLOAT)


def _dot_unit(direction: Array, normal: Array) -> Array:
    return dot(direction, unit(normal))


def _separate(graph: Graph, node: Node, output: str) -> Value:
    whole = graph.whole(node, "Vector")
    return step(_row, whole, static=("XYZ".index(output),), kind=FLOAT)


def _row(whole: Array, row: int) -> Array:
    return whole[row]


def _combine(graph: Graph, node: Node, output: str) -> Value:
    return step(_stack, *(graph.number(node, name) for name in "XYZ"), kind=VECTOR)


def _stack(*parts: Array) -> Array:
    return np.stack(np.broadcast_arrays(*parts))


VECTORS: dict[str, NodeFunction] = {
    "VectorMath": _vector_math,
    "Normal": _normal,
    "SeparateXYZ": _separate,
    "CombineXYZ": _combine,
}
