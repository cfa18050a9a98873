"""bpy curves and colour ramps -> tables.  Sampled where Cycles samples them.

Cycles never sees a curve: it gets 257 of its values, at even steps over all of the curve's
points, and draws straight lines between them.
"""

import bpy
import numpy as np
from numpy.typing import NDArray

ENTRIES = 257


def sample_ramp(ramp: bpy.types.ColorRamp) -> NDArray[np.float32]:
    """Return the ramp's red, green, blue and alpha (4, ENTRIES) from 0 to 1."""
    places = np.linspace(0.0, 1.0, ENTRIES, dtype=np.float32)
    return np.array([ramp.evaluate(float(x))[:] for x in places], np.float32).T


def sample_curves(
    mapping: bpy.types.CurveMapping,
) -> tuple[NDArray[np.float32], tuple[float, float]]:
    """Return the curves (R, ENTRIES) of a node, and the range of their x.

    Of four curves the last comes first: its value goes into each of the others.
    """
    mapping.initialize()
    curves = list(mapping.curves)
    low = min(curve.points[0].location[0] for curve in curves)
    high = max(curve.points[-1].location[0] for curve in curves)
    places = [low + k / (ENTRIES - 1) * (high - low) for k in range(ENTRIES)]
    if len(curves) == 4:
        common = curves.pop()
        places = [mapping.evaluate(common, x) for x in places]
    rows = [[mapping.evaluate(curve, x) for x in places] for curve in curves]
    return np.array(rows, np.float32), (low, high)
