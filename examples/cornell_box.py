"""numbers -> cornell_box.blend: a box of two metres, one lamp, one block, one ball.

Look at the soft edges of the two shadows, at the red and green that the walls throw on the block,
the ball and the floor, and at the ceiling, which only bounced light reaches.
"""

import math

from _stage import ball, camera, lamp, matte, mesh, put, save, start

WHITE, RED, GREEN = (0.73, 0.73, 0.73), (0.65, 0.05, 0.05), (0.12, 0.45, 0.15)

start(512, 512, view="Standard", exposure=0.5, max_bounces=4, diffuse_bounces=4)
white, red, green = matte("White", WHITE), matte("Red", RED), matte("Green", GREEN)

corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
walls = {
    "Floor": ((0, 4, 6, 2), white),
    "Ceiling": ((1, 3, 7, 5), white),
    "Back": ((2, 6, 7, 3), white),
    "Left": ((0, 2, 3, 1), red),
    "Right": ((4, 5, 7, 6), green),
}
for name, (face, material) in walls.items():
    put(name, mesh([corners[i] for i in face], [(0, 1, 2, 3)]), material)

half = [tuple(0.3 * c for c in corner) for corner in corners]
sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
turn = (0, 0, math.degrees(0.3))
put("Block", mesh(half, sides), white, at=(0.35, -0.3, -0.7), turn=turn)
put("Ball", ball(0.4, 64, smooth=False), white, at=(-0.35, 0.2, -0.6))

lamp("Lamp", "AREA", 20, at=(0, 0, 0.98), shape="SQUARE", size=0.5)
camera(at=(0, -3.9, 0), to=(0, 0, 0), lens=50, sensor_width=36)
save(__file__)
