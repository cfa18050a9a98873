"""a node -> its numbers.  What one output of a shader node gives at points."""

from penumbra.core import Link, Node
from penumbra.core.arrays import F32
from penumbra.core.shading.graph import Graph
from penumbra.core.shading.nodes import NODES
from penumbra.core.shading.program import merge

POSITION = Link(Node("NewGeometry", ""), "Position")
GIVEN = [Link(Node("SeparateXYZ", "", {"Vector": POSITION}), axis) for axis in "XYZ"]


def with_notes(node, output, at, ask="number"):
    """The array of a node's output at a context, and the notes."""
    graph = Graph("Material 'X'", NODES)
    made = getattr(graph, ask)(Node("Target", "", {"A": Link(node, output)}), "A")
    program = merge([[made]])
    (found,) = program.run([made], program.order, at, None)
    return found, graph.notes


def of(node, output, at, ask="number"):
    """The same where nothing may be left out."""
    found, notes = with_notes(node, output, at, ask)
    assert notes == []
    assert found.dtype == F32
    return found
