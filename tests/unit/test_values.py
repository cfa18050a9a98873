"""core.shading.values -> constants fold, what does nothing is left out, kinds widen."""

import numpy as np
import pytest

from penumbra.core.arrays import F32
from penumbra.core.shading.program import merge
from penumbra.core.shading.values import (
    COLOUR,
    FLOAT,
    VECTOR,
    average,
    clamp,
    constant,
    grey,
    mix,
    positive,
    read,
    several,
    step,
    value,
    walk,
    widened,
)
from tests.support.points import context, seen_from

RED = (1.0, 0.25, 0.0)


def _cosine(context):
    return context.cosine


def _normal(context):
    return context.normal


X, NORMAL = read(_cosine), read(_normal, kind=VECTOR)
TINT = widened(X, COLOUR)


def run(*wanted, cosines=(0.25, 0.5, 1.0)):
    """The arrays of values at three points, whose X are these cosines."""
    program = merge([wanted])
    return program.run(wanted, program.order, context(seen_from(*cosines)), None)


def seen(number):
    """The number of a constant: a float, or three."""
    assert number.is_constant
    return tuple(number.constant.reshape(-1).tolist())


# --- Folding ------------------------------------------------------------------------------------


def test_constants_have_one_column_of_float32():
    for number, kind, shape in (
        (2.0, FLOAT, (1,)), (RED, COLOUR, (3, 1)), (np.float64(2), FLOAT, (1,)),
    ):  # fmt: skip
        made = constant(number)
        assert (made.kind, made.constant.shape, made.constant.dtype) == (kind, shape, F32)
    assert constant(RED, VECTOR).kind == VECTOR
    assert seen(constant(0.5, COLOUR)) == (0.5, 0.5, 0.5)


def test_what_depends_on_constants_alone_is_computed_at_once():
    two, red = constant(2.0), constant(RED)
    for made, expected in (
        (two + 1.0, (3.0,)),
        (1.0 + two, (3.0,)),
        (two - 0.5, (1.5,)),
        (0.5 - two, (-1.5,)),
        (two * red, (2.0, 0.5, 0.0)),
        (red * 2.0, (2.0, 0.5, 0.0)),
        (red / two, (0.5, 0.125, 0.0)),
        (1.0 / two, (0.5,)),
        (step(np.maximum, red, 0.5), (1.0, 0.5, 0.5)),
        (clamp(constant((-1.0, 0.5, 7.0))), (0.0, 0.5, 1.0)),
        (clamp(constant(-3.0), -2.0, 2.0), (-2.0,)),
        (positive(constant((-1.0, 0.5, 7.0))), (0.0, 0.5, 7.0)),
        (mix(red, 3.0, 0.5), (2.0, 1.625, 1.5)),
        (average(constant((1.0, 2.0, 6.0))), (3.0,)),
        (widened(two, COLOUR), (2.0, 2.0, 2.0)),
    ):
        np.testing.assert_allclose(seen(made), expected, rtol=1e-6)
        assert made.args == () and made.function is None


def test_a_scalar_is_the_luminance_of_a_colour_and_the_mean_of_a_vector():
    # Luminance of Rec. 709 primaries
    np.testing.assert_allclose(seen(grey(constant(RED))), 0.2127 + 0.25 * 0.7152, atol=1e-4)
    np.testing.assert_allclose(seen(grey(constant((1.0, 2.0, 6.0), VECTOR))), 3.0, rtol=1e-6)
    assert seen(grey(constant(0.5))) == (0.5,)
    number = constant(0.5)
    assert grey(number) is number and average(number) is number
    np.testing.assert_allclose(run(grey(TINT), average(TINT)), [[0.25, 0.5, 1]] * 2, rtol=1e-6)


def test_a_step_of_something_else_waits_and_is_computed_in_the_program():
    made = (X + 1.0) * RED_VALUE - X / 2.0
    assert not made.is_constant
    (found,) = run(made)
    x = np.array([0.25, 0.5, 1.0])
    np.testing.assert_allclose(found, (x + 1) * np.array(RED)[:, None] - x / 2, rtol=1e-6)
    found = run(1.0 - X, 1.0 / X, mix(X, 2.0, X), clamp(X, 0.3, 0.6))
    np.testing.assert_allclose(
        found, [1 - x, 1 / x, x * (1 - x) + 2 * x, np.clip(x, 0.3, 0.6)], rtol=1e-6
    )


