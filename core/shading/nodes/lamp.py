"""node -> Value.  What nodes mean in the shader of a lamp: places on it, and its own space."""

from collections.abc import Callable

from ...scene import Node
from ..graph import Graph
from ..lamp_context import LampContext
from ..values import VECTOR, Array, Value, read
from .coordinates import COORDINATES
from .hit import GEOMETRY


def _parametric(context: LampContext) -> Array:
    return context.parametric


def _in_object(context: LampContext) -> Array:
    return context.in_object


def _normal_in_object(context: LampContext) -> Array:
    return context.normal_in_object


PARAMETRIC = read(_parametric, kind=VECTOR)
OBJECT = read(_in_object, kind=VECTOR)

# Output -> what it reads
ON_LAMPS: dict[str, dict[str, Value]] = {
    "NewGeometry": {**GEOMETRY, "Parametric": PARAMETRIC},
    "TexCoord": {
        "Generated": OBJECT,  # there is none: Cycles takes the place in the lamp's space
        "Object": OBJECT,
        "UV": PARAMETRIC,
        "Normal": read(_normal_in_object, kind=VECTOR),
        "Reflection": COORDINATES["Reflection"],
    },
    "UVMap": {"UV": PARAMETRIC},
}


def _read_lamp(graph: Graph, node: Node, output: str) -> Value | None:
    return ON_LAMPS[node.kind].get(output)


LAMP: dict[str, Callable[[Graph, Node, str], Value | None]] = dict.fromkeys(ON_LAMPS, _read_lamp)
