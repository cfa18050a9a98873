"""points -> closures.  What a surface does with light, compiled from its nodes."""

from .closures import Closures, Group, SurfaceTable, choose_lobe, compile_table
from .surfaces import Surface, compile_emission, compile_surface

__all__ = [
    "Closures",
    "Group",
    "Surface",
    "SurfaceTable",
    "choose_lobe",
    "compile_emission",
    "compile_surface",
    "compile_table",
]
