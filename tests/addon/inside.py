"""bpy scenes for the tests of the add-on.  Imported inside of Blender only, see conftest.py."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np

import penumbra
from penumbra import core
from penumbra.core.scene import Cancelled


def empty_scene(width=16, height=8):
    """Return a scene with a camera at (0, 0, 10) that looks down, and the engine chosen."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    penumbra.register()
    scene = bpy.context.scene
    scene.render.engine = "PENUMBRA"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.penumbra.samples = 2
    scene.camera = add("Camera", bpy.data.cameras.new("Camera"), location=(0, 0, 10))
    return scene


def add(name, data, collection=None, **properties):
    """Link a new object into the scene, or a collection of its own."""
    item = bpy.data.objects.new(name, data)
    for key, value in properties.items():
        setattr(item, key, value)
    (collection or bpy.context.scene.collection).objects.link(item)
    return item


def mesh(name="Triangle", vertices=((0, 0, 0), (1, 0, 0), (0, 1, 0)), faces=((0, 1, 2),)):
    """Return a new mesh, flat shaded."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    data.update()
    return data


def exported():
    """Press F12, and return the core's scene and settings instead of rendering them."""
    seen = []

    def compile_plan(scene, settings, **_):
        seen.append((scene, settings))
        raise Cancelled

    original = getattr(core, "compile_plan", None)
    core.compile_plan = compile_plan
    try:
        bpy.ops.render.render()
    finally:
        core.compile_plan = original
    return seen[0]


def counts(scene):
    """Return how many instances there are by name."""
    names = [instance.name for instance in scene.instances]
    return {name: names.count(name) for name in names}


def corners(instance):
    """Return the triangles' corners (F, 3, 3) in the world."""
    positions = instance.mesh.positions.astype(np.float64)
    world = positions @ instance.to_world[:, :3].T + instance.to_world[:, 3]
    return world[instance.mesh.triangles]


def pixels(path):
    """Return the pixels (H, W, 4) of a picture file, the bottom row first."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    flat = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(flat)
    return flat.reshape(image.size[1], image.size[0], 4)


def exr_header(path):
    """Return the text attributes of an EXR file's first part."""
    data = Path(path).read_bytes()
    at, found = 8, {}
    while data[at]:
        name, kind, rest = data[at:].split(b"\0", 2)
        size = int.from_bytes(rest[:4], "little")
        if kind == b"string":
            found[name.decode()] = rest[4 : 4 + size].decode()
        at += len(name) + len(kind) + 2 + 4 + size
    return found


def use_exr(scene, path, multilayer=False):
    """Write float32 EXR files, of one or of several layers, to `path`."""
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE" if multilayer else "IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER" if multilayer else "OPEN_EXR"
    image.color_depth = "32"
    scene.render.filepath = str(path)


def glowing(colour=(1.0, 1.0, 1.0), name="Glow"):
    """Return a material that emits."""
    return shaded("ShaderNodeEmission", colour, name)


def shaded(kind, colour, name):
    """Return a material of one shader node of this colour."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    shader = tree.nodes.new(kind)
    shader.inputs["Color"].default_value = (*colour, 1)
    tree.links.new(shader.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    return material


class Layout:
    """Stands in for Blender's layout: notes what a panel shows, and where Blender would object."""

    def __init__(self, shown=None):
        self.shown = [] if shown is None else shown

    def __getattr__(self, name):
        if name not in ("row", "column", "box", "split", "grid_flow"):
            raise AttributeError(name)
        return lambda **_: Layout(self.shown)

    def prop(self, data, name, text=None, **_):
        """Show a property."""
        prop = data.bl_rna.properties[name]
        self.shown.append(("prop", name, prop.name if text is None else text))

    def prop_search(self, data, name, *_, **__):
        """Show a property with a list to choose from."""
        self.prop(data, name)

    def template_ID(self, data, name, **_):  # noqa: N802  (Blender's name)
        """Show a choice of datablocks."""
        self.prop(data, name)

    def popover(self, panel, **_):
        """Show a button that opens a panel."""
        self.shown.append(("popover", panel, None))

    def operator(self, name, **_):
        """Show a button; return what its properties are set on."""
        properties = SimpleNamespace()
        self.shown.append(("operator", name, properties))
        return properties

    def label(self, text="", **_):
        """Show a text."""
        self.shown.append(("label", text, None))

    def template_curve_mapping(self, data, name, **_):
        """Show a curve."""
        self.prop(data, name)

    def template_preview(self, data):
        """Show a picture of a datablock."""
        self.shown.append(("preview", data.name, None))

    def names(self):
        """Return the properties and operators that are shown."""
        return [name for kind, name, _ in self.shown if kind in ("prop", "operator")]
