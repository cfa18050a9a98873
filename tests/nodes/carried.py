"""rows -> pictures by both engines.  What meshes carry and images show, a tile each.

Every tile is a bent, turned square with two UV maps, attributes and colours, whose material glows
by one output of a node.  The camera looks straight down, one sample to a pixel's middle.
"""

import math

import bpy
import numpy as np
from carried_rows import FAMILIES

LATER = {"base", "convention"}  # choices that Blender 4.2 does not offer
TILE, SIDE, OFFSET = 24, 0.4, 8.0  # pixels, metres, added so that the light is positive


def render(family, folder):
    """Return both pictures (H, W, 3) of a family's rows, the upper row of pixels first."""
    import penumbra

    penumbra.register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    rows = FAMILIES[family]()
    scene = bpy.context.scene
    across = math.ceil(math.sqrt(len(rows)))
    down = math.ceil(len(rows) / across)
    pictures = make_pictures(folder) if family != "carried" else {}
    view_layer = bpy.context.view_layer
    view_layer["own"], scene["own 3"], view_layer["own 4"] = (
        0.3,
        (0.1, 0.5, 0.8),
        (0.1, 0.2, 0.3, 0.4),
    )
    for k, (kind, output, properties, inputs, shape) in enumerate(rows.values()):
        at = ((k % across - (across - 1) / 2) * SIDE, ((down - 1) / 2 - k // across) * SIDE, 0)
        thing = put(shape, k, at)
        material = bpy.data.materials.new(f"Row {k}")
        thing.data.materials.append(material)
        tree = with_nodes(material)
        node = plant(tree, kind, properties, inputs, pictures)
        show(tree, next(socket for socket in node.outputs if socket.identifier == output))
        if shape.endswith("displaced"):
            displace(material)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.ortho_scale = "ORTHO", max(across, down) * SIDE
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.location = (0, 0, 3)
    scene.collection.objects.link(scene.camera)
    scene.render.resolution_x, scene.render.resolution_y = across * TILE, down * TILE
    scene.frame_set(3)
    return shots(scene, folder)


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
    taken = []
    for engine in ("CYCLES", "PENUMBRA"):
        render.engine = engine
        render.filepath = str(folder / f"{engine}.exr")
        bpy.ops.render.render(write_still=True)
        taken.append(OpenImageIO.ImageBuf(render.filepath).get_pixels()[..., :3].copy())
    return taken


def with_nodes(datablock):
    if datablock.node_tree is None or bpy.app.version < (5, 0):
        datablock.use_nodes = True
    datablock.node_tree.nodes.clear()
    return datablock.node_tree


def put(shape, k, at):
    """Put the object of a tile."""
    h = 0.42 * SIDE
    points = [(-h, -h, 0), (h, -h, 0.12), (h, h, 0.28), (-h, h, 0.04), (0.06, 0.05, 0.15)]
    faces = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
    if shape == "plain":
        points, faces = [(x, y, 0) for x, y, _ in points[:4]], [(0, 1, 2, 3)]
    elif shape == "ngon":
        points = [(x, y, 0) for x, y, _ in points[:4]] + [(-1.2 * h, 0, 0)]
        faces = [(0, 1, 2, 3, 4)]
    if shape.endswith("behind"):
        faces = [face[::-1] for face in faces]
    mesh = bpy.data.meshes.new(f"Mesh {k}")
    mesh.from_pydata(points, [], faces)
    is_smooth = [shape.startswith(("smooth", "sharp"))] * len(faces)
    is_smooth[-1] &= not shape.startswith("sharp")
    mesh.polygons.foreach_set("use_smooth", is_smooth)
    if not shape.endswith("bare"):
        carry(mesh)
    thing = bpy.data.objects.new(f"Tile {k}", mesh)
    thing.location = at
    if shape not in ("plain", "ngon"):
        thing.rotation_euler = (0.2, -0.15, 0.5)
        thing.scale = (-0.8, 0.7, 0.5) if "mirrored" in shape else (0.8, 0.7, 0.5)
        if "displaced" in shape:  # Cycles does not carry their normals before it mixes them
            thing.scale = (-0.7 if "mirrored" in shape else 0.7, 0.7, 0.7)
    thing.color = (0.2, 0.5, 0.7, 0.6)
    thing["own"], thing["own 3"], thing.data["own 4"] = 0.7, (0.2, 0.6, 0.9), (0.4, 0.3, 0.2, 0.1)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def displace(material):
    """Let a material displace its mesh, by a number that vertices carry."""
    tree = material.node_tree
    node = add(tree, "Displacement", _carried(tree, {}), space="OBJECT")
    node.inputs["Scale"].default_value = 0.2
    end = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], end.inputs["Displacement"])
    material.displacement_method = "DISPLACEMENT"


