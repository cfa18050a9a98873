"""numbers -> a hall with strings of beads that glow, 100,000 triangles of light.

1,250 icospheres of 80 triangles hang in clusters between columns: long strings, dense swarms and
rings, in eight colours whose radiance spans a factor of 40. There are no lamps.
"""

import math

import numpy as np

from ...examples._stage import box, camera, cone, glow, matte, put
from .shapes import bead, begin, copies, lathe, metal, plastic, rounded, soft_box, suzanne

GLOWS = (
    ((1.0, 0.62, 0.28), 60.0),
    ((1.0, 0.80, 0.55), 24.0),
    ((1.0, 0.30, 0.12), 16.0),
    ((0.95, 0.20, 0.45), 10.0),
    ((0.30, 0.55, 1.0), 10.0),
    ((0.25, 0.90, 0.75), 5.0),
    ((0.55, 0.35, 1.0), 4.0),
    ((1.0, 0.95, 0.85), 1.5),
)
BEADS = 1250


def build():
    """Make the hall in an empty file."""
    begin(320, 208, world=(0.004, 0.005, 0.008), exposure=0.4)
    random = np.random.default_rng(23)
    _hall(random)
    _beads(random)
    camera(at=(0.9, -7.2, 1.9), to=(-0.2, 1.5, 1.9), lens=27)


def _hall(random):
    slab, wall = plastic("Slab", (0.16, 0.14, 0.13), 0.3), matte("Wall", (0.50, 0.46, 0.42))
    stone = matte("Stone", (0.58, 0.54, 0.48))
    grid = np.arange(-4.5, 5, 1.0)
    tiles = [(x, y, -0.05) for x in grid for y in np.arange(-8.5, 7, 1.0)]
    put("Slabs", copies(soft_box(0.985, 0.985, 0.1, 0.012, 2), tiles), slab)
    put("Ground", box(12, 18, 0.1), wall, at=(0, -1, -0.16))
    put("Ceiling", box(12, 18, 0.2), wall, at=(0, -1, 4.7))
    put("Back", box(12, 0.2, 5), wall, at=(0, 7.1, 2.3))
    put("Front", box(12, 0.2, 5), wall, at=(0, -9.1, 2.3))
    for side in (-1, 1):
        put("Side", box(0.2, 18, 5), wall, at=(5.1 * side, -1, 2.3))

    # Columns, arches' beams, and company.
    shaft = [(0.34, 0), (0.34, 0.12), (0.25, 0.2), (0.24, 2.0), (0.21, 4.1), (0.33, 4.3),
             (0.36, 4.6)]  # fmt: skip
    for side in (-1, 1):
        for y in (-6.0, -3.0, 0.0, 3.0, 6.0):
            put("Column", lathe(rounded(shaft), 48), stone, at=(3.1 * side, y, 0))
            put("Plinth", soft_box(0.85, 0.85, 0.16, 0.03, 2), stone, at=(3.1 * side, y, 0.05))
    for y in (-6.0, -3.0, 0.0, 3.0, 6.0):
        put("Beam", soft_box(10, 0.35, 0.3, 0.04, 2), stone, at=(0, y, 4.5))
    gold, red = metal("Gold", (1.0, 0.72, 0.32), 0.3), plastic("Red", (0.5, 0.04, 0.03), 0.3)
    put("Base", cone(0.8, 0.7, 0.6, 64), stone, at=(0, 1.2, 0))
    suzanne("Suzanne", gold, (0, 1.2, 1.25), (-15, 0, 10), 0.75, levels=2)
    for k in range(14):
        at = (random.uniform(-2.4, 2.4), random.uniform(-4.5, 4.5))
        if math.hypot(at[0], at[1] - 1.2) < 1.2:
            continue
        size = random.uniform(0.15, 0.32)
        put("Crate", soft_box(2 * size, 2 * size, 2 * size, 0.03, 2), red if k % 3 else gold,
            at=(*at, size), turn=(0, 0, random.uniform(0, 90)))  # fmt: skip


def _beads(random):
    # Ten strings of 60 along and across the hall, three swarms of 130, ten rings of 26.
    groups = []
    t = np.linspace(0, 1, 60)
    for k in range(10):
        a, b = np.array([-3.0, -6 + 1.3 * k, 3.6]), np.array([3.0, -6 + 1.3 * ((k * 7) % 10), 3.9])
        line = a + (b - a) * t[:, None]
        line[:, 2] -= (1.3 + 0.3 * (k % 3)) * 4 * t * (1 - t) * 0.6
        groups.append((line, 0.024))
    for middle in ((-1.7, 3.8, 1.9), (1.6, 2.2, 2.7), (-1.5, -2.2, 2.2)):
        groups.append((middle + random.normal(0, 0.28, (130, 3)), 0.016))
    angle = 2 * np.pi * np.arange(26) / 26
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    for k in range(10):
        side, y = (-1, 1)[k % 2], (-6.0, -3.0, 0.0, 3.0, 6.0)[k // 2]
        groups.append((0.33 * ring + (3.1 * side, y, 1.1 + 0.5 * (k % 3)), 0.03))

    # One mesh for each group.
    assert sum(len(places) for places, _ in groups) == BEADS
    shine = [glow(f"Glow {k}", color, strength) for k, (color, strength) in enumerate(GLOWS)]
    for k, (places, radius) in enumerate(groups):
        sizes = radius * random.uniform(0.7, 1.3, (len(places), 1))
        put(f"Beads {k}", copies(bead(), places, sizes), shine[k % len(shine)])
