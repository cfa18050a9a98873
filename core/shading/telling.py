"""program steps -> verdict.  Which of them tell rays from matte closures from glossy ones."""

from collections.abc import Iterable

from .nodes.hit import LIGHT_PATH
from .normals import reader
from .values import Value

# Depths as well: they count bounces of one kind.
_OUTPUTS = ("Is Diffuse Ray", "Is Glossy Ray", "Is Reflection Ray", "Diffuse Depth", "Glossy Depth")
_READERS = frozenset(reader(LIGHT_PATH[output]) for output in _OUTPUTS)


def tells_kinds(steps: Iterable[Value]) -> bool:
    """Tell whether what steps compute differs for rays from matte and from glossy closures."""
    return any(reader(step) in _READERS for step in steps)
