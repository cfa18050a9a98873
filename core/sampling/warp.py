"""u in the unit square -> directions and points.

Each shape is a tested set: `shape(u, v)` samples, `shape_pdf` is the density of the samples, and
`shape_invert` gives u, v back.  u and v are (N,) in [0, 1); directions are unit vectors (3, N) of
the local frame, z up; all float32, finite for every u and v, and unbiased.

Directions take the polar map, points on a disk the concentric one.  Around a normal the polar map
of a Sobol point costs less than half of the concentric map, and its error is the lower by up to
two for smooth integrands (azimuth is periodic, so the map has no seam that matters) and the same,
within 5 %, at shadow edges.
"""

import numpy as np

from ..arrays import F32, INV_PI, ONE_BELOW, TWO_PI, Scalar, Vec

_QUARTER_PI, _HALF_PI = F32(np.pi / 4), F32(np.pi / 2)
_TINY = F32(1e-30)
_RIM = F32(1 + 1e-6)  # a squared radius of 1, rounded up


def _around(sine: Scalar, v: Scalar) -> Vec:
    """Return (3, N) with x and y at azimuth 2 pi v [radians], z not yet written."""
    wi = np.empty((3, v.size), F32)
    azimuth = v * TWO_PI
    np.cos(azimuth, out=wi[0])
    np.sin(azimuth, out=wi[1])
    wi[:2] *= sine
    return wi


def _azimuth_invert(wi: Vec) -> Scalar:
    """Return v (N,) in [0, 1) of directions; 0 on the z axis."""
    v: Scalar = np.arctan2(wi[1], wi[0])
    v *= F32(1 / (2 * np.pi))
    v += v < 0
    np.minimum(v, ONE_BELOW, out=v)
    return v


# --- Directions ---------------------------------------------------------------------------------


def cosine_hemisphere(u: Scalar, v: Scalar) -> Vec:
    """Return directions (3, N) with density cos(theta) / pi [1/sr] (Malley's method).

    z is at least 2^-12, so that no sample has the density 0.
    """
    wi = _around(np.sqrt(u), v)
    np.subtract(F32(1), u, out=wi[2])
    np.sqrt(wi[2], out=wi[2])
    return wi


def cosine_hemisphere_pdf(wi: Vec) -> Scalar:
    """Return cos(theta) / pi (N,) [1/sr], 0 below the horizon."""
    pdf: Scalar = np.maximum(wi[2], F32(0)) * INV_PI
    return pdf


def cosine_hemisphere_invert(wi: Vec) -> tuple[Scalar, Scalar]:
    """Return the u, v (N,) that `cosine_hemisphere` maps to `wi`."""
    return np.minimum(wi[0] * wi[0] + wi[1] * wi[1], ONE_BELOW), _azimuth_invert(wi)


def uniform_cone(u: Scalar, v: Scalar, one_minus_cos_max: Scalar | np.float32) -> Vec:
    """Return directions (3, N) uniform in a cone around z, `one_minus_cos_max` in (0, 2].

    The cone is given by 1 - cos(angle), (N,) or one number, because cos(angle) of a small cone
    rounds to 1: take 2 sin^2(angle / 2), or sin^2 / (1 + cos).
    """
    height = u * one_minus_cos_max  # 1 - cos(theta)
    wi = _around(np.sqrt(height * (F32(2) - height)), v)
    np.subtract(F32(1), height, out=wi[2])
    return wi


def uniform_cone_pdf(one_minus_cos_max: Scalar | np.float32) -> Scalar | np.float32:
    """Return the density inside the cone, 1 / its solid angle [1/sr]."""
    return F32(1) / (TWO_PI * one_minus_cos_max)


def uniform_cone_invert(wi: Vec, one_minus_cos_max: Scalar | np.float32) -> tuple[Scalar, Scalar]:
    """Return the u, v (N,) that `uniform_cone` maps to `wi`."""
    x, y, z = wi
    height = np.where(z > 0, (x * x + y * y) / (F32(1) + np.maximum(z, F32(0))), F32(1) - z)
    return np.minimum(height / one_minus_cos_max, ONE_BELOW), _azimuth_invert(wi)


def uniform_hemisphere(u: Scalar, v: Scalar) -> Vec:
    """Return directions (3, N) uniform in the upper hemisphere; z is at least 2^-24."""
    return uniform_cone(u, v, F32(1))


