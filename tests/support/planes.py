"""nodes, views, suns -> radiance.  What Cycles' closures send from suns to an orthographic camera.

A picture has a row for each material and a column for each view; its pixel shows a flat square
whose tilt makes the camera stand in that direction of the square's own frame, the tangent being
its UV map's u.  A sun without an angle is a single direction, so a picture of one sample is exact.
Blender's process imports this file by itself.
"""

import tempfile
from pathlib import Path

import numpy as np

HALF = 0.45  # of a square's side on the picture [pixels]
LEAST = 4  # pixels that Blender's pictures have at least, in width and height


def frames(views):
    """Return rotations (V, 3, 3) that turn the local directions `views` (3, V) to the camera."""
    rotations = []
    for x, y, z in np.asarray(views, float).T:
        cross = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
        rotations.append(np.eye(3) + cross + cross @ cross / (1 + z))
    return np.array(rotations)


def local(views, suns):
    """Return the directions (3, S, V) of suns (3, S) in the frames of the views (3, V)."""
    return np.einsum("vij,is->jsv", frames(views), suns)


def polar(cosine, azimuth):
    """Return unit directions (3, ...) float64 of cosines and azimuths [radians]."""
    cosine, azimuth = np.broadcast_arrays(cosine, azimuth)
    sine = np.sqrt(1 - cosine**2)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])


def radiance(materials, views, suns):
    """Render with Cycles, inside Blender; return (3, S, M, V) float64 [1/sr], that is f cos.

    materials: (node's type, {property or input: value}) each; suns (3, S) in the world, whose z
    points to the camera.
    """
    import bpy

    columns, rows = len(views[0]), len(materials)
    scene = _empty_scene(max(columns, LEAST), max(rows, LEAST))
    for row, (kind, values) in enumerate(materials):
        scene.collection.objects.link(_squares(row, views, _material(kind, values)))
    lamp = bpy.data.lights.new("Sun", "SUN")
    lamp.energy, lamp.angle = 1.0, 0.0
    for owner, name in ((lamp, "use_shadow"), (lamp.cycles, "cast_shadow")):
        if hasattr(owner, name):
            setattr(owner, name, False)
    holder = bpy.data.objects.new("Sun", lamp)
    holder.rotation_mode = "QUATERNION"
    scene.collection.objects.link(holder)
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "picture.exr")
        pictures = [_picture(scene, holder, sun) for sun in np.asarray(suns).T]
    return np.stack(pictures)[:, :rows, :columns].transpose(3, 0, 1, 2)


def _empty_scene(width, height):
    """Return a new scene whose camera looks down on a pixel per unit, from the origin on."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    for name, value in {
        "device": "CPU",
        "samples": 1,
        "use_adaptive_sampling": False,
        "use_denoising": False,
        "max_bounces": 0,
        "sample_clamp_direct": 0.0,
        "light_sampling_threshold": 0.0,
        "pixel_filter_type": "BOX",
        "filter_width": 0.01,
    }.items():
        setattr(scene.cycles, name, value)
    camera = bpy.data.cameras.new("Camera")
    camera.type = "ORTHO"
    camera.ortho_scale = max(width, height)
    camera.clip_start, camera.clip_end = 1.0, 4000.0
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location = (width / 2, height / 2, 2000.0)
    scene.collection.objects.link(scene.camera)
    return scene


def _squares(row, views, material):
    """Return an object: a square for each view, all of them in one row of the picture."""
    import bpy

    corners = np.array([(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF)])
    points, coordinates = [], []
    for column, rotation in enumerate(frames(views)):
        normal = rotation[:, 2]
        depth = -(corners @ normal[:2]) / normal[2]
        corner = np.column_stack([corners, depth])
        points.extend(corner + (column + 0.5, row + 0.5, 0.0))
        coordinates.extend(corner @ rotation[:, :2])
    mesh = bpy.data.meshes.new("Squares")
    faces = np.arange(len(points)).reshape(-1, 4)
    mesh.from_pydata(np.array(points).tolist(), [], faces.tolist())
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", np.ravel(coordinates))
    mesh.materials.append(material)
    return bpy.data.objects.new("Squares", mesh)


def _material(kind, values):
    """Return a material of one node, its tangent along the UV map."""
    import bpy

    material = bpy.data.materials.new(kind)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new(kind)
    for name, value in values.items():
        if name in node.inputs:
            node.inputs[name].default_value = value
        else:
            setattr(node, name, value)
    if "Tangent" in node.inputs:
        tangent = tree.nodes.new("ShaderNodeTangent")
        tangent.direction_type, tangent.uv_map = "UV_MAP", "UVMap"
        tree.links.new(tangent.outputs[0], node.inputs["Tangent"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def _picture(scene, holder, sun):
    """Return the picture (H, W, 3), row 0 at the bottom, with the sun in that direction."""
    import bpy
    import mathutils
    import OpenImageIO

    holder.rotation_quaternion = mathutils.Vector(sun).to_track_quat("Z", "Y")
    bpy.ops.render.render(write_still=True)
    return OpenImageIO.ImageBuf(scene.render.filepath).get_pixels()[::-1, :, :3].astype(float)
