"""scattering -> ray kind.  Bits that say how a ray was made, for visibility and bounce limits."""

from typing import Any

from ..scene import CAMERA, DIFFUSE, GLOSSY, SHADOW, TRANSMISSION

EVERY_KIND = CAMERA | DIFFUSE | GLOSSY | TRANSMISSION
STRAIGHT = 32  # no scattering: the ray keeps its kind
SINGULAR = 64  # scattered into the only direction there was
CLEAR = 128  # seen through glass that is as good as transparent, as far as the film knows


def lit_as(closure: Any) -> int:
    """Return the ray kinds of which a light must be seen by one to light a closure (Blender)."""
    if closure.RAY_KIND == DIFFUSE:
        return DIFFUSE
    return GLOSSY | TRANSMISSION if closure.TRANSMITS else GLOSSY


__all__ = [
    "CAMERA",
    "CLEAR",
    "DIFFUSE",
    "EVERY_KIND",
    "GLOSSY",
    "SHADOW",
    "SINGULAR",
    "STRAIGHT",
    "TRANSMISSION",
    "lit_as",
]
