"""core.shading.program, closures -> materials of one graph share a program, and nothing changes."""

import numpy as np
import pytest

from penumbra.core import Link, Node
from penumbra.core.arrays import F32
from penumbra.core.shading import Arrival, Rules, compile_surface, compile_table
from penumbra.core.shading.program import merge, structure
from penumbra.core.shading.values import COLOUR, constant, read, several, step, widened
from tests.support import scenes as s
from tests.support.points import context, points, seen_from, vectors

RED, BLUE = (1.0, 0.25, 0.0), (0.1, 0.2, 0.9)


def _cosine(context):
    return context.cosine


def _power(x, exponent):
    return x**exponent


X = read(_cosine)


def surface(node):
    return compile_surface("Material 'X'", s.Material("X", node), Rules())


def diffuse(colour):
    return s.node("BsdfDiffuse", Color=colour)


def principled(colour, roughness, **more):
    return s.node("BsdfPrincipled", Base_Color=colour, Roughness=roughness, **more)


# --- Structure ----------------------------------------------------------------------------------


def graph(a=2.0, function=np.multiply, static=3, kind=None):
    made = step(_power, step(function, X, a, kind=kind), static=(static,))
    return [made, None, widened(made, COLOUR)]


def test_graphs_that_differ_in_constants_have_the_same_structure():
    assert structure(graph()) == structure(graph(a=5.0))


@pytest.mark.parametrize(
    "other",
    (
        graph(function=np.add),
        graph(static=4),
        graph(a=(1.0, 2.0, 3.0)),
        graph(kind=COLOUR),
        graph()[::-1],
        graph()[:2],
        [*graph()[:2], X],
    ),
    ids=("function", "static", "kind of a constant", "kind", "order", "number", "output"),
)
def test_graphs_that_differ_in_more_have_other_structures(other):
    assert structure(graph()) != structure(other)


def test_a_step_used_twice_is_not_two_equal_steps():
    once = X + 1.0
    assert structure([once * once]) != structure([(X + 1.0) * (X + 1.0)])


# --- Merging ------------------------------------------------------------------------------------


def test_only_what_differs_becomes_a_column():
    members = [[X * number + 7.0, constant((number, 1.0, 0.0))] for number in (2.0, 3.0, 5.0)]
    program = merge(members)
    np.testing.assert_array_equal(
        program.table[[0, 1]], [[2, 3, 5], [2, 3, 5]]
    )  # the factor, and red
    assert program.table.shape == (4, 3)
    assert {rows.stop - rows.start for rows in program.columns.values()} == {1, 3}
    assert program.table.dtype == F32


def test_points_get_the_numbers_of_their_own_column():
    members = [[X * number, constant((number, 1.0, 0.0))] for number in (2.0, 3.0, 5.0)]
    program = merge(members)
    at = context(seen_from(0.25, 0.5, 1.0, 0.5))
    column = np.array([2, 0, 1, 1], np.int32)
    scaled, colour = program.run(program.outputs, program.order, at, column)
    np.testing.assert_allclose(scaled, [1.25, 1.0, 3.0, 1.5])
    np.testing.assert_allclose(colour, [[5, 2, 3, 3], [1] * 4, [0] * 4])


def test_one_material_has_no_table():
    program = merge([graph()])
    assert not program.columns and program.table.shape == (0, 1)


def _two(a, b):
    return a + b, a * b


def test_results_of_one_function_are_merged_as_well():
    kinds = ("float", "float")
    program = merge([several(_two, X, number, kinds=kinds) for number in (2.0, 3.0)])
    at, column = context(seen_from(0.25, 0.5)), np.array([0, 1], np.int32)
    found = program.run(program.outputs, program.order, at, column)
    np.testing.assert_allclose(found, [[2.25, 3.5], [0.5, 1.5]])


def _double(a):
    return a.astype(np.float64)


def _endless(a):
    return a / F32(0)


def _short(a):
    return a[:1].repeat(2)


@pytest.mark.parametrize(
    ("function", "error", "what"),
    (
        (_double, TypeError, "float64"),
        (_endless, FloatingPointError, "_endless"),
        (_short, TypeError, "shape"),
    ),
)
def test_a_step_that_breaks_its_promise_is_named(function, error, what):
    program = merge([[step(function, X)]])
    at = context(seen_from(0.25, 0.5, 1.0))
    with np.errstate(all="ignore"), pytest.raises(error, match=what):
        program.run(program.outputs, program.order, at, None)


# --- Materials ----------------------------------------------------------------------------------


def test_materials_that_differ_in_constants_share_one_program():
    nodes = [principled(RED, 0.2), principled(BLUE, 0.7), principled(RED, 0.9)]
    table = compile_table([surface(node) for node in nodes])
    assert len(table.recipes) == 1
    assert table.program.tolist() == [0, 0, 0]
    assert table.column.tolist() == [0, 1, 2]
    (recipe,) = table.recipes
    assert recipe.program.table.shape[1] == 3


