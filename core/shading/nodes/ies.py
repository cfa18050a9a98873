"""node -> Value.  IES Texture: how lamps of luminaires shine into each direction."""

import numpy as np

from ...arrays import normalize
from ...scene import Node
from ..context import Context
from ..graph import Graph, NodeFunction, title
from ..ies import Profile, read_profile
from ..values import FLOAT, VECTOR, Array, Value, constant, read, step
from .legacy import mapped

# Of what has no profile (Cycles)
UNKNOWN = 100.0


def _ies(graph: Graph, node: Node, output: str) -> Value:
    strength = graph.number(node, "Strength", 1.0)
    text = node.properties.get("text")
    profile = graph.library.get(node, lambda: read_profile(text or ""))
    if profile is None:
        graph.note(f"{title(node)} has no IES profile that can be read: it shines alike everywhere")
        return strength * constant(UNKNOWN)
    linked = graph.vector(node, "Vector") if graph.is_linked(node, "Vector") else None
    where = mapped(graph, node, read(_incoming, kind=VECTOR) if linked is None else linked)
    return strength * step(_shine, where, static=(profile,), kind=FLOAT)


def _incoming(context: Context) -> Array:
    return context.wo


def _shine(direction: Array, profile: Profile) -> Array:
    return profile.at(normalize(np.array(direction)))


IES: dict[str, NodeFunction] = {"TexIES": _ies}
OF_VIEWER = (_incoming,)  # steps that depend on the viewer's direction
