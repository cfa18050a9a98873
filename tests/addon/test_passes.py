"""Passes in Blender: the compositor, cryptomattes there, view layers and what each asks for."""

import numpy as np
import pytest


def matte(name, colour):
    from inside import shaded

    return shaded("ShaderNodeBsdfDiffuse", colour, name)


def two_squares():
    """A scene of two matte squares under a white world: Left, red, and Right, green."""
    import bpy
    from inside import add, empty_scene, mesh

    scene = empty_scene(8, 8)
    scene.penumbra.use_denoising = False
    scene.penumbra.max_bounces, scene.penumbra.samples = 0, 4
    scene.penumbra.pixel_filter_type = "BOX"
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 2
    world = scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    for name, x, colour in (("Left", -9, (1, 0, 0)), ("Right", 0, (0, 1, 0))):
        corners = [(x, -9, 0), (x + 9, -9, 0), (x + 9, 9, 0), (x, 9, 0)]
        square = mesh(name, corners, [(0, 1, 2, 3)])
        square.materials.append(matte(name, colour))
        group = bpy.data.collections.new(name)
        scene.collection.children.link(group)
        add(name, square, group)
    return scene


def composited(path):
    import bpy
    from inside import pixels, use_exr

    scene = two_squares()
    layer = scene.view_layers[0]
    layer.use_pass_diffuse_color = layer.use_pass_cryptomatte_object = True
    layer.use_pass_normal = True
    if bpy.app.version >= (5, 0):
        tree = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
        scene.compositing_node_group = tree
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        output = tree.nodes.new("NodeGroupOutput")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
        tree.nodes.clear()
        output = tree.nodes.new("CompositorNodeComposite")
    layers = tree.nodes.new("CompositorNodeRLayers")
    names = [socket.name for socket in layers.outputs if socket.enabled]
    found = {}

    def shot(socket, name):
        tree.links.new(socket, output.inputs[0])
        use_exr(scene, path / f"{name}.exr")
        bpy.ops.render.render(write_still=True)
        found[name] = pixels(path / f"{name}.exr")

    colour = "DiffCol" if bpy.app.version < (5, 0) else "Diffuse Color"
    shot(layers.outputs[colour], "colour")
    crypto = tree.nodes.new("CompositorNodeCryptomatteV2")
    crypto.source, crypto.scene = "RENDER", scene
    crypto.matte_id = "Right"
    shot(crypto.outputs["Matte"], "matte")
    return names, found


@pytest.fixture(scope="module")
def compositor(blender, tmp_path_factory):
    return blender(composited, tmp_path_factory.mktemp("compositor"))


def test_the_compositor_offers_the_passes_of_the_layer(compositor):
    names, _ = compositor
    assert {"Image", "Alpha", "Normal"} <= set(names)
    assert "Mist" not in names
    assert any(name in names for name in ("DiffCol", "Diffuse Color"))


def test_the_compositor_gets_the_pixels_of_passes(compositor):
    _, found = compositor
    assert (found["colour"][:, :4, :3] == (1, 0, 0)).all()
    assert (found["colour"][:, 4:, :3] == (0, 1, 0)).all()


def test_blenders_cryptomatte_node_finds_an_object_by_its_name(compositor):
    _, found = compositor
    assert (found["matte"][:, 4:, 0] == 1).all()
    assert (found["matte"][:, :4, 0] == 0).all()


def many_layers(path):
    import bpy
    from inside import use_exr
    from pass_files import read_layers

    from penumbra.addon import report

    scene = two_squares()
    report.clear()
    first = scene.view_layers[0]
    first.name, first.use_pass_z, first.samples = "First", True, 3
    names = ("Covered", "Excluded", "Held", "Indirect", "Empty", "Dark")
    layers = {name: scene.view_layers.new(name) for name in names}
    for layer in layers.values():
        layer.use_pass_z = False
    layers["Covered"].material_override = matte("Blue", (0, 0, 1))
    layers["Excluded"].layer_collection.children["Right"].exclude = True
    layers["Held"].layer_collection.children["Right"].holdout = True
    layers["Indirect"].layer_collection.children["Right"].indirect_only = True
    layers["Empty"].use_solid = False
    layers["Dark"].use_sky = False
    layers["Dark"].use_pass_environment = True
    layers["Held"].use_pass_cryptomatte_object = True
    use_exr(scene, path / "layers.exr", multilayer=True)
    bpy.ops.render.render(write_still=True)
    samples = {frame["view_layer"]: frame["samples"] for frame in report.frames}
    return read_layers(path / "layers.exr"), samples


