"""a tree, a node -> the output that is looked at.  Rows that take more than a node: zones, files.

Each setup gets the tree, the row's node and a function that makes fields by name.
"""

import tempfile
from pathlib import Path

import bpy
import numpy as np


def _constant(tree, node, field):
    for name, value in (("boolean", True), ("integer", 3), ("vector", (0.2, 0.7, -0.4))):
        if hasattr(node, name):
            setattr(node, name, value)
    return node.outputs[0]


def _menu(tree, node, field):
    switch = tree.nodes.new("GeometryNodeMenuSwitch")
    switch.data_type = "FLOAT"
    tree.links.new(node.outputs[0], switch.inputs[0])
    node.value = "B"
    for place, name in ((1, "p"), (2, "p2")):
        tree.links.new(field(name), switch.inputs[place])
    return switch.outputs[0]


def _repeat(tree, node, field):
    start, end = (tree.nodes.new(f"GeometryNodeRepeat{k}") for k in ("Input", "Output"))
    start.pair_with_output(end)
    end.repeat_items.clear()
    end.repeat_items.new("VECTOR", "V")
    start.inputs["Iterations"].default_value = 3
    tree.links.new(field("A"), start.inputs[1])
    step = tree.nodes.new("ShaderNodeVectorMath")
    step.operation = "MULTIPLY_ADD"
    step.inputs[1].default_value = (0.9, -1.1, 0.7)
    tree.links.new(start.outputs[1], step.inputs[0])
    tree.links.new(start.outputs[0], step.inputs[2])
    tree.links.new(step.outputs[0], end.inputs[0])
    return end.outputs[0]


def _closure(tree, node, field):
    start, end = (tree.nodes.new(f"NodeClosure{k}") for k in ("Input", "Output"))
    start.pair_with_output(end)
    end.input_items.new("FLOAT", "X")
    end.output_items.new("FLOAT", "Y")
    sine = tree.nodes.new("ShaderNodeMath")
    sine.operation = "SINE"
    tree.links.new(start.outputs[0], sine.inputs[0])
    tree.links.new(sine.outputs[0], end.inputs[0])
    both = tree.nodes.new("ShaderNodeMath")
    both.operation = "SUBTRACT"
    for place, name in enumerate(("a", "b")):
        evaluate = tree.nodes.new("NodeEvaluateClosure")
        evaluate.input_items.new("FLOAT", "X")
        evaluate.output_items.new("FLOAT", "Y")
        tree.links.new(end.outputs[0], evaluate.inputs[0])
        tree.links.new(field(name), evaluate.inputs[1])
        tree.links.new(evaluate.outputs[0], both.inputs[place])
    return both.outputs[0]


def _bundle(tree, node, field):
    bundles = []
    for name in ("P", "A"):
        made = tree.nodes.new("NodeCombineBundle")
        made.bundle_items.new("VECTOR", name)
        tree.links.new(field(name), made.inputs[0])
        bundles.append(made)
    join, apart = tree.nodes.new("NodeJoinBundle"), tree.nodes.new("NodeSeparateBundle")
    for made in bundles:
        tree.links.new(made.outputs[0], join.inputs[0])
    apart.bundle_items.new("VECTOR", "A")
    tree.links.new(join.outputs[0], apart.inputs[0])
    return apart.outputs[0]


def _ies(tree, node, field, kind, shape):
    """Give the node a file or a text of a photometric type."""
    number = {"C": 1, "B": 2, "A": 3}[kind]
    largest = {("C", "quarter"): 90, ("C", "half"): 180, ("C", "whole"): 360}.get((kind, shape), 90)
    lowest = 0 if kind == "C" or shape == "half" else -90
    around = np.linspace(lowest, largest, 7)
    down = np.linspace(0, 180, 10) if kind == "C" else np.linspace(lowest, 90, 10)
    random = np.random.default_rng(number)
    strength = random.random((len(around), len(down))) * 90
    if shape == "whole" and kind == "C":
        strength[-1] = strength[0]
    lines = ["IESNA:LM-63-2002", "[TEST] rows", "TILT=NONE"]
    lines.append(f"1 1000 1.5 {len(down)} {len(around)} {number} 2 0.1,0.2,0.3")
    lines.append("1.0 0.9 55")
    lines += [" ".join(f"{x:g}" for x in row) for row in (down, around, *strength)]
    text = "\n".join(lines) + "\n"
    if node.mode == "INTERNAL":
        node.ies = bpy.data.texts.new("ies")
        node.ies.write(text)
    else:
        path = Path(tempfile.mkdtemp()) / "lamp.ies"
        path.write_text(text)
        node.filepath = str(path)
    return node.outputs[0]


def _through(tree, node, field, name, how, *types):
    """Let a field, or a socket's own value, come to a node in a way that is not a plain link."""
    target = node.inputs.get("Normal") or node.inputs[0]
    source = field(name)
    if how in ("group", "value"):
        made = tree.nodes.new("ShaderNodeGroup")
        made.node_tree = group = bpy.data.node_groups.new("Through", "ShaderNodeTree")
        for way, kind in (("INPUT", types[0]), ("OUTPUT", types[-1])):
            group.interface.new_socket(way, in_out=way, socket_type=f"NodeSocket{kind}")
        group.interface.items_tree["INPUT"].hide_value = how == "value" and types[0] == "Vector"
        start, end = (group.nodes.new(f"NodeGroup{k}") for k in ("Input", "Output"))
        group.links.new(start.outputs[0], end.inputs[0])
        if how == "value":
            value = {"Float": 0.6, "Vector": (-0.2, 0.5, 0.9), "Color": (0.2, 0.5, 0.9, 1)}
            made.inputs[0].default_value = value[types[0]]
        else:
            tree.links.new(source, made.inputs[0])
    elif how == "reroute":
        made = tree.nodes.new("NodeReroute")
        tree.links.new(source, made.inputs[0])
    elif how == "muted":
        made = tree.nodes.new("ShaderNodeInvert")
        made.mute = True
        tree.links.new(source, made.inputs["Color"])
    elif how == "unknown":
        made = tree.nodes.new("ShaderNodeSqueeze")
        tree.links.new(source, made.inputs[0])
    elif how == "unavailable":  # an output that the node has not any more
        made = tree.nodes.new("ShaderNodeMapRange")
        tree.links.new(source, made.inputs[0])
        tree.links.new(made.outputs[0], target)
        made.data_type = "FLOAT_VECTOR"
        return _last(node)
    tree.links.new(made.outputs[0], target)
    return _last(node)


def _last(node):
    return [output for output in node.outputs if output.enabled][-1]


SETUPS = {
    "bundle": _bundle,
    "closure": _closure,
    "constant": _constant,
    "ies": _ies,
    "menu": _menu,
    "repeat": _repeat,
    "through": _through,
}
