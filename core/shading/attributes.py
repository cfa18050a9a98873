"""nodes -> names; context -> Values.  The attributes of meshes that materials ask for."""

from collections.abc import Callable, Iterator

import numpy as np

from ..arrays import F32, Vec, cross, dot, normalize
from ..geometry.attributes import ALPHA, VECTOR, Asked
from ..scene import (
    ACTIVE_COLOUR,
    ACTIVE_UV,
    ISLAND,
    POINTINESS,
    PROPERTIES,
    SHARP,
    Link,
    Material,
    Node,
)
from . import values
from .context import Context
from .graph import links_below, output_of
from .normals import reader
from .values import Array, Value, read


def uv_map(node: Node, name: str = "uv_map") -> str:
    """Return the name of the attribute that is a node's UV map."""
    return node.properties.get(name) or ACTIVE_UV


def attribute_of(node: Node) -> str:
    """Return the name of the attribute of an Attribute node."""
    prefix = PROPERTIES.get(node.properties.get("attribute_type", "GEOMETRY"), "")
    name = node.properties.get("attribute_name", "")
    return prefix + name if name else ""


def layer_of(node: Node) -> str:
    """Return the name of the attribute of a Color Attribute node."""
    return node.properties.get("layer_name") or ACTIVE_COLOUR


def _is(name: str, choice: str) -> Callable[[Node], str | None]:
    return lambda node: uv_map(node) if node.properties.get(name, choice) == choice else None


# Kind of node -> the attribute that its outputs read, None if it is none
ASKS: dict[str, Callable[[Node], str | None]] = {
    "UVMap": uv_map,
    "Attribute": attribute_of,
    "VertexColor": layer_of,
    "NormalMap": _is("space", "TANGENT"),
    "VectorDisplacement": lambda n: (
        ACTIVE_UV if n.properties.get("space", "TANGENT") == "TANGENT" else None
    ),
    "Tangent": _is("direction_type", "UV_MAP"),
    "TexImage": lambda n: None if isinstance(n.inputs.get("Vector"), Link) else ACTIVE_UV,
}


# Output of Volume Info -> the attribute that it is
VOLUME_INFO = {name: name.lower() for name in ("Color", "Density", "Flame", "Temperature")}

# Output of Geometry -> the attribute that it is
OF_MESH = {"Pointiness": POINTINESS, "Random Per Island": ISLAND}


def attributes_wanted(material: Material) -> frozenset[str]:
    """Return the names of all attributes that a material may ask for."""
    names: set[str | None] = {SHARP} if material.moves else set()
    for link in links_below(output_of(material)):
        asks = ASKS.get(link.node.kind)
        if asks is not None:
            names.add(asks(link.node))
        elif link.node.kind == "TexCoord" and link.output == "UV":
            names.add(uv_map(link.node))
        elif link.node.kind == "VolumeInfo":
            names.add(VOLUME_INFO.get(link.output))
        elif link.node.kind == "NewGeometry":
            names.add(OF_MESH.get(link.output))
    return frozenset(name for name in names if name)


def attribute(context: Context, asked: Asked) -> Array:
    """Return a vector (3, n) or number (n,) of an attribute; 0 where there is none."""
    found = context.attribute(asked)
    if asked[1] != VECTOR:
        return np.full(1, F32(asked[1] == ALPHA)) if found is None else found[0]
    if found is None:
        return np.zeros((3, 1), F32)
    if len(found) == 3:
        return found
    flat = np.zeros((3, found.shape[1]), F32)
    flat[:2] = found
    return flat


def read_attribute(name: str, output: str = VECTOR, kind: str | None = None) -> Value:
    """Return an attribute as a value, a vector if `kind` does not say otherwise."""
    kind = kind or (values.VECTOR if output == VECTOR else values.FLOAT)
    return read(attribute, kind=kind, static=((name, output),))


def asked_by(order: tuple[Value, ...]) -> Iterator[Asked]:
    """Yield what steps ask meshes for."""
    for item in order:
        function, static = reader(item)
        if function in (attribute, along_u, footprint, framed, framed_at_rest, in_frame):
            yield static[0]


def framed(context: Context, local: Array, asked: Asked) -> Vec:
    """Return unit vectors (3, n) of the world, of vectors along a UV map's u, v and the normal.

    On the viewer's side; the shading normal where the mesh has no such map.
    """
    found = context.attribute(asked)
    if found is None:
        return context.normal
    return _along(context, normalize(found[:3].copy()), found[3:7], local)


def framed_at_rest(
    context: Context, local: Array, strong: Array, strength: Array, asked: Asked
) -> Vec:
    """Return the same of a mesh as it was before it was displaced.

    There the frame is not that of the shading normal, with which vectors `local` are mixed by
    `strength`; elsewhere it is `strong` that counts, vectors of that strength.
    """
    found = context.attribute(asked)
    if found is None:
        return context.normal
    was = found[7] > F32(0.5)
    normal = np.where(was, found[:3], normalize(found[:3].copy()))
    bent = _along(context, normal, found[3:7], np.where(was, local, strong))
    mixed = context.normal + (bent - context.normal) * np.maximum(strength, F32(0))
    mixed = np.where(was, normalize(mixed), bent)
    return np.where(dot(mixed, mixed) > F32(0.5), mixed, context.normal)


def _along(context: Context, normal: Vec, along_map: Vec, local: Array) -> Vec:
    tangent, side = along_map[:3], along_map[3]
    vector = cross(normal, tangent)
    vector *= side * local[1]
    vector += tangent * local[0]
    vector += normal * local[2]
    vector = context.out_of_object(vector, "NORMAL")
    vector *= np.where(context.back, F32(-1), F32(1))
    lost = ~(dot(vector, vector) > F32(0.5)) | (side == 0)
    return np.where(lost, context.normal, vector) if lost.any() else vector


def footprint(context: Context, scale: Array, asked: Asked) -> Array:
    """Return how wide (n,) what rays stand for is on a UV map that is scaled; 0 without a map."""
    density = context.attribute(asked)
    if density is None:
        return np.zeros(1, F32)
    wide: Array = density[0] * context.cone
    wide *= scale
    return wide


def in_frame(context: Context, local: Array, asked: Asked) -> Vec:
    """Return vectors (3, n) of objects, of vectors along a UV map's u, the normal and v.

    Without a map they run about the object's z, as on a globe.
    """
    up = context.into_object(context.normal, "NORMAL")
    found = context.attribute(asked)
    if found is None:
        return up * local[1]
    across = normalize(cross(up, found[3:6])) * found[6]
    vector: Vec = found[3:6] * local[0] + up * local[1] + across * local[2]
    return vector


def along_u(context: Context, asked: Asked) -> Vec:
    """Return tangents (3, n) along a UV map's u; 0 where the mesh has no such map."""
    found = context.attribute(asked)
    if found is None:
        return np.zeros((3, 1), F32)
    tangent = context.out_of_object(found[3:6], "NORMAL")
    normal = context.normal
    return cross(normal, normalize(cross(tangent, normal)))
