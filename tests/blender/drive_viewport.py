"""The rendered viewport as a user meets it.  Runs inside a real Blender; see window.py."""

import os
import sys

sys.path.insert(0, os.path.dirname(__file__))  # noqa: PTH120

import bpy
import numpy as np
import window as w
from bpy_extras.view3d_utils import location_3d_to_region_2d


def drive(found):
    """Look at the default scene, change it in every way, and leave."""
    scene = bpy.context.scene
    scene.render.engine = "PENUMBRA"
    scene.view_settings.view_transform = "Standard"
    scene.render.preview_pixel_size = "4"
    scene.penumbra.preview_samples = 4
    cube, light = bpy.data.objects["Cube"], bpy.data.objects["Light"]
    w.show_rendered()
    yield 0.5
    yield w.done()
    session = w.viewport.sessions[0]
    found["sessions"] = len(w.viewport.sessions)
    found["first"] = w.picture().shape
    first = w.picture()

    def note(name):
        found["log"].append(name)
        found[name] = {
            "changed": not np.array_equal(first, w.picture()),
            "exports": session.exports,
            "asked": session.renderer.asked,
            "mean": float(w.picture()[..., :3].mean()),
            "status": session.status(),
        }

    # What is on the screen is what the engine says it drew, through the view transform.
    note("start")
    yield 0.5
    area, item = w.areas()[0], w.region()
    screen = w.screenshot(os.environ["PENUMBRA_FOUND"] + ".png")
    seen = screen[item.y : item.y + item.height, item.x : item.x + item.width]
    size = session.drawn.size
    drawn = w.displayed(first).repeat(size, axis=0).repeat(size, axis=1)
    drawn = drawn[: item.height, : item.width]
    error = np.abs(seen - drawn)[60:-60, 80:-80]
    found["screen"] = {
        "median": float(np.median(error)),
        "mean": float(error.mean()),
        "contrast": float(drawn.std()),
    }

    # Orbit with the mouse: the scene is not read again.
    x, y = w.middle()
    yield from w.drag(w.MIDDLE_BUTTON, (x, y), (x + 120, y + 40))
    yield 0.3
    yield w.done()
    note("orbit")
    with w.here():
        bpy.ops.view3d.view_axis(type="FRONT")
    yield 0.6
    yield w.done()
    note("front, orthographic")
    area.spaces.active.region_3d.view_perspective = "CAMERA"
    yield 0.3
    yield w.done()
    note("camera")
    area.spaces.active.region_3d.view_perspective = "PERSP"
    yield 0.3
    yield w.done()
    first = w.picture()

    # Edits, and back again with undo.
    def edits():
        colour = cube.active_material.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
        colour.default_value = (1, 0, 0, 1)
        yield "material"
        tree = cube.active_material.node_tree
        noise = tree.nodes.new("ShaderNodeTexNoise")
        tree.links.new(noise.outputs["Color"], tree.nodes["Principled BSDF"].inputs[0])
        yield "nodes"
        cube.location.x += 0.5
        yield "move"
        light.location.z += 2
        yield "move light"
        light.data.energy *= 3
        yield "brighter"
        world = bpy.context.scene.world.node_tree.nodes["Background"]
        world.inputs["Color"].default_value = (0.1, 0.3, 0.9, 1)
        yield "world"
        bpy.context.scene.penumbra.max_bounces = 0
        yield "setting"
        light.data.penumbra.max_bounces = 0
        bpy.context.scene.penumbra.film_exposure = 2.0
        yield "exposure"
        cube.modifiers.new("Bevel", "BEVEL").width = 0.4
        yield "modifier"
        with w.here():
            bpy.ops.mesh.primitive_monkey_add(location=(0, 0, 2))
        yield "add"
        with w.here():
            bpy.ops.object.delete()
        yield "delete"
        cube.hide_set(True)
        yield "hide"
        cube.hide_set(False)
        yield "show"
        cube.select_set(True)
        bpy.context.view_layer.objects.active = cube
        with w.here():
            bpy.ops.view3d.localview(frame_selected=False)
        yield "local view"
        with w.here():
            bpy.ops.view3d.localview(frame_selected=False)
        yield "global view"
        with w.here():
            bpy.ops.object.mode_set(mode="EDIT")
            bpy.ops.mesh.select_all(action="SELECT")
            bpy.ops.transform.translate(value=(0, 0, 0.5))
        yield "edit mode"
        with w.here():
            bpy.ops.object.mode_set(mode="OBJECT")
        yield "object mode"
        cube.visible_camera = False
        yield "not to the camera"
        cube.visible_camera = True
        area.spaces.active.use_render_border = True
        area.spaces.active.render_border_max_x = 0.6
        yield "border"
        area.spaces.active.use_render_border = False
        scene.render.film_transparent = True
        yield "transparent"
        scene.render.film_transparent = False
        area.spaces.active.shading.use_scene_world_render = False
        yield "studio light"
        area.spaces.active.shading.use_scene_world_render = True
        area.spaces.active.lens = 80
        yield "lens"

    for name in edits():
        yield 0.4
        yield w.done()
        note(name)
        first = w.picture()

        # What was read and compiled again is what reading and compiling all of it gives.
        session.forget()
        session.scene = None
        session.renderer._kept = type(session.renderer._kept)()
        area.tag_redraw()
        yield 0.2
        yield w.done()
        found[name]["same anew"] = bool(np.array_equal(first, w.picture()))
        found[name]["off by"] = float(np.abs(first - w.picture()).max())

    # A panorama fills the camera's frame, and is the one that F12 gives.
    camera, render = scene.camera.data, scene.render
    camera.type, camera.panorama_type = "PANO", "EQUIRECTANGULAR"
    view = area.spaces.active.region_3d
    view.view_perspective = "CAMERA"
    yield 0.6
    yield w.done()
    corners = [scene.camera.matrix_world @ each for each in camera.view_frame(scene=scene)]
    corners = [location_3d_to_region_2d(w.region(), view, each) for each in corners]
    found["frame"] = [f(each[k] for each in corners) for f in (min, max) for k in (0, 1)]
    found["panorama"] = session.drawn.rectangle
    shown = w.picture()
    render.resolution_x, render.resolution_y = 4 * shown.shape[1], 4 * shown.shape[0]
    render.resolution_percentage = 25
    scene.penumbra.samples, scene.penumbra.use_denoising = 4, False
    bpy.ops.render.render()
    path = os.environ["PENUMBRA_FOUND"] + ".panorama.png"
    bpy.data.images["Render Result"].save_render(path)
    flat = np.array(bpy.data.images.load(path).pixels[:]).reshape(*shown.shape)[..., :3]
    found["panorama off by"] = float(np.abs(w.displayed(shown) - flat).mean()), float(flat.std())

    # The denoiser of the viewport comes when all samples are there.
    scene.penumbra.use_preview_denoising = True
    yield 0.4
    yield w.done()
    smooth = w.picture()
    found["denoised"] = not np.array_equal(shown, smooth)
    found["denoised status"] = session.status()
    scene.penumbra.use_preview_denoising = False
    camera.type = view.view_perspective = "PERSP"
    yield 0.4
    yield w.done()
    first = w.picture()

    # Undo gives the picture of before; the local origin may be another one.
    with w.here():
        bpy.ops.ed.undo_push(message="before")
    cube = bpy.data.objects["Cube"]
    cube.location.y += 1
    with w.here():
        bpy.ops.ed.undo_push(message="moved")
    yield 0.4
    yield w.done()
    moved = w.picture()
    with w.here():
        bpy.ops.ed.undo()
    yield 0.5
    yield w.done()
    found["undo"] = float(np.abs(first - w.picture()).mean()), float(np.abs(first - moved).mean())
    with w.here():
        bpy.ops.ed.redo()
    yield 0.5
    yield w.done()
    found["redo"] = float(np.abs(moved - w.picture()).mean()), found["undo"][1]

    # Nothing that matters has changed: nothing is sampled again.
    asked = session.renderer.asked
    bpy.data.objects["Cube"].select_set(not bpy.data.objects["Cube"].select_get())
    yield 0.5
    found["idle asks"] = w.viewport.sessions[0].renderer.asked - asked

    # Errors are words in the viewport.
    bpy.context.scene.penumbra.instance_memory = 0.01
    bpy.data.objects["Cube"].modifiers.new("Many", "SUBSURF").levels = 6
    bpy.data.objects["Cube"].modifiers.new("More", "SUBSURF").levels = 3
    yield 0.5
    yield w.done()
    found["error text"] = w.viewport.sessions[0].status()
    bpy.data.objects["Cube"].modifiers.clear()
    bpy.context.scene.penumbra.instance_memory = 4.0
    yield 0.5
    yield w.done()
    found["after the error"] = w.viewport.sessions[0].status()


w.run(drive)
