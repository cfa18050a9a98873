"""closure, wo -> wi, weight.  Light that passes straight, as if there were no surface.

Such a ray stays what it was: it keeps its kind, is no bounce of any sort, and remembers where it
was scattered last.  Only surfaces that have been passed are counted.
"""

import numpy as np

from ..arrays import Scalar, Vec
from .kinds import STRAIGHT

NAME = "transparent"
PARAMETERS: dict[str, int] = {}
IS_DELTA = True
RAY_KIND = STRAIGHT
WEIGHT_IN_WI_Z = False
TRANSMITS = True
DRAWS = 2


def branches(parameters: tuple[Vec, ...], wo: Vec) -> tuple[tuple[Vec, None], ...]:
    """Return the one direction (3, N); all of the light passes."""
    return ((np.negative(wo), None),)


def sample(
    parameters: tuple[Vec, ...], wo: Vec, u: Scalar, v: Scalar, w: Scalar | None
) -> tuple[Vec, None, Scalar]:
    """Return the direction straight on; the pdf of a delta direction is reported as 1."""
    return np.negative(wo), None, np.ones_like(u)
