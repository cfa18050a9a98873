"""axes -> scenes in Blender.  Each axis has more of what it is named after, and of nothing else."""

import pytest

from penumbra.benchmarks.axes import AXES, BY_NAME
from penumbra.benchmarks.interpreter import lock_address

# What grows along with an axis
TOGETHER = {"bounces": {"bounces of Cycles"}, "node graphs": {"materials"}}


def counts(bpy, name, value):
    """Build a scene; return what there is of everything."""
    samples = BY_NAME[name].build(bpy, value)
    scene = bpy.context.scene
    meshes = [thing for thing in scene.objects if thing.type == "MESH"]
    materials = {slot.material for thing in meshes for slot in thing.material_slots}
    triangles = 0
    for thing in meshes:
        thing.data.calc_loop_triangles()
        triangles += len(thing.data.loop_triangles)
    return {
        "samples": samples,
        "pixels": scene.render.resolution_x * scene.render.resolution_y,
        "triangles": triangles,
        "lights": sum(thing.type == "LIGHT" for thing in scene.objects),
        "materials": len(materials),
        "node graphs": len({len(each.node_tree.nodes) for each in materials if each}),
        "bounces": scene.penumbra.max_bounces,
        "bounces of Cycles": scene.cycles.max_bounces,
    }


def measured():
    """Return what scenes hold by axis and value, and what renders of some tell."""
    import bpy

    import penumbra
    from penumbra.benchmarks import bounds, clocks
    from penumbra.core.transport import path

    penumbra.register()
    scenes = {a.name: [(v, counts(bpy, a.name, v)) for v in a.values[:3:2]] for a in AXES}
    before = path.scatter
    return {
        "scenes": scenes,
        "plain": {engine: clocks.scale(engine, "bounces", 1) for engine in ("PENUMBRA", "CYCLES")},
        "split": clocks.scale("PENUMBRA", "samples", 16, threads=2, workers="PROCESSES"),
        "stages": bounds.stages("bounces", 1),
        "restored": path.scatter is before,
        "lock": clocks.lock()["address"],
    }


@pytest.fixture(scope="module")
def found(blender):
    return blender(measured)


@pytest.mark.parametrize("axis", BY_NAME)
def test_an_axis_has_so_much_of_what_it_is_named_after_and_as_much_of_all_else(axis, found):
    (first, before), (last, after) = found["scenes"][axis]
    assert before[axis] == pytest.approx(first, rel=0.02)
    assert after[axis] == pytest.approx(last, rel=0.02)
    changed = {key for key in before if before[key] != after[key]}
    assert changed == {axis} | TOGETHER.get(axis, set())


def test_a_render_tells_its_processor_time(found):
    for engine in ("PENUMBRA", "CYCLES"):
        assert found["plain"][engine]["sampling"] > 0
        assert found["plain"][engine]["rest"] > 0
    ours = found["plain"]["PENUMBRA"]
    assert ours["begin"] < ours["end"] and ours["processes"] == 0
    assert ours["own"] == ours["sampling"] >= sum(ours["stage_seconds"].values())
    assert set(ours["parts"]) == {"export", "compile", "build"}


def test_processes_are_counted_apart(found):
    split = found["split"]
    if not split["processes"]:
        pytest.skip("this system has no processes for workers")
    assert 0 < split["own"] < 0.9 * split["sampling"]


def test_stages_tell_what_they_exchange(found):
    stages = found["stages"]
    assert found["restored"]
    assert set(stages["bytes"]) == set(stages["stage_seconds"])
    each = {stage: size / stages["path_vertices"] for stage, size in stages["bytes"].items()}
    # A hit is t, triangle, u and v, and a direction; a path has at least its slot and colour
    assert each["surface"] > 28 and each["scatter"] > 16 and each["film"] > 2
    assert max(each.values()) < 400
    assert stages["triangles"] > 0 and stages["roof"]["size"] > 1000


def test_a_process_knows_its_lock(found):
    assert (found["lock"] is None) == (lock_address() is None)
