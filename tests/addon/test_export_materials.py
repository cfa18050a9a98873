"""Node trees become DAGs that say what the material says, and nothing of how it is drawn."""

import pytest

from penumbra.core.scene import Link, Node


def show(socket):
    """Return a socket as nested plain data: constants, or (kind, output, {inputs it has set})."""
    if isinstance(socket, Link):
        return socket.node.kind, socket.output
    return socket


def materials():
    import bpy
    from inside import add, empty_scene, exported, mesh

    empty_scene()
    made = {}

    def material(name):
        data = bpy.data.materials.new(name)
        if bpy.app.version < (5, 0):
            data.use_nodes = True
        tree = data.node_tree
        item = mesh(name)
        item.materials.append(data)
        add(name, item)
        made[name] = data
        principled = tree.nodes["Principled BSDF"]
        return tree, tree.nodes.new, tree.links.new, principled

    def constant_group(name, kind, value, way_in=True):
        """Make a group whose input is handed to its output through a reroute."""
        group = bpy.data.node_groups.new(name, "ShaderNodeTree")
        for way in ("INPUT", "OUTPUT"):
            group.interface.new_socket("Thing", in_out=way, socket_type=kind)
        into, out = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
        reroute = group.nodes.new("NodeReroute")
        group.links.new(into.outputs[0], reroute.inputs[0])
        group.links.new(reroute.outputs[0], out.inputs[0])
        return group

    # Constants and properties
    _, new, link, principled = material("Plain")
    principled.inputs["Base Color"].default_value = (0.1, 0.2, 0.3, 1)
    principled.inputs["Roughness"].default_value = 0.25
    principled.distribution = "GGX"

    # One node used twice, reached through reroutes; properties of several types
    _, new, link, principled = material("Shared")
    noise, reroute = new("ShaderNodeTexNoise"), new("NodeReroute")
    noise.noise_dimensions = "4D"
    link(noise.outputs["Color"], reroute.inputs[0])
    link(reroute.outputs[0], principled.inputs["Base Color"])
    link(noise.outputs[0], principled.inputs["Roughness"])

    # Muted: a link that does not count, a node that hands through
    _, new, link, principled = material("Muted")
    rgb, invert = new("ShaderNodeRGB"), new("ShaderNodeInvert")
    rgb.outputs[0].default_value = (0.7, 0.6, 0.5, 1)
    link(rgb.outputs[0], invert.inputs["Color"])
    invert.mute = True
    link(invert.outputs[0], principled.inputs["Base Color"])
    value = new("ShaderNodeValue")
    link(value.outputs[0], principled.inputs["Roughness"]).is_muted = True
    dead = new("ShaderNodeTexNoise")
    dead.mute = True
    link(dead.outputs[0], principled.inputs["Metallic"])

    # Groups: two uses of one group differ, nested, a constant that changes its type on the way
    _, new, link, principled = material("Grouped")
    colour = constant_group("Through", "NodeSocketColor", None)
    outer = constant_group("Outer", "NodeSocketColor", None)
    nested = outer.nodes.new("ShaderNodeGroup")
    nested.node_tree = colour
    into, out = outer.nodes["Group Input"], outer.nodes["Group Output"]
    outer.links.new(into.outputs[0], nested.inputs[0])
    outer.links.new(nested.outputs[0], out.inputs[0])
    for index, name in enumerate(("Base Color", "Emission Color", "Roughness")):
        node = new("ShaderNodeGroup")
        node.node_tree = outer
        node.inputs[0].default_value = (0.1 * index, 0.2, 0.3, 1)
        link(node.outputs[0], principled.inputs[name])
    through = new("ShaderNodeGroup")
    through.node_tree = outer
    value = new("ShaderNodeValue")
    value.outputs[0].default_value = 0.9
    link(value.outputs[0], through.inputs[0])
    link(through.outputs[0], principled.inputs["Metallic"])

    # A shader inside of a group, one group used twice with other inputs
    tree, new, link, principled = material("ShaderGroup")
    group = bpy.data.node_groups.new("Paint", "ShaderNodeTree")
    group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    diffuse = group.nodes.new("ShaderNodeBsdfDiffuse")
    group.links.new(group.nodes.new("NodeGroupInput").outputs[0], diffuse.inputs["Color"])
    group.links.new(diffuse.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    mix = new("ShaderNodeMixShader")
    for index in (1, 2):
        use = new("ShaderNodeGroup")
        use.node_tree = group
        use.inputs[0].default_value = (index / 2, 0, 0, 1)
        link(use.outputs[0], mix.inputs[index])
    link(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])

    # Outputs: the one for Cycles wins; none at all; a volume is told
    tree, new, link, principled = material("Outputs")
    tree.nodes["Material Output"].target = "EEVEE"
    output, emission = new("ShaderNodeOutputMaterial"), new("ShaderNodeEmission")
    output.target = "CYCLES"
    link(emission.outputs[0], output.inputs["Surface"])
    link(new("ShaderNodeVolumeScatter").outputs[0], output.inputs["Volume"])
    link(new("ShaderNodeDisplacement").outputs[0], output.inputs["Displacement"])
    tree, *_ = material("Nothing")
    tree.nodes.clear()

    # Bent normals: whose light is softened, and whose not
    material("Soft")
    material("Hard")
    made["Hard"].cycles.use_bump_map_correction = False

    # A chain far longer than Python's stack
    _, new, link, principled = material("Chain")
    last = new("ShaderNodeGamma")
    link(new("ShaderNodeTexCoord").outputs["Object"], last.inputs["Color"])  # not a constant
    for _ in range(1500):
        node = new("ShaderNodeGamma")
        link(last.outputs[0], node.inputs["Color"])
        last = node
    link(last.outputs[0], principled.inputs["Base Color"])

    if bpy.app.version < (5, 0):
        bare = bpy.data.materials.new("Bare")
        bare.diffuse_color = (0.2, 0.4, 0.6, 1)
        item = mesh("Bare")
        item.materials.append(bare)
        add("Bare", item)

    scene, _ = exported()
    chain = next(i for i in scene.instances if i.name == "Chain").materials[0].surface
    length = 0
    while "Base Color" in chain.inputs or "Color" in chain.inputs:
        following = chain.inputs.get("Base Color") or chain.inputs["Color"]
        if not hasattr(following, "node"):
            break
        chain, length = following.node, length + 1
    kept = {i.name: i.materials[0] for i in scene.instances if i.name != "Chain"}
    notes = [(note.owner, note.what) for note in scene.notes]
    return kept, notes, length, bpy.app.version


