"""scenes -> Mitsuba's dictionary.  What is exported, what is refused, and whose picture it is."""

import importlib.util

import pytest

from penumbra.benchmarks.scenes import SCENES


def describe(name, change=""):
    """Return the dictionary of a scene, changed by a line of code, or why there is none."""
    from pathlib import Path
    from types import SimpleNamespace

    import bpy
    import numpy as np

    from penumbra.benchmarks import worker
    from penumbra.benchmarks.mitsuba_scene import NotExpressed, describe

    mi = SimpleNamespace(ScalarTransform4f=np.array)
    scene = next(each for each in SCENES if each.name == name)
    blend = scene.blend()
    worker.open_scene(name, None if blend is None else str(blend), 50)
    for key, value in scene.settings.items():
        setattr(bpy.context.scene.cycles, key, value)
    exec(change, {"bpy": bpy})
    bpy.context.view_layer.update()
    try:
        found = describe(mi, 16, Path())
    except NotExpressed as error:
        return str(error)
    for shape in found.values():
        if isinstance(shape, dict) and shape["type"] == "ply":
            shape["faces"] = Path(shape["filename"]).read_bytes().count(b"element face")
    return found


def of_type(found, kind):
    return [each for each in found.values() if isinstance(each, dict) and each["type"] == kind]


@pytest.mark.parametrize(("name", "depth"), [("cornell_direct", 2), ("cornell_gi", 6)])
def test_the_cornell_box_is_exported(blender, name, depth):
    found = blender(describe, name)
    assert len(of_type(found, "ply")) == 7
    (lamp,) = of_type(found, "rectangle")
    assert lamp["emitter"]["radiance"]["value"] == pytest.approx([20 / (3.14159265 * 0.25)] * 3)
    assert found["integrator"]["max_depth"] == depth
    sensor = found["sensor"]
    assert (sensor["film"]["width"], sensor["film"]["height"]) == (256, 256)
    assert sensor["fov"] == pytest.approx(39.5978, abs=1e-3)
    assert sensor["film"]["rfilter"]["stddev"] == pytest.approx(0.2078, abs=1e-3)
    assert "world" not in found
    assert all(each["face_normals"] and each["faces"] == 1 for each in of_type(found, "ply"))


def test_mirrors_glass_and_the_world_are_exported(blender):
    found = blender(describe, "mirrors_and_glass")
    kinds = {each["bsdf"].get("bsdf", each["bsdf"])["type"] for each in of_type(found, "ply")}
    assert kinds == {"diffuse", "conductor", "dielectric"}
    assert found["world"]["radiance"]["value"] == pytest.approx([0.06, 0.07, 0.09])
    assert found["integrator"]["max_depth"] == 10


def test_lamps_that_are_round_are_exported(blender):
    found = blender(describe, "soft_shadows")
    (disk,), (ball,) = of_type(found, "disk"), of_type(found, "sphere")
    assert disk["emitter"]["radiance"]["value"][2] == pytest.approx(130 / (3.14159265**2 / 4))
    radiance = 60 / (3.14159265**2 * 4 * 0.3**2)
    assert ball["emitter"]["radiance"]["value"] == pytest.approx([radiance] * 3)


BOX = "cornell_direct"
SHADER = "bpy.data.materials['White'].node_tree.nodes['Diffuse BSDF']"


@pytest.mark.parametrize(
    ("name", "change", "culprit"),
    [
        ("mirrors", "", "Principled BSDF"),
        ("lamps", "", "SPOT|SUN|AREA"),
        ("hdri_object", "", "World|Principled"),
        ("motion_blur", "", "Principled|motion"),
        (BOX, "bpy.context.scene.camera.data.dof.use_dof = True", "Camera: a lens"),
        (BOX, "bpy.context.scene.camera.data.shift_x = 0.1", "Camera: a lens, a shift"),
        (BOX, "bpy.context.scene.render.use_motion_blur = True", "motion blur"),
        (BOX, f"{SHADER}.inputs['Roughness'].default_value = 0.5", "White: Diffuse BSDF"),
        (BOX, "bpy.data.lights['Lamp'].spread = 1", "Lamp: a lamp of type AREA"),
        (BOX, "bpy.data.meshes['Mesh'].materials.clear()", "without a material"),
    ],
)
def test_what_is_not_exported_is_named(blender, name, change, culprit):
    found = blender(describe, name, change)
    assert isinstance(found, str), "it was exported"
    assert any(each in found for each in culprit.split("|")), found


def off(name):
    """Return how far Mitsuba's picture is off, as the benchmark checks it."""
    import numpy as np

    from penumbra.benchmarks import run, worker

    scene = next(each for each in SCENES if each.name == name)
    blend = scene.blend()
    worker.open_scene(name, None if blend is None else str(blend), 16)
    pictures = []
    for engine in ("CYCLES", "MITSUBA"):
        answer = worker.render_scene(engine, scene.settings, 64, 1, 2, "small.npy")
        pictures.append(np.load("small.npy"))
    halves = [[run.off_by(b[rows], a[rows]) for rows in np.array_split(np.arange(len(a)), 2)]
              for a, b in [pictures]]  # fmt: skip
    return np.abs(run.off_by(*pictures)).max(), np.abs(halves).max(), sorted(answer["parts"])


@pytest.mark.skipif(importlib.util.find_spec("mitsuba") is None, reason="needs Mitsuba")
@pytest.mark.parametrize("name", [BOX, "cornell_gi", "soft_shadows", "mirrors_and_glass"])
def test_the_picture_of_mitsuba_is_that_of_cycles(blender, name):
    whole, halves, parts = blender(off, name)
    assert whole < 0.01
    assert halves < 0.03, "it is neither upside down nor shifted"
    assert parts == ["build", "export", "sampling"]