def test_materials_of_other_graphs_have_other_programs():
    value = Node("LayerWeight", "", {"Blend": 0.3})
    nodes = [
        diffuse(RED),
        principled(RED, 0.2),
        diffuse(BLUE),
        principled(RED, 0.2, Metallic=0.5),
        principled(RED, 0.2, Metallic=Link(value, "Facing")),
        s.node("BsdfTranslucent", Color=RED),
        None,
    ]
    table = compile_table([surface(node) for node in nodes])
    assert table.program.tolist() == [0, 1, 0, 2, 3, 4, 5]
    assert table.column.tolist() == [0, 0, 1, 0, 0, 0, 0]


def many():
    """Materials of a few graphs, in no order."""
    facing = Link(Node("LayerWeight", "", {"Blend": 0.3}), "Facing")
    rng = np.random.default_rng(3)
    nodes = []
    for number in range(24):
        colour, roughness = tuple(rng.random(3).tolist()), 0.1 + 0.8 * float(rng.random())
        more = (
            {},
            {"Metallic": roughness, "Coat_Weight": 0.3, "Sheen_Weight": 0.1},
            {"Transmission_Weight": facing, "IOR": 1 + roughness},
            {"Alpha": roughness, "Emission_Strength": 2.0, "Emission_Color": colour},
            {"Alpha": facing, "Diffuse_Roughness": roughness, "Specular_IOR_Level": roughness},
        )[int(rng.integers(5))]
        nodes.append(s.glass(1 + roughness, colour).surface if number % 7 == 3 else
                     principled(colour, roughness, **more))  # fmt: skip
    return [surface(node) for node in nodes]


def lobes_of(shaded, size):
    """For each point: its lobes, as (name, weight, parameters, share)."""
    found = [[] for _ in range(size)]
    for each in shaded:
        index = range(size) if each.index is None else each.index.tolist()
        for lobe in each.lobes:
            arrays = (lobe.weight, *lobe.parameters, lobe.frame.normal)
            arrays += () if lobe.share is None else (lobe.share,)
            for column, point in enumerate(index):
                numbers = [a[..., column if a.shape[-1] > 1 else 0].tolist() for a in arrays]
                found[point].append((lobe.module.NAME, numbers))
    return found


def flattened(lobes):
    return np.array([x for _, arrays in lobes for a in arrays for x in np.ravel(a)])


@pytest.mark.parametrize("is_chosen", (False, True), ids=("all", "one"))
def test_materials_together_are_what_each_is_alone(is_chosen):
    # But for the last bits: what is computed once for constants may be rounded otherwise.
    surfaces = many()
    table = compile_table(surfaces)
    assert 3 < len(table.recipes) < len(surfaces)
    rng = np.random.default_rng(4)
    count = 600
    wo, normal = rng.normal(size=(2, count, 3))
    wo[:, 2], normal = np.abs(wo[:, 2]), normal * 0.3 + (0, 0, 1)
    material = rng.integers(len(surfaces), size=count)
    back = rng.random(count) < 0.3
    throughput = rng.random((3, count)).astype(F32)

    def at(number, which):
        return points(
            vectors(*wo[which]), vectors(*normal[which]), number, back[which], distance=2.0
        )

    every = slice(None)
    together = at(material, every)
    found = lobes_of(table.shade(together, Arrival(), throughput, is_chosen), count)
    glow, clear = np.zeros((2, 3, count), F32)
    for index, light in table.emission(together, Arrival()):
        glow[:, every if index is None else index] = light
    clear[:] = table.transparency(together, Arrival())

    for number, own in enumerate(surfaces):
        which = np.flatnonzero(material == number)
        alone, single = compile_table([own]), at(0, which)
        shaded = alone.shade(single, Arrival(), throughput[:, which], is_chosen)
        expected = lobes_of(shaded, which.size)
        for point, lobes in zip(which, expected, strict=True):
            assert [name for name, _ in found[point]] == [name for name, _ in lobes], number
            flat, own_flat = (flattened(each) for each in (found[point], lobes))
            np.testing.assert_allclose(flat, own_flat, rtol=3e-6, atol=1e-7)
        light = np.zeros((3, which.size), F32)
        for _, some in alone.emission(single, Arrival()):
            light[:] = some
        np.testing.assert_allclose(glow[:, which], light, rtol=3e-6)
        passed = alone.transparency(single, Arrival())
        np.testing.assert_allclose(clear[:, which], passed, rtol=3e-6, atol=1e-7)


def test_the_order_of_materials_does_not_change_a_bit():
    surfaces = many()
    rng = np.random.default_rng(5)
    wo = vectors(*np.abs(rng.normal(size=(300, 3))))
    material = rng.integers(len(surfaces), size=300)
    one, other = (
        lobes_of(table.shade(points(wo, material=number), Arrival(), None, True), 300)
        for table, number in (
            (compile_table(surfaces), material),
            (compile_table(surfaces[::-1]), len(surfaces) - 1 - material),
        )
    )
    assert one == other