@pytest.fixture(scope="module")
def exported(blender):
    return blender(materials)


def surface(exported, name) -> Node:
    return exported[0][name].surface


def test_constants_and_properties_are_read_by_identifier(exported):
    node = surface(exported, "Plain")
    assert node.kind == "BsdfPrincipled"
    assert node.inputs["Base Color"] == pytest.approx((0.1, 0.2, 0.3))
    assert node.inputs["Roughness"] == 0.25
    assert node.inputs["Normal"] is None
    choices = {"distribution": "GGX", "subsurface_method": "RANDOM_WALK"}
    old = {"films_metal": False} if exported[-1] < (5, 0) else {}
    assert node.properties == choices | old


def test_a_node_used_twice_is_one_node(exported):
    node = surface(exported, "Shared")
    first, second = node.inputs["Base Color"], node.inputs["Roughness"]
    assert isinstance(first, Link)
    assert first.node is second.node
    assert first.node.kind == "TexNoise"
    assert first.node.properties["noise_dimensions"] == "4D"
    assert first.node.properties["normalize"] is True
    assert first.node.inputs["Vector"] is None
    assert first.default == pytest.approx((0.8, 0.8, 0.8))
    assert second.default == 0.5


def test_muted_links_and_nodes_are_not_there(exported):
    node = surface(exported, "Muted")
    base = node.inputs["Base Color"]
    assert show(base) == ("RGB", "Color")
    assert base.node.properties["Color"] == pytest.approx((0.7, 0.6, 0.5))
    assert node.inputs["Roughness"] == 0.5
    assert node.inputs["Metallic"] == 0.0


def test_groups_are_gone_and_their_inputs_arrive_by_value_or_link(exported):
    node = surface(exported, "Grouped")
    assert node.inputs["Base Color"] == pytest.approx((0.0, 0.2, 0.3))
    assert node.inputs["Emission Color"] == pytest.approx((0.1, 0.2, 0.3))
    roughness, metallic = node.inputs["Roughness"], node.inputs["Metallic"]
    if isinstance(roughness, Link):
        assert show(roughness) == ("RGB", "Color")
        assert roughness.node.properties["Color"] == pytest.approx((0.2, 0.2, 0.3))
        assert roughness.default == 0.5
        assert show(metallic) == ("Value", "Value")
        assert metallic.node.properties["Value"] == pytest.approx(0.9)
    else:
        assert roughness == pytest.approx(0.2 * 0.92783 + 0.3 * 0.07217, abs=1e-5)
        assert metallic == pytest.approx(0.9)  # Blender 5 folds constants itself


def test_two_uses_of_a_group_are_two_shaders(exported):
    mix = surface(exported, "ShaderGroup")
    shaders = [socket.node for socket in mix.inputs.values() if isinstance(socket, Link)]
    assert [shader.kind for shader in shaders] == ["BsdfDiffuse", "BsdfDiffuse"]
    assert [shader.inputs["Color"] for shader in shaders] == [(0.5, 0, 0), (1, 0, 0)]


def test_the_output_for_cycles_counts_and_what_else_it_has_is_noted(exported):
    assert surface(exported, "Outputs").kind == "Emission"
    assert surface(exported, "Nothing") is None
    notes = exported[1]
    assert [owner for owner, _ in notes] == ["Material 'Outputs'"]
    assert "volume" in notes[0][1]


def test_a_long_chain_of_nodes_does_not_overflow_the_stack(exported):
    assert exported[2] == 1502


def test_light_on_bent_normals_is_softened_as_this_version_of_cycles_does(exported):
    materials, *_, version = exported
    assert materials["Hard"].bump_softening == "NONE"
    assert materials["Soft"].bump_softening == ("CUBIC" if version < (4, 5) else "MICROFACET")
    assert materials["Soft"].bump_width == (1.0 if version < (4, 4) else 0.1)


def test_a_material_without_nodes_is_diffuse(exported):
    if "Bare" in exported[0]:
        bare = surface(exported, "Bare")
        assert bare.kind == "BsdfDiffuse"
        assert bare.inputs["Color"] == pytest.approx((0.2, 0.4, 0.6))
