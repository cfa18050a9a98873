"""built benchmark scenes -> counts.  Each holds what its name and the README promise."""

import pytest

from penumbra.benchmarks.scenes import EXAMPLES, SCENES

BUILT = [s.name for s in SCENES if not s.example and s.reference]

# Least and most triangles, triangles that glow, lamps.
CONTENT = {
    "glossy_interior": ((30_000, 50_000), 0, 5),
    "glass": ((30_000, 60_000), 0, 2),
    "many_lights": ((100_000, 200_000), 0, 1000),
    "many_emitters": ((150_000, 200_000), 100_000, 0),
    "hdri_object": ((30_000, 50_000), 0, 0),
    "emissive_mesh": ((10_000, 20_000), 9_684, 0),
    "materials-constant": ((10_000, 20_000), 0, 1),
    "materials-image": ((10_000, 20_000), 0, 1),
    "materials-pbr": ((10_000, 20_000), 0, 1),
    "materials-procedural": ((10_000, 20_000), 0, 1),
    "materials-many": ((2_400, 2_400), 0, 1),
    "materials-one": ((2_400, 2_400), 0, 1),
}
MATERIALS = {"materials-many": 200, "materials-one": 200}  # no less than these


def build_and_count(name):
    import bpy

    from penumbra.benchmarks import built

    built.build(name)
    scene = bpy.context.scene
    triangles = glowing = 0
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        if instance.object.type not in {"MESH", "FONT"}:
            continue
        mesh = instance.object.to_mesh()
        mesh.calc_loop_triangles()
        kinds = {
            node.type
            for slot in instance.object.material_slots
            for node in slot.material.node_tree.nodes
        }
        triangles += len(mesh.loop_triangles)
        glowing += len(mesh.loop_triangles) * ("EMISSION" in kinds)
        instance.object.to_mesh_clear()
    lamps = sum(item.type == "LIGHT" for item in scene.objects)
    same = [
        getattr(engine, limit)
        for engine in (scene.cycles, scene.penumbra)
        for limit in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces")
    ]
    size = scene.render.resolution_x, scene.render.resolution_y
    counts = triangles, glowing, lamps, len(bpy.data.materials)
    return counts, same, size, scene.camera is not None


def test_the_table_has_all_built_scenes():
    assert list(CONTENT) == BUILT


@pytest.mark.parametrize("name", BUILT)
def test_a_built_scene_holds_what_is_promised(blender, name):
    (least, most), emitting, lights = CONTENT[name]
    counts, same, (width, height), has_camera = blender(build_and_count, name)
    triangles, glowing, lamps, materials = counts
    assert least <= triangles <= most
    assert (glowing, lamps) == (emitting, lights)
    assert materials >= MATERIALS.get(name, 1)
    assert same == [12, 4, 4, 12] * 2, "both engines have Blender's own bounce limits"
    assert 50_000 <= width * height <= 130_000
    assert has_camera


def describe_states(blend):
    """What the core is told of each state of each feature of the cost table."""
    import bpy
    from inside import exported

    import penumbra
    from penumbra.benchmarks import costs

    penumbra.register()
    found = {}
    for feature in costs.FEATURES:
        for state in feature.states():
            bpy.ops.wm.open_mainfile(filepath=str(blend))
            scene = bpy.context.scene
            scene.render.engine, scene.render.use_motion_blur = "PENUMBRA", False
            scene.penumbra.use_denoising = scene.penumbra.use_adaptive_sampling = False
            scene.penumbra.pixel_filter_type = "BOX"
            feature.apply(state, scene)
            told, settings = exported()
            view = told.camera
            found[feature.name, state] = (
                repr((told.layer, told.film_transparent, view.aperture, view.panorama, settings)),
                bool(view.motion) or any(each.moves for each in told.instances),
            )
    return {each.name: each.states() for each in costs.FEATURES}, found


def test_every_feature_of_the_cost_table_is_turned_on_and_nothing_moves_unused(blender):
    states, found = blender(describe_states, EXAMPLES / "cornell_box.blend")
    for name, has in states.items():
        moves = name.startswith("motion blur") or name == "vector"
        assert (found[name, "on"] != found[name, "bare"]) and found[name, "on"][1] == moves, name
        if "unused" in has:
            described, moved = found[name, "unused"]
            assert not moved, name
            assert name.startswith("motion blur") or described != found[name, "plain"][0], name
