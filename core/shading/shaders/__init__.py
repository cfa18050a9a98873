"""node kind -> function.  What every shader node means; add one with a line here."""

from collections.abc import Callable

from ...scene import Node
from ..surface import Surface
from ..values import Value
from .glossy import GLOSSY
from .matte import MATTE
from .principled import PRINCIPLED
from .structure import SHADER_INPUTS, STRUCTURE

SHADERS: dict[str, Callable[[Surface, Node, Value], None]] = {
    **STRUCTURE,
    **MATTE,
    **GLOSSY,
    **PRINCIPLED,
}

__all__ = ["SHADERS", "SHADER_INPUTS"]
