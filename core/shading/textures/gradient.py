"""points (3, N) -> number.  Gradient Texture: ramps along an axis, an angle, or a radius."""

from collections.abc import Callable

import numpy as np

from ...arrays import F32, TWO_PI, dot
from ..values import Array

_ZERO, _ONE = F32(0), F32(1)


def _linear(points: Array) -> Array:
    return points[0]


def _quadratic(points: Array) -> Array:
    ramp = np.maximum(points[0], _ZERO)
    return ramp * ramp


def _easing(points: Array) -> Array:
    ramp = np.minimum(np.maximum(points[0], _ZERO), _ONE)
    return ramp * ramp * (F32(3) - F32(2) * ramp)


def _diagonal(points: Array) -> Array:
    return (points[0] + points[1]) * F32(0.5)


def _radial(points: Array) -> Array:
    return np.arctan2(points[1], points[0]) / TWO_PI + F32(0.5)


def _spherical(points: Array) -> Array:
    # A little less than 1, so that unit vectors give 0 and not their rounding error.
    return np.maximum(F32(0.999999) - np.sqrt(dot(points, points)), _ZERO)


def _quadratic_sphere(points: Array) -> Array:
    ramp = _spherical(points)
    return ramp * ramp


# Type -> the ramp
TYPES: dict[str, Callable[[Array], Array]] = {
    "LINEAR": _linear,
    "QUADRATIC": _quadratic,
    "EASING": _easing,
    "DIAGONAL": _diagonal,
    "SPHERICAL": _spherical,
    "QUADRATIC_SPHERE": _quadratic_sphere,
    "RADIAL": _radial,
}


def gradient(points: Array, kind: str) -> Array:
    """Return the ramp (N,) of a kind among TYPES, 0 to 1, at points (3, N)."""
    return np.minimum(np.maximum(TYPES[kind](points), _ZERO), _ONE)
