"""node -> Value.  Math, Clamp and Map Range."""

from collections.abc import Callable

import numpy as np

from ...arrays import F32
from ...scene import Node
from ..graph import Graph
from ..values import Array, Value, clamp, step
from . import arithmetic as a
from .arithmetic import ONE, TWO, ZERO

NodeFunction = Callable[[Graph, Node, str], Value | None]

# Operation -> how many inputs it has, and the function
MATH: dict[str, tuple[int, Callable[..., Array]]] = {
    "ADD": (2, np.add),
    "SUBTRACT": (2, np.subtract),
    "MULTIPLY": (2, a.multiply),
    "DIVIDE": (2, a.divide),
    "MULTIPLY_ADD": (3, a.multiply_add),
    "POWER": (2, a.power),
    "LOGARITHM": (2, a.logarithm),
    "SQRT": (1, a.square_root),
    "INVERSE_SQRT": (1, a.inverse_root),
    "ABSOLUTE": (1, np.abs),
    "EXPONENT": (1, a.exponential),
    "MINIMUM": (2, np.minimum),
    "MAXIMUM": (2, np.maximum),
    "LESS_THAN": (2, a.less),
    "GREATER_THAN": (2, a.greater),
    "SIGN": (1, np.sign),
    "COMPARE": (3, a.compare),
    "SMOOTH_MIN": (3, a.smooth_minimum),
    "SMOOTH_MAX": (3, a.smooth_maximum),
    "ROUND": (1, a.round_half_up),
    "FLOOR": (1, np.floor),
    "CEIL": (1, np.ceil),
    "TRUNC": (1, np.trunc),
    "FRACT": (1, a.fraction),
    "MODULO": (2, a.modulo),
    "FLOORED_MODULO": (2, a.floored_modulo),
    "WRAP": (3, a.wrap),
    "SNAP": (2, a.snap),
    "PINGPONG": (2, a.pingpong),
    "SINE": (1, np.sin),
    "COSINE": (1, np.cos),
    "TANGENT": (1, np.tan),
    "ARCSINE": (1, a.arc_sine),
    "ARCCOSINE": (1, a.arc_cosine),
    "ARCTANGENT": (1, np.arctan),
    "ARCTAN2": (2, a.arc_tangent_2),
    "SINH": (1, a.hyperbolic_sine),
    "COSH": (1, a.hyperbolic_cosine),
    "TANH": (1, np.tanh),
    "RADIANS": (1, a.radians),
    "DEGREES": (1, a.degrees),
}


def _math(graph: Graph, node: Node, output: str) -> Value:
    count, function = MATH[graph.choice(node, "operation", "ADD")]
    sockets = ("Value", "Value_001", "Value_002")[:count]
    found = step(function, *(graph.number(node, socket, 0.5) for socket in sockets))
    return clamp(found) if graph.choice(node, "use_clamp", False) else found


def between(x: Value, low: Value, high: Value) -> Value:
    """Return x limited to [low, high]; to `high` where that is below `low`."""
    return step(np.minimum, step(np.maximum, x, low), high)


def between_either(x: Value, low: Value, high: Value) -> Value:
    """Return x limited to what is between two numbers, whichever is the greater."""
    return between(x, step(np.minimum, low, high), step(np.maximum, low, high))


def _clamp(graph: Graph, node: Node, output: str) -> Value:
    limit = between_either if graph.choice(node, "clamp_type", "MINMAX") == "RANGE" else between
    low, high = graph.number(node, "Min", 0.0), graph.number(node, "Max", 1.0)
    return limit(graph.number(node, "Value", 1.0), low, high)


def _share(x: Array, low: Array, high: Array) -> Array:
    return a.divide(x - low, high - low)


def _stepped(share: Array, steps: Array) -> Array:
    return a.divide(np.floor(share * (steps + ONE)), np.maximum(steps, ZERO))


def _smooth(share: Array) -> Array:
    x = np.clip(share, ZERO, ONE)
    return (F32(3) - TWO * x) * x * x


def _smoother(share: Array) -> Array:
    x = np.clip(share, ZERO, ONE)
    bend: Array = x * (x * F32(6) - F32(15)) + F32(10)
    return x * x * x * bend


def _unless_empty(x: Array, low: Array, high: Array) -> Array:
    return np.where(low != high, x, ZERO)


def _map_range(graph: Graph, node: Node, output: str) -> Value:
    kind = graph.choice(node, "interpolation_type", "LINEAR")
    is_clamped = graph.choice(node, "clamp", True)
    if graph.choice(node, "data_type", "FLOAT") == "FLOAT_VECTOR":
        names = ("Vector", "From_Min_FLOAT3", "From_Max_FLOAT3", "To_Min_FLOAT3", "To_Max_FLOAT3")
        x, low, high, to_low, to_high = (graph.whole(node, name) for name in names)
        found = _mapped(x, low, high, to_low, to_high, kind, graph.whole(node, "Steps_FLOAT3"))
        is_clamped = is_clamped and kind in ("LINEAR", "STEPPED")
    else:
        names = ("Value", "From Min", "From Max", "To Min", "To Max")
        x, low, high, to_low, to_high = (graph.number(node, name) for name in names)
        found = _mapped(x, low, high, to_low, to_high, kind, graph.number(node, "Steps", 4.0))
        found = step(_unless_empty, found, low, high)
    return between_either(found, to_low, to_high) if is_clamped else found


def _mapped(
    x: Value, low: Value, high: Value, to_low: Value, to_high: Value, kind: str, steps: Value
) -> Value:
    share = step(_share, x, low, high)
    if kind == "STEPPED":
        share = step(_stepped, share, steps)
    elif kind == "SMOOTHSTEP":
        share = step(_smooth, share)
    elif kind == "SMOOTHERSTEP":
        share = step(_smoother, share)
    return to_low + share * (to_high - to_low)


MATHS: dict[str, NodeFunction] = {
    "Math": _math,
    "Clamp": _clamp,
    "MapRange": _map_range,
}
