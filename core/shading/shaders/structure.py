"""shader node -> weights, emission.  Nodes that arrange shaders, glow, let through or hold out."""

from ...scene import Node
from ..surface import Surface
from ..values import Value, clamp, positive


def _mix(surface: Surface, node: Node, weight: Value) -> None:
    factor = clamp(surface.graph.number(node, "Fac", 0.5))
    surface.pass_on(node, "Shader", weight * (1.0 - factor))
    surface.pass_on(node, "Shader_001", weight * factor)


def _sum(surface: Surface, node: Node, weight: Value) -> None:
    for socket in SHADER_INPUTS[node.kind]:
        surface.pass_on(node, socket, weight)


def _emission(surface: Surface, node: Node, weight: Value) -> None:
    strength = surface.graph.number(node, "Strength", 1.0)
    surface.emit(weight * surface.graph.colour(node, "Color") * strength)


def _transparent(surface: Surface, node: Node, weight: Value) -> None:
    surface.let_through(weight * positive(surface.graph.colour(node, "Color")))


def _holdout(surface: Surface, node: Node, weight: Value) -> None:
    surface.hold_out(weight)


# Which inputs of these nodes are shaders
SHADER_INPUTS = {
    "MixShader": ("Shader", "Shader_001"),
    "AddShader": ("Shader", "Shader_001"),
}

STRUCTURE = {
    "MixShader": _mix,
    "AddShader": _sum,
    "Emission": _emission,
    "Background": _emission,
    "BsdfTransparent": _transparent,
    "Holdout": _holdout,
}
