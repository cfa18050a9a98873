"""closure, wo, u -> wi, weight, pdf.  Rough matte transmission, of thin sheets that scatter.

The rough matte reflection, mirrored at the surface: light from behind is sent on as it would be
sent back from before.  Together they are a thin wall with subsurface scattering, of which
`shares` tells how much goes which way.
Source: OpenPBR specification 1.1, section 3.8 "Thin-walled case", as Cycles approximates it.
"""

import numpy as np

from ..arrays import F32, Scalar, Vec
from . import oren_nayar
from .kinds import DIFFUSE

NAME = "rough translucent"
PARAMETERS = oren_nayar.PARAMETERS
IS_DELTA = False
RAY_KIND = DIFFUSE
TRANSMITS = True
WEIGHT_IN_WI_Z = False
DRAWS = 2

prepare = oren_nayar.prepare


def shares(anisotropy: Scalar) -> tuple[Scalar, Scalar]:
    """Return the shares (N,) of light reflected and transmitted; anisotropy 1 is all forward."""
    forward = F32(0.5) * (F32(1) + np.clip(anisotropy, F32(-1), F32(1)))
    return F32(1) - forward, forward


def evaluate(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec) -> tuple[Vec, Scalar]:
    """Return f |cos| (3, N) and the pdf (N,) [1/sr] with which `sample` finds wi (3, N)."""
    return oren_nayar.evaluate(parameters, wo, _mirrored(wi))


def sample(
    parameters: tuple[Scalar, ...], wo: Vec, u: Scalar, v: Scalar, w: None = None
) -> tuple[Vec, Vec, Scalar]:
    """Draw wi (3, N) in proportion to |cos|."""
    wi, weight, pdf = oren_nayar.sample(parameters, wo, u, v, w)
    return _mirrored(wi), weight, pdf


def _mirrored(wi: Vec) -> Vec:
    """Return wi (3, N) on the other side of the surface."""
    out = wi.copy()
    np.negative(wi[2], out=out[2])
    return out
