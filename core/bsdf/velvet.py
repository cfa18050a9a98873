"""closure, wo, u -> wi, weight, pdf.  Velvet: fibres that stand up and light up at grazing angles.

Microfacets whose slopes follow an inverted Gaussian, of width sigma, so that few face the normal:

    f = D G / (4 cos_o cos_i),   D = exp(-cot^2 / sigma^2) / (pi sigma^2 sin^4)   of the half vector
    G = min(1, 2 cos_h cos_o / cos_d, 2 cos_h cos_i / cos_d)

It is not normalised, and its albedo is far below 1 where sigma is small.
Source: Ashikhmin, Premoze and Shirley 2000, "A Microfacet-based BRDF Generator"; G, Torrance and
Sparrow 1967.
"""

import numpy as np

from ..arrays import F32, INV_PI, TWO_PI, Scalar, Vec
from ..sampling import warp
from .kinds import DIFFUSE, GLOSSY

NAME = "velvet"
PARAMETERS = {"sigma": 1}
IS_DELTA = False
RAY_KIND = DIFFUSE
SHOWN_AS = GLOSSY  # as in Cycles
TRANSMITS = False
WEIGHT_IN_WI_Z = False
DRAWS = 2

UNIFORM = F32(0.5 / np.pi)  # pdf over the hemisphere
LEAST_SIGMA, LEAST, TINY = F32(0.01), F32(1e-5), F32(1e-20)


def evaluate(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec) -> tuple[Scalar, Scalar]:
    """Return f cos (N,) and the pdf (N,) [1/sr] with which `sample` finds wi (3, N)."""
    cos_o, cos_i = wo[2], wi[2]
    seen = (cos_o > 0) & (cos_i > 0)
    (sigma,) = parameters
    inverse = F32(1) / np.square(np.maximum(sigma, LEAST_SIGMA))

    # Half vector h of length 2 cos_d: squares of its parts
    x, y, z = wo[0] + wi[0], wo[1] + wi[1], cos_o + cos_i
    across = x * x + y * y
    up = z * z
    squared = across + up

    # D, without its angles' functions
    across = np.maximum(across, squared * (F32(2) * LEAST))
    across += TINY
    value = np.exp(up / across * -inverse)
    value *= np.square(squared / across)
    value *= inverse * (F32(0.25) * INV_PI)

    # G / cos_o, which is finite where cos_o is 0
    ratio = F32(4) * z / np.maximum(squared, TINY)
    nearest = np.maximum(cos_o, TINY)
    value *= np.minimum(np.minimum(F32(1) / nearest, ratio), ratio * (cos_i / nearest))
    value *= seen & (squared > F32(4) * LEAST * LEAST)
    return value, seen * UNIFORM


def sample(
    parameters: tuple[Scalar, ...], wo: Vec, u: Scalar, v: Scalar, w: None = None
) -> tuple[Vec, Scalar, Scalar]:
    """Draw wi (3, N) uniformly over the hemisphere."""
    wi = warp.uniform_hemisphere(u, v)
    value, pdf = evaluate(parameters, wo, wi)
    value *= TWO_PI
    return wi, value, pdf
