"""node -> Value.  The direction along which brushed surfaces are stretched."""

import numpy as np

from ..arrays import F32, Vec, cross, dot, normalize
from ..scene import Node
from .context import Context
from .surface import Surface
from .values import VECTOR, Array, Value, read


def tangent_of(surface: Surface, node: Node, rotation: str) -> Value:
    """Return a node's tangent, turned about the normal by its rotation, in turns.

    Without a link it runs around the z axis of the object.
    """
    tangent = read(around_z, kind=VECTOR)
    if surface.graph.is_linked(node, "Tangent"):
        linked = surface.graph.vector(node, "Tangent")
        assert linked is not None
        tangent = linked
    turn = surface.graph.number(node, rotation)
    return tangent if turn.is_exactly(0) else read(_turned, tangent, turn, kind=VECTOR)


def around_z(context: Context) -> Vec:
    """Return the radial tangents (3, n) that Blender gives surfaces without others."""
    normal = context.valid_normal
    return cross(normal, normalize(cross(context.around(2), normal)))


def _turned(context: Context, tangent: Array, turn: Array) -> Vec:
    """Return tangents turned about the normal by `turn` full circles (Rodrigues)."""
    normal = context.valid_normal
    angle = turn * F32(2 * np.pi)
    cosine, sine = np.cos(angle), np.sin(angle)
    turned: Vec = tangent * cosine
    turned += cross(normal, tangent) * sine
    turned += normal * (dot(normal, tangent) * (F32(1) - cosine))
    return turned
