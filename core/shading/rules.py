"""settings -> Rules.  What the settings of a render change in the meaning of shader nodes."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Rules:
    """How shader nodes are compiled.

    is_blurred: for paths whose glossy closures filter glossy makes rougher; has_reflective and
    has_refractive_caustics: whether matte surfaces see light by way of glossy ones;
    occlusion_distance: how far Ambient Occlusion looks if it does not say so [m]; shown: what
    passes want surfaces to tell of themselves, see `Surface.facts`.
    """

    is_blurred: bool = False
    has_reflective_caustics: bool = True
    has_refractive_caustics: bool = True
    occlusion_distance: float = np.inf
    shown: tuple[str, ...] = ()
