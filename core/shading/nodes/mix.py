"""node -> Value.  Mix, and Mix Color as it was before: all the ways in which colours blend.

Each blend is a function of the factor (N,), and colours a and b (3, N).
Source: Cycles' mix nodes, kernel/svm/color_util.h.
"""

from collections.abc import Callable

import numpy as np

from ...arrays import F32
from ...scene import Node
from ..graph import Graph, title
from ..values import COLOUR, Array, Value, clamp, mix, step
from .arithmetic import ONE, TWO, ZERO, divide, nonzero
from .colour_models import hsv_of_rgb, rgb_of_hsv

HALF = F32(0.5)


def _between(a: Array, b: Array, factor: Array) -> Array:
    return a + (b - a) * factor


def _overlay(factor: Array, a: Array, b: Array) -> Array:
    rest = ONE - factor
    dark = a * (rest + TWO * factor * b)
    return np.where(a < HALF, dark, ONE - (rest + TWO * factor * (ONE - b)) * (ONE - a))


def _divide(factor: Array, a: Array, b: Array) -> Array:
    return np.where(b != 0, (ONE - factor) * a + factor * divide(a, b), a)


def _difference(factor: Array, a: Array, b: Array) -> Array:
    return _between(a, np.abs(a - b), factor)


def _exclusion(factor: Array, a: Array, b: Array) -> Array:
    return np.maximum(_between(a, a + b - TWO * a * b, factor), ZERO)


def _dodge(factor: Array, a: Array, b: Array) -> Array:
    rest = ONE - factor * b
    lit = np.where(rest > 0, np.minimum(a / nonzero(rest), ONE), ONE)
    return np.where(a != 0, lit, a)


def _burn(factor: Array, a: Array, b: Array) -> Array:
    rest = ONE - factor + factor * b
    burnt = np.clip(ONE - (ONE - a) / nonzero(rest), ZERO, ONE)
    return np.where(rest > 0, burnt, ZERO)


def _hue(factor: Array, a: Array, b: Array) -> Array:
    hue, saturation, _ = hsv_of_rgb(b)
    _, own, value = hsv_of_rgb(a)
    return np.where(saturation != 0, _between(a, rgb_of_hsv(hue, own, value), factor), a)


def _saturation(factor: Array, a: Array, b: Array) -> Array:
    hue, own, value = hsv_of_rgb(a)
    mixed = (ONE - factor) * own + factor * hsv_of_rgb(b)[1]
    return np.where(own != 0, rgb_of_hsv(hue, mixed, value), a)


def _value(factor: Array, a: Array, b: Array) -> Array:
    hue, saturation, own = hsv_of_rgb(a)
    return rgb_of_hsv(hue, saturation, (ONE - factor) * own + factor * hsv_of_rgb(b)[2])


def _colour(factor: Array, a: Array, b: Array) -> Array:
    hue, saturation, _ = hsv_of_rgb(b)
    value = hsv_of_rgb(a)[2]
    return np.where(saturation != 0, _between(a, rgb_of_hsv(hue, saturation, value), factor), a)


def _soft_light(factor: Array, a: Array, b: Array) -> Array:
    screen = ONE - (ONE - b) * (ONE - a)
    return _between(a, (ONE - a) * b * a + a * screen, factor)


# How colours blend that needs no function of its own: factor, a, b -> colour
PLAIN_BLENDS: dict[str, Callable[[Value, Value, Value], Value]] = {
    "MIX": lambda factor, a, b: mix(a, b, factor),
    "ADD": lambda factor, a, b: a + b * factor,
    "SUBTRACT": lambda factor, a, b: a - b * factor,
    "MULTIPLY": lambda factor, a, b: a * (1.0 - factor + b * factor),
    "SCREEN": lambda factor, a, b: 1.0 - (1.0 - b * factor) * (1.0 - a),
    "DARKEN": lambda factor, a, b: mix(a, step(np.minimum, a, b), factor),
    "LIGHTEN": lambda factor, a, b: mix(a, step(np.maximum, a, b), factor),
    "LINEAR_LIGHT": lambda factor, a, b: a + (b * 2.0 - 1.0) * factor,
}
BLENDS: dict[str, Callable[[Array, Array, Array], Array]] = {
    "OVERLAY": _overlay,
    "DIVIDE": _divide,
    "DIFFERENCE": _difference,
    "EXCLUSION": _exclusion,
    "DODGE": _dodge,
    "BURN": _burn,
    "HUE": _hue,
    "SATURATION": _saturation,
    "VALUE": _value,
    "COLOR": _colour,
    "SOFT_LIGHT": _soft_light,
}


def blended(blend: str, factor: Value, a: Value, b: Value) -> Value:
    """Return two colours blended; the factor is not limited."""
    if blend in PLAIN_BLENDS:
        return PLAIN_BLENDS[blend](factor, a, b)
    return step(BLENDS[blend], factor, a, b, kind=COLOUR)


def _mix(graph: Graph, node: Node, output: str) -> Value | None:
    kind = graph.choice(node, "data_type", "FLOAT")
    if kind == "ROTATION":
        graph.note(f"{title(node)}: rotations are not mixed")
        return None
    if kind == "VECTOR" and graph.choice(node, "factor_mode", "UNIFORM") == "NON_UNIFORM":
        factor = graph.whole(node, "Factor_Vector")
    else:
        factor = graph.number(node, "Factor_Float", 0.5)
    if graph.choice(node, "clamp_factor", True):
        factor = clamp(factor)
    if kind == "RGBA":
        a, b = graph.colour(node, "A_Color"), graph.colour(node, "B_Color")
        found = blended(graph.choice(node, "blend_type", "MIX"), factor, a, b)
        return clamp(found) if graph.choice(node, "clamp_result", False) else found
    if kind == "VECTOR":
        return mix(graph.whole(node, "A_Vector"), graph.whole(node, "B_Vector"), factor)
    return mix(graph.number(node, "A_Float"), graph.number(node, "B_Float"), factor)


def _mix_rgb(graph: Graph, node: Node, output: str) -> Value:
    factor = clamp(graph.number(node, "Fac", 0.5))
    a, b = graph.colour(node, "Color1"), graph.colour(node, "Color2")
    found = blended(graph.choice(node, "blend_type", "MIX"), factor, a, b)
    return clamp(found) if graph.choice(node, "use_clamp", False) else found


MIXES: dict[str, Callable[[Graph, Node, str], Value | None]] = {
    "Mix": _mix,
    "MixRGB": _mix_rgb,
}
