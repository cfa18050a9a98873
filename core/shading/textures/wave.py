"""points (3, N) -> number.  Wave Texture: bands or rings, bent by noise."""

import numpy as np

from ...arrays import F32, TWO_PI, dot
from ..values import Array
from .batches import WHOLE, by_octaves
from .noise import fbm

_NUDGE, _SHRINK = F32(1e-6), F32(0.999999)
_AXES = {"X": 0, "Y": 1, "Z": 2}


def wave(
    points: Array,
    distortion: Array,
    detail: Array,
    detail_scale: Array,
    roughness: Array,
    phase: Array,
    kind: str,
    direction: str,
    profile: str,
) -> Array:
    """Return the wave (N,), 0 to 1; kind BANDS or RINGS, and profile SIN, SAW or TRI."""
    # Blender moves points a little, so that whole numbers are not where a band ends.
    points = (points + _NUDGE) * _SHRINK
    if kind == "RINGS":
        if direction in _AXES:
            points_here = np.delete(points, _AXES[direction], axis=0)
            way = np.sqrt((points_here * points_here).sum(axis=0)) * F32(20)
        else:
            way = np.sqrt(dot(points, points)) * F32(20)
    elif direction in _AXES:
        way = points[_AXES[direction]] * F32(20)
    else:
        way = (points[0] + points[1] + points[2]) * F32(10)
    way = way + phase

    if distortion.any():

        def bend(octaves: int, share: Array, points: Array, roughness: Array) -> Array:
            return fbm(points, octaves, share, roughness, np.full(1, F32(2)), True)[None]

        # Detail from -1 to 0 has the part of a second octave that is above -1 (Blender).
        detail = np.where(detail < 0, np.maximum(detail + F32(1), F32(0)), detail)
        bent = by_octaves(bend, detail, (points * detail_scale, roughness), 1, WHOLE)[0]
        way = way + distortion * (bent * F32(2) - F32(1))

    if profile == "SIN":
        return np.sin(way - F32(np.pi / 2)) * F32(0.5) + F32(0.5)
    way = way / TWO_PI
    if profile == "SAW":
        return way - np.floor(way)
    return np.abs(way - np.floor(way + F32(0.5))) * F32(2)
