"""node -> Value.  Nodes that hold a number: Value, RGB, Scene Time, folded constants."""

from collections.abc import Callable

from ...scene import Node
from ..graph import Graph
from ..values import COLOUR, FLOAT, VECTOR, Value, constant


def _held(kind: str) -> Callable[[Graph, Node, str], Value | None]:
    def make(graph: Graph, node: Node, output: str) -> Value | None:
        found = node.properties.get(output, node.inputs.get(output))
        if found is None:
            return None
        return constant(found if kind == FLOAT else tuple(found)[:3], kind)

    return make


CONSTANTS: dict[str, Callable[[Graph, Node, str], Value | None]] = {
    "Value": _held(FLOAT),
    "RGB": _held(COLOUR),
    "FunctionNodeInputBool": _held(FLOAT),
    "FunctionNodeInputInt": _held(FLOAT),
    "FunctionNodeInputVector": _held(VECTOR),
    "GeometryNodeInputSceneTime": _held(FLOAT),
}
