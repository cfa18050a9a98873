"""closure, wo, u -> wi, weight, pdf.  Lambertian reflection.

f = 1/pi on the shading normal's side, 0 behind; the closure's colour is the albedo.
Source: Pharr et al. 2023, "Physically Based Rendering", 4th ed., section 9.2.
"""

import numpy as np

from ..arrays import F32, INV_PI, Scalar, Vec, dot
from ..sampling import warp
from .kinds import DIFFUSE

NAME = "diffuse"
PARAMETERS: dict[str, int] = {}
IS_DELTA = False
RAY_KIND = DIFFUSE
WEIGHT_IN_WI_Z = True
TRANSMITS = False
DRAWS = 2

TINY = F32(2.0**-24)


def evaluate(parameters: tuple[()], wo: Vec, wi: Vec) -> tuple[Scalar, Scalar]:
    """Return f cos (N,) and the pdf (N,) [1/sr] with which `sample` finds wi (3, N)."""
    pdf = wi[2] * INV_PI
    np.maximum(pdf, 0, out=pdf)
    return pdf, pdf


def sample(
    parameters: tuple[()], wo: Vec, u: Scalar, v: Scalar, w: None = None
) -> tuple[Vec, None, Scalar]:
    """Draw wi (3, N) in proportion to cos; the weight is exactly 1."""
    wi = warp.cosine_hemisphere(u, v)
    return wi, None, wi[2] * INV_PI


def sample_about(
    parameters: tuple[()], normal: Vec, u: Scalar, v: Scalar
) -> tuple[Vec, None, None]:
    """Draw directions (3, N) in proportion to cos about world-space normals, without a frame.

    The normal plus a uniform point of the unit sphere is distributed so.
    Source: Shirley 2020, "Ray Tracing in One Weekend", section 9.4.
    """
    direction = warp.uniform_sphere(u, v)
    direction += normal
    length = dot(direction, direction)
    fallen = np.flatnonzero(length < TINY)
    if fallen.size:
        # The point opposite to the normal leaves no direction: once in 2^26.
        direction[:, fallen] = normal[:, fallen]
        length[fallen] = 1
    np.sqrt(length, out=length)
    direction /= length
    return direction, None, None
