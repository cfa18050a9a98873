"""steps -> what happened.  Runs inside a real Blender with its window; see conftest.py.

A drive is a generator that runs on Blender's timers: it yields seconds to wait, or a function that
says when to go on.  What it finds is written as JSON where PENUMBRA_FOUND says, with the traceback
of what went wrong; then Blender quits.
"""

import ctypes
import importlib
import json
import os
import subprocess
import time
import traceback

import bpy
import numpy as np

PATIENCE = 120.0  # seconds that a condition may take
TICK = 0.02
# What xdotool calls them: its F12 would come as Alt F12, so that one goes by its number.
MIDDLE_BUTTON, ESCAPE, F12 = 2, "Escape", 96


def of_ours(name):
    """Return a module of the installed extension."""
    return importlib.import_module(f"bl_ext.user_default.penumbra.{name}")


viewport, report = of_ours("addon.viewport"), of_ours("addon.report")
pages, engine = of_ours("core.pages"), of_ours("addon.engine")


class Stuck(Exception):
    """A condition never came true."""


def run(drive):
    """Run a drive; `drive(found)` puts what it finds into a dict."""
    found = {"log": []}
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.filepaths.use_auto_save_temporary_files = False
    steps = drive(found)
    state = {"wait": 1.0, "since": time.monotonic()}

    def finish(error=""):
        found["error"] = error
        with open(os.environ["PENUMBRA_FOUND"], "w", encoding="utf-8") as file:  # noqa: PTH123
            json.dump(found, file)
        bpy.ops.wm.quit_blender()

    def advance():
        try:
            wait = state["wait"]
            if callable(wait):
                if not wait():
                    if time.monotonic() - state["since"] > PATIENCE:
                        raise Stuck(f"{wait.__name__} after {found['log'][-3:]}: {states()}")
                    return TICK
                state["wait"] = next(steps)
            else:
                state["wait"] = next(steps)
            state["since"] = time.monotonic()
            return TICK if callable(state["wait"]) else state["wait"]
        except StopIteration:
            finish()
        except BaseException:
            finish(traceback.format_exc())
        return None

    bpy.app.timers.register(advance, first_interval=1.0, persistent=True)


def window():
    """Return Blender's first window."""
    return bpy.context.window_manager.windows[0]


def areas():
    """Return the 3D viewports."""
    return [area for area in window().screen.areas if area.type == "VIEW_3D"]


def region(area=None):
    """Return the main region of a viewport."""
    area = area or areas()[0]
    return next(each for each in area.regions if each.type == "WINDOW")


def here(area=None):
    """Return the context of a viewport, for operators."""
    area = area or areas()[0]
    return bpy.context.temp_override(window=window(), area=area, region=region(area))


def show_rendered(shading="RENDERED"):
    """Choose the shading of all viewports, with nothing drawn over the picture."""
    for area in areas():
        space = area.spaces.active
        space.overlay.show_overlays = False
        space.show_gizmo = False
        space.show_region_header = space.show_region_toolbar = space.show_region_ui = False
        space.shading.type = shading


def done(session=None):
    """Return a condition: all that was asked for is drawn, all its samples."""
    before = len(viewport.sessions)

    def is_done():
        each = [session] if session else viewport.sessions
        shown = [one.drawn for one in each]
        return bool(each or not before) and all(
            not one.is_stale
            and picture is not None
            and picture.number == one.renderer.asked
            and (picture.complete or picture.error)
            for one, picture in zip(each, shown, strict=True)
        )

    return is_done


def states():
    """Return how each session is, in words."""
    timer = bpy.app.timers.is_registered(viewport._look)
    words = [f"rendering {bpy.app.is_job_running('RENDER')}, timer {timer}"]
    for one in viewport.sessions:
        asked, shown = one.renderer.asked, number(one.renderer.shown)
        words.append(
            f"asked {asked}, shown {shown}, drawn {number(one.drawn)}, stale {one.is_stale}, "
            f"paused {one.renderer.is_paused}, status {one.renderer.status!r}, {one.error!r}"
        )
    sizes = [f"{each.width} x {each.height} {each.spaces.active.shading.type}" for each in areas()]
    return words + sizes


def number(picture):
    """Return which picture it is, and how far."""
    return picture and (picture.number, picture.samples, picture.of, picture.complete)


def picture(session=None):
    """Return the pixels that a viewport shows, as the engine has them."""
    session = session or viewport.sessions[0]
    assert not session.error, session.error
    assert not session.drawn.error, session.drawn.error
    return session.drawn.pixels


def screenshot(path):
    """Return the screen (H, W, 3), the bottom row first, 0 to 1."""
    subprocess.run(["import", "-window", "root", path], check=True)  # noqa: S607
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    flat = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(flat)
    flat = flat.reshape(image.size[1], image.size[0], 4)
    bpy.data.images.remove(image)
    return flat[..., :3]


def displayed(pixels):
    """Return scene-linear pixels as the view transform Standard shows them."""
    colour = np.clip(pixels[..., :3].astype(np.float64), 0, 1)
    return np.where(colour <= 0.0031308, 12.92 * colour, 1.055 * colour ** (1 / 2.4) - 0.055)


def drag(button, start, end, steps=6):
    """Yield while the mouse is dragged from start to end, in pixels of the window."""
    _xdotool("mousemove", *_on_screen(start))
    yield 0.2
    _xdotool("mousedown", button)
    for step in range(1, steps + 1):
        place = [a + (b - a) * step // steps for a, b in zip(start, end, strict=True)]
        _xdotool("mousemove", *_on_screen(place))
        yield 0.05
    _xdotool("mouseup", button)


def click(place):
    """Yield while the left button is pressed and let go; Blender wants to see the mouse come."""
    _xdotool("mousemove", *_on_screen((place[0], place[1] + 3)))
    yield 0.2
    _xdotool("mousemove", *_on_screen(place))
    yield 0.3
    _xdotool("mousedown", 1)
    yield 0.1
    _xdotool("mouseup", 1)


def press(key):
    """Yield while a key is pressed with the mouse over the first viewport."""
    _xdotool("mousemove", *_on_screen(middle()))
    yield 0.2
    _xdotool("key", key)


def _on_screen(place):
    return place[0], window().height - place[1]


def _xdotool(*words):
    subprocess.run(["xdotool", *map(str, words)], check=True)  # noqa: S607


def middle(area=None):
    """Return the middle of a viewport in pixels of the window."""
    item = region(area)
    return item.x + item.width // 2, item.y + item.height // 2


def trim():
    """Let the allocator give back what is free, so that `memory` is what is in use.

    That is the C library's, or TBB's, whose command 0 cleans all buffers.
    """
    program = ctypes.CDLL(None)
    program.malloc_trim(0)
    if hasattr(program, "scalable_allocation_command"):
        program.scalable_allocation_command(0, None)


def memory():
    """Return the memory of this process [bytes]."""
    with open("/proc/self/statm") as file:  # noqa: PTH123
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
