"""node -> Value.  Light Falloff: strength by the distance that light has come."""

from collections.abc import Callable

import numpy as np

from ...arrays import F32
from ...scene import Node
from ..context import NEVER, Context
from ..graph import Graph
from ..values import Array, Value, read

# Output -> the power of the distance that it puts back
POWERS = {"Quadratic": 0, "Linear": 1, "Constant": 2}


def _falloff(graph: Graph, node: Node, output: str) -> Value:
    strength = graph.number(node, "Strength", 100.0)
    smooth = graph.number(node, "Smooth")
    return read(_by_distance, strength, smooth, static=(POWERS[output],))


def _by_distance(context: Context, strength: Array, smooth: Array, power: int) -> Array:
    """Return strengths at rays of some length; light from infinitely far keeps its own (Cycles)."""
    is_near = context.length < NEVER
    length = np.where(is_near, context.length, F32(1))
    squared = length * length
    strength = np.where(is_near, strength * (F32(1), length, squared)[power], strength)
    is_smooth = is_near & (smooth > 0)
    share = squared / np.maximum(smooth + squared, F32(1e-30))
    faded: Array = np.where(is_smooth, strength * share, strength)
    return faded


LIGHT: dict[str, Callable[[Graph, Node, str], Value | None]] = {"LightFalloff": _falloff}