def carry(mesh):
    """Give a mesh UV maps, colours and attributes of all sorts."""
    random = np.random.default_rng(len(mesh.vertices))
    corners = np.array([mesh.vertices[loop.vertex_index].co[:2] for loop in mesh.loops])
    for name, scale in (("UVMap", 2.1), ("Second", -1.3)):
        layer = mesh.uv_layers.new(name=name)
        uv = corners * scale + 0.45 + random.random((len(corners), 2)) * 0.1
        layer.data.foreach_set("uv", uv.astype(np.float32).ravel())
    mesh.uv_layers["UVMap"].active_render = True
    count = {"POINT": len(mesh.vertices), "CORNER": len(mesh.loops), "FACE": len(mesh.polygons)}
    for name, kind, domain, field, width in (
        ("float", "FLOAT", "POINT", "value", 1),
        ("integer", "INT", "POINT", "value", 1),
        ("switch", "BOOLEAN", "FACE", "value", 1),
        ("plane", "FLOAT2", "POINT", "vector", 2),
        ("vector", "FLOAT_VECTOR", "CORNER", "vector", 3),
        ("face", "FLOAT_COLOR", "FACE", "color", 4),
        ("Corner", "FLOAT_COLOR", "CORNER", "color", 4),
        ("Byte", "BYTE_COLOR", "CORNER", "color", 4),
    ):
        made = mesh.attributes.new(name, kind, domain)
        values = random.random(count[domain] * width)
        if kind in ("INT", "BOOLEAN"):
            values = (values * 4).astype(np.int32) > 1 if kind == "BOOLEAN" else np.rint(values * 4)
            values = values.astype(np.int32 if kind == "INT" else bool)
        made.data.foreach_set(field, values if values.dtype != float else values.astype(np.float32))
    mesh.color_attributes.render_color_index = list(mesh.color_attributes.keys()).index("Byte")


def make_pictures(folder):
    """Write small pictures; return images by name."""
    import OpenImageIO as oiio

    random = np.random.default_rng(1)
    colour = random.random((6, 10, 3)).astype(np.float32)
    alpha = np.concatenate([colour, random.random((6, 10, 1), np.float32)], axis=2)
    alpha[2:4, 3:6, 3] = 0
    files = {
        "byte.png": colour,
        "alpha.png": alpha,
        "float.exr": colour * 3,
        "grey.png": colour[..., :1],
    }
    files["premul.exr"] = np.concatenate([colour * alpha[..., 3:], alpha[..., 3:]], axis=2)
    for n in (1001, 1002, 1012):
        files[f"tile.{n}.png"] = np.roll(colour, n, axis=1)
    for n in range(1, 6):
        files[f"frame{n:03}.png"] = np.roll(colour, n, axis=0)
    for name, pixels in files.items():
        kind = "uint8" if name.endswith("png") else "float"
        spec = oiio.ImageSpec(10, 6, pixels.shape[2], kind)
        spec.attribute("oiio:UnassociatedAlpha", int(name == "alpha.png"))
        file = oiio.ImageOutput.create(str(folder / name))
        file.open(str(folder / name), spec)
        file.write_image(np.ascontiguousarray(pixels))
        file.close()

    def load(name):
        return bpy.data.images.load(str(folder / name), check_existing=False)

    made = {name.split(".")[0]: load(name) for name in files if "tile" not in name}
    made["data"] = load("byte.png")
    made["data"].colorspace_settings.name = "Non-Color"
    for name, mode in (("channels", "CHANNEL_PACKED"), ("none", "NONE")):
        made[name] = load("alpha.png")
        made[name].alpha_mode = mode
    made["packed"] = load("alpha.png")
    made["packed"].pack()
    made["generated"] = bpy.data.images.new("Generated", 32, 16)
    made["generated"].generated_type = "COLOR_GRID"
    made["missing"] = bpy.data.images.new("Lost", 1, 1)
    made["missing"].source, made["missing"].filepath = "FILE", str(folder / "missing.png")
    made["tiles"] = load("tile.1001.png")
    made["tiles"].source = "TILED"
    made["tiles"].filepath = str(folder / "tile.<UDIM>.png")
    for n in (1002, 1012):
        if n not in [tile.number for tile in made["tiles"].tiles]:
            made["tiles"].tiles.new(n)
    made["sequence"] = load("frame001.png")
    made["sequence"].source = "SEQUENCE"
    return made


