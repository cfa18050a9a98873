"""node -> Value.  What nodes mean in the shader of a lamp: places on it, and its own space.

Where an output is None, there is none of it for lamps, and the graph notes that.
"""

from collections.abc import Callable

from ...scene import Node
from ..graph import Graph
from ..lamp_context import LampContext
from ..values import VECTOR, Array, Value, constant, read
from .coordinates import COORDINATES, PLACES
from .hit import GEOMETRY

NodeFunction = Callable[[Graph, Node, str], Value | None]


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
    "NewGeometry": {
        **{output: value for output, value in GEOMETRY.items() if output != "Tangent"},
        "Parametric": PARAMETRIC,
    },
    "UVMap": {"UV": PARAMETRIC},
    "Tangent": {},
    "CameraData": {},
    "ParticleInfo": {},
    "Wireframe": {"Fac": constant(0.0)},
}
PLACES_ON_LAMPS: dict[str, Value] = {
    "Generated": OBJECT,  # there is none: Cycles takes the place in the lamp's space
    "Object": OBJECT,
    "UV": PARAMETRIC,
    "Normal": read(_normal_in_object, kind=VECTOR),
    "Reflection": COORDINATES["Reflection"],
}


def _read_lamp(graph: Graph, node: Node, output: str) -> Value | None:
    return ON_LAMPS[node.kind].get(output)


def _coordinates(graph: Graph, node: Node, output: str) -> Value | None:
    other = graph.choice(node, "object", None) is not None and output == "Object"
    maker = graph.choice(node, "from_instancer", False) and output in ("Generated", "UV")
    if other or maker:
        return PLACES["TexCoord"](graph, node, output)
    return PLACES_ON_LAMPS.get(output)


def _vector_transform(graph: Graph, node: Node, output: str) -> Value | None:
    spaces = (graph.choice(node, name, "WORLD") for name in ("convert_from", "convert_to"))
    return None if "CAMERA" in spaces else PLACES["VectorTransform"](graph, node, output)


LAMP: dict[str, NodeFunction] = dict.fromkeys(ON_LAMPS, _read_lamp)
LAMP |= {"TexCoord": _coordinates, "VectorTransform": _vector_transform}
