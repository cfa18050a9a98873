"""core.shading.graph -> inputs as values: constants, links, what is unknown, long chains."""

import weakref

import numpy as np
import pytest

from penumbra.core import Link, Node
from penumbra.core.arrays import F32
from penumbra.core.shading.graph import Graph, Library, title
from penumbra.core.shading.nodes import NODES
from penumbra.core.shading.program import merge
from penumbra.core.shading.values import COLOUR, FLOAT, VECTOR, constant, read, step
from tests.support.points import context, seen_from

RED = (1.0, 0.25, 0.0)
OWNER = "Material 'X'"


def _cosine(context):
    return context.cosine


def _plus_one(x):
    return x + F32(1)


X = read(_cosine)
MADE = []


def _known(graph, node, output):
    """A node that adds one to its input; its output Nothing is not there."""
    MADE.append((node.name, output))
    if output == "Nothing":
        return None
    return step(_plus_one, graph.number(node, "A"))


TABLE = {
    "X": lambda graph, node, output: X,
    "Plus": _known,
    "Red": lambda graph, node, output: constant(RED),
    "Up": lambda graph, node, output: constant((0.0, 0.0, 3.0), VECTOR),
}


@pytest.fixture
def graph():
    MADE.clear()
    return Graph(OWNER, TABLE)


def node(**inputs):
    return Node("Target", "T", inputs)


def linked(kind, output="O", default=None, **inputs):
    return Link(Node(kind, "N", inputs), output, default)


def seen(made):
    assert made.is_constant
    return tuple(made.constant.reshape(-1).tolist())


def run(made, *cosines):
    program = merge([[made]])
    (found,) = program.run([made], program.order, context(seen_from(*cosines)), None)
    return found


def notes(graph):
    assert {note.owner for note in graph.notes} <= {OWNER}
    return [note.what for note in graph.notes]


# --- Constants ----------------------------------------------------------------------------------


def test_a_constant_is_a_value_of_the_kind_that_is_asked_for(graph):
    one = node(A=0.5, B=RED, C=(*RED, 1.0), D=(1.0, 2.0, 6.0), E=True, F=None)
    assert (graph.number(one, "A").kind, seen(graph.number(one, "A"))) == (FLOAT, (0.5,))
    assert (graph.colour(one, "B").kind, seen(graph.colour(one, "B"))) == (COLOUR, RED)
    assert (graph.vector(one, "D").kind, seen(graph.vector(one, "D"))) == (VECTOR, (1, 2, 6))
    assert seen(graph.colour(one, "C")) == RED
    assert seen(graph.colour(one, "A")) == (0.5, 0.5, 0.5)
    assert seen(graph.number(one, "E")) == (1.0,)
    assert seen(graph.number(one, "F", 7.0)) == (7.0,)
    np.testing.assert_allclose(seen(graph.number(one, "B")), 0.2127 + 0.25 * 0.7152, atol=1e-4)
    assert notes(graph) == []


def test_what_is_absent_has_the_default_of_the_node(graph):
    assert seen(graph.number(node(), "A")) == (0.0,)
    assert seen(graph.number(node(), "A", 1.25)) == (1.25,)
    assert seen(graph.colour(node(), "A")) == (1.0, 1.0, 1.0)
    assert graph.vector(node(), "A") is None
    assert seen(graph.vector(node(), "A", (1.0, 2.0, 3.0))) == (1, 2, 3)
    assert not graph.has(node(), "A") and graph.has(node(A=1.0), "A")


def test_choices_are_the_nodes_properties(graph):
    one = Node("Target", "", {}, {"operation": "SINE"})
    assert graph.choice(one, "operation", "ADD") == "SINE"
    assert graph.choice(one, "clamp", False) is False


# --- Links --------------------------------------------------------------------------------------


def test_a_link_gives_what_the_other_node_makes(graph):
    one = node(A=linked("X"), B=linked("Red"), C=linked("Up"))
    assert graph.number(one, "A") is X
    assert graph.colour(one, "A").kind == COLOUR
    assert seen(graph.colour(one, "B")) == RED
    np.testing.assert_allclose(seen(graph.number(one, "C")), 1.0, rtol=1e-6)  # the mean
    assert seen(graph.vector(one, "C")) == (0, 0, 3)
    assert graph.is_linked(one, "A") and not graph.is_linked(one, "Z")
    assert notes(graph) == []


def test_links_are_followed_and_folded(graph):
    chain = linked("Plus", A=linked("Plus", A=linked("Plus", A=0.5)))
    assert seen(graph.number(node(A=chain), "A")) == (3.5,)
    made = graph.number(node(A=linked("Plus", A=linked("X"))), "A")
    np.testing.assert_allclose(run(made, 0.25, 0.5), [1.25, 1.5])


def test_an_output_that_feeds_many_inputs_is_made_once(graph):
    shared = Node("Plus", "shared", {"A": Link(Node("X"), "O")})
    one = node(A=Link(shared, "O"), B=Link(shared, "O"), C=Link(shared, "Other"))
    a, b, c = (graph.number(one, name) for name in "ABC")
    assert a is b and a is not c
    assert MADE == [("shared", "O"), ("shared", "Other")]


# --- What is not known --------------------------------------------------------------------------


