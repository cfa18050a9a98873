"""closure name -> module.  The registry, and the protocol that every closure type obeys.

Directions are unit, in the local frame whose z is the shading normal on the viewer's side; wo
points to the viewer, wi to the light.  A module declares

    NAME, PARAMETERS   rows of `parameters` (P, N) float32, in this order
    IS_DELTA           scatters into single directions only: `evaluate` is never asked
    RAY_KIND           DIFFUSE or GLOSSY: what a reflected ray counts as
    TRANSMITS          whether wi may lie behind the surface
    WEIGHT_IN_WI_Z     True if only wi[2] is read of the directions: wo may then be None
    evaluate(parameters, wo, wi) -> (f cos, pdf)          cos = |wi_z|; (N,) or (3, N), and (N,)
    sample(parameters, wo, back, u, v) -> (wi, weight, pdf)      weight = f cos / pdf, None is 1

`back` (N,) tells that the surface is seen from behind.  A weight of 0 is a failed sample; nothing
here returns NaN or raises.  wi_z < 0 means the ray has passed through.  A module whose sampling
depends on the normal alone may add, to spare the frame, in world space

    sample_about(parameters, normal, u, v) -> (direction, weight, pdf)

with the distribution of `sample`; and a delta module

    branches(parameters, wo, back) -> ((wi, weight), ...)

with all its directions at once, for splitting; the weights are then those of the sum.
"""

from types import ModuleType

from . import diffuse, glass, mirror, refraction
from .kinds import CAMERA, DIFFUSE, EVERY_KIND, GLOSSY, TRANSMISSION

REGISTRY: dict[str, ModuleType] = {
    module.NAME: module for module in (diffuse, mirror, glass, refraction)
}

__all__ = ["CAMERA", "DIFFUSE", "EVERY_KIND", "GLOSSY", "REGISTRY", "TRANSMISSION"]
