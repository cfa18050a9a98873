"""a seed -> a .blend that nobody meant.  Random data and values, through Blender itself.

A few objects of random types get random data, materials and nodes; then properties of all of
these, of the scene and of our settings get values from their extremes.  What is asked of a render
is what is asked of fuzzed descriptions: a picture without a NaN or an infinity, or an error with a
message that names something.  Seeds that end Blender are rendered again by an engine that draws
nothing: what ends Blender then, too, is its own.
"""

import json
import math
import os
import random
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

import penumbra
from penumbra import core
from penumbra.addon import report
from penumbra.core.render import Picture

FLOATS = (
    *(0.0, -0.0, 1.0, -1.0, 0.5, 1e-45, 1e-30, 1e-8, 1e3, 1e8, 1e30, 3.4e38, -1e12),
    *(math.pi, math.nan, math.inf, -math.inf),
)
INTS = (0, 1, -1, 2, 7, 255, -(1 << 31), (1 << 31) - 1)
TEXTS = (
    "",
    " ",
    "Nonsense",
    "UVMap",
    "Col",
    "\u00e4\U0001f600",
    "x" * 60,
    "../..",
    "\t\n",
    "a.b:c",
)

# Properties that say how much work there is, for Blender or for us; and those that Blender's own
# interface never lets anybody set in a scene that is to be rendered
LEFT_OUT = {
    *("name", "filepath", "frame_current", "frame_start", "frame_end", "frame_step", "engine"),
    *("use_fake_user", "use_extra_user", "tag", "is_runtime_data", "use_nodes", "mode", "tile_x"),
    *("users_remap", "resolution_x", "resolution_y", "resolution_percentage", "threads"),
    *("samples", "total_samples", "preview_samples", "max_bounces", "scatter_samples"),
    *("light_samples", "texture_memory", "instance_memory", "sample_offset", "time_limit"),
    *("sample_subset_length", "subsurface_subdivision", "workers", "use_denoising"),
    *("use_simplify", "threads_mode", "use_multiview", "film_size", "views_format", "fps"),
    *("fps_base", "frame_map_old", "frame_map_new", "use_sequencer", "use_compositing"),
    *("use_border", "use_persistent_data", "sync_mode", "use_freestyle", "parent", "data"),
    *("hide_render", "instance_type", "node_tree", "tool_settings", "use_motion_blur"),
}
WORK = ("resolution", "levels", "segments", "count", "_res", "dimension", "iterations", "step")
OBJECTS = ("mesh", "curve", "text", "meta", "light", "camera", "empty", "points")
LIGHTS = ("POINT", "SUN", "SPOT", "AREA")
MATERIAL_NODES = sorted(
    name
    for name in dir(bpy.types)
    if name.startswith("ShaderNode") and name not in ("ShaderNode", "ShaderNodeTree")
)
SIZE = 12  # pixels
DEEP = 2  # properties of properties that are looked at


