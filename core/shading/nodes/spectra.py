"""node -> Value.  Colours of light itself: Blackbody and Wavelength.

A wavelength is scaled so that no channel exceeds 1, without what is below 0, as Blender does.
"""

from collections.abc import Callable

import numpy as np

from ...arrays import F32
from ...scene import Node
from ..black_body import seen_black_body
from ..graph import Graph
from ..observer import FIRST, OBSERVER, STEP
from ..sky import REC709, rgb_of_xyz
from ..values import COLOUR, Array, Value, step
from .ramps import Table

BRIGHTEST = 2.52  # red of Rec.709 where it is the highest of all channels

# Blender's table has four digits
VALUES = np.round(OBSERVER, 4)


def _wavelength(graph: Graph, node: Node, output: str) -> Value:
    space, config = (graph.choice(node, key, "") for key in ("working_space", "config"))
    rgb = VALUES @ rgb_of_xyz(space or REC709, config).T / BRIGHTEST
    table = Table(rgb.T.astype(F32), (FIRST, FIRST + STEP * (len(VALUES) - 1)), is_extended=True)
    return step(_colour, graph.number(node, "Wavelength", 500.0), kind=COLOUR, static=(table,))


def _colour(wavelength: Array, table: Table) -> Array:
    last = F32(FIRST + STEP * (len(VALUES) - 1))
    seen = (wavelength > F32(FIRST - STEP)) & (wavelength < last)
    return np.where(seen, np.maximum(table.at(wavelength), F32(0)), F32(0))


def _black_body(graph: Graph, node: Node, output: str) -> Value:
    static = tuple(graph.choice(node, key, "") for key in ("working_space", "config"))
    temperature = graph.number(node, "Temperature", 1500.0)
    return step(_glow, temperature, kind=COLOUR, static=static)


def _glow(temperature: Array, space: str, config: str) -> Array:
    matrix: Array = rgb_of_xyz(space or REC709, config).astype(F32)
    rgb: Array = matrix @ seen_black_body(temperature)
    return np.maximum(rgb, F32(0))


SPECTRA: dict[str, Callable[[Graph, Node, str], Value]] = {
    "Blackbody": _black_body,
    "Wavelength": _wavelength,
}
