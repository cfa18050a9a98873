"""files, options -> pictures, exit codes.  `dev.py render` from the inside, in this environment."""

import gzip
import json
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("blender")
SIZE = (24, 16)


def make_files(folder):
    """Save the scenes of these tests; called inside Blender."""
    import bpy

    import penumbra

    def save(name, **options):
        bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/{name}.blend", **options)

    # A cube under a lamp, as Cycles' users know it; Penumbra has never seen the file.
    bpy.ops.wm.read_factory_settings(use_empty=False)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.max_bounces, scene.cycles.seed = 3, 2, 5
    save("cycles", compress=False)

    # The same, made for Penumbra.
    penumbra.register()
    scene.render.engine = "PENUMBRA"
    scene.penumbra.samples = 2
    scene.penumbra.use_adaptive_sampling = False  # renders that are to be interrupted do not end
    scene.frame_end = 3
    save("plain", compress=False)
    save("packed", compress=True)

    # Two eyes, a file for each and both in one.
    scene.render.use_multiview = True
    image = scene.render.image_settings
    image.views_format = "INDIVIDUAL"
    save("eyes")
    image.views_format = "STEREO_3D"
    save("both_eyes")
    scene.render.use_multiview = False

    # Two scenes; a broken object; no camera.
    bpy.ops.scene.new(type="EMPTY")
    save("two_scenes")
    bpy.context.window.scene = scene
    cube = scene.objects["Cube"]
    cube.location.x = float("nan")
    save("broken_cube")
    cube.location.x = 0
    scene.camera = None
    save("no_camera")


