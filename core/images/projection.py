"""directions -> image coordinates.  How pictures of everything around are laid out.

Coordinates u, v are 0 to 1 from the lower left corner of the picture.  Both layouts are Blender's:
the middle of an equirectangular picture is the direction (1, 0, 0) and its top +z; a mirror ball is
seen along (0, 1, 0), so that its middle shows -y and its rim +y.
"""

import numpy as np

from ..arrays import F32, Scalar, Vec

_INV_PI, _INV_TWO_PI = F32(1 / np.pi), F32(0.5 / np.pi)
_TWO_PI = F32(2 * np.pi)


def equirectangular(direction: Vec) -> tuple[Scalar, Scalar]:
    """Return u, v (N,) of directions (3, N) of any length; (0, 0) for a zero vector."""
    x, y, z = direction
    u = np.arctan2(y, x)
    u *= -_INV_TWO_PI
    u += F32(0.5)
    # Measured from the horizon by arctan2, which is exact at the poles where arccos is not
    v = np.arctan2(z, np.sqrt(x * x + y * y))
    v *= _INV_PI
    v += F32(0.5)
    return u, v


def equirectangular_invert(u: Scalar, v: Scalar) -> Vec:
    """Return the unit directions (3, N) of u, v (N,)."""
    direction = np.empty((3, np.broadcast(u, v).size), F32)
    azimuth = (F32(0.5) - u) * _TWO_PI
    elevation = (v - F32(0.5)) * F32(np.pi)
    flat = np.cos(elevation)
    np.multiply(np.cos(azimuth), flat, out=direction[0])
    np.multiply(np.sin(azimuth), flat, out=direction[1])
    np.sin(elevation, out=direction[2])
    return direction


def mirror_ball(direction: Vec) -> tuple[Scalar, Scalar]:
    """Return u, v (N,) of unit directions (3, N); the middle of the ball for exactly +y."""
    x, y, z = direction
    # |direction - (0, 1, 0)|, twice the length that the normal of the ball has across the view
    scale = np.sqrt(np.maximum((F32(1) - y) * F32(2), F32(0)))
    scale = F32(0.5) / np.where(scale > 0, scale, F32(1))
    return x * scale + F32(0.5), z * scale + F32(0.5)


def sphere(direction: Vec) -> tuple[Scalar, Scalar]:
    """Return u, v (N,) of directions (3, N) on a globe whose north is +z; 0 for a zero vector."""
    x, y, z = direction
    length = np.sqrt(x * x + y * y + z * z)
    is_there = length > 0
    cosine = np.clip(z / np.where(is_there, length, F32(1)), F32(-1), F32(1))
    u = np.where((x == 0) & (y == 0), F32(0), F32(0.5) - np.arctan2(x, y) * _INV_TWO_PI)
    return u * is_there, (F32(1) - np.arccos(cosine) * _INV_PI) * is_there


def tube(direction: Vec) -> tuple[Scalar, Scalar]:
    """Return u, v (N,) of places (3, N) around the z axis, from -1 to 1; 0 on the axis."""
    x, y, z = direction
    is_there = (x * x + y * y) > 0
    u = (F32(1) - np.arctan2(x, y) * _INV_PI) * F32(0.5)
    return u * is_there, (z + F32(1)) * F32(0.5) * is_there


PROJECTIONS = {"EQUIRECTANGULAR": equirectangular, "MIRROR_BALL": mirror_ball}
