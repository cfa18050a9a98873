"""closure, wo, u -> wi, weight, pdf.  Lambertian transmission: matte light on the far side.

f = 1/pi behind the surface, 0 before it; the closure's colour is the albedo.
Source: Pharr et al. 2023, "Physically Based Rendering", 4th ed., section 9.2.
"""

import numpy as np

from ..arrays import INV_PI, Scalar, Vec
from ..sampling import warp
from . import diffuse
from .kinds import DIFFUSE

NAME = "translucent"
PARAMETERS: dict[str, int] = {}
IS_DELTA = False
RAY_KIND = DIFFUSE
TRANSMITS = True
WEIGHT_IN_WI_Z = True
DRAWS = 2


def evaluate(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec) -> tuple[Scalar, Scalar]:
    """Return f |cos| (N,) and the pdf (N,) [1/sr] with which `sample` finds wi (3, N)."""
    pdf = wi[2] * -INV_PI
    np.maximum(pdf, 0, out=pdf)
    return pdf, pdf


def sample(
    parameters: tuple[Scalar, ...], wo: Vec, u: Scalar, v: Scalar, w: None = None
) -> tuple[Vec, None, Scalar]:
    """Draw wi (3, N) in proportion to |cos|; the weight is exactly 1."""
    wi = warp.cosine_hemisphere(u, v)
    pdf = wi[2] * INV_PI
    np.negative(wi[2], out=wi[2])
    return wi, None, pdf


def sample_about(
    parameters: tuple[Scalar, ...], normal: Vec, u: Scalar, v: Scalar
) -> tuple[Vec, None, None]:
    """Draw directions (3, N) behind world-space normals (3, N) in proportion to |cos|."""
    return diffuse.sample_about((), -normal, u, v)
