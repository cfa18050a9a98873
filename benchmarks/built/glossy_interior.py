"""numbers -> a living room.  Varnished floor, metal and plastic furniture, five area lamps.

The light comes through a window on the left, where an area lamp stands in for the sky, and from
four lamps under the ceiling. Most of what is seen has been reflected, sharply or not, by a
floor of roughness 0.25 and metals of 0.2.
"""

import math

import numpy as np

from ...examples._stage import ball, box, camera, cone, lamp, matte, put
from .shapes import begin, copies, lathe, metal, plastic, rounded, soft_box, suzanne

WIDTH, DEPTH, HEIGHT = 6.0, 5.0, 2.8


def build():
    """Make the room in an empty file."""
    begin(360, 232, world=(0.25, 0.33, 0.45), exposure=0.2)
    _shell()
    _table()
    _sofa()
    _shelf()
    lamp("Sky", "AREA", 170, (-3.06, 0.0, 1.55), (0, 0, 1.0), (0.78, 0.89, 1.0),
         shape="RECTANGLE", size=2.2, size_y=1.5)  # fmt: skip
    for x in (-1.2, 1.4):
        for y in (-1.2, 1.3):
            lamp("Ceiling lamp", "AREA", 22, (x, y, 2.72), color=(1.0, 0.86, 0.68),
                 shape="SQUARE", size=0.35)  # fmt: skip
    camera(at=(1.15, -2.35, 1.5), to=(-0.35, 1.2, 0.78), lens=24)


def _shell():
    # Planks with rounded edges, of four woods, each row moved along.
    random = np.random.default_rng(3)
    woods = [
        plastic(f"Wood {k}", color, 0.25)
        for k, color in enumerate(
            [(0.30, 0.15, 0.07), (0.24, 0.11, 0.05), (0.36, 0.19, 0.09), (0.28, 0.13, 0.06)]
        )
    ]
    rows, length, wide = 26, 1.25, DEPTH / 26
    for wood in range(4):
        places = []
        for row in range(rows):
            shift = length * (row * 0.37 % 1)
            for k in range(-1, 6):
                x = -WIDTH / 2 + shift + length * k
                if (row * 7 + k * 3) % 4 == wood:
                    places.append((x, -DEPTH / 2 + wide * (row + 0.5), -0.02))
        places = np.array(places) + random.uniform(-1, 1, (len(places), 1)) * (0, 0, 0.0006)
        plank = soft_box(length - 0.002, wide - 0.002, 0.04, 0.003, 1)
        put(f"Planks {wood}", copies(plank, places), woods[wood])

    # Walls; the left one leaves a window open.
    white, warm = matte("White wall", (0.76, 0.74, 0.70)), matte("Warm wall", (0.62, 0.33, 0.20))
    thick = 0.12
    put("Ceiling", box(WIDTH + 0.3, DEPTH + 0.3, thick), white, at=(0, 0, HEIGHT + thick / 2))
    put("Ground", box(WIDTH + 3, DEPTH + 0.3, thick), warm, at=(0, 0, -0.05 - thick / 2))
    for y, material in ((DEPTH / 2, white), (-DEPTH / 2, white)):
        at = (0, y + math.copysign(thick / 2, y), HEIGHT / 2)
        put("Wall", box(WIDTH + 0.3, thick, HEIGHT), material, at=at)
    put("Right wall", box(thick, DEPTH, HEIGHT), warm, at=(WIDTH / 2 + thick / 2, 0, HEIGHT / 2))
    x = -WIDTH / 2 - thick / 2
    for y in (-1.8, 1.8):
        put("Window wall", box(thick, 1.4, HEIGHT), white, at=(x, y, HEIGHT / 2))
    for z, tall in ((0.4, 0.8), (2.55, 0.5)):
        put("Window wall", box(thick, 2.2, tall), white, at=(x, 0, z))
    frame = plastic("Frame", (0.85, 0.85, 0.83))
    for y in (-1.07, 0.0, 1.07):
        put("Frame", soft_box(0.07, 0.06, 1.5, 0.01), frame, at=(-2.97, y, 1.55))
    for z in (0.83, 2.27):
        put("Frame", soft_box(0.07, 2.2, 0.06, 0.01), frame, at=(-2.97, 0, z))
    put("Skirting", soft_box(WIDTH, 0.02, 0.1, 0.006), frame, at=(0, DEPTH / 2 - 0.01, 0.05))


