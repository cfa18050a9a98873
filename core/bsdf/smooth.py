"""closure, wo, u -> wi, weight, pdf.  Smooth mirrors, glass and refraction.

The limit of `microfacet` as alpha goes to 0: single directions, by the same Fresnel models and
with the same parameters but alpha.  Named "smooth reflection f82", "smooth glass", "smooth
refraction" and "smooth thin", straight on.  Radiance is carried without the factor eta^2.
Source: Pharr et al. 2023, "Physically Based Rendering", 4th ed., sections 9.3 and 9.5.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..arrays import F32, Scalar, Vec
from .fresnel import dielectric
from .kinds import GLOSSY
from .microfacet import GLASSES, MODELS, TINTS, Model, Parameters

Branches = tuple[tuple[Vec, Vec], ...]

_TINY = F32(1e-20)


@dataclass(frozen=True, eq=False)
class Smooth:
    """A closure type that scatters into one or two single directions, by `follow`."""

    NAME: str
    PARAMETERS: dict[str, int]
    TRANSMITS: bool
    follow: Callable[[Model, Parameters, Vec], Branches]
    model: Model

    IS_DELTA: ClassVar = True
    RAY_KIND: ClassVar = GLOSSY
    WEIGHT_IN_WI_Z: ClassVar = False
    DRAWS: ClassVar = 2

    def branches(self, parameters: Parameters, wo: Vec) -> Branches:
        """Return all directions (3, N) with their weights (N,) or (3, N); the sum is exact."""
        return self.follow(self.model, parameters, wo)

    def sample(
        self, parameters: Parameters, wo: Vec, u: Scalar, v: Scalar, w: None = None
    ) -> tuple[Vec, Vec, Scalar]:
        """Follow one branch, by the probability of its share of the light, which is the pdf."""
        branches = self.branches(parameters, wo)
        if len(branches) == 1:
            ((wi, weight),) = branches
            return wi, weight, np.ones_like(u)
        (first, a), (second, b) = branches
        share = a[0] + a[1] + a[2]
        total = b[0] + b[1] + b[2]
        total += share
        share /= np.maximum(total, _TINY)
        chosen = u < share
        pdf = np.where(chosen, share, F32(1) - share)
        weight = np.where(chosen, a, b)
        weight /= np.maximum(pdf, _TINY)
        return np.where(chosen, first, second), weight, pdf


def _reflected(wo: Vec) -> Vec:
    wi = np.negative(wo)
    wi[2] = wo[2]
    return wi


def _refracted(wo: Vec, eta: Scalar, cos: Scalar) -> Vec:
    """Return wo (3, N) bent through the surface, cos (N,) being the cosine beyond it."""
    wi = wo * (F32(-1) / eta)
    np.negative(cos, out=wi[2])
    return wi


def _cosine(wo: Vec) -> Scalar:
    return np.clip(wo[2], F32(0), F32(1))


def _reflect(model: Model, parameters: Parameters, wo: Vec) -> Branches:
    seen = (wo[2] > 0).astype(F32)
    if model.reflectance is None:
        return ((_reflected(wo), seen),)
    return ((_reflected(wo), model.reflectance(_cosine(wo), *parameters) * seen),)


def _pass(model: Model, parameters: Parameters, wo: Vec) -> Branches:
    return ((np.negative(wo), (wo[2] > 0).astype(F32)),)


def _refract(model: Model, parameters: Parameters, wo: Vec) -> Branches:
    (eta,) = parameters
    _, cos = dielectric(_cosine(wo), eta)
    open_ = ((cos > 0) & (wo[2] > 0)).astype(F32)
    return ((_refracted(wo, eta, cos), open_),)


def _reflect_and_refract(model: Model, parameters: Parameters, wo: Vec) -> Branches:
    assert model.reflectance is not None
    *optics, reflection, transmission = parameters
    cos, seen = _cosine(wo), wo[2] > 0
    reflectance = model.reflectance(cos, *optics)
    _, beyond = dielectric(cos, optics[0])
    transmittance = (F32(1) - reflectance) * (transmission * seen)
    return (
        (_reflected(wo), reflectance * (reflection * seen)),
        (_refracted(wo, optics[0], beyond), transmittance),
    )


TYPES = (
    *(
        Smooth(f"smooth reflection {name}", model.parameters, False, _reflect, model)
        for name, model in MODELS.items()
    ),
    *(
        Smooth(
            f"smooth {glass}",
            {**MODELS[name].parameters, **TINTS},
            True,
            _reflect_and_refract,
            MODELS[name],
        )
        for glass, name in GLASSES.items()
    ),
    Smooth("smooth refraction", {"eta": 1}, True, _refract, MODELS["unit"]),
    Smooth("smooth thin", {}, True, _pass, MODELS["unit"]),
)
