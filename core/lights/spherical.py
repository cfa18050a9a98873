"""rectangle at a height, u, v -> x, y on it.  Uniform sampling of the solid angle of a rectangle.

Urena et al. 2013, "An Area-Preserving Parametrization for Spherical Rectangles", here with products
of corner distances instead of sums of four arcs: single precision is enough down to 1e-3 sr, and
there are two arctangents.  Angles have no scale: give lengths in units of the diagonal.
"""

from typing import NamedTuple

import numpy as np

from ..arrays import F32, Index, Scalar

SMALL = F32(1e-12)


class Rectangle(NamedTuple):
    """[x0, x1] x [y0, y1] at the height z >= 0 above each point, and what follows from that."""

    x0: Scalar
    x1: Scalar
    y0: Scalar
    y1: Scalar
    z: Scalar
    r00: Scalar  # distance of the corner x0, y0
    r01: Scalar  # distance of the corner x0, y1
    angle: Scalar  # [sr]

    def take(self, index: Index) -> "Rectangle":
        """Keep the points of `index` (M,)."""
        return Rectangle(*(part.take(index) for part in self))


def rectangle(x0: Scalar, x1: Scalar, y0: Scalar, y1: Scalar, z: Scalar) -> Rectangle:
    """Return what points see of a rectangle: its solid angle, to some 1e-7 sr.

    The solid angle is the sum of atan2(x y, z r) over the corners with alternating signs; the two
    of a side are added as complex numbers, which leaves no difference of equal angles.
    """
    zz, xx = z * z, x0 * x1
    x00, x11 = x0 * x0 + zz, x1 * x1 + zz
    y00, y11 = y0 * y0, y1 * y1
    r00, r10 = np.sqrt(x00 + y00), np.sqrt(x11 + y00)
    r01, r11 = np.sqrt(x00 + y11), np.sqrt(x11 + y11)
    angle = np.arctan2(z * y1 * (x1 * r01 - x0 * r11), xx * y11 + zz * r01 * r11)
    angle -= np.arctan2(z * y0 * (x1 * r00 - x0 * r10), xx * y00 + zz * r00 * r10)
    return Rectangle(x0, x1, y0, y1, z, r00, r01, angle)


def sample(seen: Rectangle, u: Scalar, v: Scalar) -> tuple[Scalar, Scalar]:
    """Return the point x, y of the rectangle that u, v choose uniformly by solid angle.

    Source: Urena et al. 2013, section 5, with eq. 8 solved by the law of cosines.
    """
    # Begin with atan2(x y1, z r) - atan2(x y0, z r) at x0, as cosine and sine
    x0, x1, y0, y1, z, r00, r01, angle = seen
    zz, x00, y00, y11, yy = z * z, x0 * x0, y0 * y0, y1 * y1, y0 * y1
    i00, i11 = np.reciprocal(y00 + zz), np.reciprocal(y11 + zz)
    scale = np.sqrt(i00 * i11)
    p, q = np.sqrt(y00 * i00), np.sqrt(y11 * i11)
    scale /= x00 + zz
    cosine = (zz * r00 * r01 + x00 * yy) * scale
    sine = z * x0 * (y1 * r00 - y0 * r01) * scale

    # Turn by the share u of the solid angle, to the angle t of the slice at x
    turn = u * angle
    cos_turn, sin_turn = np.cos(turn), np.sin(turn)
    cos_t = cosine * cos_turn - sine * sin_turn
    sin_t = sine * cos_turn + cosine * sin_turn

    # Solve asin(b1 s) - asin(b0 s) = t, s = x / hypot(x, z), |b0| = p, |b1| = q, for x / z =
    # sin t / sqrt(b0^2 + b1^2 - 2 b0 b1 cos t - sin^2 t), its root without cancellation
    w = F32(1) - np.copysign(cos_t, cos_t * yy)
    w = F32(0.5) * (w * w + sin_t * sin_t)
    e00, e11 = zz * i00, zz * i11
    root = (q - p) * (q - p)
    root += w * (w - F32(2) * (e00 + e11 - e00 * e11) / (F32(1) + p * q))
    x = z * sin_t / np.sqrt(np.maximum(root, SMALL * SMALL))
    x = np.minimum(np.maximum(x, x0), x1)

    # Find y in the slice
    rr = x * x + zz
    h = y0 / np.sqrt(rr + y00)
    h += v * (y1 / np.sqrt(rr + y11) - h)
    y = h * np.sqrt(rr / np.maximum(F32(1) - h * h, SMALL))
    return x, np.minimum(np.maximum(y, y0), y1)
