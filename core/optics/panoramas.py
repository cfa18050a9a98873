"""places on a picture -> directions, and back.  The maps of panoramic cameras.

Pictures are unit squares, u to the right and v up.  Directions are in the camera's space (see
`geometry.view`): a panorama looks along x, with y to the left and z up; a mirror ball looks
along -y, with x to the right and z up.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec, normalize
from . import Panorama

Inside = NDArray[np.bool_] | None

_HALF_PI = F32(np.pi / 2)
_TINY = F32(1e-30)


def direction(panorama: Panorama, u: Scalar, v: Scalar) -> tuple[Vec, Inside]:
    """Return directions (3, N), of any length, and which of them (N,) are in the picture.

    The second is None if all are; what is outside has some finite direction.
    """
    return _MAPS[panorama.kind].direction(panorama, u, v)


def place(panorama: Panorama, direction: Vec) -> tuple[Scalar, Scalar]:
    """Return u and v (N,) where unit directions (3, N) are on the picture, or beyond its edge."""
    u, v = _MAPS[panorama.kind].place(panorama, direction)
    return np.nan_to_num(u), np.nan_to_num(v)


# --- Equirectangular: longitude and latitude -----------------------------------------------------


def _equirectangular(p: Panorama, u: Scalar, v: Scalar) -> tuple[Vec, Inside]:
    phi = u * F32(p.longitude[0] - p.longitude[1]) - F32(p.longitude[0])
    height = v * F32(p.latitude[1] - p.latitude[0]) + F32(p.latitude[0])
    level = np.cos(height)
    return np.stack([level * np.cos(phi), level * np.sin(phi), np.sin(height)]), None


def _equirectangular_place(p: Panorama, direction: Vec) -> tuple[Scalar, Scalar]:
    x, y, z = direction
    (west, east), (low, high) = p.longitude, p.latitude
    u = (np.arctan2(y, x) + F32(west)) / _apart(west - east)
    v = (np.arctan2(z, np.hypot(x, y)) - F32(low)) / _apart(high - low)
    return u, v


# --- A face of a cube, seen at equal angles ------------------------------------------------------


def _cube_face(p: Panorama, u: Scalar, v: Scalar) -> tuple[Vec, Inside]:
    left, up = np.tan((F32(0.5) - u) * _HALF_PI), np.tan((v - F32(0.5)) * _HALF_PI)
    return normalize(np.stack([np.ones_like(u), left, up])), None


def _cube_face_place(p: Panorama, direction: Vec) -> tuple[Scalar, Scalar]:
    x, y, z = direction
    u = F32(0.5) - np.arctan2(y, x) / _HALF_PI
    return u, np.arctan2(z, x) / _HALF_PI + F32(0.5)


# --- Mirror ball ---------------------------------------------------------------------------------


def _mirror_ball(p: Panorama, u: Scalar, v: Scalar) -> tuple[Vec, Inside]:
    x, z = F32(2) * u - F32(1), F32(2) * v - F32(1)
    rest = F32(1) - x * x - z * z
    normal = F32(2) * np.sqrt(np.maximum(rest, F32(0)))
    y = F32(1) - F32(2) * np.maximum(rest, F32(0))
    return np.stack([normal * x, y, normal * z]), rest >= 0


def _mirror_ball_place(p: Panorama, direction: Vec) -> tuple[Scalar, Scalar]:
    # The ball's normal is halfway between the viewer and the direction
    x, y, z = direction
    twice = F32(2) * np.sqrt(np.maximum(F32(0.5) * (F32(1) - y), F32(0)))
    twice = np.where(twice > 0, twice, F32(1))
    return F32(0.5) * (x / twice + F32(1)), F32(0.5) * (z / twice + F32(1))


# --- Fisheyes: the angle from the axis by the distance from the middle ---------------------------


def _fisheye(theta: Scalar, x: Scalar, y: Scalar, r: Scalar) -> Vec:
    """Return what is theta [rad] off the axis, towards (x, y) of length r."""
    aside = np.sin(theta) / np.maximum(r, _TINY)
    return np.stack([np.cos(theta), -x * aside, y * aside])


def _aside(direction: Vec, r: Scalar) -> tuple[Scalar, Scalar]:
    """Return (x, y) of length r (N,), to the side of the axis where directions are."""
    _, y, z = direction
    long = np.maximum(np.hypot(y, z), _TINY)
    return -y * (r / long), z * (r / long)


def _off_axis(direction: Vec) -> Scalar:
    x, y, z = direction
    theta: Scalar = np.arctan2(np.hypot(y, z), x)
    return theta


def _equidistant(p: Panorama, u: Scalar, v: Scalar) -> tuple[Vec, Inside]:
    x, y = F32(2) * u - F32(1), F32(2) * v - F32(1)
    r = np.sqrt(x * x + y * y)
    return _fisheye(r * F32(0.5 * p.fov), x, y, r), r <= 1


def _equidistant_place(p: Panorama, direction: Vec) -> tuple[Scalar, Scalar]:
    x, y = _aside(direction, _off_axis(direction) / _apart(p.fov))
    return x + F32(0.5), y + F32(0.5)


def _on_sensor(p: Panorama, u: Scalar, v: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    width, height = p.sensor
    x, y = (u - F32(0.5)) * F32(width), (v - F32(0.5)) * F32(height)
    return x, y, np.sqrt(x * x + y * y)


def _off_sensor(p: Panorama, direction: Vec, r: Scalar) -> tuple[Scalar, Scalar]:
    x, y = _aside(direction, r)
    return x / F32(p.sensor[0]) + F32(0.5), y / F32(p.sensor[1]) + F32(0.5)


def _equisolid(p: Panorama, u: Scalar, v: Scalar) -> tuple[Vec, Inside]:
    x, y, r = _on_sensor(p, u, v)
    theta = F32(2) * np.arcsin(np.minimum(r * F32(0.5 / p.lens), F32(1)))
    return _fisheye(theta, x, y, r), r <= F32(2 * p.lens * np.sin(p.fov / 4))


def _equisolid_place(p: Panorama, direction: Vec) -> tuple[Scalar, Scalar]:
    r = F32(2 * p.lens) * np.sin(F32(0.5) * _off_axis(direction))
    return _off_sensor(p, direction, r)


def _bend(p: Panorama, r: Scalar) -> Scalar:
    """Return the angle from the axis [rad], negative, at distances r [mm] on the sensor."""
    k0, k1, k2, k3, k4 = np.array(p.polynomial, F32)
    bend: Scalar = k0 + r * (k1 + r * (k2 + r * (k3 + r * k4)))
    return bend


def _polynomial(p: Panorama, u: Scalar, v: Scalar) -> tuple[Vec, Inside]:
    x, y, r = _on_sensor(p, u, v)
    theta = -_bend(p, r)
    return _fisheye(theta, x, y, r), np.abs(theta) <= F32(0.5 * p.fov)


def _polynomial_place(p: Panorama, direction: Vec) -> tuple[Scalar, Scalar]:
    # Newton's steps, as many as in Cycles, from where the polynomial would be if it were straight
    wanted = -_off_axis(direction)
    k0, k1, k2, k3, k4 = np.array(p.polynomial, F32)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        r = (wanted - k0) / k1
        for _ in range(20):
            slope = k1 + r * (F32(2) * k2 + r * (F32(3) * k3 + r * F32(4) * k4))
            r = r + (wanted - _bend(p, r)) / slope
        return _off_sensor(p, direction, r)


# --- Central cylindrical: a cylinder seen from its middle ----------------------------------------


def _cylinder(p: Panorama, u: Scalar, v: Scalar) -> tuple[Vec, Inside]:
    phi = u * F32(p.around[0] - p.around[1]) - F32(p.around[0])
    height = v * F32(p.height[1] - p.height[0]) + F32(p.height[0])
    return np.stack([np.cos(phi), np.sin(phi), height]), None


def _cylinder_place(p: Panorama, direction: Vec) -> tuple[Scalar, Scalar]:
    x, y, z = direction
    (west, east), (low, high) = p.around, p.height
    height = z / np.maximum(np.hypot(x, y), _TINY)
    u = (np.arctan2(y, x) + F32(west)) / _apart(west - east)
    return u, (height - F32(low)) / _apart(high - low)


def _apart(difference: float) -> np.float32:
    """Return a divisor that is not 0."""
    return F32(difference if difference else 1.0)


class _Map(NamedTuple):
    direction: Callable[[Panorama, Scalar, Scalar], tuple[Vec, Inside]]
    place: Callable[[Panorama, Vec], tuple[Scalar, Scalar]]


_MAPS = {
    "EQUIRECTANGULAR": _Map(_equirectangular, _equirectangular_place),
    "EQUIANGULAR_CUBEMAP_FACE": _Map(_cube_face, _cube_face_place),
    "MIRRORBALL": _Map(_mirror_ball, _mirror_ball_place),
    "FISHEYE_EQUIDISTANT": _Map(_equidistant, _equidistant_place),
    "FISHEYE_EQUISOLID": _Map(_equisolid, _equisolid_place),
    "FISHEYE_LENS_POLYNOMIAL": _Map(_polynomial, _polynomial_place),
    "CENTRAL_CYLINDRICAL": _Map(_cylinder, _cylinder_place),
}
