"""numbers -> balls of polished metal and clear glass between two mirrors, under a wide lamp.

Caustics are met by chance by all who trace paths from the camera; the lamp is so large that they
converge. Diffuse, perfect mirror and perfect glass: any renderer can draw it.
"""

from ...examples._stage import ball, box, camera, cone, glass, lamp, matte, put, surface
from .shapes import begin


def build():
    """Make the balls and the mirrors in an empty file."""
    begin(320, 240, world=(0.06, 0.07, 0.09))
    floor, tile = matte("Floor", (0.55, 0.52, 0.48)), matte("Tile", (0.12, 0.16, 0.22))
    silver, gold, copper = (
        surface("Silver", "BsdfAnisotropic", (0.92, 0.93, 0.94), Roughness=0.0),
        surface("Gold", "BsdfAnisotropic", (0.95, 0.70, 0.30), Roughness=0.0),
        surface("Copper", "BsdfAnisotropic", (0.90, 0.48, 0.34), Roughness=0.0),
    )
    clear, flint = glass("Clear", 1.45), glass("Flint", 1.65, (0.93, 1.0, 0.96))
    put("Floor", box(12, 12, 0.2), floor, at=(0, 0, -0.1))
    for k in range(25):
        x, y = k % 5 - 2, k // 5 - 2
        put(f"Tile {k}", box(0.5, 0.5, 0.02), tile, at=(0.9 * x, 0.9 * y, 0.011))
    put("Mirror 0", box(0.06, 4.4, 2.6), silver, at=(-2.7, 0.2, 1.35), turn=(0, 0, -12))
    put("Mirror 1", box(0.06, 4.4, 2.6), silver, at=(2.7, 0.2, 1.35), turn=(0, 0, 12))
    for name, material, radius, at in (
        ("Golden ball", gold, 0.6, (-0.9, 0.7)),
        ("Copper ball", copper, 0.32, (1.5, 1.4)),
        ("Glass ball", clear, 0.55, (0.55, -0.2)),
        ("Flint ball", flint, 0.3, (-0.75, -1.0)),
    ):
        put(name, ball(radius, 128), material, at=(*at, radius + 0.03))
    put("Glass block", box(0.5, 0.5, 0.9), clear, at=(1.4, -1.0, 0.49), turn=(0, 0, 30))
    put("Clay cone", cone(0.3, 0.0, 0.9, 48), matte("Clay", (0.6, 0.2, 0.1)), at=(0.1, 1.7, 0.02))
    lamp("Lamp", "AREA", 520, (-0.6, -0.8, 5), (0, 0.2, 0), shape="RECTANGLE", size=6, size_y=5)
    camera(at=(0.2, -6.6, 2.7), to=(0, 0, 0.65), lens=46)
