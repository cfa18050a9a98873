"""Nodes that trace rays at random show in the mean what Cycles shows.

For each row a few solids stand close together; the picture of all rows is made several times by
both engines, with other seeds, and blocks of 8 x 8 pixels are compared by Welch's t, at a
significance of about 1 % over all blocks of all rows.
"""

import math

import numpy as np
import pytest

from penumbra.tests.nodes.traced_rows import ROWS

SIZE, BLOCK, SEEDS, SAMPLES = 48, 8, 8, 4
SIDE = 4.5  # from stand to stand [m]
# A bevel makes the sum of a few normals unit: how few samples are spread changes its mean
BIAS = 2e-3
SIGMAS = 7.0  # of Welch's t with some 10 degrees of freedom: 4e-5 for a block, 1 % for all


def render(folder):
    """Return pictures (engines, seeds, SIZE, SIZE, 3) by row, all of a world in one."""
    import bpy

    import penumbra

    penumbra.register()
    found = {}
    for world in sorted({choices.get("world", 0.0) for _, _, choices in ROWS.values()}):
        rows = {k: row for k, row in ROWS.items() if row[2].get("world", 0.0) == world}
        across = math.ceil(math.sqrt(len(rows)))
        down = math.ceil(len(rows) / across)
        scene = look(bpy, across, down)
        if world:
            scene.world = bpy.data.worlds.new("World")
            scene.world.light_settings.distance = world
        for k, (kind, output, choices) in enumerate(rows.values()):
            row, column = divmod(k, across)
            at = ((column - (across - 1) / 2) * SIDE, ((down - 1) / 2 - row) * SIDE, 0)
            tree = stand(bpy, scene, at)
            show(tree, plant(tree, kind, choices).outputs[output])
        pictures = np.array(shots(bpy, scene, folder))
        tiles = pictures.reshape(2, SEEDS, down, SIZE, across, SIZE, 3).swapaxes(3, 4)
        tiles = tiles.reshape(2, SEEDS, down * across, SIZE, SIZE, 3)
        found |= {name: tiles[:, :, k] for k, name in enumerate(rows)}
    return found


def look(bpy, across, down):
    """Return a new scene whose camera looks at so many stands, from aside."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    data = bpy.data.cameras.new("Camera")
    data.type, data.ortho_scale = "ORTHO", max(across, down) * SIDE
    camera = bpy.data.objects.new("Camera", data)
    camera.location = (0, 0, 9)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.cycles.device = "CPU"
    image = scene.render.image_settings
    image.file_format, image.color_depth = "OPEN_EXR", "32"
    scene.render.resolution_x, scene.render.resolution_y = across * SIZE, down * SIZE
    return scene


def shots(bpy, scene, folder):
    """Return what both engines make of a scene, with one seed after the other."""
    import OpenImageIO

    pictures = []
    for engine, settings in (("CYCLES", scene.cycles), ("PENUMBRA", scene.penumbra)):
        scene.render.engine = engine
        settings.samples = SAMPLES
        settings.pixel_filter_type = "BOX"
        for seed in range(SEEDS):
            settings.seed = seed
            scene.render.filepath = str(folder / "picture.exr")
            bpy.ops.render.render(write_still=True)
            pixels = OpenImageIO.ImageBuf(scene.render.filepath).get_pixels()
            pictures.append(pixels[..., :3].copy())
    down, across = pixels.shape[:2]
    return np.array(pictures).reshape(2, SEEDS, down, across, 3)


def stand(bpy, scene, at):
    """Put a floor, a cube and a mirrored sphere, all turned; return the empty tree of all three."""
    import bmesh
    import mathutils

    turn = mathutils.Euler((-0.7, 0.4, 0.3)).to_matrix().to_4x4()
    material = bpy.data.materials.new("M")
    if material.node_tree is None:
        material.use_nodes = True
    material.node_tree.nodes.clear()
    scale, rotation = mathutils.Matrix.Diagonal((-1, 1, 1, 1)), mathutils.Euler((0.3, 0.2, 0.5))
    places = (
        mathutils.Matrix(),
        mathutils.Matrix.Translation((0, 0, 0.5)) @ rotation.to_matrix().to_4x4(),
        mathutils.Matrix.Translation((1.2, 0.3, 0.3)) @ scale,
    )
    for k, place in enumerate(places):
        mesh, made = bpy.data.meshes.new("Solid"), bmesh.new()
        if k == 0:
            bmesh.ops.create_grid(made, x_segments=1, y_segments=1, size=1.7)
        elif k == 1:
            bmesh.ops.create_cube(made, size=1.2)
        else:
            bmesh.ops.create_uvsphere(made, u_segments=32, v_segments=16, radius=0.5)
        made.to_mesh(mesh)
        made.free()
        mesh.polygons.foreach_set("use_smooth", [k == 2] * len(mesh.polygons))
        mesh.materials.append(material)
        solid = bpy.data.objects.new("Solid", mesh)
        solid.matrix_world = mathutils.Matrix.Translation(at) @ turn @ place
        scene.collection.objects.link(solid)
    return material.node_tree


def plant(tree, kind, choices):
    """Put a row's node into a tree."""
    node = tree.nodes.new(f"ShaderNode{kind}")
    for key, value in choices.items():
        if key == "Normal":
            link_vector(tree, value, node.inputs["Normal"])
        elif key[0].isupper():
            node.inputs[key].default_value = value
        elif key != "world":
            setattr(node, key, value)
    return node


def link_vector(tree, vector, socket):
    node = tree.nodes.new("ShaderNodeCombineXYZ")
    for number, part in zip(vector, node.inputs, strict=True):
        part.default_value = number
    tree.links.new(node.outputs[0], socket)


def show(tree, output):
    """Let an output of either sign be seen as light."""
    raised = tree.nodes.new("ShaderNodeVectorMath")
    raised.operation = "MULTIPLY_ADD"
    raised.inputs[1].default_value, raised.inputs[2].default_value = (0.5,) * 3, (0.6,) * 3
    light, end = (tree.nodes.new(f"ShaderNode{k}") for k in ("Emission", "OutputMaterial"))
    tree.links.new(output, raised.inputs[0])
    tree.links.new(raised.outputs[0], light.inputs["Color"])
    tree.links.new(light.outputs[0], end.inputs["Surface"])


@pytest.fixture(scope="module")
def pictures(blender, tmp_path_factory):
    return blender(render, tmp_path_factory.mktemp("traced"))


@pytest.mark.parametrize("name", ROWS)
def test_the_mean_is_that_of_cycles(pictures, name):
    count = SIZE // BLOCK
    blocks = pictures[name].reshape(2, SEEDS, count, BLOCK, count, BLOCK, 3).mean(axis=(3, 5))
    mean, variance = blocks.mean(axis=1), blocks.var(axis=1, ddof=1) / SEEDS
    assert np.ptp(mean[0]) > 0.05 or name.endswith("none")
    miss = np.abs(mean[1] - mean[0]) - BIAS * name.startswith("bevel")
    assert (miss / np.sqrt(variance.sum(axis=0) + 1e-8)).max() < SIGMAS
