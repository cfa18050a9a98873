"""numbers -> far_away.blend: a stone circle ten kilometres from the origin, on a ground as wide.

Look at the ground: two triangles of ten kilometres, tilted by four degrees, under a low sun. It
has no speckle, the stones' shadows start where the stones stand, and the horizon is straight.
"""

import math
import random

import bpy
from _stage import box, camera, lamp, matte, mesh, mirror, orb, put, save, start
from mathutils import Matrix

start(720, 405, exposure=0.3, world=(0.16, 0.27, 0.46), max_bounces=6, diffuse_bounces=4)
heath, stone, moss = (
    matte("Heath", (0.42, 0.30, 0.16)),
    matte("Stone", (0.46, 0.43, 0.40)),
    matte("Worn stone", (0.34, 0.35, 0.33)),
)
half, dice = 5000.0, random.Random(7)
ground = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
put("Ground", mesh(ground, [(0, 1, 2, 3)]), heath)

# Two rings of standing stones, the outer one with lintels, about a mirror ball.
for k in (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 13, 14, 15):
    angle = 2 * math.pi * (k + 0.5) / 16
    x, y, turn = 9 * math.cos(angle), 9 * math.sin(angle), math.degrees(angle)
    tall = 4.2 + dice.uniform(-0.1, 0.1)
    lean = (dice.uniform(-2, 2), dice.uniform(-2, 2), turn + dice.uniform(-6, 6))
    put(f"Stone {k}", box(0.8, 1.7, tall), dice.choice((stone, moss)), (x, y, tall / 2), lean)
    if k not in (2, 3, 10, 13):
        angle += math.pi / 16
        x, y, turn = 9 * math.cos(angle), 9 * math.sin(angle), math.degrees(angle)
        put(f"Lintel {k}", box(1.0, 3.6, 0.7), stone, (x, y, 4.6), (0, 0, turn))
for k in range(9):
    angle = 2 * math.pi * k / 9 + 0.3
    place, turn = (5.2 * math.cos(angle), 5.2 * math.sin(angle)), math.degrees(angle)
    tall = dice.uniform(1.2, 2.4)
    put(f"Inner {k}", box(0.5, 0.9, tall), moss, (*place, tall / 2), (0, 0, turn))
orb("Ball", 1.3, mirror("Silver", (0.93, 0.93, 0.92)), at=(0, 0, 1.3))

sun = {"angle": math.radians(2)}
lamp("Sun", "SUN", 6.5, (0, 0, 0), (5.0, -2.4, -2.5), (1, 0.76, 0.48), **sun)
camera(at=(2.5, -28, 5.6), to=(0.5, 0, 2.5), lens=42, clip_end=20000)

# Take all of it ten kilometres away and tilt it.
bpy.context.view_layer.update()
far = Matrix.Translation((8000, 6000, 300)) @ Matrix.Rotation(math.radians(4), 4, (0.6, 0.8, 0))
for thing in bpy.context.scene.objects:
    thing.matrix_world = far @ thing.matrix_world
save(__file__)
