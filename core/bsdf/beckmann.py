"""roughness, wo, u -> microfacet normals.  The Beckmann distribution.

The protocol is that of `smith`.  Masking takes Walter's rational fit, as Cycles does, while normals
are drawn by the exact visible area; the two differ by less than 0.4 %, and so may the sum of all
light that is sent back.  The slope along the view is found by inverting its distribution with three
Newton steps in the variable b = erf(slope), from a parabola that is close.
Source: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; Heitz and
d'Eon 2014, "Importance Sampling Microfacet-Based BSDFs with the Distribution of Visible Normals";
Jakob 2014, "An Improved Visible Normal Sampling Routine for the Beckmann Distribution".
"""

import numpy as np

from ..arrays import F32, INV_PI, ONE_BELOW, Scalar, Vec, dot
from .smith import LEAST_COS, Normals, stretch, stretched2

NAME = "beckmann"

_INV_SQRT_PI = F32(1 / np.sqrt(np.pi))
_LEAST_SQUARE = F32(1e-14)  # of a normal's z
_NEWTON_STEPS = 3


def _erf(x: Scalar) -> Scalar:
    """Return erf(x) (N,) for x >= 0 to 2e-7 (Abramowitz and Stegun 1964, 7.1.26)."""
    t = F32(1) / (F32(1) + F32(0.3275911) * x)
    series = t * F32(1.061405429)
    for coefficient in (-1.453152027, 1.421413741, -0.284496736, 0.254829592):
        series += F32(coefficient)
        series *= t
    series *= np.exp(-x * x)
    return F32(1) - series


def _erfinv(x: Scalar) -> Scalar:
    """Return the inverse of erf (N,) for |x| < 1 (Giles 2010, "Approximating the erfinv function").

    Relative error below 1e-6.
    """
    w = -np.log((F32(1) - x) * (F32(1) + x))
    out = _horner(
        w - F32(2.5),
        (2.81022636e-08, 3.43273939e-07, -3.5233877e-06, -4.39150654e-06, 0.00021858087)
        + (-0.00125372503, -0.00417768164, 0.246640727, 1.50140941),
    )
    far = np.flatnonzero(w >= 5)
    if far.size:
        out[far] = _horner(
            np.sqrt(w.take(far)) - F32(3),
            (-0.000200214257, 0.000100950558, 0.00134934322, -0.00367342844, 0.00573950773)
            + (-0.0076224613, 0.00943887047, 1.00167406, 2.83297682),
        )
    out *= x
    return out


def _horner(x: Scalar, coefficients: tuple[float, ...]) -> Scalar:
    first, *rest = coefficients
    out = np.full_like(x, first)
    for coefficient in rest:
        out *= x
        out += F32(coefficient)
    return out


def _area(z: Scalar, slope: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Return the exact area (N,), erf(a) and exp(-a^2), for a stretched direction's z and sine."""
    a: Scalar = np.divide(z, np.maximum(slope, F32(1e-20)))
    np.minimum(a, F32(9), out=a)
    below, tail = _erf(a), np.exp(-a * a)
    area = F32(0.5) * (z * (F32(1) + below) + slope * tail * _INV_SQRT_PI)
    return area, below, tail


def _shadow(z: Scalar, slope: Scalar) -> Scalar:
    # Lambda = (1 - 1.259 a + 0.396 a^2) / (3.535 a + 2.181 a^2) with a = z / slope < 1.6
    a: Scalar = np.divide(z, np.maximum(slope, F32(1e-20)))
    np.minimum(a, F32(1.6), out=a)
    masked: Scalar = a * F32(0.396)
    masked -= F32(1.259)
    masked *= a
    masked += F32(1)
    np.maximum(masked, F32(0), out=masked)
    masked *= slope
    a *= F32(2.181)
    a += F32(3.535)
    masked /= a
    masked *= F32(2)
    masked += z
    return masked


def density(h: Vec, ax: Scalar, ay: Scalar) -> tuple[Scalar, Scalar]:
    """Return D (N,) [1/sr] of normals h (3, N) of any length, and |h|^2 (N,)."""
    square = np.maximum(h[2] * h[2], _LEAST_SQUARE)
    slope2 = stretched2(h, F32(1) / ax, F32(1) / ay) if ay is not ax else None
    length2 = dot(h[:2], h[:2])
    if slope2 is None:
        slope2 = length2 * (F32(1) / (ax * ax))
    slope2 /= square
    length2 += square
    value = length2 / square
    value *= value
    np.negative(slope2, out=slope2)
    np.exp(slope2, out=slope2)
    value *= slope2
    return value * (INV_PI / (ax * ay)), length2


def shadow(w: Vec, ax: Scalar, ay: Scalar) -> Scalar:
    """Return |cos| (1 + 2 Lambda) (N,) of directions w (3, N) on either side, by Walter's fit."""
    return _shadow(np.abs(w[2]), np.sqrt(stretched2(w, ax, ay)))


def view(wo: Vec, ax: Scalar, ay: Scalar) -> tuple[Scalar, Scalar]:
    """Return the area (N,) that the viewer sees, and the shadow (N,) of wo (3, N)."""
    z, slope = np.maximum(wo[2], LEAST_COS), np.sqrt(stretched2(wo, ax, ay))
    return _area(z, slope)[0], _shadow(z, slope)


def sample(wo: Vec, ax: Scalar, ay: Scalar, u: Scalar, v: Scalar) -> Normals:
    """Draw visible normals from D |wo.h| / area."""
    # Stretch the viewer's direction; a is the cotangent of its angle.
    z = np.maximum(wo[2], LEAST_COS)
    s = stretch(wo, ax, ay)
    slope = np.sqrt(dot(s, s))
    area, below, tail = _area(z, slope)
    tan = slope / z
    k = tan * _INV_SQRT_PI

    # Start where exp(-slope^2) = 1 - b^2 would have the slope.
    goal = u * (F32(1) + below + k * (F32(1) - below * below))
    start = k - goal + F32(1)
    root = np.sqrt(np.maximum(k * start + F32(0.25), F32(0)))
    b = -start / (F32(0.5) + root)

    # Solve 1 + b + k exp(-erfinv(b)^2) = goal, a concave function of b.
    goal = u * (F32(1) + below + k * tail)
    top = np.minimum(below, ONE_BELOW)
    for _ in range(_NEWTON_STEPS):
        np.clip(b, -ONE_BELOW, top, out=b)
        x = _erfinv(b)
        excess = F32(1) + b + k * np.exp(-x * x) - goal
        b -= excess / np.maximum(F32(1) - x * tan, F32(1e-4))
    x = _erfinv(np.clip(b, -ONE_BELOW, top, out=b))
    y = _erfinv(np.clip(v * F32(2) - F32(1), -ONE_BELOW, ONE_BELOW))

    # Turn the slopes to the view's azimuth; a normal leans against its slope.
    slope = np.maximum(slope, F32(1e-20))
    c, d = s[0] / slope, s[1] / slope
    upright = c * c + d * d < F32(0.5)
    c += upright
    h = np.empty((3, u.size), F32)
    h[0] = d * y - c * x
    h[1] = -d * x - c * y
    h[2] = 1

    # D of the slopes; then unstretch.
    value = np.exp(-dot(h[:2], h[:2]))
    twice = dot(h[:2], s) + z
    twice *= F32(2)
    np.maximum(twice, F32(0), out=twice)
    h[0] *= ax
    h[1] *= ay
    length2 = dot(h, h)
    value *= length2
    value *= length2
    value *= INV_PI / (ax * ay)
    return Normals(h, length2, twice / length2, value, area, _shadow(z, slope))
