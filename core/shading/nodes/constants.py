"""node -> Value.  Nodes that hold a number: Value and RGB."""

from collections.abc import Callable

from ...scene import Node
from ..graph import Graph
from ..values import COLOUR, FLOAT, Value, constant


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
}
