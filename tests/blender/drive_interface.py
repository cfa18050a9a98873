"""Buttons, panels and icons.  Runs inside a real Blender; see window.py."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))  # noqa: PTH120

import bpy
import numpy as np
import window as w

panels, preferences = w.of_ours("addon.panels"), w.of_ours("addon.preferences")
TABS = ("RENDER", "OUTPUT", "VIEW_LAYER", "WORLD", "OBJECT", "DATA", "MATERIAL")


def show_all_of_ours():
    """Let our panels be open, so that Blender draws what is in them; return who was drawn."""
    drawn = []
    for cls in panels._registered:
        bpy.utils.unregister_class(cls)
        cls.bl_options = set()
        cls.draw = _noted(cls.draw, cls.__name__, drawn)
        bpy.utils.register_class(cls)
    return drawn


def _noted(draw, name, drawn):
    def both(self, context):
        draw(self, context)
        drawn.append(name)

    return both


def drive(found):
    """Choose the engine, look at all tabs, copy from Cycles, wait for icons."""
    scene = bpy.context.scene
    scene.cycles.samples = 17
    drawn = show_all_of_ours()
    properties = next(area for area in w.window().screen.areas if area.type == "PROPERTIES")
    space = properties.spaces.active
    space.context = "RENDER"
    yield 0.5

    # The engine's drop-down is the first row of the render tab; its menu knows the first letter.
    item = w.region(properties)
    yield from w.click((item.x + 3 * item.width // 4, item.y + item.height - 56))
    yield 0.7
    w._xdotool("key", "p")
    yield 1.0
    found["engine"], found["samples"] = scene.render.engine, scene.penumbra.samples

    # All tabs, for an object and a light.
    with bpy.context.temp_override(window=w.window(), area=properties):
        bpy.ops.screen.screen_full_area(use_hide_panels=False)
    yield 0.5
    properties = next(area for area in w.window().screen.areas if area.type == "PROPERTIES")
    for name in ("Cube", "Light"):
        bpy.context.view_layer.objects.active = bpy.data.objects[name]
        yield 0.2
        for tab in TABS:
            if name == "Light" and tab == "MATERIAL":
                continue
            properties.spaces.active.context = tab
            yield 0.4
            w.screenshot(os.environ["PENUMBRA_FOUND"] + f".{name}.{tab}.png")
    found["drawn"] = sorted(set(drawn))
    found["ours"] = sorted(cls.__name__ for cls in panels._registered)

    # Preferences
    wished = preferences.read_preferences()
    found["preferences"] = [wished.threads, wished.instance_memory]
    bpy.ops.penumbra.system_check("INVOKE_DEFAULT")
    yield 1.0
    found["clipboard"] = bpy.context.window_manager.clipboard
    w.screenshot(os.environ["PENUMBRA_FOUND"] + ".check.png")

    # Icons, of both engines
    tree = bpy.data.materials["Material"].node_tree
    tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.05, 0.05, 1)
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.1, 0.2, 0.9, 1)
    blocks = bpy.data.materials["Material"], scene.world, bpy.data.objects["Light"].data
    found["icons"], frames = {}, len(w.report.frames)
    for block in blocks:
        icons = []
        for engine in ("CYCLES", "PENUMBRA"):
            scene.render.engine = engine
            with bpy.context.temp_override(window=w.window(), id=block):
                bpy.ops.ed.lib_id_generate_preview()
            yield 0.2
            yield lambda: not bpy.app.is_job_running("RENDER_PREVIEW")
            icons.append(np.array(block.preview.image_pixels_float[:]).reshape(-1, 4))
        cycles, ours = icons
        found["icons"][type(block).__name__] = {
            "same": bool(np.array_equal(cycles, ours)),
            "off by": float(np.abs(cycles - ours).mean()),
            "of": float(np.abs(cycles - cycles[0]).mean()),
        }
    found["reported"] = len(w.report.frames) - frames
    found["errors"] = w.report.errors


w.run(drive)
