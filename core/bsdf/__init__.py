"""closure name -> closure type.  The registry, and the protocol that every closure type obeys.

Directions are unit, in the local frame whose z is the shading normal on the viewer's side and whose
x is the tangent; wo points to the viewer, wi to the light.  A closure type is a module or an object
with

    NAME, PARAMETERS   name -> rows: 1 is a scalar (N,) or (1,), 3 a colour (3, N) or (3, 1)
    IS_DELTA           scatters into single directions only: `evaluate` is never asked
    RAY_KIND           DIFFUSE or GLOSSY: what a reflected ray counts as
    TRANSMITS          whether wi may lie behind the surface
    WEIGHT_IN_WI_Z     True if only wi[2] is read of the directions: wo may then be None
    DRAWS              random numbers that `sample` needs, 2 or 3; w is None if 2
    evaluate(parameters, wo, wi) -> (f cos, pdf)          cos = |wi_z|; (N,) or (3, N), and (N,)
    sample(parameters, wo, u, v, w) -> (wi, weight, pdf)          weight = f cos / pdf, None is 1

`parameters` is a tuple in the order of PARAMETERS; what is constant may have one column only, and
all of them broadcast.  `eta` is the index beyond the surface divided by that on the viewer's side.
The closure's colour is applied by the caller.  Where wo_z <= 0 nothing is scattered.  A weight of
0 is a failed sample; nothing here returns NaN or raises.  wi_z < 0 means the ray has passed
through; radiance is carried without the factor eta^2.  A type whose sampling depends on the normal
alone may add, to spare the frame, in world space

    sample_about(parameters, normal, u, v) -> (direction, weight, pdf)

with the distribution of `sample`; and a delta type

    branches(parameters, wo) -> ((wi, weight), ...)

with all its directions at once, for splitting; the weights are then those of the sum.  SHOWN_AS is
the ray kind as whose passes show it, if not its own.
"""

from typing import Any

from . import (
    ashikhmin_shirley,
    diffuse,
    microfacet,
    oren_nayar,
    rough_translucent,
    sheen,
    smooth,
    toon_diffuse,
    toon_glossy,
    translucent,
    transparent,
    velvet,
)
from .kinds import (
    CAMERA,
    CLEAR,
    DIFFUSE,
    EVERY_KIND,
    GLOSSY,
    MATTE,
    SHADOW,
    SINGULAR,
    STRAIGHT,
    TRANSMISSION,
    lit_as,
    sent_as,
    shown_as,
)

REGISTRY: dict[str, Any] = {
    each.NAME: each
    for each in (
        diffuse,
        oren_nayar,
        translucent,
        rough_translucent,
        sheen,
        velvet,
        toon_diffuse,
        toon_glossy,
        ashikhmin_shirley,
        transparent,
        *microfacet.TYPES,
        *smooth.TYPES,
    )
}

__all__ = [
    "CAMERA",
    "CLEAR",
    "DIFFUSE",
    "EVERY_KIND",
    "GLOSSY",
    "MATTE",
    "REGISTRY",
    "SHADOW",
    "SINGULAR",
    "STRAIGHT",
    "TRANSMISSION",
    "lit_as",
    "sent_as",
    "shown_as",
    "transparent",
]
