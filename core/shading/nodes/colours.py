"""node -> Value.  Nodes that change a colour, take it apart or put it together.

Source: Cycles' kernel/svm, a header for each of them.
"""

from collections.abc import Callable

import numpy as np

from ...arrays import F32
from ...scene import Node
from ..graph import Graph
from ..values import COLOUR, FLOAT, Array, Value, grey, several, step
from .arithmetic import ONE, ZERO, fraction, power
from .colour_models import hsl_of_rgb, hsv_of_rgb, rgb_of_hsl, rgb_of_hsv

NodeFunction = Callable[[Graph, Node, str], Value | None]


def _hue_saturation(graph: Graph, node: Node, output: str) -> Value:
    changes = (graph.number(node, name, 1.0) for name in ("Saturation", "Value", "Fac"))
    return step(
        _changed_hue,
        graph.colour(node, "Color"),
        graph.number(node, "Hue", 0.5),
        *changes,
        kind=COLOUR,
    )


def _changed_hue(rgb: Array, turn: Array, saturation: Array, value: Array, share: Array) -> Array:
    hue, own, high = hsv_of_rgb(rgb)
    hue = fraction(hue + turn + F32(0.5))
    changed = rgb_of_hsv(hue, np.clip(own * saturation, ZERO, ONE), high * value)
    return np.maximum(share * changed + (ONE - share) * rgb, ZERO)


def _bright_contrast(graph: Graph, node: Node, output: str) -> Value:
    bright, contrast = graph.number(node, "Bright"), graph.number(node, "Contrast")
    return step(_brightened, graph.colour(node, "Color"), bright, contrast, kind=COLOUR)


def _brightened(rgb: Array, bright: Array, contrast: Array) -> Array:
    return np.maximum((ONE + contrast) * rgb + (bright - contrast * F32(0.5)), ZERO)


def _gamma(graph: Graph, node: Node, output: str) -> Value:
    gamma = graph.number(node, "Gamma", 1.0)
    return step(_raised, graph.colour(node, "Color"), gamma, kind=COLOUR)


def _raised(rgb: Array, gamma: Array) -> Array:
    raised = np.where(rgb > 0, power(np.maximum(rgb, ZERO), gamma), rgb)
    return np.where(gamma == 0, ONE, raised)


def _invert(graph: Graph, node: Node, output: str) -> Value:
    share, colour = graph.number(node, "Fac", 1.0), graph.colour(node, "Color")
    return share * (1.0 - colour) + (1.0 - share) * colour


def _rgb_to_bw(graph: Graph, node: Node, output: str) -> Value:
    return grey(graph.colour(node, "Color"))


def _rows(rgb: Array) -> tuple[Array, ...]:
    return rgb[0], rgb[1], rgb[2]


def _stack(*rows: Array) -> Array:
    return np.stack(np.broadcast_arrays(*rows))


# Mode -> how to take a colour apart, and how to put it together
MODELS: dict[str, tuple[Callable[..., tuple[Array, ...]], Callable[..., Array]]] = {
    "RGB": (_rows, _stack),
    "HSV": (hsv_of_rgb, rgb_of_hsv),
    "HSL": (hsl_of_rgb, rgb_of_hsl),
}


def _separate(socket: str, names: tuple[str, ...], mode: str | None = None) -> NodeFunction:
    def make(graph: Graph, node: Node, output: str) -> Value:
        apart = MODELS[mode or graph.choice(node, "mode", "RGB")][0]
        parts = several(apart, graph.colour(node, socket), kinds=(FLOAT, FLOAT, FLOAT))
        return parts[names.index(output)]

    return make


def _combine(names: tuple[str, ...], mode: str | None = None) -> NodeFunction:
    def make(graph: Graph, node: Node, output: str) -> Value:
        together = MODELS[mode or graph.choice(node, "mode", "RGB")][1]
        return step(together, *(graph.number(node, name) for name in names), kind=COLOUR)

    return make


COLOURS: dict[str, NodeFunction] = {
    "HueSaturation": _hue_saturation,
    "BrightContrast": _bright_contrast,
    "Gamma": _gamma,
    "Invert": _invert,
    "RGBToBW": _rgb_to_bw,
    "SeparateColor": _separate("Color", ("Red", "Green", "Blue")),
    "CombineColor": _combine(("Red", "Green", "Blue")),
    # As they were before Blender 3.3; files keep them
    "SeparateRGB": _separate("Image", ("R", "G", "B"), "RGB"),
    "CombineRGB": _combine(("R", "G", "B"), "RGB"),
    "SeparateHSV": _separate("Color", ("H", "S", "V"), "HSV"),
    "CombineHSV": _combine(("H", "S", "V"), "HSV"),
}
