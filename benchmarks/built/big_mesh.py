"""numbers -> a wavy carpet of two million triangles.  Export and build, and next to no rays.

The variant `viewport` has half a million and a material.
"""

import bpy
import numpy as np

from .five_million import sheet


def build(variant: str = "") -> None:
    """Make a wavy carpet of two million triangles, seen in 16 x 16 pixels, in an empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    count = 500 if variant == "VIEWPORT" else 1000
    x, y = np.meshgrid(*[np.linspace(-1, 1, count + 1, dtype=np.float32)] * 2)
    mesh = sheet("Carpet", np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], axis=-1))
    if variant == "VIEWPORT":
        mesh.materials.append(bpy.data.materials.new("Wool"))
        mesh.materials[0].use_nodes = True

    scene = bpy.context.scene
    lamp, camera = bpy.data.lights.new("Sun", "SUN"), bpy.data.cameras.new("Camera")
    for name, data, height in (("Carpet", mesh, 0), ("Sun", lamp, 3), ("Camera", camera, 3)):
        thing = bpy.data.objects.new(name, data)
        thing.location.z = height
        scene.collection.objects.link(thing)
    scene.camera = scene.objects["Camera"]
    scene.render.resolution_x = scene.render.resolution_y = 16
