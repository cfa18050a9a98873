"""numbers -> a market street at night under a thousand lamps.

400 points hang on lines across the street, 300 spots light fronts and stalls from above, and
300 small areas shine out of windows. Powers are spread evenly on a logarithmic scale over two
decades, so that at any place few of them matter and none can be left out.
"""

import math

import numpy as np

from ...examples._stage import box, camera, cone, lamp, matte, put
from .shapes import bead, begin, copies, metal, plastic, soft_box

LENGTH, HALF = 44.0, 4.0  # of the street, and half its width [m]
POINTS, SPOTS, AREAS = 400, 300, 300


def build():
    """Make the street in an empty file."""
    begin(300, 192, world=(0.006, 0.009, 0.02), exposure=0.0)
    random = np.random.default_rng(17)
    _street(random)
    windows = _houses(random)
    _stalls(random)
    _lines(random)
    _windows(random, windows)
    _spots(random)
    camera(at=(-1.4, -3.0, 2.1), to=(0.5, 14, 2.4), lens=24)


def _powers(random, count, low, high):
    return low * (high / low) ** random.permutation((np.arange(count) + 0.5) / count)


def _street(random):
    stones, wide = [], 0.5
    for k in range(round(LENGTH / wide)):
        shift = wide / 2 * (k % 2)
        stones += [(x + shift, wide * (k + 0.5) - 4, -0.06) for x in np.arange(-4.25, 4.0, wide)]
    stones = np.array(stones)
    stones[:, 2] += random.uniform(0, 0.012, len(stones))
    wet = plastic("Wet stone", (0.10, 0.095, 0.09), 0.3)
    put("Stones", copies(soft_box(wide - 0.02, wide - 0.02, 0.12, 0.02, 1), stones), wet)
    put("Ground", box(30, LENGTH + 10, 0.1), matte("Ground", (0.05, 0.05, 0.05)),
        at=(0, LENGTH / 2 - 4, -0.12))  # fmt: skip


