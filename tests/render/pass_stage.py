"""a scene with everything -> its passes by both engines.  Runs inside of Blender only."""

import bpy
import mathutils
import numpy as np
import OpenImageIO

import penumbra

SIZE = 48
GROUPS = ("mesh", "lamp", "world")


def shaded(name, kind, **inputs):
    """Return a material of one shader node, and the node tree."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    node = tree.nodes.new(kind)
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    return material, tree, node


def put(operator, name, material, **where):
    operator(**where)
    item = bpy.context.object
    item.name = name
    item.data.materials.append(material)
    material.pass_index = 10 + len(bpy.data.objects)
    item.pass_index = len(bpy.data.objects)
    return item


def build():
    """Make the scene: matte, glossy, glass and glowing things, a veil, lamps, a world, groups."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    penumbra.register()
    scene, ops = bpy.context.scene, bpy.ops.mesh
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    camera.location = (5, -5, 4)
    way = mathutils.Vector((-5, 5, -3.5))
    camera.rotation_euler = way.to_track_quat("-Z", "Y").to_euler()
    scene.camera = camera
    floor, tree, _ = shaded("Floor", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.6, 0.7, 1))
    put(ops.primitive_plane_add, "Floor", floor, size=8)
    write_aov(tree, "Place", "Object")
    write_aov(tree, "Number", 0.75)
    kept = {"Metallic": 0.3, "Roughness": 0.4, "Coat_Weight": 0.5, "Transmission_Weight": 0.3}
    kept["Base_Color"] = (0.8, 0.2, 0.1, 1)
    paint, _, _ = shaded("Paint", "ShaderNodeBsdfPrincipled", **kept)
    ball = put(ops.primitive_uv_sphere_add, "Ball", paint, radius=1, location=(0, 0, 1.01))
    bpy.ops.object.shade_smooth()
    glass, _, _ = shaded("Glass", "ShaderNodeBsdfGlass", Roughness=0.3)
    put(ops.primitive_uv_sphere_add, "Glass", glass, radius=0.6, location=(1.5, -1, 0.61))
    bpy.ops.object.shade_smooth()
    veil, tree, mix = shaded("Veil", "ShaderNodeMixShader")
    for kind, colour, socket in (
        ("ShaderNodeBsdfTransparent", (0.5, 0.9, 0.9, 1), 1),
        ("ShaderNodeBsdfDiffuse", (0.2, 0.4, 0.6, 1), 2),
    ):
        part = tree.nodes.new(kind)
        part.inputs[0].default_value = colour
        tree.links.new(part.outputs[0], mix.inputs[socket])
    mix.inputs[0].default_value = 0.3
    where = {"location": (-1.2, -1.5, 1), "rotation": (1.57, 0, 0.3)}
    put(ops.primitive_plane_add, "Veil", veil, size=2, **where)
    glow, _, _ = shaded("Glow", "ShaderNodeEmission", Color=(1, 0.7, 0.3, 1), Strength=3)
    where = {"location": (-1, 2, 2.5), "rotation": (0.7, 0, 0)}
    put(ops.primitive_plane_add, "Glow", glow, size=1.5, **where).lightgroup = "mesh"
    metal, _, _ = shaded("Metal", "ShaderNodeBsdfAnisotropic", Roughness=0.4)
    where = {"location": (-3, 1, 1.5), "rotation": (0, 1.57, 0.3)}
    wall = put(ops.primitive_plane_add, "Wall", metal, size=3, **where)
    wall.parent, wall.matrix_parent_inverse = ball, ball.matrix_world.inverted()
    light()
    return scene


def write_aov(tree, name, source):
    node = tree.nodes.new("ShaderNodeOutputAOV")
    node.aov_name = name
    if isinstance(source, float):
        node.inputs["Value"].default_value = source
    else:
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        tree.links.new(coordinates.outputs[source], node.inputs["Color"])


def light():
    scene = bpy.context.scene
    for name, kind, energy, place in (
        ("Lamp", "POINT", 300, {"location": (2, -2, 4)}),
        ("Sun", "SUN", 1, {"rotation_euler": (0.5, 0.5, 0)}),
    ):
        lamp = bpy.data.lights.new(name, kind)
        lamp.energy = energy
        item = bpy.data.objects.new(name, lamp)
        for key, value in place.items():
            setattr(item, key, value)
        item.lightgroup = "lamp"
        scene.collection.objects.link(item)
    bpy.data.lights["Lamp"].shadow_soft_size = 0.3
    world = scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (0.2, 0.3, 0.5, 1)
    world.lightgroup = "world"
    world.mist_settings.start, world.mist_settings.depth = 4, 6


def ask(scene):
    """Ask for all passes that both engines have."""
    layer = scene.view_layers[0]
    left_out = ("vector", "shadow", "subsurface", "grease")
    for prop in layer.bl_rna.properties:
        name = prop.identifier
        if name.startswith("use_pass_") and not any(word in name for word in left_out):
            setattr(layer, name, True)
    for name, kind in (("Place", "COLOR"), ("Number", "VALUE")):
        aov = layer.aovs.add()
        aov.name, aov.type = name, kind
    for name in GROUPS:
        layer.lightgroups.add(name=name)
    for settings in (layer.penumbra, layer.cycles):
        settings.pass_debug_sample_count = settings.denoising_store_passes = True


def shot(scene, engine, samples, seed, path):
    """Render; return the passes (H, W, C) by name, the top row first, and the file's metadata."""
    render = scene.render
    render.engine = engine
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.penumbra.use_adaptive_sampling = scene.penumbra.use_denoising = False
    scene.cycles.device = "CPU"
    for settings in (scene.cycles, scene.penumbra):
        settings.samples, settings.seed = samples, seed
        settings.sample_clamp_direct = settings.sample_clamp_indirect = 0
        settings.blur_glossy = 0
    image = render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
    image.exr_codec = "ZIP"
    render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return read(path)


def read(path):
    """Return the passes of a multilayer EXR file, one picture or many in it, and its metadata."""
    file, channels, part = OpenImageIO.ImageInput.open(str(path)), {}, 0
    metadata = {each.name: each.value for each in file.spec().extra_attribs}
    while file.seek_subimage(part, 0):
        spec = file.spec()
        pixels = file.read_image(part, 0, 0, spec.nchannels, "float")
        for place, name in enumerate(spec.channelnames):
            *_, layer, letter = name.split(".")
            channels.setdefault(layer, {})[letter] = pixels[..., place]
        part += 1
    order = "RGBrgbXYZWUVAa".index
    passes = {
        name: np.stack([found[letter] for letter in sorted(found, key=order)], axis=-1)
        for name, found in channels.items()
    }
    return passes, metadata
