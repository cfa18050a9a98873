"""bpy's scene -> a dictionary for Mitsuba 3.  What both renderers mean alike, and nothing else.

Diffuse, mirrors, clear glass and emission, in constant colours; rectangles, disks and balls of
light, an even world; perspective cameras. Whatever else there is raises `NotExpressed`. The filter
is a Gaussian as wide as Cycles' Blackman-Harris filter (of the same standard deviation).
"""

import math
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

FILTER_DEVIATION = 0.1385  # of a Blackman-Harris window of width 1
TURNED = Matrix.Diagonal((-1, 1, -1, 1))  # cameras look along z there, and x points to the left
FLIPPED = Matrix.Diagonal((1, -1, -1, 1))  # lamps look along z, too
LIMITS = ("diffuse_bounces", "glossy_bounces", "transmission_bounces")


class NotExpressed(ValueError):
    """The scene has something that is not exported; the message names it."""


def describe(mi: Any, samples: int, folder: Path) -> dict[str, Any]:
    """Return the open scene; its meshes are written to the folder.  Raises NotExpressed."""
    found: dict[str, Any] = {"type": "scene"}
    kinds: set[str] = set()
    hidden = True
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for number, instance in enumerate(depsgraph.object_instances):
        thing, place = instance.object, instance.matrix_world.copy()
        if thing.type == "LIGHT":
            found[f"lamp {number}"] = _lamp(mi, thing, place)
            hidden &= not thing.visible_camera
        elif thing.type in {"MESH", "CURVE", "FONT", "SURFACE", "META"}:
            shapes = _shapes(thing, place, folder, number, kinds)
            hidden &= not any("emitter" in shape for shape in shapes.values())
            found |= shapes
    world = _world()
    if world is not None:
        found["world"], hidden = world, False
    found["integrator"] = {
        "type": "path",
        "max_depth": _bounces(kinds) + 2,
        "hide_emitters": hidden,
    }
    found["sensor"] = _sensor(mi, samples)
    return found


def _refuse(owner: str, what: str) -> NotExpressed:
    return NotExpressed(f"{owner}: {what} is not exported")


def _bounces(kinds: set[str]) -> int:
    settings = bpy.context.scene.cycles
    limits = {getattr(settings, name) for name in LIMITS}
    if kinds <= {"BSDF_DIFFUSE", "EMISSION"}:
        return min(settings.max_bounces, settings.diffuse_bounces)
    if min(limits) < settings.max_bounces:
        raise _refuse("Scene", "a limit of bounces for each kind of them")
    return int(settings.max_bounces)


def _to_world(mi: Any, matrix: Matrix) -> Any:
    return mi.ScalarTransform4f([list(row) for row in matrix])


def _rgb(color: Any, factor: float = 1.0) -> dict[str, Any]:
    return {"type": "rgb", "value": [factor * float(each) for each in color[:3]]}


# ---- camera and world


def _sensor(mi: Any, samples: int) -> dict[str, Any]:
    scene = bpy.context.scene
    eye, render = scene.camera, scene.render
    camera = eye.data
    if camera.type != "PERSP" or camera.dof.use_dof or camera.shift_x or camera.shift_y:
        raise _refuse("Camera", "a lens, a shift or another projection")
    if camera.sensor_fit != "AUTO" or render.pixel_aspect_x != render.pixel_aspect_y:
        raise _refuse("Camera", "this sensor fit or pixel aspect")
    if render.use_motion_blur or render.film_transparent or render.use_border:
        raise _refuse("Scene", "motion blur, a transparent film or a border")
    share = render.resolution_percentage / 100
    size = [max(1, int(v * share)) for v in (render.resolution_x, render.resolution_y)]
    width = FILTER_DEVIATION * scene.cycles.filter_width
    return {
        "type": "perspective",
        "fov_axis": "larger",
        "fov": math.degrees(camera.angle),
        "near_clip": camera.clip_start,
        "far_clip": camera.clip_end,
        "to_world": _to_world(mi, eye.matrix_world @ TURNED),
        "sampler": {"type": "multijitter", "sample_count": samples},
        "film": {
            "type": "hdrfilm",
            "width": size[0],
            "height": size[1],
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "gaussian", "stddev": width},
        },
    }


def _world() -> dict[str, Any] | None:
    world = bpy.context.scene.world
    if world is None:
        return None
    node = _surface(world.node_tree, "ShaderNodeOutputWorld", "World")
    if node.type != "BACKGROUND":
        raise _refuse("World", node.bl_label)
    color, strength = _value(node, "Color", "World"), _value(node, "Strength", "World")
    if strength * max(color[:3]) == 0:
        return None
    return {"type": "constant", "radiance": _rgb(color, strength)}


# ---- lamps


def _lamp(mi: Any, thing: Any, place: Matrix) -> dict[str, Any]:
    """Return the shape of a lamp; its radiance is power over pi times its area."""
    data = thing.data
    if data.type == "POINT" and data.shadow_soft_size > 0:
        radius = data.shadow_soft_size
        area, shape = 4 * math.pi * radius**2, {"type": "sphere", "radius": radius}
        shape["center"] = list(place.translation)
    elif data.type == "AREA" and data.spread >= math.pi - 1e-4:
        is_round = data.shape in {"DISK", "ELLIPSE"}
        tall = data.size_y if data.shape in {"RECTANGLE", "ELLIPSE"} else data.size
        area = data.size * tall * (math.pi / 4 if is_round else 1)
        half = Matrix.Diagonal((data.size / 2, tall / 2, 1, 1))
        shape = {"type": "disk" if is_round else "rectangle"}
        shape["to_world"] = _to_world(mi, place @ FLIPPED @ half)
    else:
        raise _refuse(thing.name, f"a lamp of type {data.type} of this size or spread")
    radiance = _rgb(data.color, data.energy / (math.pi * area))
    # Blender's lamps do not stop what meets them.
    return shape | {"emitter": {"type": "area", "radiance": radiance}, "bsdf": {"type": "null"}}


