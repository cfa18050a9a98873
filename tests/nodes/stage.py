"""rows -> pictures by both engines.  A tile for each row, its node feeding an emission shader.

Every tile is a small object of its own, TILE pixels wide, under a camera that looks straight
down.  Fields are constant over a pixel, and samples lie within a hundredth of its middle.
"""

import math

import bpy
import numpy as np

from . import zones
from .rows import OFFSET, TILE

SIDE = 0.4  # of a tile [m]

# Field -> factors and summands of what varies over a tile from -1/2 to 1/2
FIELDS = {
    "A": ((2.2, 1.9, 1.7), (0.217, 0.331, -0.1737)),
    "B": ((-1.3, 2.9, 0.8), (0.53, -0.11, 0.41)),
    "C": ((1.1, -0.7, 2.3), (-0.37, 0.61, 0.29)),
    "P": ((0.9, -0.8, 0.55), (0.51, 0.49, 0.47)),
    "Q": ((-0.6, 0.7, 0.5), (0.52, 0.43, 0.46)),
}
SCALARS = {"a": ("A", 0), "b": ("B", 1), "c": ("C", 2), "p": ("P", 0), "p2": ("Q", 1)}


def render(rows, folder, camera="ORTHO", size=TILE):
    """Return both pictures (H, W, 3) of the rows, the upper row of pixels first."""
    import penumbra

    penumbra.register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_set(7)
    scene.render.fps, scene.render.fps_base = 30, 1.5
    across = math.ceil(math.sqrt(len(rows)))
    down = math.ceil(len(rows) / across)
    other = bpy.data.objects.new("Other", None)
    other.location, other.rotation_euler, other.scale = (0.2, -0.3, 0.1), (0.4, 1, 0.2), (1, 2, 0.7)
    scene.collection.objects.link(other)
    for k, row in enumerate(rows):
        at = ((k % across - (across - 1) / 2) * SIDE, ((down - 1) / 2 - k // across) * SIDE, 0)
        put(row, k, at, other)
    look(scene, camera, across * SIDE, down * SIDE)
    scene.render.resolution_x, scene.render.resolution_y = across * size, down * size
    bpy.context.view_layer.update()
    return shots(scene, folder)


def render_worlds(rows, folder):
    """Return both pictures of each row's node feeding the world."""
    import penumbra

    penumbra.register()
    pictures = []
    for row in rows:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.world = bpy.data.worlds.new("World")
        tree = with_nodes(scene.world)
        show(tree, plant(tree, row, None), row, "Background", "OutputWorld")
        look(scene, "PERSP", 4.0, 4.0)
        scene.render.resolution_x = scene.render.resolution_y = TILE
        pictures.append(shots(scene, folder))
    return [np.concatenate([each[k] for each in pictures]) for k in range(2)]


def shots(scene, folder):
    import OpenImageIO

    render = scene.render
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.resolution_percentage = 100
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.device = "CPU"
    for settings in (scene.cycles, scene.penumbra):
        settings.samples = 1
        settings.pixel_filter_type, settings.filter_width = "GAUSSIAN", 0.01
        settings.sample_clamp_direct = settings.sample_clamp_indirect = 0
    pictures = []
    for engine in ("CYCLES", "PENUMBRA"):
        render.engine = engine
        render.filepath = str(folder / f"{engine}.exr")
        bpy.ops.render.render(write_still=True)
        pictures.append(OpenImageIO.ImageBuf(render.filepath).get_pixels()[..., :3].copy())
    return pictures


def look(scene, projection, width, height):
    data = bpy.data.cameras.new("Camera")
    data.type = projection
    camera = bpy.data.objects.new("Camera", data)
    camera.location, camera.rotation_euler = (0, 0, 3), (0, 0, 0)
    data.ortho_scale = max(width, height)
    if projection == "PERSP":
        camera.rotation_euler = (0.15, 0.08, 0.1)
        away = camera.rotation_euler.to_matrix().col[2]
        camera.location = away * 1.2 * max(width, height)
        data.lens, data.shift_x = 40, 0.03
    scene.collection.objects.link(camera)
    scene.camera = camera


def put(row, k, at, other):
    """Put the object of a tile; none if this Blender has no such node, or not this choice."""
    h = SIDE / 2
    points = [(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)]
    is_plane = row.thing == "plane"
    if not is_plane:
        points = [(x, y, z * h) for (x, y, _), z in zip(points, (0, 0.3, 0.7, 0.1), strict=True)]
    mesh = bpy.data.meshes.new(f"Mesh {k}")
    faces = [(0, 1, 2, 3)] if is_plane else [(0, 1, 2), (0, 2, 3)]
    if row.thing == "islands":
        points, faces = points + [points[0], points[2]], [(0, 1, 2), (4, 5, 3)]
    elif row.thing == "behind":
        faces = [face[::-1] for face in faces]
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", [row.thing == "smooth"] * len(mesh.polygons))
    thing = bpy.data.objects.new(f"Tile {k} é", mesh)
    thing.location = at
    if row.thing == "instanced":
        instance(thing)
    elif not is_plane:
        thing.rotation_euler = (0.3, -0.2, 0.5)
        thing.scale = (-0.61, 0.487, 0.7) if row.thing == "mirrored" else (0.6, 0.5, 0.7)
        thing.color, thing.pass_index = (0.2, 0.5, 0.7, 0.6), 3 + k % 4
    material = bpy.data.materials.new(f"Row {k}")
    material.pass_index = 5
    mesh.materials.append(material)
    tree = with_nodes(material)
    try:
        show(tree, plant(tree, row, other), row, "Emission", "OutputMaterial")
    except (TypeError, RuntimeError, KeyError, StopIteration):
        return
    bpy.context.scene.collection.objects.link(thing)


def instance(thing):
    """Let four instances stand for a thing, one on each face of a grid."""
    h = SIDE * 0.42
    grid = [(x * h, y * h, 0) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    faces = [(k, k + 1, k + 4, k + 3) for k in (0, 1, 3, 4)]
    maker_mesh = bpy.data.meshes.new("Grid")
    maker_mesh.from_pydata(grid, [], faces)
    maker_mesh.uv_layers.new()
    maker = bpy.data.objects.new("Maker", maker_mesh)
    maker.location, thing.location = thing.location, (0, 0, 0)
    maker.instance_type, maker.show_instancer_for_render = "FACES", False
    maker.color, maker.pass_index = (0.1, 0.3, 0.9, 0.7), 7
    thing.color, thing.pass_index = (0.2, 0.5, 0.7, 0.6), 4
    thing.scale, thing.parent = (0.4, 0.4, 0.4), maker
    bpy.context.scene.collection.objects.link(maker)


def with_nodes(datablock):
    if datablock.node_tree is None or bpy.app.version < (5, 0):
        datablock.use_nodes = True
    datablock.node_tree.nodes.clear()
    return datablock.node_tree


def plant(tree, row, other):
    """Put the row's node into a tree, with what feeds it; return its output."""
    node = tree.nodes.new(full_name(row.kind))
    for name, value in row.properties.items():
        setattr(node, name, value)
    fields = {}
    sockets = {socket.identifier: socket for socket in node.inputs}
    for name, value in row.inputs.items():
        socket = sockets[name]
        if isinstance(value, str):
            tree.links.new(field(tree, value, fields), socket)
        elif socket.type == "RGBA":
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value
    word, *rest = row.setup.split() or [""]
    if word in ("RGB", "HSV", "HSL"):
        set_ramp(node.color_ramp, word, rest[0])
    elif word == "curves":
        set_curves(node.mapping, rest[0])
    elif word == "span":
        low, high = map(float, rest)
        number = math_node(tree, "MULTIPLY_ADD", field(tree, "p", fields), high - low, low)
        tree.links.new(number, node.inputs[0])
    elif word == "tilted_normal":
        node.outputs[0].default_value = (0.36, 0.48, 0.8)
    elif word == "held":
        held = node.outputs[0]
        held.default_value = -0.7 if held.type == "VALUE" else (0.3, 1.4, 0.2, 1.0)
    elif word == "other_object":
        node.object = other
    elif word:
        return zones.SETUPS[word](tree, node, lambda name: field(tree, name, fields), *rest)
    return next(socket for socket in node.outputs if socket.identifier == row.output)


def full_name(kind):
    """Return what Blender calls a kind of node."""
    return (
        kind if kind.startswith(("Node", "FunctionNode", "GeometryNode")) else f"ShaderNode{kind}"
    )


def field(tree, name, known):
    """Return the output that has a field."""
    if name == "T":
        node = tree.nodes.new("ShaderNodeNormal")
        node.outputs[0].default_value = (0.36, 0.48, 0.8)
        return node.outputs[0]
    if "base" not in known:
        where = tree.nodes.new("ShaderNodeTexCoord").outputs["Object"]
        pixel = vector_node(tree, "MULTIPLY", where, (TILE / SIDE,) * 3)
        pixel = vector_node(tree, "FLOOR", vector_node(tree, "ADD", pixel, (1e-3,) * 3))
        pixel = vector_node(tree, "MULTIPLY", pixel, (1 / TILE,) * 3)
        known["base"] = vector_node(tree, "CROSS_PRODUCT", pixel, (0.7, 0.4, 0.9))
    if name not in known:
        if name in FIELDS:
            known[name] = vector_node(tree, "MULTIPLY_ADD", known["base"], *FIELDS[name])
            if name in "PQ":  # a colour, where it matters
                mix = tree.nodes.new("ShaderNodeMixRGB")
                mix.inputs["Fac"].default_value = 1
                tree.links.new(known[name], mix.inputs["Color2"])
                known[name] = mix.outputs[0]
        else:
            whole, place = SCALARS[name]
            parts = tree.nodes.new("ShaderNodeSeparateXYZ")
            tree.links.new(field(tree, whole, known), parts.inputs[0])
            known[name] = parts.outputs[place]
    return known[name]


def vector_node(tree, operation, first, *others):
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    tree.links.new(first, node.inputs[0])
    for socket, value in zip(list(node.inputs)[1:], others, strict=False):
        socket.default_value = value
    return node.outputs["Vector"]


def math_node(tree, operation, first, *others):
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    tree.links.new(first, node.inputs[0])
    for socket, value in zip(list(node.inputs)[1:], others, strict=False):
        socket.default_value = value
    return node.outputs[0]


def show(tree, output, row, shader, end):
    """Let an output be seen as light, scaled and raised above 0."""
    raised = vector_node(tree, "MULTIPLY_ADD", output, (row.scale,) * 3, (OFFSET,) * 3)
    light = tree.nodes.new(f"ShaderNode{shader}")
    tree.links.new(raised, light.inputs["Color"])
    tree.links.new(light.outputs[0], tree.nodes.new(f"ShaderNode{end}").inputs["Surface"])


def set_ramp(ramp, mode, kind):
    ramp.color_mode = mode
    if mode == "RGB":
        ramp.interpolation = kind
    else:
        ramp.hue_interpolation = kind
    ramp.elements[0].position, ramp.elements[0].color = 0.11, (0.8, 0.1, 0.2, 0.3)
    ramp.elements[1].position, ramp.elements[1].color = 0.93, (0.1, 0.6, 0.9, 1.0)
    third = ramp.elements.new(0.47)
    third.color = (0.3, 0.9, 0.15, 0.6)


def set_curves(mapping, extend):
    mapping.extend = extend
    mapping.use_clip = False
    for k, curve in enumerate(mapping.curves):
        curve.points[0].location = (-0.3 - 0.1 * k, 0.1)
        curve.points[-1].location = (1.1, 0.8 + 0.1 * k)
        curve.points.new(0.3 + 0.1 * k, 0.75)
    mapping.update()