def _table():
    steel, brass = metal("Steel", (0.66, 0.67, 0.69)), metal("Brass", (0.90, 0.66, 0.30))
    red = plastic("Red plastic", (0.62, 0.05, 0.04))
    at = (0.35, 0.35)
    top = [(0, 0.40), (0.50, 0.40), (0.53, 0.415), (0.53, 0.43), (0.50, 0.44), (0, 0.44)]
    put("Table top", lathe(top, 64), plastic("Lacquer", (0.03, 0.035, 0.04), 0.15), at=(*at, 0))
    foot = [(0, 0), (0.30, 0), (0.30, 0.02), (0.03, 0.05), (0.025, 0.2), (0.025, 0.38), (0.12, 0.4)]
    put("Table foot", lathe(rounded(foot)), steel, at=(*at, 0.001))
    vase = [(0, 0), (0.09, 0), (0.14, 0.08), (0.10, 0.2), (0.03, 0.26), (0.05, 0.34), (0.04, 0.34),
            (0.02, 0.26), (0.03, 0.22)]  # fmt: skip
    put("Vase", lathe(rounded(vase)), brass, at=(at[0] - 0.18, at[1] + 0.16, 0.441))
    bowl = [(0, 0), (0.07, 0), (0.16, 0.05), (0.18, 0.1), (0.17, 0.1), (0.15, 0.055), (0, 0.02)]
    put("Bowl", lathe(rounded(bowl)), red, at=(at[0] + 0.2, at[1] - 0.1, 0.441))
    fruits = plastic("Green plastic", (0.18, 0.42, 0.06))
    for x, y, z in ((0.05, 0.02, 0.1), (-0.05, 0.04, 0.1), (0.0, -0.06, 0.1), (0.01, 0.0, 0.18)):
        fruit = ball(0.052, 24)
        put("Fruit", fruit, fruits, at=(at[0] + 0.2 + x, at[1] - 0.1 + y, 0.441 + z))

    # A lamp that is off: its shade hangs over the table and mirrors the room.
    shade = [(0.03, 0.22), (0.08, 0.2), (0.25, 0.0), (0.245, 0.0), (0.075, 0.19), (0.03, 0.21)]
    put("Shade", lathe(rounded(shade[::-1]), 64), brass, at=(*at, 1.75))
    put("Cord", cone(0.006, 0.006, 0.85, 12, True), steel, at=(*at, 1.95))


def _sofa():
    blue = plastic("Blue plastic", (0.05, 0.14, 0.30))
    pillow = plastic("Yellow plastic", (0.75, 0.42, 0.04))
    chrome = metal("Chrome", (0.80, 0.81, 0.83))
    y = 1.75
    put("Seat", soft_box(2.0, 0.85, 0.2, 0.06, 4), blue, at=(-1.3, y, 0.33))
    for x in (-1.78, -0.82):
        put("Cushion", soft_box(0.92, 0.75, 0.16, 0.07, 4), blue, at=(x, y - 0.05, 0.49))
    put("Back", soft_box(2.0, 0.22, 0.6, 0.09, 4), blue, at=(-1.3, y + 0.42, 0.62))
    for x in (-2.38, -0.22):
        put("Arm", soft_box(0.2, 0.9, 0.5, 0.08, 4), blue, at=(x, y, 0.44))
    at, turn = (-1.95, y + 0.13, 0.74), (-68, 0, 20)
    put("Pillow", soft_box(0.42, 0.42, 0.16, 0.075, 4), pillow, at, turn)
    legs = [(x, y + s, 0.12) for x in (-2.35, -0.25) for s in (-0.38, 0.38)]
    put("Legs", copies(cone(0.022, 0.022, 0.23, 24), np.array(legs) - (0, 0, 0.12)), chrome)

    # A stool beside it.
    put("Stool", lathe(rounded([(0, 0), (0.2, 0), (0.22, 0.03), (0.2, 0.06), (0, 0.06)])),
        plastic("White plastic", (0.8, 0.8, 0.8)), at=(-1.15, 0.25, 0.42))  # fmt: skip
    feet = [(-1.15 + 0.16 * math.cos(a), 0.25 + 0.16 * math.sin(a), 0) for a in (0.4, 2.5, 4.6)]
    put("Stool legs", copies(cone(0.015, 0.015, 0.42, 24), feet), chrome)


def _shelf():
    dark, copper = plastic("Oak", (0.22, 0.12, 0.06), 0.35), metal("Copper", (0.93, 0.53, 0.38))
    x, y = 1.75, 2.3
    for z in (0.06, 0.62, 1.18, 1.74):
        put("Board", soft_box(1.7, 0.36, 0.035, 0.006), dark, at=(x, y, z))
    for side in (-0.85, 0.85):
        put("Side", soft_box(0.035, 0.36, 1.8, 0.006), dark, at=(x + side, y, 0.9))

    # Books of four colours, drawn at random.
    random = np.random.default_rng(11)
    colors = [(0.5, 0.07, 0.05), (0.06, 0.2, 0.25), (0.62, 0.5, 0.3), (0.08, 0.09, 0.1)]
    shelves = [([], []) for _ in colors]
    for z, start, stop in ((0.08, -0.8, 0.75), (0.64, -0.8, 0.1), (1.2, 0.05, 0.8)):
        at = start
        while at < stop:
            thick, tall = random.uniform(0.02, 0.05), random.uniform(0.24, 0.38)
            places, sizes = shelves[random.integers(4)]
            places.append((x + at + thick / 2, y, z + tall / 2))
            sizes.append((thick - 0.003, 0.22, tall))
            at += thick
    for k, (color, (places, sizes)) in enumerate(zip(colors, shelves, strict=True)):
        book = soft_box(1, 1, 1, 0.03, 1)
        put(f"Books {k}", copies(book, places, sizes), plastic(f"Cover {k}", color))
    put("Globe", ball(0.16, 48), copper, at=(x + 0.5, y - 0.02, 0.8))
    suzanne("Suzanne", metal("Silver", (0.82, 0.83, 0.85)), (x - 0.42, y - 0.02, 1.4), (-20, 0, 12),
            0.2, levels=1)  # fmt: skip
    jar = [(0, 0), (0.09, 0), (0.12, 0.12), (0.08, 0.24), (0.06, 0.25), (0, 0.24)]
    put("Jar", lathe(rounded(jar)), plastic("Turquoise", (0.03, 0.4, 0.38)),
        at=(x + 0.3, y, 1.76))  # fmt: skip
