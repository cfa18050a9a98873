"""node -> Value.  What was hit: Object Info and Particle Info."""

from collections.abc import Callable

from ...geometry.spaces import ALPHA, COLOUR, LOCATION, NUMBER, RANDOM
from ...scene import Node
from .. import values
from ..context import Context
from ..graph import Graph, title
from ..values import Array, Value, constant, read

NodeFunction = Callable[[Graph, Node, str], Value | None]


def fact(context: Context, row: int, is_vector: bool) -> Array:
    """Return what is known of the objects hit."""
    return context.fact(row, is_vector)


# Output -> what it reads
OBJECT_INFO: dict[str, Value] = {
    "Location": read(fact, kind=values.VECTOR, static=(LOCATION, True)),
    "Color": read(fact, kind=values.COLOUR, static=(COLOUR, True)),
    "Alpha": read(fact, static=(ALPHA, False)),
    "Object Index": read(fact, static=(NUMBER, False)),
    "Random": read(fact, static=(RANDOM, False)),
}
PARTICLE_VECTORS = ("Location", "Velocity", "Angular Velocity")

# What Blender hashes the number of no particle to
NO_RANDOM = 0.86031246


def _object_info(graph: Graph, node: Node, output: str) -> Value | None:
    if output == "Material Index":
        return constant(float(graph.material_index))
    return OBJECT_INFO.get(output)


def _particle_info(graph: Graph, node: Node, output: str) -> Value:
    graph.note(f"{title(node)}: particles are not known to shaders; {output} is that of none")
    if output == "Random":
        return constant(NO_RANDOM)
    return constant(0.0, values.VECTOR if output in PARTICLE_VECTORS else values.FLOAT)


OBJECTS: dict[str, NodeFunction] = {
    "ObjectInfo": _object_info,
    "ParticleInfo": _particle_info,
}
