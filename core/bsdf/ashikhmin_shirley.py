"""closure, wo, u -> wi, weight, pdf.  Anisotropic Phong highlight.

The half vector's density is a power of its cosine, with an exponent for either axis:

    p = sqrt((n_x + 1)(n_y + 1)) / (2 pi) cos_h^(n_x cos^2 + n_y sin^2)     of the azimuth
    f cos_i = p / (4 cos_d) cos_i / max(cos_o, cos_i),   n = 2 / alpha^2 - 2

without Fresnel's factor: the closure's colour is the reflectance.
Source: Ashikhmin and Shirley 2000, "An Anisotropic Phong BRDF Model", eq. 4 and 6 to 8.
"""

import numpy as np

from ..arrays import F32, INV_PI, TWO_PI, Scalar, Vec, dot
from .kinds import GLOSSY

NAME = "ashikhmin shirley"
PARAMETERS = {"alpha_x": 1, "alpha_y": 1}
IS_DELTA = False
RAY_KIND = GLOSSY
TRANSMITS = False
WEIGHT_IN_WI_Z = False
DRAWS = 2

LEAST_ALPHA, TINY = F32(1e-4), F32(1e-20)
BELOW_1 = F32(1 - 2.0**-23)


def evaluate(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec) -> tuple[Scalar, Scalar]:
    """Return f cos (N,) and the pdf (N,) [1/sr] with which `sample` finds wi (3, N)."""
    weight, pdf = _highlight(parameters, wo, wi)
    return weight * pdf, pdf


def sample(
    parameters: tuple[Scalar, ...], wo: Vec, u: Scalar, v: Scalar, w: None = None
) -> tuple[Vec, Scalar, Scalar]:
    """Draw a half vector in proportion to its density and mirror wo at it."""
    n_x, n_y = (_exponent(alpha) for alpha in parameters)

    # Azimuth: the angle of a point on an ellipse is the density's, in all four quarters
    azimuth = u * TWO_PI
    x = np.cos(azimuth) / np.sqrt(n_x + F32(1))
    y = np.sin(azimuth) / np.sqrt(n_y + F32(1))
    scale = F32(1) / np.sqrt(x * x + y * y)
    x *= scale
    y *= scale

    # Height, by its logarithm, so that narrow highlights keep their shape
    exponent = n_x * (x * x) + n_y * (y * y) + F32(1)
    height = np.log1p(-v)
    height /= exponent
    sine = np.sqrt(-np.expm1(F32(2) * height))
    half = np.empty((3, u.size), F32)
    np.multiply(x, sine, out=half[0])
    np.multiply(y, sine, out=half[1])
    np.exp(height, out=half[2])

    wi = half * (F32(2) * dot(half, wo))
    wi -= wo
    return wi, *_highlight(parameters, wo, wi)


def _exponent(alpha: Scalar) -> Scalar:
    clipped = np.clip(alpha, LEAST_ALPHA, F32(1))
    return F32(2) / (clipped * clipped) - F32(2)


def _highlight(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec) -> tuple[Scalar, Scalar]:
    """Return weight and pdf (N,) of wi (3, N)."""
    n_x, n_y = (_exponent(alpha) for alpha in parameters)
    cos_o, cos_i = wo[2], wi[2]
    seen = (cos_o > 0) & (cos_i > 0)

    # Half vector h of length 2 cos_d: squares of its parts
    x, y, z = wo[0] + wi[0], wo[1] + wi[1], cos_o + cos_i
    x *= x
    y *= y
    across = x + y
    inverse = F32(1) / np.maximum(across + z * z, TINY)
    sine2 = np.clip(across * inverse, TINY, BELOW_1)

    # log of cos_h^exponent: log(1 - sine^2) / sine^2 is -1 in the middle
    power = n_x * x + n_y * y
    power *= inverse
    power *= F32(0.5) * np.log1p(-sine2) / sine2
    pdf = np.exp(power)
    pdf *= np.sqrt((n_x + F32(1)) * (n_y + F32(1))) * (F32(0.25) * INV_PI)
    pdf *= np.sqrt(inverse)
    pdf *= seen
    return cos_i / np.maximum(np.maximum(cos_o, cos_i), TINY) * seen, pdf
