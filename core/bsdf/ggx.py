"""roughness, wo, u -> microfacet normals.  The GGX (Trowbridge-Reitz) distribution.

The protocol is that of `smith`.  In the space stretched by alpha, the surface is a hemisphere, and
a visible normal is the mean of the viewer's direction and one that is uniform on a spherical cap.
With s the stretched wo, t = |s| and c on the cap, h' = t c + s: then wo.h = |h'|^2 / 2 and
D = (|h|^2 / |h'|^2)^2 / (pi ax ay), so that hardly anything is left to compute.
Source: Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps"; Heitz 2014,
"Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", eq. 72 and 85.
"""

import numpy as np

from ..arrays import F32, INV_PI, TWO_PI, Scalar, Vec, dot
from .smith import LEAST_COS, Normals, stretch, stretched2

NAME = "ggx"


def density(h: Vec, ax: Scalar, ay: Scalar) -> tuple[Scalar, Scalar]:
    """Return D (N,) [1/sr] of normals h (3, N) of any length, and |h|^2 (N,)."""
    square = h[2] * h[2]
    if ay is ax:
        # No 1 - cos^2, which would cancel for small alpha.
        length2 = dot(h[:2], h[:2])
        stretched = length2 * (F32(1) / (ax * ax))
    else:
        length2 = dot(h[:2], h[:2])
        stretched = stretched2(h, F32(1) / ax, F32(1) / ay)
    length2 += square
    stretched += square
    np.maximum(stretched, F32(1e-30), out=stretched)
    np.divide(length2, stretched, out=stretched)
    stretched *= stretched
    return stretched * (INV_PI / (ax * ay)), length2


def shadow(w: Vec, ax: Scalar, ay: Scalar) -> Scalar:
    """Return |cos| (1 + 2 Lambda) (N,) of directions w (3, N) on either side."""
    out = stretched2(w, ax, ay)
    out += w[2] * w[2]
    return np.sqrt(out, out=out)


def view(wo: Vec, ax: Scalar, ay: Scalar) -> tuple[Scalar, Scalar]:
    """Return the area (N,) that the viewer sees, and the shadow (N,) of wo (3, N)."""
    cast = shadow(wo, ax, ay)
    area = cast + np.maximum(wo[2], LEAST_COS)
    area *= F32(0.5)
    return area, cast


def sample(wo: Vec, ax: Scalar, ay: Scalar, u: Scalar, v: Scalar) -> Normals:
    """Draw visible normals from D |wo.h| / area."""
    # Stretch the viewer's direction.
    z = np.maximum(wo[2], LEAST_COS)
    s = stretch(wo, ax, ay)
    flat = dot(s, s)
    t = z * z
    t += flat
    np.sqrt(t, out=t)
    z += t  # now t + z

    # Choose a point of the cap: t - t c_z = v (t + z), so its radius has no cancellation.
    h = np.empty((3, u.size), F32)
    height = F32(1) - v
    np.multiply(height, z, out=h[2])
    radius = h[2] * z
    radius += flat
    radius *= v
    np.sqrt(radius, out=radius)
    azimuth = u * TWO_PI
    np.cos(azimuth, out=h[0])
    np.sin(azimuth, out=h[1])
    h[:2] *= radius
    h[:2] += s

    # D by |h'|^2; then unstretch, and reflect by the true wo.h, which keeps wi of unit length.
    np.multiply(h[2], h[2], out=height)
    flat = dot(h[:2], h[:2])
    stretched = flat + height
    h[0] *= ax
    h[1] *= ay
    length2 = flat * (ax * ax) if ay is ax else dot(h[:2], h[:2])
    length2 += height
    np.divide(length2, stretched, out=stretched)
    stretched *= stretched
    stretched *= INV_PI / (ax * ay)
    ratio = dot(wo, h)
    ratio *= F32(2)
    np.maximum(ratio, F32(0), out=ratio)
    ratio /= length2
    z *= F32(0.5)
    return Normals(h, length2, ratio, stretched, z, t)
