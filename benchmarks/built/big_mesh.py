"""numbers -> a wavy carpet of two million triangles.  Export and build, and next to no rays.

The variant `viewport` has half a million and a material.
"""

import bpy
import numpy as np


def build(variant: str = "") -> None:
    """Make a wavy carpet of two million triangles, seen in 16 x 16 pixels, in an empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    count = 500 if variant == "VIEWPORT" else 1000
    x, y = np.meshgrid(*[np.linspace(-1, 1, count + 1, dtype=np.float32)] * 2)
    positions = np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], axis=-1).reshape(-1, 3)
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    a, b, c, d = first, first + 1, first + count + 2, first + count + 1
    corners = np.stack([a, b, c, a, c, d], axis=1).ravel().astype(np.int32)

    mesh = bpy.data.meshes.new("Carpet")
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", positions.ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(corners) // 3)
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    mesh.update(calc_edges=True)
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
