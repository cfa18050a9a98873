"""node -> Value.  The direction along which brushed surfaces are stretched."""

import numpy as np

from ..arrays import F32, Vec, cross, dot, normalize
from ..scene import Node
from .context import Context
from .inputs import VALID_NORMAL
from .surface import Surface
from .values import VECTOR, Array, Value, read


def tangent_of(surface: Surface, node: Node, rotation: str, normal: Value | None = None) -> Value:
    """Return a node's tangent, turned about the normal by its rotation, in turns.

    Without a link it runs around the z axis of the object.
    """
    tangent = read(around_z, kind=VECTOR)
    if surface.graph.is_linked(node, "Tangent"):
        found = surface.graph.vector(node, "Tangent")
        assert found is not None
        tangent = read(_everywhere, found, kind=VECTOR)
    turn = surface.graph.number(node, rotation)
    if turn.is_exactly(0):
        return tangent
    return read(_turned, tangent, turn, normal or VALID_NORMAL, kind=VECTOR)


def _everywhere(context: Context, vector: Array) -> Vec:
    return np.broadcast_to(vector, (3, context.size))


def around_z(context: Context) -> Vec:
    """Return the radial tangents (3, n) that Blender gives surfaces without others."""
    normal = context.valid_normal
    return cross(normal, normalize(cross(context.around(2), normal)))


def _turned(context: Context, tangent: Array, turn: Array, normal: Array) -> Vec:
    """Return tangents turned about the normal by `turn` full circles (Rodrigues)."""
    angle = turn * F32(2 * np.pi)
    cosine, sine = np.cos(angle), np.sin(angle)
    turned: Vec = tangent * cosine
    turned += cross(normal, tangent) * sine
    turned += normal * (dot(normal, tangent) * (F32(1) - cosine))
    return turned


OF_VIEWER = (around_z,)  # steps that depend on the viewer's direction
