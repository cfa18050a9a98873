"""node -> Value.  What was hit: Object Info and Particle Info."""

from collections.abc import Callable

import numpy as np

from ...geometry.spaces import (
    ALPHA,
    COLOUR,
    LOCATION,
    NUMBER,
    P_AGE,
    P_INDEX,
    P_LIFETIME,
    P_LOCATION,
    P_SIZE,
    P_TURN,
    P_VELOCITY,
    RANDOM,
)
from ...scene import Node
from .. import values
from ..context import Context
from ..graph import Graph
from ..textures.hashing import fractions, hash_words
from ..values import Array, Value, constant, read, step

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


def particle(context: Context, row: int, is_vector: bool) -> Array:
    """Return what is known of the particles that show the objects hit."""
    return context.particle(row, is_vector)


def _number(row: int) -> Value:
    return read(particle, static=(row, False))


def _vector(row: int) -> Value:
    return read(particle, kind=values.VECTOR, static=(row, True))


def _hashed(index: Array) -> Array:
    whole = index.astype(np.uint32)
    return fractions(hash_words([whole, np.zeros(1, np.uint32)]))


# Output -> what it reads
PARTICLE_INFO: dict[str, Value] = {
    "Index": _number(P_INDEX),
    "Random": step(_hashed, _number(P_INDEX)),
    "Age": _number(P_AGE),
    "Lifetime": _number(P_LIFETIME),
    "Location": _vector(P_LOCATION),
    "Size": _number(P_SIZE),
    "Velocity": _vector(P_VELOCITY),
    "Angular Velocity": _vector(P_TURN),
}


def _object_info(graph: Graph, node: Node, output: str) -> Value | None:
    if output == "Material Index":
        return constant(float(graph.material_index))
    return OBJECT_INFO.get(output)


def _particle_info(graph: Graph, node: Node, output: str) -> Value | None:
    return PARTICLE_INFO.get(output)


OBJECTS: dict[str, NodeFunction] = {
    "ObjectInfo": _object_info,
    "ParticleInfo": _particle_info,
}