def _houses(random):
    # Fronts of boxes, each with a plinth, ledges and window frames; return the windows' places.
    plasters = [(0.55, 0.42, 0.30), (0.42, 0.24, 0.18), (0.48, 0.48, 0.44), (0.30, 0.34, 0.38)]
    plasters = [matte(f"Plaster {k}", color) for k, color in enumerate(plasters)]
    stone, pane = matte("Ledge", (0.5, 0.47, 0.42)), plastic("Pane", (0.02, 0.025, 0.03), 0.1)
    ledges, sizes, frames, panes, windows = [], [], [], [], []
    for side in (-1, 1):
        y, k = -4.0, 0
        while y < LENGTH - 4:
            wide, floors = random.uniform(4.5, 6.5), random.integers(2, 5)
            tall = 3.2 * floors + 0.6
            at = (side * (HALF + 3), y + wide / 2, tall / 2)
            put("House", box(6, wide - 0.05, tall), plasters[(k + (side > 0)) % 4], at=at)
            front = side * HALF
            for floor in range(floors + 1):
                ledges.append((front, y + wide / 2, 3.2 * floor + (0.25 if floor == 0 else 0)))
                sizes.append((0.25, wide, 0.5 if floor == 0 else 0.18))
            for floor in range(floors):
                for column in range(int(wide // 1.6)):
                    place = (front, y + 1.0 + 1.6 * column, 3.2 * floor + 1.75)
                    frames.append(place)
                    panes.append((front + side * 0.02, *place[1:]))
                    windows.append((*place, -side))
            y, k = y + wide, k + 1
    put("Ledges", copies(soft_box(1, 1, 1, 0.06, 1), ledges, sizes), stone)
    bars = np.array(frames)
    for shift, size in (
        ((0, 0.45, 0), (0.12, 0.08, 1.5)),
        ((0, -0.45, 0), (0.12, 0.08, 1.5)),
        ((0, 0, 0.75), (0.16, 1.1, 0.1)),
        ((0, 0, -0.75), (0.24, 1.1, 0.08)),
    ):
        put("Frames", copies(box(*size), bars + shift), stone)
    put("Panes", copies(box(0.06, 0.9, 1.5), panes), pane)
    return np.array(windows)


def _stalls(random):
    # Tables with cloth roofs on poles, and wares on them.
    cloths = [plastic(f"Cloth {k}", color, 0.6) for k, color in enumerate(
        [(0.6, 0.06, 0.05), (0.75, 0.55, 0.12), (0.08, 0.28, 0.42), (0.7, 0.68, 0.6)])]  # fmt: skip
    wood, steel = matte("Wood", (0.30, 0.19, 0.10)), metal("Steel", (0.6, 0.61, 0.63), 0.25)
    wares = [plastic("Oranges", (0.85, 0.30, 0.03)), plastic("Apples", (0.45, 0.05, 0.04)),
             plastic("Limes", (0.25, 0.5, 0.05))]  # fmt: skip
    heaps = [[], [], []]
    for side in (-1, 1):
        for k in range(11):
            x, y = side * 2.7, 1.5 + 3.2 * k + (1.1 if side > 0 else 0)
            put("Table", soft_box(1.1, 2.0, 0.08, 0.02, 2), wood, at=(x, y, 0.85))
            put("Trestle", box(0.9, 1.8, 0.8), wood, at=(x, y, 0.41))
            roof = soft_box(1.5, 2.3, 0.05, 0.02, 2)
            put("Roof", roof, cloths[(k + (side > 0) * 2) % 4], (x, y, 2.25), (0, -side * 12, 0))
            corners = [(x + a, y + b, 0) for a in (-0.6, 0.6) for b in (-1.05, 1.05)]
            slope = side * math.tan(math.radians(12))
            tall = [(1, 1, 2.22 + slope * (corner[0] - x)) for corner in corners]
            put("Poles", copies(cone(0.025, 0.025, 1.0, 12), corners, tall), steel)
            for heap in range(3):
                kind = random.integers(3)
                for a in range(4):
                    for b in range(3):
                        place = (x - 0.36 + 0.17 * a, y - 0.75 + 0.55 * heap + 0.17 * b, 0.97)
                        heaps[kind].append(place)
    for kind, places in enumerate(heaps):
        ware = bead(0.08)
        jitter = random.uniform(-0.012, 0.012, (len(places), 3)) * (1, 1, 0)
        put("Wares", copies(ware, np.array(places) + jitter, smooth=True), wares[kind])


def _lines(random):
    # Points on 20 hanging lines of 20, of warm and coloured light.
    colors = [(1.0, 0.72, 0.42)] * 3 + [(1.0, 0.25, 0.15), (0.3, 0.9, 0.4), (0.35, 0.5, 1.0)]
    powers = _powers(random, POINTS, 0.3, 30.0)
    for k in range(POINTS):
        line, step = divmod(k, 20)
        t = (step + 0.5) / 20 * 2 - 1
        y = -1.0 + 2.0 * line + 0.8 * t * (-1) ** line
        z = 4.3 + 0.9 * t * t - 0.25 * math.cos(2.1 * line)
        lamp(f"Point {k}", "POINT", powers[k], (t * (HALF - 0.2), y, z),
             color=colors[random.integers(6)], shadow_soft_size=0.04)  # fmt: skip


def _windows(random, windows):
    # Areas in front of panes; the smaller ones are shop signs lower down.
    powers = _powers(random, AREAS, 0.5, 50.0)
    order = random.permutation(len(windows))
    for k in range(AREAS):
        x, y, z, side = windows[order[k % len(order)]]
        sign = k >= len(order)
        at = (x + side * 0.16, y, z + (0.95 if sign else 0))
        color = (0.5, 0.75, 1.0) if random.random() < 0.25 else (1.0, 0.78, 0.5)
        lamp(f"Window {k}", "AREA", powers[k], at, (at[0] + side, y, at[2] - 0.3), color,
             shape="RECTANGLE", size=0.8, size_y=0.25 if sign else 1.3)  # fmt: skip


def _spots(random):
    # Half of them under the eaves on the fronts, half over the stalls.
    powers = _powers(random, SPOTS, 2.0, 200.0)
    for k in range(SPOTS):
        side, y = (-1, 1)[k % 2], -2 + (LENGTH - 6) * (k + random.random()) / SPOTS
        if k % 4 < 2:
            at = (side * (HALF - 0.35), y, random.uniform(3.0, 6.5))
            to = (side * HALF, y, at[2] - 2)
        else:
            at = (side * random.uniform(1.2, 2.0), y, random.uniform(3.2, 4.0))
            to = (side * 2.4, y + random.uniform(-0.8, 0.8), 0.9)
        lamp(f"Spot {k}", "SPOT", powers[k], at, to, (1.0, 0.88, 0.70), shadow_soft_size=0.05,
             spot_size=math.radians(random.uniform(25, 60)), spot_blend=0.2)  # fmt: skip
