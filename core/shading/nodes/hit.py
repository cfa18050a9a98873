"""node -> Value.  Nodes that read the hit point: Light Path, Geometry, Fresnel, Layer Weight."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ...arrays import F32, cross, dot, normalize
from ...bsdf import CAMERA, DIFFUSE, GLOSSY, SHADOW, SINGULAR, TRANSMISSION, fresnel
from ...geometry.attributes import FACTOR, FRAME
from ...scene import Node
from ..attributes import OF_MESH, along_u, read_attribute, uv_map
from ..context import Arrival, Context
from ..graph import Graph
from ..inputs import BACK, FACING, NORMAL, POSITION
from ..values import VECTOR, Array, Value, clamp, read, step
from .arithmetic import power
from .triangle import PARAMETRIC

NodeFunction = Callable[[Graph, Node, str], Value | None]


def _is(context: Context, bits: int) -> Array:
    return context.has_kind(bits)


def _is_reflection(context: Context) -> Array:
    return (F32(1) - context.has_kind(TRANSMISSION | CAMERA | SHADOW)) * context.has_kind(
        DIFFUSE | GLOSSY
    )


def _length(context: Context) -> Array:
    return context.length


def _counted(context: Context, choose: Callable[[Arrival], object]) -> Array:
    return context.counted(choose)


def _depth(arrival: Arrival) -> object:
    return arrival.depth if arrival.total is None else arrival.total


def _count(row: int, arrival: Arrival) -> object:
    if arrival.count is None:
        return arrival.depth if row == 0 else 0
    return arrival.count[row]


def _passed(arrival: Arrival) -> object:
    return arrival.passed


# Output -> what it reads
LIGHT_PATH: dict[str, Value] = {
    "Is Camera Ray": read(_is, static=(CAMERA,)),
    "Is Shadow Ray": read(_is, static=(SHADOW,)),
    "Is Diffuse Ray": read(_is, static=(DIFFUSE,)),
    "Is Glossy Ray": read(_is, static=(GLOSSY,)),
    "Is Singular Ray": read(_is, static=(SINGULAR,)),
    "Is Reflection Ray": read(_is_reflection),
    "Is Transmission Ray": read(_is, static=(TRANSMISSION,)),
    "Is Volume Scatter Ray": Value("float", np.zeros(1, F32)),
    "Ray Length": read(_length),
    "Ray Depth": read(_counted, static=(_depth,)),
    "Diffuse Depth": read(_counted, static=(partial(_count, 0),)),
    "Glossy Depth": read(_counted, static=(partial(_count, 1),)),
    "Transmission Depth": read(_counted, static=(partial(_count, 2),)),
    "Transparent Depth": read(_counted, static=(_passed,)),
    "Portal Depth": Value("float", np.zeros(1, F32)),
}


def radial_tangent(context: Context, axis: int) -> Array:
    """Return the way around an axis of the objects (3, n), in the surface."""
    normal = context.normal
    return cross(normal, normalize(cross(context.around(axis), normal)))


def _geometric(context: Context) -> Array:
    return context.geometric


def _incoming(context: Context) -> Array:
    return context.wo


GEOMETRY: dict[str, Value] = {
    "Position": POSITION,
    "Normal": NORMAL,
    "True Normal": read(_geometric, kind=VECTOR),
    "Incoming": read(_incoming, kind=VECTOR),
    "Backfacing": BACK,
    "Tangent": read(radial_tangent, kind=VECTOR, static=(2,)),
    "Parametric": PARAMETRIC,
}


def _geometry(graph: Graph, node: Node, output: str) -> Value | None:
    if output in OF_MESH:
        return read_attribute(OF_MESH[output], FACTOR)
    return GEOMETRY.get(output)


def _tangent(graph: Graph, node: Node, output: str) -> Value:
    if graph.choice(node, "direction_type", "RADIAL") != "RADIAL":
        return read(along_u, static=((uv_map(node), FRAME),), kind=VECTOR)
    axis = "XYZ".index(graph.choice(node, "axis", "Z"))
    return read(radial_tangent, kind=VECTOR, static=(axis,))


def _from_table(table: dict[str, Value]) -> NodeFunction:
    def make(graph: Graph, node: Node, output: str) -> Value | None:
        return table.get(output)

    return make


def _fresnel(graph: Graph, node: Node, output: str) -> Value:
    ior = clamp(graph.number(node, "IOR", 1.5), 1e-5, np.inf)
    return step(_reflectance, ior, BACK, _facing(graph, node))


def _reflectance(ior: Array, back: Array, cosine: Array) -> Array:
    eta = np.where(back > 0, F32(1) / ior, ior)
    reflectance = fresnel.dielectric(np.abs(cosine), eta)[0]
    return np.where(cosine == 0, F32(1), reflectance)  # even of what is as dense as air


def _layer_weight(graph: Graph, node: Node, output: str) -> Value:
    blend = graph.number(node, "Blend", 0.5)
    facing = _facing(graph, node)
    if output == "Fresnel":
        ior = step(np.reciprocal, clamp(1.0 - blend, 1e-5, np.inf))
        return step(_reflectance, ior, BACK, facing)
    return step(_facing_weight, blend, facing)


def _facing_weight(blend: Array, cosine: Array) -> Array:
    blend = np.clip(blend, F32(0), F32(1 - 1e-5))
    exponent = np.where(blend < F32(0.5), F32(2) * blend, F32(0.5) / (F32(1) - blend))
    return F32(1) - power(np.abs(cosine), exponent)  # normals that are linked may be long


def _facing(graph: Graph, node: Node) -> Value:
    """Return the cosine of the viewer's direction at the node's normal."""
    normal = graph.vector(node, "Normal") if graph.is_linked(node, "Normal") else None
    return FACING if normal is None else read(_cosine_at, normal)


def _cosine_at(context: Context, normal: Array) -> Array:
    return dot(np.broadcast_to(normal, context.wo.shape), context.wo)


HIT: dict[str, NodeFunction] = {
    "LightPath": _from_table(LIGHT_PATH),
    "NewGeometry": _geometry,
    "Fresnel": _fresnel,
    "LayerWeight": _layer_weight,
    "Tangent": _tangent,
}
OF_VIEWER = _incoming, _cosine_at  # steps that depend on the viewer's direction
OF_DISTANCE = (_length,)  # and on how far away the viewer is