RED_VALUE = constant(RED)


# --- Shortcuts ----------------------------------------------------------------------------------


def test_what_changes_nothing_makes_no_step():
    for number in (X, TINT, NORMAL, constant(RED)):
        for same in (number * 1.0, 1.0 * number, number + 0.0, 0.0 + number, number - 0.0):
            assert same is number
    for same in (mix(X, TINT, 1.0), mix(TINT, X, 0.0), mix(TINT, RED, 0.0), mix(RED, TINT, 1.0)):
        assert same is TINT


def test_a_product_with_zero_is_zero_of_the_wider_kind():
    for made, kind in (
        (X * 0.0, FLOAT),
        (0.0 * TINT, COLOUR),
        (X * constant((0.0, 0.0, 0.0)), COLOUR),
        (constant(0.0) * NORMAL, VECTOR),
    ):
        assert made.is_exactly(0) and made.kind == kind


def test_a_shortcut_never_narrows_the_kind():
    white, black = constant((1.0, 1.0, 1.0)), constant((0.0, 0.0, 0.0))
    for made in (X * white, white * X, X + black, X - black, mix(X, TINT, 0.0), mix(TINT, X, 1.0)):
        assert made.kind == COLOUR
        assert run(made)[0].shape == (3, 3)


def test_subtraction_is_not_reversed_by_its_shortcut():
    np.testing.assert_allclose(run(0.0 - X)[0], [-0.25, -0.5, -1])


def test_only_constants_have_a_largest_component():
    assert constant(RED).largest() == 1.0
    assert X.largest() == np.inf
    assert not X.is_exactly(0) and not constant(RED).is_exactly(1)


# --- Kinds --------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", (VECTOR, COLOUR))
def test_kinds_widen_scalars_only(kind):
    assert (X * constant(RED, kind)).kind == kind
    assert (constant(RED, kind) * X).kind == kind
    wide = widened(X, kind)
    assert wide.kind == kind and widened(wide, kind) is wide
    np.testing.assert_allclose(run(wide)[0], [[0.25, 0.5, 1.0]] * 3)


def test_a_vector_read_as_a_colour_keeps_its_components():
    colour = widened(NORMAL, COLOUR)
    assert colour.kind == COLOUR
    np.testing.assert_array_equal(run(colour)[0], run(NORMAL)[0])
    assert widened(X, FLOAT) is X


# --- Functions with several results -------------------------------------------------------------


def _parts(a, b):
    return a + b, np.stack([a, b, a * b]) if a.ndim == 1 else a * b


CALLS = []


def _counted(a):
    CALLS.append(a.size)
    return a + F32(1), a + F32(2)


def test_several_results_of_constants_are_constants():
    both = several(_parts, constant(2.0), constant(3.0), kinds=(FLOAT, COLOUR))
    assert [seen(each) for each in both] == [(5.0,), (2.0, 3.0, 6.0)]
    assert [each.kind for each in both] == [FLOAT, COLOUR]


def test_several_results_cost_one_call():
    CALLS.clear()
    one, other = several(_counted, X, kinds=(FLOAT, FLOAT))
    np.testing.assert_allclose(run(one, other), [[1.25, 1.5, 2], [2.25, 2.5, 3]])
    assert CALLS == [3]


# --- Order --------------------------------------------------------------------------------------


def test_arguments_stand_before_what_uses_them_and_each_only_once():
    a = X + 1.0
    b, c = a * a, a / X
    order = walk([b + c, b, a])
    place = {id(item): number for number, item in enumerate(order)}
    assert len(place) == len(order)
    for item in order:
        assert all(place[id(arg)] < place[id(item)] for arg in item.args)
    assert {id(X), id(a), id(b), id(c)} < set(place)


def test_the_order_is_the_same_for_graphs_of_the_same_shape():
    def made(number):
        x = X * number + 0.5
        return [x * X, x + X]

    one, other = walk(made(2.0)), walk(made(3.0))
    assert [item.function for item in one] == [item.function for item in other]


def test_a_chain_of_ten_thousand_steps_needs_no_deep_recursion():
    made = X
    for _ in range(10_000):
        made = made + 1.0
    # x, and a sum and its own constant for each step
    assert len(walk([made])) == 20_001
    np.testing.assert_allclose(run(made)[0], [10_000.25, 10_000.5, 10_001])


def test_a_number_is_a_value():
    assert value(X) is X
    assert seen(value(2.0)) == (2.0,)