def plant(tree, kind, properties, inputs, pictures):
    """Put the row's node into a tree, with what feeds it."""
    node = tree.nodes.new(f"ShaderNode{kind}")
    properties = dict(properties)
    legacy, both = properties.pop("legacy", None), properties.pop("both", False)
    for name, value in properties.items():
        if name in LATER and not hasattr(node, name):
            continue
        setattr(node, name, pictures[value] if name == "image" else value)
    if properties.get("image") == "sequence":
        user = node.image_user
        user.frame_duration, user.frame_start, user.frame_offset = 5, 1, 1
    sockets = {socket.identifier: socket for socket in node.inputs}
    for name, value in inputs.items():
        if isinstance(value, str):
            tree.links.new(FEEDS[value](tree, pictures), sockets[name])
        else:
            sockets[name].default_value = value
    if both:
        # Using the Alpha output makes colours straight.
        mix = tree.nodes.new("ShaderNodeMixRGB")
        mix.name = "both"
        tree.links.new(node.outputs["Alpha"], mix.inputs["Fac"])
    if legacy:
        set_legacy(node.texture_mapping, legacy)
    return node


def set_legacy(mapping, how):
    mapping.rotation, mapping.scale = (0.1, 0.2, 0.6), (1.2, 0.7, 0.9)
    mapping.translation = (0.1, 0.3, -0.2)
    if how == "limits":
        mapping.use_min, mapping.min, mapping.max = True, (0.2, 0.3, 0), (0.6, 0.7, 1)
    elif how == "axes":
        mapping.mapping_x, mapping.mapping_y, mapping.mapping_z = "Y", "X", "NONE"
    else:
        mapping.vector_type = how


def add(tree, kind, source=None, **properties):
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in properties.items():
        setattr(node, name, value)
    if source is not None:
        tree.links.new(source, node.inputs[0])
    return node


def scaled(tree, source, by, plus):
    node = add(tree, "Mapping", source)
    node.inputs["Scale"].default_value, node.inputs["Location"].default_value = by, plus
    return node.outputs[0]


def _wide(tree, pictures):
    return scaled(tree, add(tree, "UVMap").outputs[0], (1.9, 1.7, 1), (-0.6, -0.5, 0.9))


def _aside(tree, pictures):
    return scaled(
        tree, add(tree, "TexCoord").outputs["Generated"], (0.5, 0.3, 0.4), (0.8, 0.1, 0.3)
    )


def _edge(tree, pictures):
    return scaled(tree, add(tree, "UVMap").outputs[0], (0.9, 0.8, 1), (-0.53, 0.67, 0))


def _tiles(tree, pictures):
    return scaled(tree, add(tree, "UVMap").outputs[0], (2.1, 1.9, 1), (-0.15, 0.03, 0))


def _object(tree, pictures):
    return scaled(
        tree, add(tree, "TexCoord").outputs["Generated"], (1.3, 1.2, 1.1), (0.2, 0.1, 0.3)
    )


def _colour(tree, pictures):
    where = scaled(tree, add(tree, "UVMap").outputs[0], (0.7, 0.5, 0), (0.1, 0.2, 0.8))
    mix = add(tree, "MixRGB")
    mix.inputs[0].default_value = 1.0
    tree.links.new(where, mix.inputs[2])
    return mix.outputs[0]


def _wave(tree, pictures):
    parts = add(
        tree, "SeparateXYZ", scaled(tree, add(tree, "NewGeometry").outputs[0], (7, 9, 5), (0, 0, 0))
    )
    sines = [add(tree, "Math", parts.outputs[k], operation="SINE") for k in range(2)]
    total = add(tree, "Math", sines[0].outputs[0], operation="ADD")
    tree.links.new(sines[1].outputs[0], total.inputs[1])
    return total.outputs[0]


def _height(tree, pictures):
    node = add(tree, "TexImage", image=pictures["data"], interpolation="Cubic")
    return node.outputs[0]


def _carried(tree, pictures):
    return add(tree, "Attribute", attribute_name="float").outputs["Fac"]


def _map(tree, pictures):
    node = add(tree, "NormalMap")
    tree.links.new(_colour(tree, pictures), node.inputs["Color"])
    return node.outputs[0]


FEEDS = {
    "wide": _wide,
    "edge": _edge,
    "aside": _aside,
    "tiles": _tiles,
    "object": _object,
    "P": _colour,
    "wave": _wave,
}
FEEDS |= {"picture": _height, "attribute": _carried, "map": _map}


def show(tree, output):
    """Let an output be seen as light, raised above 0."""
    mixed = tree.nodes.get("both")
    if mixed is not None:
        # The mix is of little effect but uses the Alpha output.
        mixed.inputs[1].default_value, mixed.inputs[2].default_value = (0, 0, 0, 1), (0, 0.01, 0, 1)
    light = tree.nodes.new("ShaderNodeEmission")
    raised = scaled(tree, output, (1, 1, 1), (OFFSET,) * 3)
    if mixed is not None:
        join = add(tree, "MixRGB", blend_type="ADD")
        join.inputs[0].default_value = 1.0
        tree.links.new(raised, join.inputs[1])
        tree.links.new(mixed.outputs[0], join.inputs[2])
        raised = join.outputs[0]
    tree.links.new(raised, light.inputs["Color"])
    tree.links.new(light.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
