"""numbers -> lamps.blend: six kinds of lamp on the same six things, in the cells of a cabinet.

Look at the shadows of the rods on the back wall: sharp where a rod stands at the wall, softer the
farther it stands off. Above: point, spot, sun (through a slot in the roof). Below: a square, a
tall rectangle (sharp across, soft along) and a disk whose spread is narrowed to 60 degrees.
"""

import math

from _stage import ball, box, camera, cone, lamp, matte, put, save, start

start(720, 480, exposure=0.2, world=(0.012, 0.014, 0.018), max_bounces=6, diffuse_bounces=4)
plaster, rod, clay, black = (
    matte("Plaster", (0.70, 0.67, 0.62)),
    matte("Rod", (0.10, 0.15, 0.26)),
    matte("Clay", (0.62, 0.21, 0.10)),
    matte("Black", (0.02, 0.02, 0.02)),
)
wide, high, deep, thick = 2.0, 1.7, 1.8, 0.08

# The cabinet: shelves, uprights, back, and a roof with a slot over the cell of the sun. Uprights
# stand back from the edges of the shelves, so that no two faces share a plane.
for row in range(2):
    put(f"Shelf {row}", box(3 * wide + thick, deep, thick), plaster, at=(0, 0, row * high))
put("Roof", box(2 * wide + thick, deep, thick), plaster, at=(-wide / 2, 0, 2 * high))
put("Roof with a slot", box(wide, 0.8, thick), plaster, at=(wide, 0.5, 2 * high))
put("Lintel", box(wide, 0.05, thick), plaster, at=(wide, -deep / 2, 2 * high))
for column in range(4):
    x = (column - 1.5) * wide
    upright = box(thick, deep - 0.02, 2 * high - thick / 2)
    put(f"Upright {column}", upright, plaster, at=(x, 0, high))
put("Back", box(3 * wide, thick, 2 * high), plaster, at=(0, deep / 2 - 0.01, high))
put("Canopy that keeps the sun off the front", box(9, 4.2, 0.1), black, at=(0, -4.4, 4.6))

# The same things in each cell: a ball, and rods that stand ever farther from the wall.
things = [(ball(0.24), clay, (-0.5, -0.2, 0.28))]
for k in range(5):
    things.append((cone(0.04, 0.04, 0.9, 24, True), rod, (-0.3 + 0.24 * k, 0.8 - 0.14 * k, 0.0)))
for data, material, _ in things:
    data.materials.append(material)
for row in range(2):
    for column in range(3):
        for data, _, (x, y, z) in things:
            put(data.name, data, at=((column - 1) * wide + x, y, row * high + z))


def cell(column, row, x, y, z):
    """Return a place in a cell, from the middle of its floor."""
    return ((column - 1) * wide + x, y, row * high + z)


warm, cool = (1, 0.76, 0.52), (0.72, 0.86, 1)
above, front, middle = (-0.6, -0.75, 1.3), (-0.75, -0.7, 0.85), (0.2, 0.7, 0.45)
lamp("Point", "POINT", 40, cell(0, 1, *above), color=warm, shadow_soft_size=0.04)
spot = {"spot_size": math.radians(48), "spot_blend": 0.2, "shadow_soft_size": 0.04}
lamp("Spot", "SPOT", 190, cell(1, 1, -0.9, -1.5, 1.2), cell(1, 1, 0.2, 0.6, 0.5), cool, **spot)
lamp("Sun", "SUN", 6, (1.9, -5, 7.4), (2.2, -2.5, 5.2), (1, 0.9, 0.72), angle=math.radians(3))
square = {"shape": "SQUARE", "size": 0.2}
lamp("Square", "AREA", 22, cell(0, 0, *above), cell(0, 0, *middle), **square)
tall = {"shape": "RECTANGLE", "size": 0.03, "size_y": 0.9}
lamp("Rectangle", "AREA", 22, cell(1, 0, *front), cell(1, 0, *middle), warm, **tall)
disk = {"shape": "DISK", "size": 0.16, "spread": math.radians(60)}
lamp("Disk", "AREA", 7, cell(2, 0, -0.8, -1.3, 1.2), cell(2, 0, *middle), cool, **disk)
camera(at=(0, -10.6, 2.1), to=(0, 0, high), lens=56)
save(__file__)
