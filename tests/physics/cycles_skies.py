"""Cycles -> cycles_skies.json.  The skies that test_sky.py compares with; run with the bpy module.

Each sky is a world alone, seen by an equirectangular camera through a filter so narrow that a pixel
is the direction of its middle; every 32nd pixel of every 32nd row is kept.  Made with Cycles of
Blender 5.2.3.
"""

import json
import os
import sys
from pathlib import Path

FILE = Path(__file__).with_suffix(".json")
WIDTH, HEIGHT = 512, 256
KEPT = slice(16, None, 32)
AIR = {"air_density": 1.0, "aerosol_density": 1.0, "ozone_density": 1.0, "altitude": 100.0}
SUN = {"sun_disc": False, "sun_elevation": 0.26, "sun_rotation": 0.0}
BIG = {"sun_disc": True, "sun_size": 0.7, "sun_intensity": 0.5}  # so that pixels meet it
THICK = {"air_density": 2.0, "aerosol_density": 3.0, "ozone_density": 4.0}
SKIES = {
    "single": {"sky_type": "SINGLE_SCATTERING", **AIR, **SUN},
    "single low": {"sky_type": "SINGLE_SCATTERING", **AIR, **SUN, "sun_elevation": 0.03},
    "single thick": {"sky_type": "SINGLE_SCATTERING", **AIR, **SUN, **THICK, "altitude": 3000.0},
    "single sun": {"sky_type": "SINGLE_SCATTERING", **AIR, **SUN, **BIG, "sun_rotation": 1.0},
    "multiple": {"sky_type": "MULTIPLE_SCATTERING", **AIR, **SUN},
    "multiple low": {"sky_type": "MULTIPLE_SCATTERING", **AIR, **SUN, "sun_elevation": -0.05},
    "multiple thick": {"sky_type": "MULTIPLE_SCATTERING", **AIR, **SUN, **THICK},
    "multiple sun": {"sky_type": "MULTIPLE_SCATTERING", **AIR, **SUN, **BIG, "sun_elevation": 2.5},
    "preetham": {"sky_type": "PREETHAM", "sun_direction": (0.0, 0.0, 1.0), "turbidity": 2.2},
    "preetham low": {"sky_type": "PREETHAM", "sun_direction": (0.8, 0.3, 0.1), "turbidity": 6.0},
}


def render(properties: dict, path: Path) -> list:
    """Return the pixels of one sky, that are kept, the bottom row first: 8 x 16 x 3."""
    import bpy
    import numpy as np

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = 1, False
    scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.render.resolution_percentage = 100
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.panorama_type = "PANO", "EQUIRECTANGULAR"
    scene.camera = bpy.data.objects.new("Camera", camera)
    scene.camera.rotation_euler = np.pi / 2, 0, -np.pi / 2
    scene.collection.objects.link(scene.camera)
    scene.world = bpy.data.worlds.new("World")
    nodes = scene.world.node_tree.nodes
    sky = nodes.new("ShaderNodeTexSky")
    for name, value in properties.items():
        setattr(sky, name, value)
    background = next(node for node in nodes if node.bl_idname == "ShaderNodeBackground")
    scene.world.node_tree.links.new(sky.outputs[0], background.inputs[0])
    settings = scene.render.image_settings
    settings.media_type, settings.file_format, settings.color_depth = "IMAGE", "OPEN_EXR", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    picture = bpy.data.images.load(str(path))
    pixels = np.empty(WIDTH * HEIGHT * 4, np.float32)
    picture.pixels.foreach_get(pixels)
    rgb = pixels.reshape(HEIGHT, WIDTH, 4)[KEPT, KEPT, :3]
    return [[[float(f"{c:.6g}") for c in pixel] for pixel in row] for row in rgb]


if __name__ == "__main__":
    found = {name: render(each, FILE.with_suffix(".exr")) for name, each in SKIES.items()}
    FILE.with_suffix(".exr").unlink()
    lines = (f"{json.dumps(name)}: {json.dumps(sky)}" for name, sky in found.items())
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    sys.stdout.flush()
    os._exit(0)
