"""names and values -> a shader tree on paper.  So that a scene's materials read as one expression.

    mix = node("MixShader", Fac=node("LayerWeight", Blend=0.3)["Facing"], Shader=a, Shader_001=b)

Capitalised keywords are sockets, by identifier or by name with `_` for a space; keywords in small
letters are properties of the node. Nothing here needs bpy: `stage.tree` plants the tree.
"""

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Node:
    """A shader node; a value of `inputs` may be a Node (its first output) or an Output."""

    kind: str
    inputs: dict[str, Any] = field(default_factory=dict)
    properties: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, output: str) -> "Output":
        """Return an output by name."""
        return Output(self, output)


@dataclass(frozen=True)
class Output:
    """One of a node's outputs."""

    node: Node
    name: str


def node(kind: str, **keywords: Any) -> Node:
    """Return a node of the kind that Blender calls "ShaderNode" + kind."""
    inputs = {key: value for key, value in keywords.items() if key[0].isupper()}
    return Node(kind, inputs, {k: v for k, v in keywords.items() if k not in inputs})


def math(operation: str, *values: Any) -> Node:
    """Return a Math node of these operands."""
    names = ("Value", "Value_001", "Value_002")
    return node("Math", operation=operation, **dict(zip(names, values, strict=False)))


def mix(factor: Any, first: Node, second: Node) -> Node:
    """Return a Mix Shader."""
    return node("MixShader", Fac=factor, Shader=first, Shader_001=second)


def add(first: Node, second: Node) -> Node:
    """Return an Add Shader."""
    return node("AddShader", Shader=first, Shader_001=second)


def diffuse(*colour: float, roughness: float = 0.0) -> Node:
    """Return a Diffuse BSDF, 0.8 grey by default."""
    return node("BsdfDiffuse", Color=colour or (0.8, 0.8, 0.8), Roughness=roughness)


def glossy(roughness: float, *colour: float, **more: Any) -> Node:
    """Return a Glossy BSDF (GGX without energy compensation by default)."""
    keywords: dict[str, Any] = {"Color": colour or (0.8, 0.8, 0.8), "Roughness": roughness}
    return node("BsdfAnisotropic", **(keywords | {"distribution": "GGX"} | more))


def principled(**inputs: Any) -> Node:
    """Return a Principled BSDF; coloured by default, so that tints show."""
    keywords: dict[str, Any] = {"Base_Color": (0.8, 0.45, 0.25), "distribution": "MULTI_GGX"}
    return node("BsdfPrincipled", **(keywords | inputs))


def glass(roughness: float = 0.0, *colour: float, **more: Any) -> Node:
    """Return a Glass BSDF of index 1.45."""
    keywords: dict[str, Any] = {"Color": colour or (1, 1, 1), "Roughness": roughness, "IOR": 1.45}
    return node("BsdfGlass", **(keywords | {"distribution": "GGX"} | more))


def clear(*colour: float) -> Node:
    """Return a Transparent BSDF."""
    return node("BsdfTransparent", Color=colour or (1, 1, 1))


def glow(strength: Any, *colour: float) -> Node:
    """Return an Emission shader."""
    return node("Emission", Color=colour or (1, 1, 1), Strength=strength)
