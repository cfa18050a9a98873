"""closure, wo, u -> wi, weight, pdf.  A perfect mirror of metal.

Reflectance is Schlick's f0 + (f90 - f0)(1 - cos)^5; f90 = f0 makes it constant.
Source: Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering", eq. 15.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec
from .kinds import GLOSSY

NAME = "mirror"
PARAMETERS: tuple[str, ...] = ("f0_r", "f0_g", "f0_b", "f90_r", "f90_g", "f90_b")
IS_DELTA = True
RAY_KIND = GLOSSY
WEIGHT_IN_WI_Z = False
TRANSMITS = False


def reflect(wo: Vec) -> Vec:
    """Return wo (3, N) mirrored at the normal."""
    wi = np.negative(wo)
    wi[2] = wo[2]
    return wi


def branches(parameters: Vec, wo: Vec, back: NDArray[np.bool_]) -> tuple[tuple[Vec, Vec], ...]:
    """Return the one direction (3, N) and its weight (3, N)."""
    cos = np.clip(wo[2], 0, 1)
    grazing = F32(1) - cos
    fifth = grazing * grazing
    fifth *= fifth
    fifth *= grazing
    weight = parameters[:3] + (parameters[3:] - parameters[:3]) * fifth
    weight *= wo[2] > 0
    return ((reflect(wo), weight),)


def sample(
    parameters: Vec, wo: Vec, back: NDArray[np.bool_], u: Scalar, v: Scalar
) -> tuple[Vec, Vec, Scalar]:
    """Return the mirrored direction; the pdf of a delta direction is reported as 1."""
    ((wi, weight),) = branches(parameters, wo, back)
    return wi, weight, np.ones_like(u)
