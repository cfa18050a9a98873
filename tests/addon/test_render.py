"""F12: the picture, what is told about it, and what happens when it cannot be had."""

import json
from pathlib import Path

import numpy as np
import pytest

PLANE_AT_2M = 0.633254  # radiance of a white plane, 2 m from a point light of 100 W (Cycles 5.2)


def white_plane(path):
    import bpy
    from inside import add, empty_scene, exr_header, glowing, mesh, pixels, use_exr

    from penumbra.addon import report

    scene = empty_scene(24, 16)
    camera = scene.camera.data
    camera.type, camera.ortho_scale = "ORTHO", 0.24
    white = bpy.data.materials.new("White")
    if bpy.app.version < (5, 0):
        white.use_nodes = True
    tree = white.node_tree
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    tree.links.new(diffuse.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    square = [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]
    plane = mesh("Plane", square, [(0, 1, 2, 3)])
    plane.materials.append(white)
    add("Plane", plane)
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy, lamp.shadow_soft_size = 100, 0
    add("Lamp", lamp, location=(0, 0, 2))

    # A small black patch in the lower left corner of the picture
    patch = mesh(
        "Patch",
        [(-0.2, -0.2, 0.1), (-0.04, -0.2, 0.1), (-0.04, -0.04, 0.1), (-0.2, -0.04, 0.1)],
        [(0, 1, 2, 3)],
    )
    patch.materials.append(glowing((0, 0, 0)))
    add("Patch", patch)
    add("Smoke", bpy.data.volumes.new("Smoke"))
    scene.penumbra.samples, scene.penumbra.max_bounces = 16, 0
    scene.penumbra.pixel_filter_type = "BOX"
    scene.penumbra.seed = 5
    use_exr(scene, path / "whole.exr")
    bpy.ops.render.render(write_still=True)
    whole = pixels(path / "whole.exr")

    # The same frame in parts
    render = scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.125, 0.5
    parts = []
    for crop in (False, True):
        render.use_crop_to_border = crop
        use_exr(scene, path / f"part{crop}.exr")
        bpy.ops.render.render(write_still=True)
        parts.append(pixels(path / f"part{crop}.exr"))
    return whole, parts, report.frames, exr_header(path / "whole.exr")


@pytest.fixture(scope="module")
def plane(blender, tmp_path_factory):
    return blender(white_plane, tmp_path_factory.mktemp("plane"))


def test_the_picture_has_the_light_of_cycles_and_its_bottom_row_below(plane):
    whole, *_ = plane
    assert whole.shape == (16, 24, 4)
    np.testing.assert_allclose(whole[7:9, 11:13, :3], PLANE_AT_2M, rtol=2e-3)
    assert (whole[:3, :5, :3] == 0).all()
    assert (whole[-3:, :, 0] > 0.5).all()
    assert (whole[:, -3:, 0] > 0.5).all()
    assert (whole[..., 3] == 1).all()


def test_a_border_shows_the_same_pixels_with_and_without_crop(plane):
    whole, (kept, cropped), *_ = plane
    assert cropped.shape == (6, 12, 4)
    np.testing.assert_array_equal(cropped, whole[2:8, 6:18])
    assert np.ptp(cropped) > 0.5
    assert kept.shape == whole.shape
    np.testing.assert_array_equal(kept[2:8, 6:18], cropped)
    assert (kept[8:] == 0).all()


def test_each_frame_is_reported_and_the_file_carries_how_it_was_made(plane):
    _, _, frames, header = plane
    assert len(frames) == 3
    first = frames[0]
    assert first["frame"] == 1
    assert first["view_layer"] == "ViewLayer"
    assert first["resolution"] == [24, 16]
    assert first["samples"] == 16
    assert first["complete"] is True
    assert first["statistics"]["rays_camera"] == 16 * 24 * 16
    assert first["statistics"]["export_seconds"] > 0
    assert "Object 'Smoke'" in [row["owner"] for row in first["not_honoured"]]
    assert "24 x 16 pixels, 16 samples" in first["plan"] and "without lens" in first["plan"]
    json.dumps(frames)
    assert header["penumbra/seed"] == "5"
    assert header["penumbra/sample_offset"] == "0"
    assert header["penumbra/samples"] == "16"
    assert header["penumbra/version"]
    assert json.loads(header["penumbra/statistics"])["rays_camera"] == 16 * 24 * 16


def layers_and_views(path):
    import bpy
    from inside import add, empty_scene, glowing, mesh, pixels, use_exr

    from penumbra import core
    from penumbra.addon import report

    scene = empty_scene(8, 8)
    square = [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]
    for index, name in enumerate(("One", "Two")):
        layer = scene.view_layers[0] if index == 0 else scene.view_layers.new(name)
        layer.name = name
        layer.samples = index + 1
        group = bpy.data.collections.new(name)
        scene.collection.children.link(group)
        data = mesh(name, square, [(0, 1, 2, 3)])
        data.materials.append(glowing((index + 1, 0, 0), name))
        add(name, data, group)
    for layer in scene.view_layers:
        for child in layer.layer_collection.children:
            child.exclude = child.name != layer.name
    scene.render.use_multiview = True
    stereo = scene.camera.data.stereo
    stereo.interocular_distance, stereo.pivot = 0.5, "CENTER"
    compile_plan, where = core.compile_plan, []

    def watched(scene, *arguments, **keywords):
        where.append(float(scene.camera.to_world[0, 3]))
        return compile_plan(scene, *arguments, **keywords)

    core.compile_plan = watched
    use_exr(scene, path / "all.exr", multilayer=True)
    bpy.ops.render.render(write_still=True)
    written = sorted(item.name for item in path.iterdir())
    use_exr(scene, path / "eye.exr")
    bpy.ops.render.render(write_still=True)
    eyes = [pixels(path / f"eye_{side}.exr") for side in "LR"]
    scene.render.use_multiview = False
    use_exr(scene, path / "one.exr")
    bpy.ops.render.render(write_still=True)
    return written, report.frames, [*eyes, pixels(path / "one.exr")], where


def test_all_view_layers_and_views_are_rendered(blender, tmp_path):
    written, frames, pictures, where = blender(layers_and_views, tmp_path)
    assert written == ["all_L.exr", "all_R.exr"]
    views = [("One", "left", 1), ("One", "right", 1), ("Two", "left", 2), ("Two", "right", 2)]
    keys = [(frame["view_layer"], frame["view"], frame["samples"]) for frame in frames]
    assert keys == [*views, *views, ("One", "", 1), ("Two", "", 2)]
    for picture in pictures:
        assert (picture[..., 0] == 1).all()
    np.testing.assert_allclose(where, [-0.25, 0.25] * 4 + [0, 0], atol=1e-6)


def stopped(path, when):
    """Press Escape: during the export, while compiling, or after a few ticks of sampling."""
    import bpy
    from inside import add, empty_scene, glowing, mesh, pixels, use_exr

    from penumbra.addon import engine, report

    scene = empty_scene(32, 32)
    data = mesh("Big", [(-9, -9, 0), (9, -9, 0), (0, 9, 0)])
    data.materials.append(glowing())
    add("Big", data)
    scene.penumbra.samples, scene.penumbra.use_adaptive_sampling = 1 << 20, False
    calls, updates = [], []
    seen = []

    class Pressed:
        """The engine with Escape pressed after a while; RNA functions cannot be overridden."""

        def __init__(self, real):
            self.real = real

        def __getattr__(self, name):
            return getattr(self.real, name)

        def test_break(self):
            calls.append(1)
            return len(calls) > when

        def update_result(self, result):
            updates.append(1)
            self.real.update_result(result)

    job = engine._Job
    engine._Job = lambda real, depsgraph: job(Pressed(real), depsgraph)
    engine._WATCHED, engine._FIRST_PICTURE = True, 0.0
    engine.progress_listener = seen.append
    use_exr(scene, path / "stopped.exr", multilayer=True)
    bpy.ops.render.render(write_still=True)
    use_exr(scene, path / "flat.exr")
    calls.clear()
    bpy.ops.render.render(write_still=True)
    status = engine.status(seen[-1]) if seen else ""
    return report.frames, len(updates), pixels(path / "flat.exr"), report.errors, status


@pytest.mark.parametrize("when", [0, 1, 12])
def test_escape_keeps_what_is_there_and_crashes_nothing(blender, tmp_path, when):
    frames, updates, picture, errors, status = blender(stopped, tmp_path, when)
    assert errors == []
    if when < 12:
        assert len(frames) == 0
        return
    assert [frame["complete"] for frame in frames] == [False, False]
    assert 0 < frames[-1]["samples"] < 1 << 20
    assert updates > 0
    assert (picture[12:20, 12:20, :3] == 1).all()
    assert status.startswith("Sample ")
    assert "M rays/s" in status


FAILURES = {
    "no camera": "no camera",  # Blender's own words: it asks before it calls an engine
    "lens": "Camera: the focus of its aperture is",
    "matrix": "Object 'Bent': its matrix has a number that is not finite",
    "pattern": "",
    "bug": "ZeroDivisionError: planted",
}


def fail(what):
    """Make a scene that cannot be rendered."""
    import bpy
    from inside import add, empty_scene, mesh

    from penumbra import core

    scene = empty_scene()
    if what == "no camera":
        scene.camera = None
        add("Spare", bpy.data.cameras.new("Spare"))
    elif what == "lens":
        dof = scene.camera.data.dof
        dof.use_dof = True
        dof.focus_object = add("Nowhere", None, location=(0, 0, float("nan")))
    elif what == "matrix":
        add("Bent", mesh(), location=(float("nan"), 0, 0))
    elif what == "pattern":
        scene.penumbra.pattern, scene.penumbra.use_sample_subset = "POISSON", True
    elif what == "bug":

        def render(*_, **__):
            raise ZeroDivisionError("planted")

        core.render = render
    return scene


def failing(path, multilayer):
    import bpy
    from inside import use_exr

    from penumbra.addon import report

    messages = {}
    for what in FAILURES:
        scene = fail(what)
        use_exr(scene, path / "failed.exr", multilayer)
        messages[what] = []
        for _ in range(2):
            try:
                messages[what].append(str(bpy.ops.render.render(write_still=True)))
            except RuntimeError as error:
                messages[what].append(str(error))
    return messages, len(report.errors), report.frames


@pytest.mark.parametrize("multilayer", [False, True])
def test_a_failure_is_an_error_with_the_culprits_name_and_no_file(blender, tmp_path, multilayer):
    messages, errors, frames = blender(failing, tmp_path, multilayer)
    assert errors == 2 * (len(FAILURES) - 1)
    assert frames == []
    for what, expected in FAILURES.items():
        for message in messages[what]:
            assert message.startswith("Error: ")
            assert expected in message
    assert list(tmp_path.iterdir()) == []


def uncaught():
    import bpy

    fail("matrix")
    bpy.ops.render.render()


def test_a_script_that_renders_ends_with_an_error_code(blender):
    process = blender.run(uncaught)
    assert process.returncode == 1
    assert FAILURES["matrix"] in process.stderr


def oddities(path):
    import bpy
    from inside import add, empty_scene, mesh, pixels, use_exr

    from penumbra.addon import report

    def picture(name, scene):
        use_exr(scene, path / f"{name}.exr")
        bpy.ops.render.render(write_still=True)
        return pixels(path / f"{name}.exr")

    found = {}
    scene = empty_scene()
    found["nothing"] = picture("nothing", scene)
    scene.render.film_transparent = True
    found["transparent"] = picture("transparent", scene)

    # Each of these has something wrong with it; the triangle beside it must show
    scene = empty_scene()
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    far = float("nan")
    add("NaN", mesh("NaN", [(0, 0, 0), (1, 0, 0), (0, far, 0)]))
    add("Infinite", mesh("Infinite", [(0, 0, 0), (1, 0, 0), (0, float("inf"), 0)]))
    add("Sliver", mesh("Sliver", [(0, 0, 0), (1, 0, 0), (2, 0, 0)]))
    add("Unfaced", mesh("Unfaced", faces=()))
    add("Void", mesh("Void", (), ()))
    add("Flat", mesh("Flat"), scale=(0, 0, 0))
    dark = bpy.data.lights.new("Dark", "AREA")
    dark.energy = 0
    add("Dark", dark, location=(0, 0, 5))
    add("Good", mesh("Good", [(-9, -9, 0), (9, -9, 0), (0, 9, 0)]))
    found["odd"] = picture("odd", scene)
    notes = report.frames[-1]["not_honoured"]
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.resolution_percentage = 25
    found["pixel"] = picture("pixel", scene)
    return found, notes


def test_odd_input_renders_without_nan(blender, tmp_path):
    found, notes = blender(oddities, tmp_path)
    for name, picture in found.items():
        assert np.isfinite(picture).all(), name
    assert (found["nothing"] == (0, 0, 0, 1)).all()
    assert (found["transparent"] == 0).all()
    assert found["pixel"].shape == (1, 1, 4)
    middle = found["odd"][3:5, 7:9, :3]
    np.testing.assert_allclose(middle, 0.8, rtol=0.1)
    owners = " ".join(row["owner"] for row in notes)
    assert "NaN" in owners
    assert "Infinite" in owners


def animation(path):
    import bpy
    from inside import add, empty_scene, glowing, mesh, pixels, use_exr

    from penumbra.addon import report

    scene = empty_scene(8, 8)
    data = mesh("Big", [(-9, -9, 0), (9, -9, 0), (0, 9, 0)])
    data.materials.append(glowing())
    item = add("Big", data)
    item.hide_render = True
    item.keyframe_insert("hide_render", frame=1)
    item.hide_render = False
    item.keyframe_insert("hide_render", frame=2)
    scene.frame_start, scene.frame_end = 1, 2
    scene.render.use_persistent_data = True
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    use_exr(scene, path / "frame####")
    bpy.ops.render.render(animation=True)
    middle = [pixels(path / f"frame000{frame}.exr")[4, 4, 0] for frame in (1, 2)]
    return middle, [(entry["frame"], Path(entry["output"]).name) for entry in report.frames]


def test_an_animation_renders_each_frame_as_it_is_then(blender, tmp_path):
    middle, frames = blender(animation, tmp_path)
    assert middle == [0.0, 1.0]
    assert frames == [(1, "frame0001.exr"), (2, "frame0002.exr")]
