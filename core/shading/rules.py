"""settings -> Rules.  What the settings of a render change in the meaning of shader nodes."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Rules:
    """How shader nodes are compiled.

    is_blurred: for paths whose glossy closures filter glossy makes rougher; has_reflective and
    has_refractive_caustics: whether matte surfaces see light by way of glossy ones; shown: what
    passes want surfaces to tell of themselves, see `Surface.facts`.
    """

    is_blurred: bool = False
    has_reflective_caustics: bool = True
    has_refractive_caustics: bool = True
    shown: tuple[str, ...] = ()
