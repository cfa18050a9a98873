"""bpy sockets -> core sockets.  What an input has without a link, and what types make of numbers.

Until Blender 5, Cycles gave what goes through groups, reroutes and muted nodes the type of each
socket on its way: a colour that passes a number is grey behind it.  Since then only the socket at
the end counts.
"""

import math
from collections.abc import Sequence

import bpy

from ...core.scene import Link, Node, Socket

_TYPES_COUNT = bpy.app.version < (5, 0)
_CARRIERS = {"RGBA": ("RGB", "Color"), "VECTOR": ("CombineXYZ", "Vector")}

# Types before and after -> kind of node, its output, the input that takes the link, other inputs
_CONVERSIONS = {
    ("RGBA", "VALUE"): ("RGBToBW", "Val", "Color", {}, {}),
    ("VECTOR", "VALUE"): (
        "VectorMath", "Value", "Vector", {"Vector_001": (1 / 3,) * 3}, {"operation": "DOT_PRODUCT"}
    ),
    ("RGBA", "VECTOR"): (
        "VectorMath", "Vector", "Vector", {"Vector_001": (0.0,) * 3}, {"operation": "ADD"}
    ),
    ("VECTOR", "RGBA"): (
        "MixRGB", "Color", "Color2", {"Fac": 1.0, "Color1": (0.0,) * 3}, {"blend_type": "MIX"}
    ),
}  # fmt: skip

# Nodes whose vectors are numbers though their values are hidden
_PLAIN = {"ShaderNodeVectorRotate", "ShaderNodeTexWhiteNoise", "NodeGroupOutput"}
_GROUPS = bpy.types.ShaderNodeGroup | bpy.types.ShaderNodeCustomGroup


def constant(socket: bpy.types.NodeSocket) -> Socket:
    """Return the value of a socket that has no link."""
    if socket.type in ("VALUE", "INT"):
        return finite(socket.default_value)
    if socket.type in ("BOOLEAN", "STRING", "MENU"):
        return socket.default_value
    if socket.type == "RGBA" or (socket.type == "VECTOR" and not _stands_for_more(socket)):
        x, y, z = (*map(finite, socket.default_value), 0.0)[:3]
        return (x, y, z)
    return None


def _stands_for_more(vector: bpy.types.NodeSocket) -> bool:
    """Tell whether something of the hit point feeds a vector without a link, as normals."""
    if not vector.hide_value:
        return False
    return not (vector.node.bl_idname in _PLAIN or isinstance(vector.node, _GROUPS))


def finite(number: float) -> float:
    """Return a number, 0 for what Blender made of constants that have no result, as 1 / 0."""
    return float(number) if math.isfinite(number) else 0.0


def converted(
    source: bpy.types.NodeSocket,
    link: Link | None,
    through: Sequence[bpy.types.NodeSocket],
    target: bpy.types.NodeSocket,
) -> Socket:
    """Return what `target` gets of a source, by way of the outputs `through`, the last one first.

    Without a link it is the source's constant; what stands for something of the hit point keeps it.
    """
    kinds = [_kind(socket) for socket in through] if _TYPES_COUNT else []
    while kinds and kinds[0] == _kind(target):
        del kinds[0]
    default, now = constant(target), _kind(source)
    if link is None:
        value = constant(source)
        if value is None or (default is None and target.type in ("VECTOR", "SHADER")):
            return default
        if {now, *kinds} == {_kind(target)}:
            return value
        link = _carried(source, value, default)
    for kind in reversed(kinds):
        conversion = _CONVERSIONS.get((now, kind))
        if conversion is not None:
            name, output, socket, more, choices = conversion
            link = Link(Node(name, source.name, {socket: link, **more}, choices), output, default)
            now = kind
    return link


def _kind(socket: bpy.types.NodeSocket) -> str:
    return "VALUE" if socket.type in ("INT", "BOOLEAN") else socket.type


def _carried(source: bpy.types.NodeSocket, value: Socket, default: Socket) -> Link:
    """Return a socket's constant as a node that has it."""
    kind, output = _CARRIERS.get(source.type, ("Value", "Value"))
    if isinstance(value, tuple) and kind == "CombineXYZ":
        return Link(Node(kind, source.name, dict(zip("XYZ", value, strict=True))), output, default)
    return Link(Node(kind, source.name, properties={output: value}), output, default)


def nothing(default: Socket) -> Socket:
    """Return what an input gets from where nothing is: 0, if it is a number."""
    if isinstance(default, tuple):
        return (0.0, 0.0, 0.0)
    return 0.0 if isinstance(default, float) else default


def is_number(source: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> bool:
    """Tell whether numbers feed a shader."""
    return target.type == "SHADER" and source.type not in ("SHADER", "CUSTOM")


def shining(number: Socket, name: str) -> Link:
    """Return what a number is that feeds a shader: it shines."""
    return Link(Node("Emission", name, {"Color": number, "Strength": 1.0}), "Emission")
