"""directions, roughness -> stretched directions.  What the distributions of microfacets share.

A distribution is a module with

    sample(wo, ax, ay, u, v) -> Normals      visible normals, and all that is known of them
    density(h, ax, ay) -> (D, |h|^2)         of normals h (3, N) of any length
    view(wo, ax, ay) -> (area, shadow)       of the viewer's direction
    shadow(w, ax, ay) -> S                   of any direction, above or below

where ax, ay (N,) or (1,) are the roughness alpha along x and y, the same object if isotropic, and

    area    (N,) the microfacets' area projected to the viewer, cos / G1; the density of visible
            normals is D |wo.h| / area
    shadow  (N,) S = |cos| (1 + 2 Lambda): Smith's masking of both directions is then
            G2 = 1 / (1 + Lambda_o + Lambda_i) = 2 cos_o cos_i / (S_o cos_i + S_i cos_o)

Source: Heitz 2014, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs".
"""

from typing import NamedTuple

import numpy as np

from ..arrays import F32, Scalar, Vec, dot

LEAST_ALPHA = F32(1.5e-5)  # below, Cycles takes surfaces for smooth
LEAST_COS = F32(1e-7)


class Normals(NamedTuple):
    """Sampled microfacet normals h (3, N), of any length, with |h|^2, 2 wo.h / |h|^2, D, ..."""

    h: Vec
    length2: Scalar
    ratio: Scalar
    density: Scalar
    area: Scalar
    shadow: Scalar


def stretch(w: Vec, ax: Scalar, ay: Scalar) -> Vec:
    """Return x and y (2, N) of directions, as seen by the distribution of roughness 1."""
    if ay is ax:
        return w[:2] * ax
    out = np.empty((2, *np.broadcast_shapes(w[0].shape, ax.shape, ay.shape)), F32)
    np.multiply(w[0], ax, out=out[0])
    np.multiply(w[1], ay, out=out[1])
    return out


def stretched2(w: Vec, ax: Scalar, ay: Scalar) -> Scalar:
    """Return the squared length (N,) of `stretch`."""
    if ay is ax:
        flat = dot(w[:2], w[:2])
        return flat * (ax * ax)
    flat = stretch(w, ax, ay)
    return dot(flat, flat)
