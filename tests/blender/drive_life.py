"""Viewports, engines, renders, files that come and go.  Inside a real Blender; see window.py."""

import os
import sys
import threading
import time

sys.path.insert(0, os.path.dirname(__file__))  # noqa: PTH120

import bpy
import numpy as np
import window as w


def drive(found):
    """Open and close whatever a user may, then leave."""
    bpy.context.preferences.view.render_display_type = "NONE"
    scene = bpy.context.scene
    scene.render.engine = "PENUMBRA"
    scene.render.preview_pixel_size = "4"
    w.show_rendered()
    yield 0.5
    yield lambda: len(w.viewport.sessions) == 1
    session = w.viewport.sessions[0]
    cube = bpy.data.objects["Cube"]

    # Pause.
    scene.penumbra.preview_samples = 0
    yield lambda: session.drawn is not None and session.drawn.samples > 3
    scene.penumbra.preview_pause = True
    yield 0.5
    one = session.renderer.shown.samples
    yield 1.0
    found["paused"] = session.renderer.shown.samples - one
    scene.penumbra.preview_pause = False
    yield lambda: session.renderer.shown.samples > one
    scene.penumbra.preview_samples = 8

    # Animation.
    cube.keyframe_insert("location", frame=1)
    cube.location.x += 3
    cube.keyframe_insert("location", frame=20)
    asked = session.renderer.asked
    with w.here():
        bpy.ops.screen.animation_play()
    yield 2.5
    with w.here():
        bpy.ops.screen.animation_cancel()
    yield 0.3
    yield w.done()
    found["animation asks"] = w.viewport.sessions[0].renderer.asked - asked

    # Several viewports, of several kinds; then one again.
    with w.here():
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    w.show_rendered()
    yield 1.0
    yield w.done()
    found["two viewports"] = [each.drawn.pixels.shape for each in w.viewport.sessions]
    with w.here(w.areas()[1]):
        bpy.ops.screen.region_quadview()
    yield 1.0
    yield w.done()
    found["five viewports"] = len(w.viewport.sessions)
    with w.here(w.areas()[1]):
        bpy.ops.screen.region_quadview()
    yield 0.5
    w.show_rendered("MATERIAL")
    yield 2.0
    found["in material preview"] = len(w.viewport.sessions)
    w.show_rendered()
    yield 0.5
    yield w.done()
    found["sessions again"] = len(w.viewport.sessions)

    # Another engine, and back.
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    yield 1.0
    found["with another engine"] = len(w.viewport.sessions)
    bpy.context.scene.render.engine = "PENUMBRA"
    yield 0.5
    yield w.done()

    # Undo goes back to before the engine was chosen, and redo forth.
    for engine in ("BLENDER_WORKBENCH", "PENUMBRA"):
        bpy.context.scene.render.engine = engine
        with w.here():
            bpy.ops.ed.undo_push(message=engine)
        yield 0.5
    yield w.done()
    with w.here():
        bpy.ops.ed.undo()
    yield 1.0
    found["after undo"] = bpy.context.scene.render.engine, len(w.viewport.sessions)
    found["timer after undo"] = bpy.app.timers.is_registered(w.viewport._look)
    with w.here():
        bpy.ops.ed.redo()
    yield 1.0
    yield w.done()
    found["after redo"] = bpy.context.scene.render.engine, len(w.viewport.sessions)

    # What arrays have taken goes back to the system.
    before = w.memory()
    arrays = [np.ones(1 << 17) for _ in range(300)]
    held = w.memory() - before
    del arrays
    w.pages.release_pages()
    found["kept pages"] = (w.memory() - before) / held

    # F12 and Escape, while the viewport is rendered.
    scene = bpy.context.scene
    scene.penumbra.samples, scene.penumbra.use_adaptive_sampling = 1 << 20, False
    scene.penumbra.preview_samples = 0
    scene.render.resolution_percentage = 25
    ticks = []
    w.engine.progress_listener = ticks.append
    yield from w.press(w.F12)
    yield lambda: bpy.app.is_job_running("RENDER")
    yield lambda: ticks and ticks[-1].sample >= 1
    yield 0.5
    found["rendering"] = bpy.app.is_job_running("RENDER")
    found["viewport waits"] = w.viewport.sessions[0].renderer.is_paused
    start = time.monotonic()
    yield from w.press(w.ESCAPE)
    yield lambda: not bpy.app.is_job_running("RENDER")
    found["escape seconds"] = time.monotonic() - start
    w.engine.progress_listener = None
    result = bpy.data.images["Render Result"]
    result.save_render(os.environ["PENUMBRA_FOUND"] + ".result.png")
    kept = bpy.data.images.load(os.environ["PENUMBRA_FOUND"] + ".result.png")
    found["kept"] = float(np.array(kept.pixels[:]).reshape(-1, 4)[:, :3].std())
    found["frames"] = len(w.report.frames)
    yield 0.5

    # Another file.
    bpy.ops.wm.read_homefile(app_template="")
    yield 1.5
    bpy.context.scene.render.engine = "PENUMBRA"
    bpy.context.scene.penumbra.preview_samples = 2
    w.show_rendered()
    yield 1.0
    yield w.done()
    found["sessions in another file"] = len(w.viewport.sessions)
    w.show_rendered("SOLID")
    yield 1.5
    found["sessions at the end"] = len(w.viewport.sessions)
    found["threads"] = [each.name for each in threading.enumerate() if "penumbra" in each.name]


w.run(drive)