def uniform_hemisphere_pdf(wi: Vec) -> Scalar:
    """Return 1 / (2 pi) (N,) [1/sr], 0 below the horizon."""
    pdf: Scalar = (wi[2] >= 0) * (F32(0.5) * INV_PI)
    return pdf


def uniform_hemisphere_invert(wi: Vec) -> tuple[Scalar, Scalar]:
    """Return the u, v (N,) that `uniform_hemisphere` maps to `wi`."""
    return uniform_cone_invert(wi, F32(1))


def uniform_sphere(u: Scalar, v: Scalar) -> Vec:
    """Return directions (3, N) uniform over the sphere."""
    return uniform_cone(u, v, F32(2))


def uniform_sphere_pdf(wi: Vec) -> Scalar:
    """Return 1 / (4 pi) (N,) [1/sr]."""
    return np.full(wi.shape[1], F32(0.25) * INV_PI, F32)


def uniform_sphere_invert(wi: Vec) -> tuple[Scalar, Scalar]:
    """Return the u, v (N,) that `uniform_sphere` maps to `wi`."""
    return uniform_cone_invert(wi, F32(2))


# --- Points -------------------------------------------------------------------------------------


def concentric_disk(u: Scalar, v: Scalar) -> Vec:
    """Return points (2, N) uniform on the unit disk.

    Squares around the centre become circles: neighbours in the square stay neighbours, and shapes
    keep their proportions.  Source: Shirley and Chiu 1997, "A Low Distortion Map Between Disk and
    Square"; all octants are folded into one, so that there is no branch.
    """
    a = u * F32(2) - F32(1)
    b = v * F32(2) - F32(1)
    size_a, size_b = np.abs(a), np.abs(b)
    radius = np.maximum(size_a, size_b)

    # Angle from the nearest axis, then from the x axis
    angle = np.minimum(size_a, size_b)
    angle /= np.maximum(radius, _TINY)
    angle *= _QUARTER_PI
    angle -= (size_b > size_a) * _HALF_PI
    np.abs(angle, out=angle)

    # Unfold to the octant by the signs
    point = np.empty((2, u.size), F32)
    np.cos(angle, out=point[0])
    np.sin(angle, out=point[1])
    point *= radius
    np.copysign(point[0], a, out=point[0])
    np.copysign(point[1], b, out=point[1])
    return point


def concentric_disk_pdf(point: Vec) -> Scalar:
    """Return 1 / pi (N,) per unit of area, 0 outside the disk."""
    inside = point[0] * point[0] + point[1] * point[1] <= _RIM
    pdf: Scalar = inside * INV_PI
    return pdf


def concentric_disk_invert(point: Vec) -> tuple[Scalar, Scalar]:
    """Return the u, v (N,) that `concentric_disk` maps to `point`."""
    x, y = np.abs(point)
    radius = np.sqrt(x * x + y * y)
    minor = np.arctan2(np.minimum(x, y), np.maximum(x, y)) / _QUARTER_PI * radius
    a = np.copysign(np.where(y > x, minor, radius), point[0])
    b = np.copysign(np.where(y > x, radius, minor), point[1])
    u, v = (a + F32(1)) * F32(0.5), (b + F32(1)) * F32(0.5)
    return np.clip(u, F32(0), ONE_BELOW), np.clip(v, F32(0), ONE_BELOW)


def uniform_triangle(u: Scalar, v: Scalar) -> Vec:
    """Return barycentric coordinates (2, N) of points uniform on a triangle; the third is 1 - both.

    Source: Heitz 2019, "A Low-Distortion Map Between Triangle and Square", without its branch.
    """
    barycentric = np.stack([u, v])
    barycentric -= np.minimum(u, v) * F32(0.5)
    return barycentric


def uniform_triangle_pdf(area: Scalar) -> Scalar:
    """Return 1 / area (N,) [1/m^2] of triangles of that area (N,) [m^2]."""
    return F32(1) / area


def uniform_triangle_invert(barycentric: Vec) -> tuple[Scalar, Scalar]:
    """Return the u, v (N,) that `uniform_triangle` maps to `barycentric`."""
    u, v = barycentric + np.minimum(barycentric[0], barycentric[1])
    return np.minimum(u, ONE_BELOW), np.minimum(v, ONE_BELOW)
