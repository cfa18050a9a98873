"""numbers -> a row of pots on a table, seen through a wide lens: one of them is sharp.

The aperture has six blades; small bright beads far behind become hexagons.
"""

import bpy

from ...examples._stage import box, camera, glow, lamp, put
from .shapes import bead, begin, lathe, metal, plastic, rounded

FOCUS = 4.0  # [m]


def build():
    """Make the table in an empty file."""
    begin(336, 240, world=(0.05, 0.06, 0.08))
    pot = rounded([(0, 0), (0.20, 0), (0.30, 0.14), (0.24, 0.34), (0.15, 0.40), (0.19, 0.48)])
    colours = ((0.55, 0.12, 0.07), (0.08, 0.28, 0.30), (0.62, 0.44, 0.12), (0.5, 0.5, 0.48))
    put("Table", box(7, 12, 0.1), plastic("Wood", (0.26, 0.15, 0.08), 0.4), at=(0, 2, -0.05))
    put("Wall", box(16, 0.1, 8), plastic("Wall", (0.22, 0.24, 0.28), 0.8), at=(0, 8, 2))
    for k in range(7):
        shade = (
            plastic(f"Glaze {k}", colours[k % 4], 0.3) if k % 3 else metal(f"Tin {k}", colours[3])
        )
        put(f"Pot {k}", lathe(pot, 96), shade, at=(-1.35 + 0.45 * k, -1.9 + 0.85 * k, 0))
    bulb = glow("Bulb", (1.0, 0.75, 0.42), 12)
    for k in range(12):
        put(f"Bulb {k}", bead(0.05, 3), bulb, at=(-3.0 + 0.55 * k, 7.2, 1.5 + 0.35 * (k % 3)))
    lamp("Lamp", "AREA", 180, (-2.5, -1.5, 3.5), (0, 1, 0), size=1.2)
    camera(at=(0, -5.0, 1.25), to=(0, 0.5, 0.42), lens=70)
    lens = bpy.context.scene.camera.data.dof
    lens.use_dof, lens.focus_distance = True, FOCUS
    lens.aperture_fstop, lens.aperture_blades = 0.7, 6
