"""bpy texture mappings -> matrices.  What texture nodes of old files do to their coordinates.

New files have Mapping nodes instead; Cycles still honours this one, but for its limits.
"""

import bpy
import numpy as np

# isort: split
from mathutils import Euler  # which the bpy module brings along


def export_mapping(
    mapping: bpy.types.TexMapping,
) -> tuple[tuple[tuple[float, ...], ...], bool] | None:
    """Return the matrix (3, 4), and whether normals are meant; None if it changes nothing."""
    axes = np.zeros((3, 3))
    for row, name in enumerate("xyz"):
        axis = getattr(mapping, f"mapping_{name}")
        if axis != "NONE":
            axes[row, "XYZ".index(axis)] = 1.0
    kind = mapping.vector_type
    scale = np.array(mapping.scale)
    if kind in ("TEXTURE", "NORMAL"):
        scale = np.where(np.abs(scale) < 1e-5, np.copysign(1e-5, scale), scale)
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(Euler(mapping.rotation).to_matrix()) * scale
    if kind in ("POINT", "TEXTURE"):
        matrix[:3, 3] = mapping.translation
    if kind == "TEXTURE":
        matrix = np.linalg.inv(matrix)
    elif kind == "NORMAL":
        matrix = np.linalg.inv(matrix).T
    matrix[:3, :3] = matrix[:3, :3] @ axes
    if np.array_equal(matrix, np.eye(4)):
        return None
    return tuple(tuple(row) for row in matrix[:3].tolist()), kind == "NORMAL"
