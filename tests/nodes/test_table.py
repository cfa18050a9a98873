"""Every node that Blender has for shaders, and each of its choices, has a row or a reason."""

from pathlib import Path

import pytest

from penumbra.tests.nodes import table

ROOT = Path(__file__).parents[2]
PREFIXES = ("ShaderNode", "FunctionNode", "GeometryNode", "Node")


def offered():
    """Return all nodes of shader trees: kind -> choice -> (values, the first one)."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    tree = bpy.data.node_groups.new("Tree", "ShaderNodeTree")
    common = {prop.identifier for prop in bpy.types.ShaderNode.bl_rna.properties}
    found = {}
    for name in dir(bpy.types):
        if not name.startswith(PREFIXES) or "node_tree" in name:
            continue
        try:
            node = tree.nodes.new(name)
        except RuntimeError:
            continue  # not a node, or not one of shaders
        outputs = {output.identifier for output in node.outputs}
        choices = {"outputs": (outputs, "")}
        for prop in node.bl_rna.properties:
            if prop.type == "ENUM" and prop.identifier not in common:
                values = {item.identifier for item in prop.enum_items} - {""}
                choices[prop.identifier] = values, getattr(node, prop.identifier)
        kind = name if name == "ShaderNodeGroup" else name.removeprefix("ShaderNode")
        found[kind] = choices
    return found


@pytest.fixture(scope="module")
def nodes(blender):
    return blender(offered)


def test_every_node_of_blender_has_a_row_or_a_reason(nodes):
    assert len(nodes) > 90
    known = {row.kind for row in table.shown()} | set(table.ELSEWHERE) | set(table.LEFT_OUT)
    assert set(nodes) - known == set()


def test_every_choice_of_every_node_has_a_row_or_a_reason(nodes):
    missing = {}
    for kind, choices in nodes.items():
        rows = [row for row in table.shown() if row.kind == kind]
        for name, (values, first) in choices.items():
            seen = {
                row.output if name == "outputs" else row.choices.get(name, first) for row in rows
            }
            left, _ = table.CHOICES_LEFT_OUT.get((kind, name), (set(), ""))
            is_whole = seen == {""} or "*" in left or not rows
            if not is_whole and values - seen - left:
                missing[kind, name] = values - seen - left
    assert missing == {}


def test_choices_of_shaders_are_in_the_tests_that_have_them(nodes):
    missing = set()
    for kind, where in table.ELSEWHERE.items():
        text = "".join(
            file.read_text("utf-8")
            for place in where.split(", ")
            for file in ([ROOT / place] if place.endswith(".py") else (ROOT / place).glob("*.py"))
        )
        assert text, where
        for name, (values, _) in nodes.get(kind, {}).items():
            left, _ = table.CHOICES_LEFT_OUT.get((kind, name), (set(), ""))
            if name != "outputs" and "*" not in left:
                missing |= {(kind, name, value) for value in values - left if value not in text}
    assert missing == set()


def test_nothing_is_left_out_that_has_a_row_or_does_not_exist(nodes):
    rows = {row.kind for row in table.shown()}
    assert not rows & (set(table.LEFT_OUT) | set(table.ELSEWHERE))
    assert all(reason for reason in table.LEFT_OUT.values())
