"""closure, wo, u -> wi, weight, pdf.  Smooth refraction without reflection.

Bends light by Snell's law and loses none to reflection; total internal reflection is black.
Source: Pharr et al. 2023, "Physically Based Rendering", 4th ed., section 9.3.3.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Scalar, Vec
from .glass import fresnel, refract, relative_index
from .kinds import GLOSSY

NAME = "refraction"
PARAMETERS: tuple[str, ...] = ("ior",)
IS_DELTA = True
RAY_KIND = GLOSSY
WEIGHT_IN_WI_Z = False
TRANSMITS = True


def branches(parameters: Vec, wo: Vec, back: NDArray[np.bool_]) -> tuple[tuple[Vec, Scalar], ...]:
    """Return the one direction (3, N) and its weight (N,), 1 or 0."""
    eta = relative_index(parameters[0], back)
    _, cos_i = fresnel(np.clip(wo[2], 0, 1), eta)
    weight = ((cos_i > 0) & (wo[2] > 0)).astype(np.float32)
    return ((refract(wo, eta, cos_i), weight),)


def sample(
    parameters: Vec, wo: Vec, back: NDArray[np.bool_], u: Scalar, v: Scalar
) -> tuple[Vec, Scalar, Scalar]:
    """Return the refracted direction; the pdf of a delta direction is reported as 1."""
    ((wi, weight),) = branches(parameters, wo, back)
    return wi, weight, np.ones_like(u)
