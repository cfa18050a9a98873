"""points -> closures.  What a surface does with light, compiled from its nodes."""

from .closures import LobeAt, Shaded, SurfaceTable, choose, columns, compile_table
from .context import Arrival, Place
from .displacement import displace
from .graph import Library, images_below, output_of
from .lamps import LampShaders, fold_lamps
from .nodes.traced import SHARP
from .rules import Rules
from .sheets import keep_used, on_sheets
from .surface import Surface
from .surfaces import compile_surface
from .tracing import EVERYWHERE, OWN, Probe, compile_tracer
from .world import WorldShader, compile_world

__all__ = [
    "EVERYWHERE",
    "OWN",
    "Arrival",
    "LampShaders",
    "Library",
    "LobeAt",
    "SHARP",
    "Place",
    "Probe",
    "Rules",
    "Shaded",
    "Surface",
    "SurfaceTable",
    "WorldShader",
    "choose",
    "columns",
    "compile_surface",
    "compile_table",
    "compile_tracer",
    "compile_world",
    "displace",
    "fold_lamps",
    "images_below",
    "keep_used",
    "on_sheets",
    "output_of",
]
