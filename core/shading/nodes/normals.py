"""node -> Value.  Normal Map, Bump, Displacement and Vector Displacement."""

import numpy as np

from ...arrays import F32, Vec, dot, normalize
from ...geometry.attributes import FRAME, REST_FRAME
from ...scene import ACTIVE_UV, Node
from ..attributes import framed, framed_at_rest, in_frame, uv_map
from ..context import Context
from ..graph import Graph, NodeFunction
from ..inputs import NORMAL
from ..normals import bump, unit_normal
from ..values import VECTOR, Array, Value, read, step
from .coordinates import out_of_object


def _normal_map(graph: Graph, node: Node, output: str) -> Value:
    colour = graph.colour(node, "Color", (0.5, 0.5, 1.0))
    strength = graph.number(node, "Strength", 1.0)
    space = graph.choice(node, "space", "TANGENT")
    is_flipped = graph.choice(node, "convention", "OPENGL") == "DIRECTX"
    if space == "TANGENT":
        local = step(_strengthened, colour, strength, static=(is_flipped,), kind=VECTOR)
        if graph.choice(node, "base", "DISPLACED") == "ORIGINAL":
            plain = step(_decoded, colour, static=(is_flipped,), kind=VECTOR)
            asked = uv_map(node), REST_FRAME
            return read(framed_at_rest, plain, local, strength, static=(asked,), kind=VECTOR)
        return read(framed, local, static=((uv_map(node), FRAME),), kind=VECTOR)
    where = _OBJECT if space.endswith("OBJECT") else _WORLD
    static = is_flipped, space.startswith("BLENDER")
    return read(where, colour, strength, static=static, kind=VECTOR)


def _decoded(colour: Array, is_flipped: bool) -> Array:
    vector = F32(2) * colour - F32(1)
    if is_flipped:
        vector[1] = -vector[1]
    return vector


def _strengthened(colour: Array, strength: Array, is_flipped: bool) -> Array:
    """Return vectors (3, n) of the colours of a map, flatter or steeper."""
    x, y, z = _decoded(colour, is_flipped)
    upright = F32(1) + (z - F32(1)) * np.clip(strength, F32(0), F32(1))
    return np.stack(np.broadcast_arrays(x * strength, y * strength, upright))


def mapped_in_object(
    context: Context, colour: Array, strength: Array, is_flipped: bool, is_old: bool
) -> Vec:
    """Return the normals (3, n) that colours give in the spaces of objects."""
    vector = np.broadcast_to(_signed(colour, is_flipped, is_old), (3, context.size))
    return _shown(context, context.out_of_object(vector, "NORMAL"), strength)


def _mapped_in_world(
    context: Context, colour: Array, strength: Array, is_flipped: bool, is_old: bool
) -> Vec:
    vector = np.broadcast_to(_signed(colour, is_flipped, is_old), (3, context.size))
    return _shown(context, normalize(vector.copy()), strength)


_OBJECT, _WORLD = mapped_in_object, _mapped_in_world


def _signed(colour: Array, is_flipped: bool, is_old: bool) -> Array:
    vector = _decoded(colour, is_flipped)
    if is_old:
        # Blender's own maps of old have y and z the other way.
        vector = vector * np.array([[1], [-1], [-1]], F32)
    return vector


def _shown(context: Context, vector: Vec, strength: Array) -> Vec:
    """Return the normals on the viewer's side, between the shading normal and the map's."""
    normal = context.normal
    vector = vector * np.where(context.back, F32(-1), F32(1))
    mixed = normalize(normal + (vector - normal) * np.maximum(strength, F32(0)))
    return np.where(dot(mixed, mixed) > F32(0.5), mixed, normal)


def _bump(graph: Graph, node: Node, output: str) -> Value:
    normal = NORMAL
    if graph.is_linked(node, "Normal"):
        given = graph.vector(node, "Normal", (0, 0, 0))
        assert given is not None
        normal = read(unit_normal, given, kind=VECTOR)
    width = graph.number(node, "Filter Width", graph.bump_width)
    return bump(
        graph.number(node, "Height", 1.0),
        graph.number(node, "Strength", 1.0),
        graph.number(node, "Distance", 1.0),
        normal,
        max(float(width.constant[0]), 1e-3) if width.constant is not None else graph.bump_width,
        graph.choice(node, "invert", False),
    )


def _displacement(graph: Graph, node: Node, output: str) -> Value | None:
    """Return the way that the surface moves, along its normal."""
    height = graph.number(node, "Height") - graph.number(node, "Midlevel", 0.5)
    way = height * graph.number(node, "Scale", 1.0)
    normal = graph.vector(node, "Normal") if graph.is_linked(node, "Normal") else NORMAL
    if graph.choice(node, "space", "OBJECT") == "OBJECT":
        return read(displaced_in_object, normal or NORMAL, way, kind=VECTOR)
    return step(np.multiply, normal or NORMAL, way, kind=VECTOR)


def displaced_in_object(context: Context, normal: Array, way: Array) -> Vec:
    """Return ways (3, n) in the world, along the normals and of such lengths in the object."""
    normal = np.broadcast_to(normal, (3, context.size))
    return context.out_of_object(context.into_object(normal, "NORMAL") * way, "VECTOR")


def _vector_displacement(graph: Graph, node: Node, output: str) -> Value | None:
    """Return the way that the surface moves, as a map of vectors says."""
    vector = graph.whole(node, "Vector") - graph.number(node, "Midlevel", 0.0)
    vector = vector * graph.number(node, "Scale", 1.0)
    space = graph.choice(node, "space", "TANGENT")
    if space == "WORLD":
        return vector
    if space == "TANGENT":
        vector = read(in_frame, vector, static=((ACTIVE_UV, FRAME),), kind=VECTOR)
    return read(out_of_object, vector, static=("VECTOR",), kind=VECTOR)


NORMALS: dict[str, NodeFunction] = {
    "NormalMap": _normal_map,
    "Bump": _bump,
    "Displacement": _displacement,
    "VectorDisplacement": _vector_displacement,
}
