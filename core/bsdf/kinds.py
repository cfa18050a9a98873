"""scattering -> ray kind.  Bits that say how a ray was made, for visibility and bounce limits."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene import CAMERA, DIFFUSE, GLOSSY, SHADOW, TRANSMISSION

EVERY_KIND = CAMERA | DIFFUSE | GLOSSY | TRANSMISSION
STRAIGHT = 32  # of closures: no scattering, the ray keeps its kind
MATTE = 32  # of rays: a matte closure sent it, whatever it counts as
SINGULAR = 64  # scattered into the only direction there was
CLEAR = 128  # seen through glass that is as good as transparent, as far as the film knows


def lit_as(closure: Any) -> int:
    """Return the ray kinds of which a light must be seen by one to light a closure (Blender)."""
    if closure.RAY_KIND == DIFFUSE:
        return DIFFUSE
    return GLOSSY | TRANSMISSION if closure.TRANSMITS else GLOSSY


def shown_as(closure: Any) -> int:
    """Return the ray kind as whose passes show a closure, DIFFUSE or GLOSSY."""
    kind: int = getattr(closure, "SHOWN_AS", closure.RAY_KIND)
    return kind


def sent_as(kinds: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the kinds (N,) of the closures that sent rays, whatever the rays count as."""
    matte = (kinds & np.uint8(MATTE)) != 0
    other = kinds & np.uint8(0xFF ^ DIFFUSE ^ GLOSSY)
    kind = np.where(matte, np.uint8(DIFFUSE), np.uint8(GLOSSY))
    sent: NDArray[np.uint8] = other | np.where(kinds & np.uint8(CAMERA), np.uint8(0), kind)
    return sent


__all__ = [
    "CAMERA",
    "CLEAR",
    "DIFFUSE",
    "EVERY_KIND",
    "GLOSSY",
    "MATTE",
    "SHADOW",
    "SINGULAR",
    "STRAIGHT",
    "TRANSMISSION",
    "lit_as",
    "sent_as",
    "shown_as",
]
