"""bpy attributes and custom properties -> core.scene.Attribute.  Only those that shaders ask for.

UV maps and colours of a mesh are attributes like others; the ones that the file renders with have
names of their own.  Custom properties are looked for where Blender does: the object, its data.
"""

from collections.abc import Collection
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.geometry.neighbours import islands, pointiness
from ...core.scene import (
    ACTIVE_COLOUR,
    ACTIVE_UV,
    ISLAND,
    POINTINESS,
    PROPERTIES,
    Attribute,
)
from ...core.shading.textures.hashing import fractions, hash_words

# Type -> the field of its items, its numbers, and how they are read
_TYPES: dict[str, tuple[str, int, type]] = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, np.bool_),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
}


def export_attributes(
    mesh: bpy.types.Mesh,
    names: Collection[str],
    corners: NDArray[np.int32] | None,
    faces: NDArray[np.int32] | None,
) -> dict[str, Attribute]:
    """Return the attributes that a mesh has of these names.

    corners (F, 3) and faces (F,) are those of the triangles; None is 0, 1, 2, ...
    """
    found = {}
    for name in sorted(names):
        if name in _OF_SHAPE:
            found[name] = _OF_SHAPE[name](mesh, faces)
            continue
        attribute = _find(mesh, name)
        if attribute is None or attribute.data_type not in _TYPES:
            continue
        field, width, dtype = _TYPES[attribute.data_type]
        values = np.empty(len(attribute.data) * width, dtype)
        attribute.data.foreach_get(field, values)
        rows = values.astype(np.float32, copy=False).reshape(-1, width)
        if attribute.domain == "CORNER":
            rows = rows.reshape(-1, 3, width) if corners is None else rows.take(corners, axis=0)
        elif attribute.domain == "FACE":
            rows = rows if faces is None else rows.take(faces, axis=0)
        elif attribute.domain != "POINT":
            continue
        found[name] = Attribute(attribute.domain, rows)
    return found


def _pointiness(mesh: bpy.types.Mesh, faces: NDArray[np.int32] | None) -> Attribute:
    positions = read_items(mesh.attributes["position"].data, "vector", np.float32, 3)
    normals = read_items(mesh.vertex_normals, "vector", np.float32, 3)
    return Attribute("POINT", pointiness(positions, normals, _edges(mesh))[:, None])


def _random_per_island(mesh: bpy.types.Mesh, faces: NDArray[np.int32] | None) -> Attribute:
    root = islands(len(mesh.vertices), _edges(mesh))
    corner = read_items(mesh.attributes[".corner_vert"].data, "value", np.int32)
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    of_face = root.take(corner.take(starts)).view(np.uint32)
    random = fractions(hash_words([of_face]))[:, None]
    return Attribute("FACE", random if faces is None else random.take(faces, axis=0))


def _edges(mesh: bpy.types.Mesh) -> NDArray[np.int32]:
    edges = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", edges)
    return edges.reshape(-1, 2)


def read_items(
    items: bpy.types.bpy_prop_collection, name: str, dtype: type, width: int = 1
) -> NDArray:
    """Return one attribute of all items as (N,), or (N, width)."""
    values = np.empty(len(items) * width, dtype)
    items.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values


_OF_SHAPE = {POINTINESS: _pointiness, ISLAND: _random_per_island}


def has_corner_attributes(mesh: bpy.types.Mesh, names: Collection[str]) -> bool:
    """Tell whether any of these attributes has values at the corners of faces."""
    found = (_find(mesh, name) for name in names)
    return any(attribute and attribute.domain == "CORNER" for attribute in found)


def _find(mesh: bpy.types.Mesh, name: str) -> bpy.types.Attribute | None:
    if name == ACTIVE_UV:
        name = next((layer.name for layer in mesh.uv_layers if layer.active_render), "")
    elif name == ACTIVE_COLOUR:
        number = mesh.color_attributes.render_color_index
        if not 0 <= number < len(mesh.color_attributes):
            return None
        name = mesh.color_attributes[number].name
    return mesh.attributes.get(name) if name else None


def export_properties(
    names: Collection[str],
    object: bpy.types.Object,
    parent: bpy.types.Object | None,
    view_layer: bpy.types.ViewLayer,
    scene: bpy.types.Scene,
) -> dict[str, tuple[float, ...]]:
    """Return the custom properties of these names; what nobody has is black without alpha."""
    owners = {
        "OBJECT": (object, object.data),
        "INSTANCER": (parent, object, object.data),
        "VIEW_LAYER": (view_layer, scene),
    }
    found = {}
    for name in names:
        for kind, prefix in PROPERTIES.items():
            if name.startswith(prefix):
                values = (_property(owner, name.removeprefix(prefix)) for owner in owners[kind])
                found[name] = next((v for v in values if v is not None), (0.0, 0.0, 0.0, 0.0))
    return found


def _property(owner: Any, name: str) -> tuple[float, ...] | None:
    """Return a custom property or, failing that, one of Blender's, as a colour with alpha."""
    if owner is None:
        return None
    try:
        value = owner[name]
    except (KeyError, TypeError):
        try:
            value = owner.path_resolve(name)
        except (ValueError, AttributeError):
            return None
    if isinstance(value, int | float):
        return float(value), float(value), float(value), 1.0
    try:
        numbers = tuple(float(number) for number in value)
    except (TypeError, ValueError):
        return None
    return (*numbers, 1.0)[:4] if len(numbers) in (3, 4) else None
