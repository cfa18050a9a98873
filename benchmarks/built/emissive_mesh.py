"""numbers -> a Cornell-like room lit by glowing meshes only.

A sign of neon tubes on the back wall (13,000 triangles or so that wind about each other), a
torus that glows on the floor, and a panel under the ceiling. There are no lamps, and no world.
"""

import bpy
import numpy as np

from ...examples._stage import box, camera, glow, matte, put
from .shapes import begin, lathe, metal, plastic, soft_box


def build():
    """Make the room in an empty file."""
    begin(320, 320, exposure=0.2)
    white, thick = matte("White", (0.73, 0.72, 0.70)), 0.1
    red, green = matte("Red", (0.60, 0.06, 0.05)), matte("Green", (0.10, 0.42, 0.10))
    for name, size, at, material in (
        ("Floor", (2.2, 3.2, thick), (0, 0, -0.05), white),
        ("Ceiling", (2.2, 3.2, thick), (0, 0, 2.05), white),
        ("Back", (2.2, thick, 2.0), (0, 1.05, 1.0), white),
        ("Left", (thick, 3.2, 2.0), (-1.05, 0, 1.0), red),
        ("Right", (thick, 3.2, 2.0), (1.05, 0, 1.0), green),
    ):
        put(name, box(*size), material, at=at)
    put("Block", soft_box(0.5, 0.5, 1.0, 0.02), white, at=(-0.42, 0.35, 0.501), turn=(0, 0, 20))
    put("Cube", soft_box(0.46, 0.46, 0.46, 0.03), plastic("Plastic", (0.05, 0.16, 0.42)),
        at=(0.5, 0.1, 0.231), turn=(0, 0, -18))  # fmt: skip
    put("Ball", _torus(0, 0.2, 64, 48), metal("Brass", (0.92, 0.70, 0.34)), at=(0.47, 0.08, 0.67))

    put("Panel", box(0.7, 0.7, 0.02), glow("Panel", (1.0, 0.93, 0.82), 5.0), at=(0, 0, 1.97))
    put("Ring", _torus(0.22, 0.025, 96, 16), glow("Ring", (1.0, 0.45, 0.15), 14.0),
        at=(-0.1, -0.5, 0.03))  # fmt: skip
    _sign("Neon", 0.62, (0.0, 0.95, 1.5), glow("Neon", (1.0, 0.12, 0.38), 16.0))
    camera(at=(0, -3.85, 1.0), to=(0, 0, 1.0), lens=40)


def _torus(major, minor, around, across):
    angle = np.linspace(-np.pi / 2, 3 * np.pi / 2, across + 1)
    profile = [(major + minor * np.cos(a), minor * np.sin(a)) for a in angle]
    if major == 0:
        half = across // 2
        profile = [(0, -minor), *profile[1:half], (0, minor)]
    return lathe(profile, around)


def _sign(name, size, at, material):
    """Put a word whose outlines are tubes, upright, facing the viewer."""
    text = bpy.data.curves.new(name, "FONT")
    text.body, text.size, text.align_x, text.align_y = "neon", size, "CENTER", "CENTER"
    text.fill_mode, text.dimensions = "NONE", "3D"
    text.bevel_depth, text.bevel_resolution, text.resolution_u = 0.014, 3, 6
    put(name, text, material, at=at, turn=(90, 0, 0))
