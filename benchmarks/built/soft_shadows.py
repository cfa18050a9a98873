"""numbers -> matte rods, boxes and balls on a floor, and the penumbrae of three large lamps.

A rectangle, a disk and a ball of light: whoever can sample their solid angles has little noise.
All is diffuse, so that any renderer can draw it.
"""

from ...examples._stage import ball, box, camera, cone, lamp, matte, put
from .shapes import begin


def build():
    """Make the things and their lamps in an empty file."""
    begin(320, 240)
    plaster, clay, ink = (
        matte("Plaster", (0.70, 0.68, 0.64)),
        matte("Clay", (0.60, 0.24, 0.12)),
        matte("Ink", (0.10, 0.16, 0.28)),
    )
    put("Floor", box(16, 12, 0.2), plaster, at=(0, 0, -0.1))
    put("Wall", box(16, 0.2, 2.5), plaster, at=(0, 3.0, 1.25))

    # Rods that stand ever farther from the wall, and things between them.
    for k in range(9):
        x = -2.4 + 0.6 * k
        put(f"Rod {k}", cone(0.05, 0.05, 1.6, 24, True), ink, at=(x, 2.6 - 0.4 * k, 0))
    put("Box", box(0.7, 0.7, 1.1), clay, at=(-1.3, -0.2, 0.55), turn=(0, 0, 28))
    put("Ball", ball(0.5), clay, at=(1.5, 0.9, 0.501))
    put("Shelf", box(1.6, 0.7, 0.05), plaster, at=(0.2, 1.2, 1.9), turn=(0, 0, -12))
    for k in range(4):
        put(f"Cone {k}", cone(0.16, 0.0, 0.5, 32), plaster, at=(-0.6 + 0.55 * k, -1.5, 0))

    wide = {"shape": "RECTANGLE", "size": 2.4, "size_y": 0.5}
    lamp("Rectangle", "AREA", 160, (-3.0, -1.6, 3.6), (0, 0.5, 0.4), (1, 0.86, 0.7), **wide)
    lamp(
        "Disk", "AREA", 130, (3.4, -1.2, 3.0), (0, 0.6, 0.4), (0.74, 0.86, 1), shape="DISK", size=1
    )
    lamp("Globe", "POINT", 60, (0.3, -2.6, 2.6), shadow_soft_size=0.3)
    camera(at=(0, -7.2, 2.9), to=(0, 0.5, 0.9), lens=44)