@pytest.fixture(scope="module")
def layers(blender, tmp_path_factory):
    return blender(many_layers, tmp_path_factory.mktemp("layers"))


def test_each_layer_has_the_passes_it_asks_for_and_no_others(layers):
    found, _ = layers
    passes = {}
    for layer, name in found:
        passes.setdefault(layer, set()).add(name)
    environment = {"Environment", "Env"}
    assert passes["First"] == {"Combined", "Depth"}
    assert passes["Covered"] == passes["Excluded"] == {"Combined"}
    assert len(passes["Dark"] & environment) == 1
    assert passes["Held"] == {"Combined", *(f"CryptoObject{i:02}" for i in range(3))}


def test_each_layer_has_its_own_samples(layers):
    _, samples = layers
    assert samples["First"] == 3
    assert samples["Covered"] == 4


def test_layers_override_exclude_hold_out_and_hide(layers):
    found, _ = layers
    red, green, blue, white, none = (1, 0, 0, 1), (0, 1, 0, 1), (0, 0, 1, 1), (1,) * 4, (0,) * 4
    for layer, left, right in (
        ("First", red, green),
        ("Covered", blue, blue),
        ("Excluded", red, white),
        ("Held", red, none),
        ("Indirect", red, white),
        ("Empty", white, white),
        ("Dark", (0, 0, 0, 1), (0, 0, 0, 1)),
    ):
        picture = found[layer, "Combined"]
        np.testing.assert_allclose(picture[:, 1], [left] * 8, atol=1e-5, err_msg=layer)
        np.testing.assert_allclose(picture[:, 6], [right] * 8, atol=1e-5, err_msg=layer)


def asks_for_much():
    from inside import exported

    scene = two_squares()
    layer = scene.view_layers[0]
    layer.use_pass_subsurface_color = layer.use_pass_normal = True
    layer.aovs.add().name = "Mine"
    described, _ = exported()
    return [(note.owner, note.what) for note in described.notes], described.layer


def test_a_pass_that_is_not_drawn_is_named(blender):
    notes, layer = blender(asks_for_much)
    assert notes == [("View layer 'ViewLayer'", "pass Subsurface Color is not drawn")]
    assert layer.passes == ("Normal",)
    assert layer.aovs == (("Mine", True),)


def asks_cycles(store, catches, denoises):
    import bpy
    from inside import exported

    scene = two_squares()
    layer = scene.view_layers[0]
    scene.penumbra.use_denoising = denoises
    layer.penumbra.denoising_store_passes = store
    layer.penumbra.use_pass_shadow_catcher = catches
    layer.cycles.use_pass_volume_direct = store
    described, _ = exported()
    return {note.what for note in described.notes}, described.layer.passes, bpy.app.version


def test_passes_that_only_cycles_has_are_named(blender):
    notes, _, version = blender(asks_cycles, True, False, False)
    expected = {"pass Volume Direct is not drawn"}
    if version >= (5, 2):
        names = "Denoising Roughness", "Denoising Specular Albedo"
        expected |= {f"pass {name} is not drawn" for name in names}
    assert notes == expected


def test_a_shadow_catcher_pass_has_a_noisy_one_beside_it_where_the_picture_is_denoised(blender):
    notes, passes, _ = blender(asks_cycles, False, True, True)
    assert passes == ("Noisy Image", "Shadow Catcher", "Noisy Shadow Catcher")
    assert "pass Shadow Catcher is not denoised" in notes
    notes, passes, _ = blender(asks_cycles, False, True, False)
    assert passes == ("Shadow Catcher",) and not notes


def from_cycles():
    from penumbra.addon.properties import adopt_cycles

    scene = two_squares()
    scene.view_layers[0].cycles.use_pass_shadow_catcher = True
    names = adopt_cycles(scene)
    return names, scene.view_layers[0].penumbra.use_pass_shadow_catcher


def test_what_cycles_asks_of_a_layer_is_taken_over(blender):
    names, is_on = blender(from_cycles)
    assert "use_pass_shadow_catcher" in names
    assert is_on
