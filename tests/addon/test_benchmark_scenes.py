"""built benchmark scenes -> counts.  Each holds what its name and the README promise."""

import math

import pytest

from penumbra.benchmarks.scenes import EXAMPLES, SCENES

BUILT = [s.name for s in SCENES if not s.example and s.reference]

# Least and most triangles, triangles that glow, lamps.
CONTENT = {
    "soft_shadows": ((4_000, 6_000), 0, 3),
    "mirrors_and_glass": ((60_000, 70_000), 0, 1),
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
    "character": ((80_000, 120_000), 0, 3),
    "five_million": ((5_000_000, 5_500_000), 0, 1),
    "instances": ((2_000_000, 3_000_000), 0, 1),
    "depth_of_field": ((30_000, 40_000), 12 * 320, 1),
    "motion_blur": ((20_000, 30_000), 0, 1),
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
        materials = {slot.material for slot in instance.object.material_slots}
        kinds = {node.type for each in materials for node in each.node_tree.nodes}
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


def render_small(name):
    """Render a scene with both engines; what Penumbra does not honour, and what was seen."""
    import numpy as np

    import penumbra
    from penumbra.benchmarks import worker

    penumbra.register()
    scene = next(each for each in SCENES if each.name == name)
    blend = scene.blend()
    percentage = 100 if name == "big_mesh" else 8  # which has 16 x 16 pixels
    size = worker.open_scene(name, None if blend is None else str(blend), percentage)["size"]
    samples, settings = scene.points()[0]
    found = {}
    for engine in ("CYCLES", "PENUMBRA"):
        few = {**scene.settings, **settings}
        answer = worker.render_scene(engine, few, min(samples, 4), 1, 2, "small.npy")
        picture = np.load("small.npy")
        seen = picture.shape, bool(np.isfinite(picture).all()), float(picture.mean())
        found[engine] = (*seen, answer["parts"], answer["seconds"], answer.get("not_honoured"))
    return size, found


@pytest.mark.parametrize("name", [scene.name for scene in SCENES])
def test_both_engines_render_every_scene(blender, name):
    (width, height), found = blender(render_small, name)
    for engine, (shape, is_finite, mean, parts, seconds, not_honoured) in found.items():
        assert shape == (height, width, 3), engine
        assert is_finite and mean > 0, engine
        assert {"export", "build", "sampling"} <= parts.keys(), engine
        assert min(parts.values()) >= 0 and sum(parts.values()) <= seconds, engine
        assert not not_honoured, engine
    assert math.isclose(found["CYCLES"][2], found["PENUMBRA"][2], rel_tol=0.5)


def told_of(blend, features, prepare):
    """Yield each state of features of a file, and the scene and settings that the core is told."""
    import bpy
    from inside import exported

    import penumbra

    penumbra.register()
    for feature in features:
        for state in feature.states():
            bpy.ops.wm.open_mainfile(filepath=str(blend))
            scene = bpy.context.scene
            scene.render.engine = "PENUMBRA"
            prepare(scene)
            feature.apply(state, scene)
            yield (feature.name, state), *exported()


def plans_of_skips(blend):
    """The plan and the scene of each state of what a scene can do without."""
    from penumbra import core
    from penumbra.benchmarks import skips

    def prepare(scene):
        scene.render.resolution_percentage = 10

    found = {}
    for key, told, settings in told_of(blend, skips.SKIPS, prepare):
        found[key] = core.compile_plan(told, settings).describe(), repr((told, settings))
    return {each.name: each.states() for each in skips.SKIPS}, found


# What the plan of the box leaves out, so that nothing of it is there.
LEFT_OUT = {
    *("procedural texture", "attribute", "transparency", "even world", "world sampling"),
    *("glowing surfaces", "border around all", "lamp of no power", "dead lobe", "black branch"),
    *("constant nodes", "roulette of light samples"),
}


def test_what_is_unused_is_not_in_the_plan_and_what_is_kept_differs(blender):
    states, found = blender(plans_of_skips, EXAMPLES / "cornell_box.blend")
    same = {name for name in states if found[name, "unused"][0] == found[name, "plain"][0]}
    assert same >= LEFT_OUT
    for name, has in states.items():
        if "kept" in has:
            assert found[name, "kept"][1] != found[name, "unused"][1], name


def describe_states(blend):
    """What the core is told of each state of each feature of the cost table."""
    from penumbra.benchmarks import costs

    def prepare(scene):
        scene.render.use_motion_blur = False
        scene.penumbra.use_denoising = scene.penumbra.use_adaptive_sampling = False
        scene.penumbra.pixel_filter_type = "BOX"

    found = {}
    for key, told, settings in told_of(blend, costs.FEATURES, prepare):
        view = told.camera
        found[key] = (
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
