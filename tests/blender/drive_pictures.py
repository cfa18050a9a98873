"""Pictures of the first three steps, for README.  Runs inside a real Blender; see window.py."""

import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(__file__))  # noqa: PTH120

import bpy
import window as w

# What the file of a picture may need: colours and a width that keep it small
SMALL = ("-colors", "200", "+dither", "-depth", "8", "-define", "png:compression-level=9")


def take(name, width, height, left=0, top=0, shown=""):
    """Take a picture of a rectangle of the screen."""
    crop = f"{width}x{height}+{left}+{top}"
    path = f"{os.environ['PENUMBRA_FOUND']}.{name}.png"
    command = ["import", "-window", "root", "-crop", crop, "+repage"]
    command += ["-resize", shown or f"{width}x", *SMALL, f"png8:{path}"]
    subprocess.run(command, check=True)  # noqa: S603


def top(part):
    """Return where an area or a region begins on the screen, counted from above."""
    return w.window().height - part.y - part.height


def drive(found):
    """Take three pictures."""
    # The extension among the others.
    area = w.areas()[0]
    area.ui_type = "PREFERENCES"
    bpy.context.preferences.active_section = "EXTENSIONS"
    yield 3.0
    take("step_install", area.width, area.height // 2, area.x, top(area), shown="640x")
    area.ui_type = "VIEW_3D"
    yield 1.0

    # The engine's drop-down, open.
    properties = next(area for area in w.window().screen.areas if area.type == "PROPERTIES")
    properties.spaces.active.context = "RENDER"
    yield 0.5
    item = w.region(properties)
    yield from w.click((item.x + 3 * item.width // 4, item.y + item.height - 56))
    yield 1.0
    take("step_engine", 460, 300, 740, top(item) - 60)
    w._xdotool("key", w.ESCAPE)
    yield 0.5

    # A rendered viewport.
    bpy.ops.wm.open_mainfile(filepath=os.environ["PENUMBRA_EXAMPLE"], load_ui=False)
    scene = bpy.context.scene
    scene.render.engine = "PENUMBRA"
    scene.penumbra.preview_samples = 16
    scene.penumbra.use_preview_denoising = True
    area = w.areas()[0]
    area.spaces.active.overlay.show_overlays = False
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    area.spaces.active.shading.type = "RENDERED"
    with w.here(area):
        bpy.ops.view3d.view_center_camera()
    yield 1.0
    yield w.done()
    yield 1.0
    take("step_viewport", 1200, 800, shown="720x")
    found["samples"] = w.viewport.sessions[0].drawn.samples


w.run(drive)
