"""closure, wo, u -> wi, weight, pdf.  Cartoon highlight: a disk of even light around the mirror.

The cone of `toon_diffuse` around the mirrored direction; what reaches below the surface is lost.
"""

import numpy as np

from ..arrays import Scalar, Vec, frame
from ..sampling import warp
from .kinds import GLOSSY
from .toon_diffuse import opening, ring

NAME = "toon glossy"
PARAMETERS = {"size": 1, "smooth": 1}
IS_DELTA = False
RAY_KIND = GLOSSY
TRANSMITS = False
WEIGHT_IN_WI_Z = False
DRAWS = 2


def evaluate(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec) -> tuple[Scalar, Scalar]:
    """Return f cos (N,) and the pdf (N,) [1/sr] with which `sample` finds wi (3, N)."""
    weight, pdf = _shine(parameters, wo, wi)
    return weight * pdf, pdf


def sample(
    parameters: tuple[Scalar, ...], wo: Vec, u: Scalar, v: Scalar, w: None = None
) -> tuple[Vec, Scalar, Scalar]:
    """Draw wi (3, N) uniformly from the cone; those below the surface fail."""
    axis = np.negative(wo)
    axis[2] = wo[2]
    tangent, bitangent = frame(axis)
    x, y, z = warp.uniform_cone(u, v, opening(parameters))
    wi = tangent * x
    wi += bitangent * y
    wi += axis * z
    return wi, *_shine(parameters, wo, wi)


def _shine(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec) -> tuple[Scalar, Scalar]:
    """Return weight and pdf (N,) of wi (3, N)."""
    weight, pdf = ring(parameters, wi[0] + wo[0], wi[1] + wo[1], wi[2] - wo[2])
    seen = (wo[2] > 0) & (wi[2] > 0)
    return weight * seen, pdf * seen
