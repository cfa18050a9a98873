"""numbers -> a meadow: 3,600 flowers and stones, each an instance of one of five meshes.

Objects that share a mesh: who keeps one copy saves memory, who makes one big mesh saves time.
"""

import numpy as np

from ...examples._stage import box, camera, lamp, put
from .shapes import bead, begin, lathe, plastic, rounded

ROWS = 60


def build():
    """Make the meadow in an empty file."""
    begin(320, 208, world=(0.20, 0.28, 0.40))
    random = np.random.default_rng(23)
    soil = plastic("Soil", (0.07, 0.10, 0.03), 0.9)
    put("Ground", box(80, 80, 0.2), soil, at=(0, 0, -0.1))
    kinds = [_flower(hue) for hue in ((0.7, 0.1, 0.08), (0.75, 0.55, 0.05), (0.6, 0.6, 0.62))]
    kinds += [_stone((0.30, 0.29, 0.27)), _stone((0.18, 0.17, 0.17))]
    for row in range(ROWS):
        for column in range(ROWS):
            mesh = kinds[random.choice(5, p=(0.3, 0.25, 0.25, 0.1, 0.1))]
            at = 0.42 * (np.array([column - ROWS / 2, row]) + random.uniform(-0.45, 0.45, 2))
            size = random.uniform(0.6, 1.3)
            turn = (*random.uniform(-12, 12, 2), random.uniform(0, 360))
            put("Thing", mesh, at=(at[0], at[1] - 2.0, 0), turn=turn, scale=(size,) * 3)
    lamp("Sun", "SUN", 3.5, (-5, -3, 6), (0, 0, 0), (1, 0.9, 0.76), angle=0.03)
    camera(at=(0, -4.6, 1.5), to=(0, 3.0, 0.1), lens=34)


def _flower(hue):
    """Return a stem with a cup of petals on it, in two materials."""
    profile = [(0.012, 0.0), (0.01, 0.15), (0.009, 0.3), (0.02, 0.36), (0.09, 0.40), (0.10, 0.48)]
    mesh = lathe(rounded(profile, 3), 20)
    mesh.materials.append(plastic("Stem", (0.10, 0.26, 0.04), 0.6))
    mesh.materials.append(plastic("Petal", hue, 0.5))
    high = [mesh.vertices[face.vertices[0]].co.z > 0.35 for face in mesh.polygons]
    mesh.polygons.foreach_set("material_index", np.array(high, np.int32))
    return mesh


def _stone(grey):
    """Return a flattened ball."""
    mesh = bead(0.14, 4)
    for vertex in mesh.vertices:
        vertex.co.z *= 0.6
    mesh.materials.append(plastic("Stone", grey, 0.8))
    return mesh