# ---- meshes and materials


def _shapes(
    thing: Any, place: Matrix, folder: Path, number: int, kinds: set[str]
) -> dict[str, dict[str, Any]]:
    """Return an object's faces, a shape for each material."""
    mesh = thing.to_mesh()
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners, slots = np.empty(3 * count, np.int32), np.empty(count, np.int32)
    loops, flat = np.empty(3 * count, np.int32), np.empty(len(mesh.polygons), bool)
    faces = np.empty(count, np.int32)
    mesh.loop_triangles.foreach_get("vertices", corners)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("material_index", slots)
    mesh.loop_triangles.foreach_get("polygon_index", faces)
    mesh.polygons.foreach_get("use_smooth", flat)
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    normals = np.empty(3 * len(mesh.loops), np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    thing.to_mesh_clear()

    matrix = np.array(place, np.float64)
    points = positions.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    across = normals.reshape(-1, 3) @ np.linalg.inv(matrix[:3, :3])
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    way = slice(None, None, -1 if np.linalg.det(matrix[:3, :3]) < 0 else 1)
    shapes = {}
    for slot in np.unique(slots):
        chosen = np.flatnonzero(slots == slot)
        which = corners.reshape(-1, 3)[chosen][:, way].ravel()
        smooth = bool(flat[faces[chosen]].any())
        rows = across[loops.reshape(-1, 3)[chosen][:, way].ravel()] if smooth else None
        path = folder / f"{number}-{slot}.ply"
        write_ply(path, points[which], rows)
        slots_of = thing.material_slots
        material = slots_of[min(int(slot), len(slots_of) - 1)].material if slots_of else None
        shape = {"type": "ply", "filename": str(path), "face_normals": not smooth}
        shapes[f"mesh {number} {slot}"] = shape | _material(material, thing.name, kinds)
    return shapes


def write_ply(path: Path, points: NDArray[np.float64], normals: NDArray[np.float64] | None) -> None:
    """Write triangles, three rows (N, 3) of points each, with a normal at each point if given."""
    names = ["x", "y", "z"] + ([] if normals is None else ["nx", "ny", "nz"])
    rows = points if normals is None else np.concatenate([points, normals], axis=1)
    faces = np.empty(len(points) // 3, np.dtype([("count", "u1"), ("corners", "<i4", (3,))]))
    faces["count"], faces["corners"] = 3, np.arange(len(points)).reshape(-1, 3)
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    head += [f"property float {name}" for name in names]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    text = ("\n".join(head) + "\n").encode()
    path.write_bytes(text + rows.astype("<f4").tobytes() + faces.tobytes())


def _material(material: Any, owner: str, kinds: set[str]) -> dict[str, Any]:
    """Return the BSDF of a material of one shader, and the emitter if it glows."""
    if material is None:
        raise _refuse(owner, "a face without a material")
    name = material.name
    node = _surface(material.node_tree, "ShaderNodeOutputMaterial", name)
    kinds.add(node.type)
    color = _value(node, "Color", name)
    if node.type == "BSDF_DIFFUSE" and _value(node, "Roughness", name) == 0:
        return _two_sided({"type": "diffuse", "reflectance": _rgb(color)})
    if node.type == "BSDF_GLOSSY" and _value(node, "Roughness", name) == 0:
        mirror = {"type": "conductor", "material": "none", "specular_reflectance": _rgb(color)}
        return _two_sided(mirror)
    if node.type == "BSDF_GLASS" and _value(node, "Roughness", name) == 0:
        tint = {f"specular_{way}": _rgb(color) for way in ("reflectance", "transmittance")}
        ior = _value(node, "IOR", name)
        return {"bsdf": {"type": "dielectric", "int_ior": ior, "ext_ior": 1.0} | tint}
    if node.type == "EMISSION":
        radiance = _rgb(color, _value(node, "Strength", name))
        black = {"type": "diffuse", "reflectance": _rgb((0, 0, 0))}
        return {"bsdf": black, "emitter": {"type": "area", "radiance": radiance}}
    raise _refuse(name, f"{node.bl_label}, or its roughness,")


def _two_sided(bsdf: dict[str, Any]) -> dict[str, Any]:
    return {"bsdf": {"type": "twosided", "bsdf": bsdf}}


def _surface(tree: Any, output: str, owner: str) -> Any:
    """Return the one shader node that the output shows."""
    outputs = [each for each in tree.nodes if each.bl_idname == output] if tree else []
    if len(outputs) != 1 or not outputs[0].inputs["Surface"].is_linked:
        raise _refuse(owner, "a node tree without one surface")
    if any(each.is_linked for each in outputs[0].inputs if each.name != "Surface"):
        raise _refuse(owner, "a volume or a displacement")
    return outputs[0].inputs["Surface"].links[0].from_node


def _value(node: Any, name: str, owner: str) -> Any:
    if name not in node.inputs:
        raise _refuse(owner, node.bl_label)
    if node.inputs[name].is_linked:
        raise _refuse(owner, f"a texture ({name})")
    return node.inputs[name].default_value
