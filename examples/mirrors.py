"""numbers -> mirrors.blend: a hall between two mirrors that face each other.

Look along the tunnel: the same things return again and again, each time a little darker and
greener by the colour of the metal, until the limit of 32 reflections. In the golden ball the
tunnel is seen once more, and in the steel one the golden ball.
"""

import math

from _stage import ball, box, camera, cone, glow, lamp, matte, mesh, mirror, orb, put, save, start

start(720, 450, world=(0.03, 0.05, 0.09), max_bounces=36, glossy_bounces=32)
silver, gold, steel = (
    mirror("Silver", (0.90, 0.96, 0.93)),
    mirror("Gold", (1.0, 0.71, 0.29)),
    mirror("Steel", (0.66, 0.70, 0.76)),
)
dark, light, red = (
    matte("Dark stone", (0.06, 0.07, 0.09)),
    matte("Light stone", (0.60, 0.58, 0.54)),
    matte("Red", (0.55, 0.05, 0.04)),
)

# A floor of tiles in two material slots, and the two mirrors in their frames.
tiles, points, faces = 9, [], []
for i in range(tiles + 1):
    points += [(0.4 * (i - tiles / 2), 0.4 * (j - tiles / 2), 0) for j in range(tiles + 1)]
for i in range(tiles):
    for j in range(tiles):
        a = i * (tiles + 1) + j
        faces.append((a, a + tiles + 1, a + tiles + 2, a + 1))
floor = put("Floor", mesh(points, faces), [dark, light]).data
floor.polygons.foreach_set("material_index", [k % 2 for k in range(tiles**2)])
for side in (-1, 1):
    put("Mirror", box(0.04, 3.2, 2.2), silver, at=(1.8 * side, 0, 1.1))
    for y in (-1.65, 1.65):
        put("Frame", box(0.1, 0.1, 2.2), red, at=(1.8 * side, y, 1.1))
    put("Lintel", box(0.1, 3.4, 0.1), red, at=(1.8 * side, 0, 2.25))

# A ring of small lamps over a golden ball on a plinth, and company.
for k in range(9):
    angle = 2 * math.pi * (k + 0.5) / 9
    place = (0.6 * math.cos(angle), 0.1 + 0.6 * math.sin(angle), 1.9)
    put(f"Bulb {k}", ball(0.05, 24), glow(f"Bulb {k}", (1.0, 0.72, 0.42), 30), at=place)
put("Plinth", cone(0.4, 0.34, 0.45, 8), light, at=(0, 0.1, 0), turn=(0, 0, 22.5))
orb("Golden ball", 0.4, gold, at=(0, 0.1, 0.85))
orb("Steel ball", 0.27, steel, at=(-0.75, -0.75, 0.27))
orb("Red ball", 0.2, red, at=(0.35, -0.95, 0.2))
put("Steel cone", cone(0.24, 0.0, 0.7, 5), steel, at=(-0.6, 1.05, 0))

lamp("Lamp", "AREA", 45, (0.3, -0.5, 3.2), (0, 0, 0), (0.85, 0.92, 1), shape="SQUARE", size=1.2)
camera(at=(1.72, -1.15, 1.5), to=(-1.8, 0.62, 0.75), lens=24)
save(__file__)
