"""closure, wo, u -> wi, weight, pdf.  Smooth clear glass: reflection and refraction.

Exact dielectric Fresnel for unpolarised light, with total internal reflection.  A surface seen
from behind is left from inside: its index is inverted.  Radiance is carried without the factor
eta^2, which cancels for light that enters and leaves again, as in Blender.
Source: Pharr et al. 2023, "Physically Based Rendering", 4th ed., sections 9.3.5 and 9.5.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec
from .kinds import GLOSSY
from .mirror import reflect

NAME = "glass"
PARAMETERS = ("ior", "reflect_r", "reflect_g", "reflect_b", "refract_r", "refract_g", "refract_b")
IS_DELTA = True
RAY_KIND = GLOSSY
WEIGHT_IN_WI_Z = False
TRANSMITS = True


def fresnel(cos_o: Scalar, eta: Scalar) -> tuple[Scalar, Scalar]:
    """Return reflectance (N,) and the cosine (N,) of the refracted direction.

    cos_o (N,) > 0 is that of the viewer's direction, eta (N,) the index beyond the surface
    divided by that on the viewer's side.  Total internal reflection gives (1, 0).
    """
    # g^2 = eta^2 - sin^2, in a form that is exact at grazing angles and for eta near 1.
    g2 = (eta - F32(1)) * (eta + F32(1)) + cos_o * cos_o
    total = g2 <= 0
    g = np.sqrt(np.maximum(g2, 0))
    perpendicular = (cos_o - g) / np.maximum(cos_o + g, F32(1e-20))
    eta2 = eta * eta
    parallel = (eta2 * cos_o - g) / np.maximum(eta2 * cos_o + g, F32(1e-20))
    reflectance = F32(0.5) * (perpendicular * perpendicular + parallel * parallel)
    return np.where(total, F32(1), reflectance), g / eta


def refract(wo: Vec, eta: Scalar, cos_i: Scalar) -> Vec:
    """Return wo (3, N) bent through the surface, cos_i (N,) being the cosine beyond it."""
    wi = np.empty_like(wo)
    scale = F32(-1) / eta
    wi[0] = wo[0] * scale
    wi[1] = wo[1] * scale
    wi[2] = -cos_i
    return wi


def relative_index(ior: Scalar, back: NDArray[np.bool_]) -> Scalar:
    """Return the index beyond the surface over that on the viewer's side (N,)."""
    return np.where(back, F32(1) / ior, ior)


def branches(parameters: Vec, wo: Vec, back: NDArray[np.bool_]) -> tuple[tuple[Vec, Vec], ...]:
    """Return (reflected, weight) and (refracted, weight), (3, N) each; their sum is exact."""
    eta = relative_index(parameters[0], back)
    reflectance, cos_i = fresnel(np.clip(wo[2], 0, 1), eta)
    seen = wo[2] > 0
    reflected = parameters[1:4] * (reflectance * seen)
    refracted = parameters[4:7] * ((F32(1) - reflectance) * seen)
    return (reflect(wo), reflected), (refract(wo, eta, cos_i), refracted)


def sample(
    parameters: Vec, wo: Vec, back: NDArray[np.bool_], u: Scalar, v: Scalar
) -> tuple[Vec, Vec, Scalar]:
    """Follow one of the two branches, with the probability of its share of the light."""
    (reflected, a), (refracted, b) = branches(parameters, wo, back)
    share_a, share_b = a[0] + a[1] + a[2], b[0] + b[1] + b[2]
    probability = share_a / np.maximum(share_a + share_b, F32(1e-20))
    first = u < probability
    wi = np.where(first, reflected, refracted)
    pdf = np.where(first, probability, F32(1) - probability)
    weight = np.where(first, a, b) / np.maximum(pdf, F32(1e-20))
    return wi, weight, pdf