class Fuzzer:
    """Builds a scene and spoils it, by the numbers of a seed."""

    def __init__(self, seed: int) -> None:
        self.dice = random.Random(seed)  # noqa: S311  (no secrets)
        self.rate = (0.01, 0.05, 0.2)[seed % 3]
        self.things: list[bpy.types.ID] = []

    # What is there

    def build(self) -> None:
        """Make some objects with materials, a world and a camera."""
        dice, scene = self.dice, bpy.context.scene
        for _ in range(dice.randint(1, 5)):
            thing = self.object(dice.choice(OBJECTS))
            scene.collection.objects.link(thing)
            thing.location = [dice.uniform(-2, 2) for _ in range(3)]
            thing.scale = [dice.choice((1, 1, 1, -0.5, 2, 0)) for _ in range(3)]
            if hasattr(thing.data, "materials"):
                for _ in range(dice.randint(0, 3)):
                    thing.data.materials.append(dice.choice((None, self.material())))
            self.things += [thing, *([thing.data] if thing.data else [])]
        camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        camera.location = (0, 0, 6)
        scene.collection.objects.link(camera)
        scene.camera = camera
        scene.world = bpy.data.worlds.new("World")
        self.nodes(scene.world)
        self.things += [camera, camera.data, scene.world, scene, *bpy.data.materials]

    def object(self, kind: str) -> bpy.types.Object:
        """Return a new object with data of a kind."""
        data, dice = bpy.data, self.dice
        made = None
        if kind == "mesh":
            made = self.mesh()
        elif kind == "curve":
            made = data.curves.new("Curve", "CURVE")
            made.dimensions, made.bevel_depth = "3D", dice.choice((0, 0.1))
            made.splines.new("POLY").points.add(dice.randint(0, 5))
        elif kind == "text":
            made = data.curves.new("Text", "FONT")
            made.body = dice.choice(TEXTS)
        elif kind == "meta":
            made = data.metaballs.new("Meta")
            made.elements.new().radius = dice.choice((1.0, 0.0, 2.0))
        elif kind == "light":
            made = data.lights.new("Light", dice.choice(LIGHTS))
            if hasattr(made, "use_nodes") and dice.random() < 0.5:
                self.nodes(made)
        elif kind == "camera":
            made = data.cameras.new("Other")
        elif kind == "points":
            made = data.pointclouds.new("Points") if hasattr(data, "pointclouds") else None
        return data.objects.new(kind.title(), made)

    def mesh(self) -> bpy.types.Mesh:
        """Return a mesh of random faces, some of which are none."""
        dice = self.dice
        count = dice.choice((0, 1, 3, 4, 8, 30))
        corners = [[dice.uniform(-1, 1) for _ in range(3)] for _ in range(count)]
        corners = [
            self.spoilt(corner) if dice.random() < self.rate else corner for corner in corners
        ]
        faces = []
        for _ in range(dice.randint(0, count)):
            size = min(count, dice.choice((3, 3, 4, 5)))
            faces += [dice.sample(range(count), size)] if size > 2 else []
        mesh = bpy.data.meshes.new("Mesh")
        mesh.from_pydata(corners, [], faces)
        if dice.random() < 0.5:
            mesh.uv_layers.new(name=dice.choice(TEXTS) or "UVMap")
        if dice.random() < 0.5:
            kind = dice.choice(("FLOAT", "FLOAT_COLOR", "FLOAT_VECTOR", "BOOLEAN", "INT"))
            domain = dice.choice(("POINT", "EDGE", "FACE", "CORNER"))
            mesh.attributes.new(dice.choice(TEXTS) or "Col", kind, domain)
        for face in mesh.polygons:
            face.material_index = dice.choice((0, 0, 1, 5, 300))
            face.use_smooth = dice.random() < 0.5
        return mesh

    def spoilt(self, values):
        return [self.dice.choice(FLOATS) for _ in values]

    def material(self) -> bpy.types.Material:
        """Return a material with a random tree."""
        made = bpy.data.materials.new("Material")
        self.nodes(made)
        return made

    def nodes(self, owner: bpy.types.ID) -> None:
        """Add random nodes and links to a tree; most of what can be wrong is."""
        dice = self.dice
        owner.use_nodes = True
        tree = owner.node_tree
        for _ in range(dice.randint(0, 8)):
            try:
                tree.nodes.new(dice.choice(MATERIAL_NODES))
            except RuntimeError:
                continue  # not for this sort of tree
        outputs = [socket for node in tree.nodes for socket in node.outputs]
        inputs = [socket for node in tree.nodes for socket in node.inputs]
        for _ in range(dice.randint(0, 12)):
            if outputs and inputs:
                tree.links.new(dice.choice(outputs), dice.choice(inputs))
        for socket in inputs:
            if hasattr(socket, "default_value") and dice.random() < 2 * self.rate:
                self.set(socket, "default_value", socket.bl_rna.properties["default_value"])
        for node in tree.nodes:
            node.mute = dice.random() < 0.05
            self.spoil(node)

    # What is wrong with it

    def spoil(self, thing: bpy.types.bpy_struct, depth: int = 0) -> None:
        """Set some properties of a thing, and of what it holds, to values that nobody meant."""
        for property_ in list(thing.bl_rna.properties):
            name = property_.identifier
            if name in LEFT_OUT or name.startswith("bl_") or any(word in name for word in WORK):
                continue
            if property_.type == "POINTER":
                held = getattr(thing, name, None)
                is_part = held is not None and not isinstance(held, bpy.types.ID)
                if (
                    is_part
                    and depth < DEEP
                    and name not in ("id_data", "rna_type", "animation_data")
                ):
                    self.spoil(held, depth + 1)
                elif not property_.is_readonly and self.dice.random() < self.rate / 2:
                    self.point(thing, name, property_)
            elif not property_.is_readonly and self.dice.random() < self.rate:
                self.set(thing, name, property_)

    def set(self, thing, name, property_) -> None:
        """Set one property; Blender may clamp or refuse what it likes."""
        dice = self.dice
        kind = property_.type
        values: object
        if kind == "FLOAT":
            values = dice.choice(FLOATS)
        elif kind == "INT":
            values = dice.choice(INTS)
        elif kind == "BOOLEAN":
            values = dice.random() < 0.5
        elif kind == "STRING":
            values = dice.choice(TEXTS)
        elif kind == "ENUM" and not property_.is_enum_flag:
            values = dice.choice([item.identifier for item in property_.enum_items] or [""])
        else:
            return
        try:
            if getattr(property_, "is_array", False):
                held = list(getattr(thing, name))
                place = dice.randrange(len(held))
                held[place] = values
                values = held
            setattr(thing, name, values)
        except (TypeError, ValueError, AttributeError, RuntimeError):
            return

    def point(self, thing, name, property_) -> None:
        """Let a pointer show to something else of its type, or nothing."""
        kind = property_.fixed_type.identifier
        found = [each for each in self.things if type(each).__name__ == kind]
        try:
            setattr(thing, name, self.dice.choice([None, *found]))
        except (TypeError, ValueError, AttributeError, RuntimeError):
            return


