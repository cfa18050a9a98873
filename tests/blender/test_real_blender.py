"""zip -> picture, in a Blender with its own Python.  See conftest.py for what is installed."""

import subprocess
import sys

import numpy as np

from penumbra.tools.environment import ROOT


def make_files(folder):
    """Save a small Cornell box, whole and broken; called inside the bpy module."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "examples" / "cornell_box.blend"))
    scene = bpy.context.scene
    scene.render.resolution_percentage = 20
    image = scene.render.image_settings
    image.file_format, image.color_depth = "OPEN_EXR", "32"
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/box.blend")

    # A ball that is nowhere: the engine has to refuse.
    scene.objects["Ball"].location.x = float("nan")
    bpy.ops.wm.save_as_mainfile(filepath=f"{folder}/wrong.blend")


def read(path):
    """Return a picture as an array (H, W, channels)."""
    import OpenImageIO

    picture = OpenImageIO.ImageBuf(str(path))
    assert picture.initialized, picture.geterror()
    return picture.get_pixels(OpenImageIO.FLOAT)


def test_a_real_blender_renders_what_the_module_renders(real, blender, tmp_path):
    blender(make_files, str(tmp_path))
    file = tmp_path / "box.blend"
    done = real("--background", file, "-E", "PENUMBRA", "-o", tmp_path / "real_##", "-f", "1")
    assert done.returncode == 0, done.stdout + done.stderr
    there = read(tmp_path / "real_01.exr")

    command = [sys.executable, "-I", "-m", "penumbra.addon.headless", str(file)]
    subprocess.run([*command, "-o", str(tmp_path / "module.exr")], check=True, timeout=300)
    here = read(tmp_path / "module.exr")

    # The same samples: all that differs is the last bit of another numpy, which may now and
    # then send a path elsewhere.
    assert there.shape == here.shape
    assert here[..., :3].std() > 0.05
    assert abs(there.mean() / here.mean() - 1) < 1e-3
    same = np.abs(there - here) <= 1e-3 * (1 + np.abs(here))
    assert same.mean() > 0.99


def test_a_render_that_fails_in_a_real_blender_does_not_exit_with_0(real, blender, tmp_path):
    blender(make_files, str(tmp_path))
    target = tmp_path / "wrong_##"
    done = real("--background", tmp_path / "wrong.blend", "-E", "PENUMBRA", "-o", target, "-f", "1")
    assert done.returncode != 0, done.stdout + done.stderr
    assert "Object 'Ball': its matrix has a number that is not finite" in done.stdout + done.stderr
    assert not list(tmp_path.glob("wrong_*"))
