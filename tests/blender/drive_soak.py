"""A user in a hurry: random edits while the viewport renders.  Runs inside a real Blender.

PENUMBRA_SOAK is "seed seconds", and perhaps how many edits at most.  The same seed gives the same
edits in the same order.  Every few of them it waits until the viewport is done, so that a stuck
render is found.  PENUMBRA_SOAK_ENGINE names another engine, for comparison.
"""

import os
import random
import sys
import threading
import time

sys.path.insert(0, os.path.dirname(__file__))  # noqa: PTH120

import bpy
import window as w

ENGINE = os.environ.get("PENUMBRA_SOAK_ENGINE", "PENUMBRA")
SETTLE = 12  # edits between two looks at whether all is well
ROUND = 8  # such looks between new files
MOST_OBJECTS = 25
NO_UNDO = ("do_undo", "do_redo", "do_render", "do_cancel", "do_orbit", "do_zoom", "do_look")


class User:
    """What a user may do; each method that begins with `do_` is one thing."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        # What was done last, should Blender crash
        self.told = open(os.environ["PENUMBRA_FOUND"] + ".log", "w", buffering=1)  # noqa: PTH123, SIM115
        self.moves = sorted(name for name in dir(self) if name.startswith("do_"))

    def act(self):
        """Do something; return what."""
        if bpy.context.scene.render.engine != ENGINE:
            choose()
        name = self.random.choice(self.moves)
        self.told.write(name[3:] + "\n")
        with w.here(self.random.choice(w.areas())):
            getattr(self, name)()
        # Like the user interface: Blender 5.2 crashes, with any engine, where scripts have changed
        # what it does not know of and it goes back to before that.
        if name not in NO_UNDO:
            with w.here():
                bpy.ops.ed.undo_push(message=name[3:])
        return name[3:]

    def object(self, kind=None):
        """Return any object, or None."""
        found = [each for each in bpy.context.view_layer.objects if kind in (None, each.type)]
        return self.random.choice(found) if found else None

    def leave_edit_mode(self):
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")

    def place(self):
        return tuple(self.random.uniform(-3, 3) for _ in range(3))

    def do_add(self):
        self.leave_edit_mode()
        if len(bpy.data.objects) > MOST_OBJECTS:
            return self.do_delete()
        add = bpy.ops.mesh
        kinds = add.primitive_monkey_add, add.primitive_cube_add, add.primitive_torus_add
        return self.random.choice(kinds)(location=self.place())

    def do_add_light(self):
        self.leave_edit_mode()
        if len(bpy.data.objects) > MOST_OBJECTS:
            return self.do_delete()
        kind = self.random.choice(("POINT", "SUN", "SPOT", "AREA"))
        return bpy.ops.object.light_add(type=kind, location=self.place())

    def do_add_text(self):
        self.leave_edit_mode()
        if len(bpy.data.objects) <= MOST_OBJECTS:
            bpy.ops.object.text_add(location=self.place())

    def do_duplicate(self):
        self.leave_edit_mode()
        item = self.object("MESH")
        if item is not None and len(bpy.data.objects) <= MOST_OBJECTS:
            bpy.ops.object.select_all(action="DESELECT")
            item.select_set(True)
            bpy.ops.object.duplicate(linked=self.random.random() < 0.5)

    def do_delete(self):
        self.leave_edit_mode()
        item = self.object()
        if item is not None and item.type != "CAMERA":
            bpy.ops.object.select_all(action="DESELECT")
            item.select_set(True)
            bpy.ops.object.delete()

    def do_move(self):
        item = self.object()
        if item is not None:
            item.location = self.place()

    def do_hide(self):
        item = self.object()
        if item is not None and bpy.context.mode == "OBJECT":
            item.hide_set(not item.hide_get())

    def do_undo(self):
        if bpy.ops.ed.undo.poll():
            bpy.ops.ed.undo()

    def do_redo(self):
        if bpy.ops.ed.redo.poll():
            bpy.ops.ed.redo()

    def do_switch_mode(self):
        item = self.object("MESH")
        if item is not None and item.visible_get():
            self.leave_edit_mode()
            bpy.context.view_layer.objects.active = item
            bpy.ops.object.mode_set(mode=self.random.choice(("EDIT", "SCULPT", "OBJECT")))

    def do_paint_material(self):
        item = self.object("MESH")
        if item is None:
            return
        if not item.data.materials:
            item.data.materials.append(bpy.data.materials.new("Paint"))
        material = item.data.materials[0]
        tree = material and material.node_tree
        for node in tree.nodes if tree else ():
            if node.type == "BSDF_PRINCIPLED":
                colour = [self.random.random() for _ in range(3)]
                node.inputs["Base Color"].default_value = (*colour, 1)
                node.inputs["Transmission Weight"].default_value = self.random.choice((0, 0, 1))

    def do_texture(self):
        item = self.object("MESH")
        material = item and item.active_material
        if material and material.node_tree and "Principled BSDF" in material.node_tree.nodes:
            tree = material.node_tree
            kind = self.random.choice(("ShaderNodeTexNoise", "ShaderNodeAttribute"))
            node = tree.nodes.new(kind)
            tree.links.new(node.outputs["Color"], tree.nodes["Principled BSDF"].inputs[0])

    def do_modify(self):
        item = self.object("MESH")
        if item is not None and len(item.modifiers) < 2:
            item.modifiers.new("Cut", self.random.choice(("SUBSURF", "BEVEL", "WIREFRAME")))
        elif item is not None:
            item.modifiers.clear()

    def do_light(self):
        item = self.object("LIGHT")
        if item is not None:
            item.data.energy = self.random.uniform(0, 1000)

    def do_world(self):
        world = bpy.context.scene.world
        if world and world.node_tree and "Background" in world.node_tree.nodes:
            strength = world.node_tree.nodes["Background"].inputs["Strength"]
            strength.default_value = self.random.random()

    def do_setting(self):
        bpy.context.scene.penumbra.max_bounces = self.random.randrange(6)

    def do_frame(self):
        bpy.context.scene.frame_set(self.random.randrange(1, 20))

    def do_orbit(self):
        bpy.ops.view3d.view_orbit(angle=self.random.uniform(-1, 1), type="ORBITRIGHT")

    def do_zoom(self):
        bpy.ops.view3d.zoom(delta=self.random.choice((-1, 1)))

    def do_look(self):
        kind = self.random.choice(("FRONT", "TOP", "LEFT"))
        bpy.ops.view3d.view_axis(type=kind)

    def do_camera(self):
        if bpy.context.scene.camera:
            bpy.ops.view3d.view_camera()

    def do_shading(self):
        kind = self.random.choice(("SOLID", "RENDERED", "RENDERED", "WIREFRAME"))
        bpy.context.space_data.shading.type = kind

    def do_split(self):
        if len(w.areas()) < 3 and bpy.context.area.width > 200:
            bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
        elif len(w.areas()) > 1:
            bpy.ops.screen.area_close()

    def do_border(self):
        space = bpy.context.space_data
        space.use_render_border = not space.use_render_border
        space.render_border_min_x = self.random.uniform(0, 0.9)

    def do_local_view(self):
        if bpy.context.selected_objects and bpy.context.mode == "OBJECT":
            bpy.ops.view3d.localview(frame_selected=False)

    def do_render(self):
        self.leave_edit_mode()
        bpy.context.scene.camera = bpy.data.objects.get("Camera")
        if bpy.context.scene.camera and not bpy.app.is_job_running("RENDER"):
            bpy.ops.render.render("INVOKE_DEFAULT")

    def do_cancel(self):
        if bpy.app.is_job_running("RENDER"):
            w._xdotool("key", w.ESCAPE)


def choose():
    """Choose the engine: in a new file, and where undo has gone back to before that."""
    scene = bpy.context.scene
    scene.render.engine = ENGINE
    scene.render.preview_pixel_size = "4"
    scene.render.resolution_percentage = 10
    scene.penumbra.samples, scene.penumbra.preview_samples = 16, 4


def prepare():
    """Open a new file, and show it rendered."""
    bpy.ops.wm.read_homefile(app_template="")
    choose()
    for area in w.areas():
        area.spaces.active.shading.type = "RENDERED"


def drive(found):
    """Edit at random for a while; tell how it went.

    Memory is what it is with a new file: else it would be that of what has been made so far.
    """
    seed, seconds, *most = map(int, os.environ["PENUMBRA_SOAK"].split())
    bpy.context.preferences.view.render_display_type = "NONE"
    prepare()
    yield 0.5
    user, done = User(seed), {}
    found.update(edits=done, memory=[], errors=[], settled=0)
    end = time.monotonic() + seconds
    count = 0
    while time.monotonic() < end and (not most or count < most[0]):
        name = user.act()
        found["log"].append(name)
        done[name] = done.get(name, 0) + 1
        yield user.random.choice((0.02, 0.05, 0.3))
        count += 1
        if count % SETTLE == 0:
            yield lambda: not bpy.app.is_job_running("RENDER")
            if bpy.context.mode != "OBJECT":
                with w.here():
                    bpy.ops.object.mode_set(mode="OBJECT")
            yield 0.3
            yield w.done()
            found["settled"] += 1
            errors = {each.error or each.drawn.error for each in w.viewport.sessions}
            found["errors"] += sorted(errors - {""})
            if found["settled"] % ROUND == 0:
                prepare()
                yield 1.0
                yield w.done()
                w.trim()
                found["memory"].append(w.memory())
    found["render errors"] = list(w.report.errors)
    found["log"] = found["log"][-40:]
    for area in w.areas():
        area.spaces.active.shading.type = "SOLID"
    yield 2.0
    found["sessions"] = len(w.viewport.sessions)
    found["threads"] = [each.name for each in threading.enumerate() if "penumbra" in each.name]


w.run(drive)
