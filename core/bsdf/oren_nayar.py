"""closure, wo, u -> wi, weight, pdf.  Rough matte reflection that keeps the energy.

Cavities of a surface shade and mask each other; light that strikes several of them comes back as
a second, coloured term.  With c the closure's own colour and s the roughness,

    f = a + b t + m (1 - E(wo)) (1 - E(wi)),      a = 1 / (pi + s (pi/2 - 2/3)),   b = s a
    t = wo.wi - cos_o cos_i, divided by max(cos_o, cos_i) where it is positive
    m = c^2 / pi  A / (1 - A) / (1 - c (1 - A)),  A the mean of E over the hemisphere

where E(w) is the albedo of the first two terms.  With the formulas of E and A put in, 1 - E is
b times a function of the cosine alone, which does not cancel when s is small.
Source: Fujii 2012, "A tiny improvement of Oren-Nayar reflectance model"; multiple scattering as
in the OpenPBR specification 1.1, section 3.4, but for one more factor c, which is Cycles'.
"""

import numpy as np

from ..arrays import F32, INV_PI, Scalar, Vec, dot
from ..sampling import warp
from .kinds import DIFFUSE

NAME = "oren nayar"
PARAMETERS = {"flat": 1, "rough": 1, "multiple": 3}
IS_DELTA = False
RAY_KIND = DIFFUSE
TRANSMITS = False
WEIGHT_IN_WI_Z = False
DRAWS = 2

PI, TINY = F32(np.pi), F32(1e-30)
TWO_THIRDS, THIRD = F32(2 / 3), F32(1 / 3)
SPAN = F32(np.pi / 2 - 2 / 3)  # of G, from its value at grazing angles
MEAN_SPAN = F32(np.pi / 2 - 2 / 3 - (2 * np.pi - 5.6) / 3)  # the same, less G's mean


def prepare(roughness: Scalar, colour: Vec) -> tuple[Scalar, Scalar, Vec]:
    """Return the closure's parameters a, b (N,) and m b^2 (3, N) of a roughness in [0, 1]."""
    roughness = np.clip(roughness, F32(0), F32(1))
    colour = np.clip(colour, F32(0), F32(1))
    flat = F32(1) / (PI + roughness * SPAN)
    rough = roughness * flat
    lost = rough * MEAN_SPAN
    compensation = INV_PI * colour * colour * (F32(1) - lost) / (F32(1) - colour * lost)
    return flat, rough, compensation * (rough * (F32(1) / MEAN_SPAN))


def evaluate(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec) -> tuple[Vec, Scalar]:
    """Return f cos (3, N) and the pdf (N,) [1/sr] with which `sample` finds wi (3, N)."""
    cos_i = np.maximum(wi[2], F32(0))
    value = _reflectance(parameters, wo, wi, cos_i)
    value *= cos_i
    return value, cos_i * INV_PI


def sample(
    parameters: tuple[Scalar, ...], wo: Vec, u: Scalar, v: Scalar, w: None = None
) -> tuple[Vec, Vec, Scalar]:
    """Draw wi (3, N) in proportion to cos."""
    wi = warp.cosine_hemisphere(u, v)
    weight = _reflectance(parameters, wo, wi, wi[2])
    weight *= PI
    return wi, weight, wi[2] * INV_PI


def _reflectance(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec, cos_i: Scalar) -> Vec:
    """Return f (3, N) for wi (3, N) with the cosine cos_i (N,) >= 0."""
    flat, rough, multiple = parameters
    cos_o = np.clip(wo[2], F32(0), F32(1))

    # Light that strikes one cavity
    t = dot(wo, wi)
    t -= cos_o * cos_i
    t /= np.where(t > 0, np.maximum(np.maximum(cos_o, cos_i), TINY), F32(1))
    t *= rough
    t += flat

    # Light that strikes several
    value = multiple * (_lost(cos_o) * _lost(np.minimum(cos_i, F32(1))))
    value += t
    return value


def _lost(cos: Scalar) -> Scalar:
    """Return (1 - E) / b = G(0) - G(cos) (N,) for cosines (N,) in [0, 1]."""
    sine = np.sqrt((F32(1) - cos) * (F32(1) + cos))
    inner = np.arccos(cos)
    inner -= TWO_THIRDS
    inner += cos * (TWO_THIRDS / (F32(1) + sine) - sine * THIRD)
    inner *= sine
    return SPAN - inner
