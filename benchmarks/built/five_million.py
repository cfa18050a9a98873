"""numbers -> dunes of 5.1 million triangles in one mesh, under a sun and a pale sky.

What a large mesh costs: to read, to build, and to gather from at every hit.
"""

import bpy
import numpy as np

from ...examples._stage import camera, lamp, put
from .shapes import begin, plastic

COUNT = 1600  # squares along each side
SIDE = 60.0  # [m]


def build():
    """Make the dunes in an empty file."""
    begin(320, 200, world=(0.30, 0.38, 0.50))
    dunes = put("Dunes", _dunes(), plastic("Sand", (0.58, 0.42, 0.26), 0.7))
    dunes.data.polygons.foreach_set("use_smooth", np.ones(2 * COUNT**2, bool))
    lamp("Sun", "SUN", 3.0, (-8, -4, 5), (0, 0, 0), (1.0, 0.88, 0.7), angle=0.02)
    camera(at=(0, -31, 4.6), to=(0, -12, 0.6), lens=32)


def _dunes():
    """Return the mesh: long waves, short ripples across them."""
    x, y = np.meshgrid(*[np.linspace(-SIDE / 2, SIDE / 2, COUNT + 1)] * 2)
    bent = x + 2.0 * np.sin(0.21 * y) + 0.7 * np.sin(0.53 * y + 1.0)
    z = 1.5 * np.abs(np.sin(0.22 * bent)) ** 1.5 + 0.5 * np.sin(0.13 * y + 0.4 * np.sin(0.3 * x))
    z += 0.03 * np.sin(7.0 * bent + 1.5 * np.sin(0.9 * y))
    return sheet("Dunes", np.stack([x, y, z], axis=-1).astype(np.float32))


def sheet(name, positions):
    """Return the mesh of points (n + 1, n + 1, 3) of float32, two triangles to each square."""
    count = len(positions) - 1
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    a, b, c, d = first, first + 1, first + count + 2, first + count + 1
    corners = np.stack([a, b, c, a, c, d], axis=1).ravel().astype(np.int32)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(positions.size // 3)
    mesh.vertices.foreach_set("co", positions.ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(corners) // 3)
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh
