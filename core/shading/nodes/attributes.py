"""node -> Value.  What meshes and objects carry by name: UV Map, Attribute, Color Attribute."""

import numpy as np

from ...arrays import F32
from ...geometry.attributes import ALPHA, FACTOR, OPACITY, VECTOR
from ...scene import Node
from .. import values
from ..attributes import attribute_of, layer_of, read_attribute, uv_map
from ..graph import Graph, NodeFunction
from ..values import COLOUR, Value, constant
from .coordinates import OF_INSTANCER

# Output -> what of the attribute it shows, and as what
OUTPUTS = {
    "Color": (VECTOR, COLOUR),
    "Vector": (VECTOR, values.VECTOR),
    "Fac": (FACTOR, values.FLOAT),
    "Alpha": (ALPHA, values.FLOAT),
}


def _uv_map(graph: Graph, node: Node, output: str) -> Value:
    if graph.choice(node, "from_instancer", False):
        return OF_INSTANCER["UV"]
    return read_attribute(uv_map(node))


def _attribute(graph: Graph, node: Node, output: str) -> Value:
    name, (part, kind) = attribute_of(node), OUTPUTS[output]
    if not name:
        # Meshes are opaque where they carry nothing; what objects tell has no alpha of its own
        is_opaque = part == ALPHA and graph.choice(node, "attribute_type", "GEOMETRY") == "GEOMETRY"
        return constant(np.full(1, F32(is_opaque)), kind)
    return read_attribute(name, part, kind)


def _layer(graph: Graph, node: Node, output: str) -> Value:
    if output == "Alpha":
        return read_attribute(layer_of(node), OPACITY)
    return read_attribute(layer_of(node), VECTOR, COLOUR)


CARRIED: dict[str, NodeFunction] = {
    "UVMap": _uv_map,
    "Attribute": _attribute,
    "VertexColor": _layer,
}
