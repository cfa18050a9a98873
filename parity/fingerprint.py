"""a scene in bpy -> a hash of all that a picture of it depends on.

Cached references are found by it. It is taken from what was built, not from the code that built
it: code may be rewritten without rendering anew, and no change of the scene goes unnoticed.
"""

import hashlib
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np

_SIMPLE = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
# What changes from run to run or from render to render, and what both engines decide themselves.
_IGNORED = {"engine", "filepath", "filepath_raw", "threads", "threads_mode", "seed", "samples"}
_IGNORED |= {"session_uid", "is_dirty", "use_fake_user", "tag", "users", "image_settings", "select"}
_IGNORED |= {"location_absolute", "frame_path", "device", "is_updated", "is_updated_data"}


def fingerprint(scene: bpy.types.Scene) -> str:
    """Return 16 hexadecimal digits for a scene and everything in the file."""
    digest = hashlib.sha256()
    for line in _lines(scene):
        digest.update(line.encode())
    return digest.hexdigest()[:16]


def _lines(scene: bpy.types.Scene) -> Iterator[str]:
    layer = scene.view_layers[0]
    yield from _struct("render", scene.render)
    yield from _struct("cycles", scene.cycles)
    yield from _struct("units", scene.unit_settings)
    for item in _tree(layer.layer_collection, "children"):
        yield from _struct(f"layer {item.name}", item)
        members = [each.name for each in item.collection.objects]
        yield f"{members} {[child.name for child in item.children]}"
    yield f"{scene.world and scene.world.name} {scene.camera.name}"
    for group in ("objects", "cameras", "lights", "worlds", "materials", "meshes", "images"):
        for item in getattr(bpy.data, group):
            yield from _datablock(f"{group} {item.name}", item)
    if scene.render.use_motion_blur:
        yield from _movement(scene)


def _movement(scene: bpy.types.Scene) -> Iterator[str]:
    """Yield what the shutter sees: places, vertices and the camera at times about the frame."""
    curve = scene.render.motion_blur_shutter_curve.curves[0]
    yield str([(_plain(each.location), each.handle_type) for each in curve.points])
    frame = scene.frame_current
    for quarter in range(-8, 9):
        scene.frame_set(frame + quarter // 4, subframe=quarter % 4 / 4)
        graph = bpy.context.evaluated_depsgraph_get()
        for item in graph.object_instances:
            yield f"{item.object.name} {[_plain(row) for row in item.matrix_world]}"
            if item.object.type == "MESH":
                mesh = item.object.data
                positions = np.empty(len(mesh.vertices) * 3, np.float32)
                mesh.vertices.foreach_get("co", positions)
                yield hashlib.sha256(positions.tobytes()).hexdigest()
        yield from _struct("camera", scene.camera.evaluated_get(graph).data)
    scene.frame_set(frame)


def _datablock(name: str, item: Any) -> Iterator[str]:
    yield from _struct(name, item)
    for part in ("cycles", "cycles_visibility"):
        if hasattr(item, part):
            yield from _struct(f"{name} {part}", getattr(item, part))
    if isinstance(item, bpy.types.Object):
        linking = item.light_linking
        linked = (linking.receiver_collection, linking.blocker_collection)
        yield f"{item.data and item.data.name} {item.parent and item.parent.name}"
        for collection in filter(None, linked):
            yield f"{collection.name} {[each.name for each in collection.objects]}"
            yield str([each.light_linking.link_state for each in collection.collection_objects])
    elif isinstance(item, bpy.types.Mesh):
        yield from _mesh(item)
    elif isinstance(item, bpy.types.Image):
        yield hashlib.sha256(np.array(item.pixels[:], np.float32).tobytes()).hexdigest()
    tree = getattr(item, "node_tree", None)
    if tree is not None:
        yield from _nodes(name, tree)


def _mesh(mesh: bpy.types.Mesh) -> Iterator[str]:
    positions = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", positions)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    smooth = np.empty(len(mesh.polygons), bool)
    mesh.polygons.foreach_get("use_smooth", smooth)
    for values in (positions, corners, smooth):
        yield hashlib.sha256(values.tobytes()).hexdigest()
    yield str([material and material.name for material in mesh.materials])


def _nodes(name: str, tree: bpy.types.NodeTree) -> Iterator[str]:
    for node in tree.nodes:
        where = f"{name} node {node.name} {node.bl_idname} {node.mute}"
        yield where
        for prop in node.bl_rna.properties:
            if prop.identifier not in bpy.types.ShaderNode.bl_rna.properties:
                value = getattr(node, prop.identifier)
                if prop.type in _SIMPLE:
                    yield f"{prop.identifier} {_plain(value)}"
                elif isinstance(value, bpy.types.ID):
                    yield value.name
        for socket in (*node.inputs, *node.outputs):
            yield f"{socket.identifier} {_plain(getattr(socket, 'default_value', None))}"
    for link in tree.links:
        ends = (link.from_node.name, link.from_socket.identifier)
        yield f"{ends} {link.to_node.name} {link.to_socket.identifier}"


def _struct(name: str, item: Any) -> Iterator[str]:
    """Yield the simple properties of a struct that can be set."""
    yield name
    for prop in item.bl_rna.properties:
        key = prop.identifier
        if key in _IGNORED or prop.is_readonly or prop.type not in _SIMPLE:
            continue
        yield f"{key} {_plain(getattr(item, key))}"


def _plain(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.7g}"
    if hasattr(value, "__len__") and not isinstance(value, str):
        return str([_plain(each) for each in value])
    return str(value)


def _tree(item: Any, children: str) -> Iterator[Any]:
    yield item
    for child in getattr(item, children):
        yield from _tree(child, children)