def test_an_unknown_node_is_noted_once_and_the_input_keeps_its_own_value(graph):
    strange = Node("TexStrange", "Grain")
    one = node(A=Link(strange, "Color", 0.3), B=Link(strange, "Color", RED))
    for _ in range(2):
        np.testing.assert_allclose(seen(graph.number(one, "A")), 0.3, rtol=1e-6)
        assert seen(graph.colour(one, "B")) == RED
    assert notes(graph) == [
        f"TexStrange 'Grain' feeding {socket} of Target 'T' is replaced by the input's own value"
        for socket in "AB"
    ]


@pytest.mark.parametrize(
    ("given", "drawn"),
    [
        (np.nan, (0.0,)),
        (-np.inf, (-1e30,)),
        (1e39, (1e30,)),
        ((0.5, np.nan, 1e300), (0.5, 0.0, 1e30)),
        ((), (0.0, 0.0, 0.0)),
    ],
)
def test_a_constant_that_is_no_number_is_noted_and_drawn_as_the_nearest(graph, given, drawn):
    one = node(A=given)
    found = graph.colour(one, "A") if len(drawn) == 3 else graph.number(one, "A")
    np.testing.assert_allclose(seen(found), drawn, rtol=1e-6)
    assert notes(graph) == [f"A of Target 'T' is {given}, which is no number to draw with"]


def test_an_unknown_node_without_a_value_gives_the_default_of_the_node_that_asks(graph):
    one = node(A=linked("TexStrange"))
    assert seen(graph.number(one, "A", 1.25)) == (1.25,)
    assert seen(graph.colour(one, "A")) == (1.0, 1.0, 1.0)
    assert seen(graph.vector(one, "A", (1.0, 2.0, 3.0))) == (1.0, 2.0, 3.0)
    assert graph.vector(one, "A") is None
    assert not graph.is_linked(one, "A")
    assert len(notes(graph)) == 1


def test_an_output_that_is_not_there_is_noted(graph):
    one = node(A=linked("Plus", "Nothing", 0.5))
    assert seen(graph.number(one, "A")) == (0.5,)
    assert notes(graph) == ["Plus 'N' feeding A of Target 'T' is replaced by the input's own value"]


def test_an_unknown_node_in_the_middle_keeps_the_rest_of_the_chain(graph):
    chain = linked("Plus", A=linked("TexStrange", "O", 5.0))
    assert seen(graph.number(node(A=chain), "A")) == (6.0,)
    (note,) = notes(graph)
    assert "feeding A of Plus" in note


def test_nodes_without_a_name_are_called_by_their_kind():
    assert title(Node("Math")) == "Math"
    assert title(Node("Math", "Half")) == "Math 'Half'"


# --- Long chains --------------------------------------------------------------------------------


@pytest.mark.parametrize("end", (0.5, Link(Node("X"), "O")), ids=("constant", "link"))
def test_a_chain_of_five_thousand_nodes_needs_no_deep_recursion(graph, end):
    for number in range(5000):
        end = Link(Node("Plus", f"{number}", {"A": end}), "O")
    made = graph.number(node(A=end), "A")
    np.testing.assert_allclose(run(made, 0.5), 5000.5)
    assert len(MADE) == 5000 and notes(graph) == []


def test_a_ladder_of_shared_nodes_is_walked_in_its_size_not_in_its_paths():
    # 2^60 paths lead through 60 nodes that each use the one before twice.
    end = Link(Node("LayerWeight", "", {"Blend": 0.5}), "Facing")
    for _ in range(60):
        end = Link(
            Node("Math", "", {"Value": end, "Value_001": end}, {"operation": "ADD"}), "Value"
        )
    graph = Graph(OWNER, NODES)
    made = graph.number(node(A=end), "A")
    np.testing.assert_allclose(run(made, 0.5), 2.0**60 * 0.5, rtol=1e-6)


# --- The library --------------------------------------------------------------------------------


def test_the_library_makes_each_thing_once_and_forgets_what_nobody_holds():
    library, made = Library(), []
    sources = [Node("One"), Node("Two")]
    for which in (0, 1, 0):
        library.get(sources[which], lambda which=which: made.append(which) or Node("Made"))
    assert made == [0, 1]
    forgotten = weakref.ref(library.get(sources[0], Node))
    del sources[0]
    assert forgotten() is None


def test_a_link_that_closes_a_circle_does_not_count(graph):
    first, second = Node("Plus", "First", {}), Node("Plus", "Second", {})
    first.inputs["A"] = Link(second, "O", 5.0)
    second.inputs["A"] = Link(first, "O", 10.0)
    found = graph.number(node(A=Link(first, "O")), "A")
    assert found.constant == 12  # the second's own value, and one twice
    assert [note.what for note in graph.notes] == [
        "Plus 'First' feeding A of Plus 'Second' is replaced by the input's own value"
    ]


def test_a_node_that_feeds_itself_has_its_own_value(graph):
    alone = Node("Plus", "Alone", {})
    alone.inputs["A"] = Link(alone, "O", 2.0)
    assert graph.number(node(A=Link(alone, "O")), "A").constant == 3


def test_two_ways_to_a_node_are_no_circle(graph):
    shared = Link(Node("Plus", "Shared", {"A": 1.0}), "O")
    both = Node("Plus", "Both", {"A": shared, "B": shared})
    assert graph.number(node(A=Link(both, "O"), B=shared), "A").constant == 3
    assert graph.notes == []