@pytest.fixture(scope="module")
def files(blender, tmp_path_factory):
    """Return a folder of .blend files, good and bad."""
    folder = tmp_path_factory.mktemp("files")
    blender(make_files, str(folder))
    plain = (folder / "plain.blend").read_bytes()
    (folder / "gzipped.blend").write_bytes(gzip.compress(plain))
    (folder / "cut.blend").write_bytes(plain[: len(plain) // 2])
    (folder / "text.blend").write_text("BLENDER is not in here, really")
    header = re.compile(rb"^(BLENDER.{1,5}v)\d+")
    version = header.match(plain)
    newer = version[1] + b"9" * len(version[0].removeprefix(version[1]))
    (folder / "newer.blend").write_bytes(header.sub(newer, plain))
    (folder / "future.blend").write_bytes(header.sub(b"BLENDER99-99v9999", plain))
    return folder


def start(*arguments, **options):
    """Start `dev.py render` as it goes on once it has found its environment."""
    command = [sys.executable, "-I", "-m", "penumbra.addon.headless", *map(str, arguments)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )


def render(*arguments):
    """Render to the end; return the exit code and the lines on stderr."""
    with start(*arguments) as process:
        out, err = process.communicate(timeout=300)
    assert out == ""
    return process.returncode, err.splitlines()


def read(path):
    """Return a picture as an array (H, W, channels)."""
    import OpenImageIO

    picture = OpenImageIO.ImageBuf(str(path))
    assert picture.initialized, picture.geterror()
    return picture.get_pixels(OpenImageIO.FLOAT)


@pytest.mark.parametrize("name", ["plain", "packed", "gzipped", "newer"])
def test_a_blend_file_is_rendered_however_it_was_saved(files, tmp_path, name):
    target = tmp_path / "picture.png"
    code, lines = render(files / f"{name}.blend", "-o", target)
    assert code == 0, lines
    assert lines[-1].startswith(f"wrote {target}")
    assert ("newer than this" in lines[0]) == (name == "newer")
    pixels = read(target)
    assert pixels.shape[1::-1] == SIZE
    assert 0.05 < pixels[..., :3].mean() < 0.95
    assert pixels[..., :3].std() > 0.01
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"]


def test_each_view_gets_a_file_where_blender_writes_one(files, tmp_path):
    target, told = tmp_path / "view.png", tmp_path / "report.json"
    code, lines = render(files / "eyes.blend", "-o", target, "--report", told)
    assert code == 0, lines
    names = ["view_L.png", "view_R.png"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report.json", *names]
    assert all(name in lines[-1] for name in names)
    frames = json.loads(told.read_text())["frames"]
    assert [frame["view"] for frame in frames] == ["left", "right"]
    assert [frame["output"] for frame in frames] == [str(tmp_path / name) for name in names]
    left, right = (read(tmp_path / name) for name in names)
    assert np.abs(left - right).max() > 0.1

    code, lines = render(files / "both_eyes.blend", "-o", target)
    assert code == 0, lines
    assert target.exists()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("no_camera", "scene 'Scene' has no camera in frame 1"),
        ("cut", "cut.blend cannot be opened"),
        ("text", "text.blend cannot be opened"),
        ("future", "future.blend cannot be opened"),
    ],
)
def test_a_file_that_cannot_be_rendered_gives_one_line_and_no_picture(files, tmp_path, name, said):
    code, lines = render(files / f"{name}.blend", "-o", tmp_path / "picture.png")
    assert code == 2
    assert len(lines) == 1
    assert said in lines[0]
    assert not list(tmp_path.iterdir())


def test_a_scene_that_is_not_there_is_told_with_those_that_are(files, tmp_path):
    there = files / "two_scenes.blend"
    code, lines = render(there, "-o", tmp_path / "a.png", "--scene", "Third")
    assert (code, len(lines)) == (2, 1)
    assert "no scene 'Third', only 'Scene', 'Scene.001'" in lines[0]
    code, lines = render(there, "-o", tmp_path / "a.png", "--scene", "Scene")
    assert code == 0, lines


def test_a_failed_render_leaves_the_old_picture_and_exits_with_1(files, tmp_path):
    target = tmp_path / "picture.png"
    target.write_text("the old one")
    code, lines = render(files / "broken_cube.blend", "-o", target)
    assert code == 1
    assert len(lines) == 1
    assert "Cube" in lines[0]
    assert target.read_text() == "the old one"
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"]


def test_an_animation_gets_a_number_in_every_name(files, tmp_path):
    code, lines = render(files / "plain.blend", "-o", tmp_path / "a.png", "-a")
    assert code == 0, lines
    code, lines = render(files / "plain.blend", "-o", tmp_path / "b_##.tif", "-f", "-7,2..3")
    assert code == 0, lines
    names = {"a0001.png", "a0002.png", "a0003.png", "b_-07.tif", "b_02.tif", "b_03.tif"}
    assert {path.name for path in tmp_path.iterdir()} == names
    code, lines = render(files / "plain.blend", "-o", tmp_path / "c.png", "-s", "4")
    assert (code, lines) == (2, ["dev.py render: the last frame, 3, is before the first, 4"])


def test_every_extension_gives_its_own_format(files, tmp_path, blender):
    import OpenImageIO

    from penumbra.tools.arguments import FORMATS

    for suffix, blenders_name in FORMATS.items():
        target = tmp_path / f"picture{suffix}"
        code, lines = render(files / "plain.blend", "-o", target, "--samples", 1)
        assert code == 0, (suffix, lines)
        found = OpenImageIO.ImageInput.open(str(target))
        if found is None and suffix == ".webp":  # not in every OpenImageIO
            continue
        name = {"OPEN_EXR": "openexr", "TARGA": "targa"}.get(blenders_name, blenders_name.lower())
        assert found.format_name() == name
        if suffix == ".exr":
            assert found.spec().format == OpenImageIO.FLOAT


def test_seed_and_threads_do_what_they_say_and_the_report_tells(files, tmp_path):
    def picture(name, *options):
        target, report = tmp_path / f"{name}.exr", tmp_path / f"{name}.json"
        asked = [files / "plain.blend", "-o", target, "--report", report, *options]
        code, lines = render(*asked)
        assert code == 0, lines
        return read(target), json.loads(report.read_text("utf-8"))

    one, report = picture("one", "--samples", 4, "--threads", 1)
    two, _ = picture("two", "--samples", 4, "--threads", 2)
    other, _ = picture("other", "--samples", 4, "--seed", 1)
    assert np.array_equal(one, two)
    assert not np.array_equal(one, other)
    assert report["schema"] == 1
    assert report["file"] == str(files / "plain.blend")
    (frame,) = report["frames"]
    assert frame["output"] == str(tmp_path / "one.exr")
    assert (frame["frame"], frame["samples"], frame["complete"]) == (1, 4, True)
    assert frame["resolution"] == list(SIZE)
    assert frame["statistics"]["rays_camera"] == SIZE[0] * SIZE[1] * 4


def test_a_file_made_for_cycles_keeps_its_settings(files, tmp_path):
    report = tmp_path / "report.json"
    asked = ["-o", tmp_path / "a.exr", "--report", report]
    code, lines = render(files / "cycles.blend", *asked)
    assert code == 0, lines
    assert json.loads(report.read_text("utf-8"))["frames"][0]["samples"] == 3


def test_braces_in_a_path_are_only_braces(files, tmp_path):
    folder = tmp_path / "{blend_name} #"
    folder.mkdir()
    code, lines = render(files / "plain.blend", "-o", folder / "{frame}.png")
    assert code == 0, lines
    assert [path.name for path in folder.iterdir()] == ["{frame}.png"]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_render_leaves_nothing_behind(files, tmp_path, number):
    asked = [files / "plain.blend", "-o", tmp_path / "a.png", "--samples", 1 << 24]
    with start(*asked) as process:
        while process.poll() is None and not list(tmp_path.glob(".penumbra-*")):
            time.sleep(0.1)
        time.sleep(0.5)
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert err.splitlines()[-1] == "Stopped."
    assert not list(tmp_path.iterdir())