class Nothing(bpy.types.RenderEngine):
    """An engine that looks at what there is and draws nothing."""

    bl_idname = "NOTHING"
    bl_label = "Nothing"

    def render(self, depsgraph):
        for _ in depsgraph.object_instances:
            pass


def outcome(seed: int, engine: str) -> str:
    """Render a fuzzed scene and return 'drawn', 'refused: message' or 'wrong: what'."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if not hasattr(bpy.types.Scene, "penumbra"):
        penumbra.register()
        bpy.utils.register_class(Nothing)
    scene = bpy.context.scene
    fuzzer = Fuzzer(seed)
    fuzzer.build()
    for thing in fuzzer.things:
        fuzzer.spoil(thing)
    render = scene.render
    render.resolution_x = render.resolution_y = SIZE
    render.resolution_percentage = 100
    scene.penumbra.samples, scene.penumbra.use_denoising = 2, False
    render.engine = engine
    report.errors.clear()
    with pictures() as found:
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            if not report.errors:
                return f"refused: {error}"  # by Blender, before it came to us
    if report.errors:
        return judged(report.errors[0])
    for picture in found:
        for values in (picture.combined(), *(pixels for _, pixels in picture.passes())):
            if not np.isfinite(values).all():
                return "wrong: NaN or infinite pixels"
    return "drawn"


@contextmanager
def pictures() -> Iterator[list[Picture]]:
    """Give a list that gets all pictures that the engine makes meanwhile."""
    found: list[Picture] = []
    make = core.render

    def keep(*of, **more):
        found.append(make(*of, **more))
        return found[-1]

    core.render = keep
    try:
        yield found
    finally:
        core.render = make


def judged(said: str) -> str:
    """Return what an error message is: one that helps, or an exception that nobody caught."""
    head = said.partition(":")[0]
    is_raw = head.endswith(("Error", "Exception", "Warning")) and " " not in head
    return f"wrong: {said}" if is_raw or len(said) < 10 else f"refused: {said}"


def main(target: str, engine: str, first: int, count: int) -> None:
    """Write the outcome of each seed to a file, a line of JSON as soon as it is known."""
    with Path(target).open("w", encoding="utf-8") as file:
        for seed in range(first, first + count):
            file.write(json.dumps(outcome(seed, engine)) + "\n")
            file.flush()


if __name__ == "__main__":
    main(*sys.argv[1:3], *map(int, sys.argv[3:]))
    os._exit(0)  # Blender may hang when it ends
