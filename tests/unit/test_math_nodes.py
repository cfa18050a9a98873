"""core.shading.nodes.math -> what Blender's Math, Clamp and Mix give: formulas in plain floats."""

import math
import warnings

import numpy as np
import pytest

from penumbra.core import Link, Node
from penumbra.core.shading.nodes import vectors as vector_nodes
from tests.support.nodes import GIVEN, POSITION, of
from tests.support.points import context, points, seen_from, vectors

SWAPPED = Link(Node("CombineXYZ", "", dict(zip("XYZ", GIVEN[::-1], strict=True))), "Vector")

# --- Math ---------------------------------------------------------------------------------------


def whole_power(a, b):
    if b == 0:
        return 1.0
    if a == 0 or (a < 0 and b != math.floor(b)):
        return 0.0
    return a**b


def wrapped(a, high, low):
    span = high - low
    return a - span * math.floor((a - low) / span) if span else low


def smooth(a, b, c):
    if not c:
        return min(a, b)
    h = max(c - abs(a - b), 0) / c
    return min(a, b) - h**3 * c / 6


def fraction(a):
    return a - math.floor(a)


# Operation -> formula, of as many numbers as it has inputs
FORMULAS = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b else 0.0,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": whole_power,
    "LOGARITHM": lambda a, b: math.log(a) / math.log(b) if a > 0 and b > 0 and b != 1 else 0.0,
    "SQRT": lambda a: math.sqrt(max(a, 0)),
    "INVERSE_SQRT": lambda a: 1 / math.sqrt(a) if a > 0 else 0.0,
    "ABSOLUTE": abs,
    "EXPONENT": math.exp,
    "MINIMUM": min,
    "MAXIMUM": max,
    "LESS_THAN": lambda a, b: float(a < b),
    "GREATER_THAN": lambda a, b: float(a > b),
    "SIGN": lambda a: float(a > 0) - float(a < 0),
    "COMPARE": lambda a, b, c: float(abs(a - b) <= max(c, 2.0**-23)),
    "SMOOTH_MIN": smooth,
    "SMOOTH_MAX": lambda a, b, c: -smooth(-a, -b, c),
    "ROUND": lambda a: float(math.floor(a + 0.5)),
    "FLOOR": lambda a: float(math.floor(a)),
    "CEIL": lambda a: float(math.ceil(a)),
    "TRUNC": lambda a: float(math.trunc(a)),
    "FRACT": fraction,
    "MODULO": lambda a, b: math.fmod(a, b) if b else 0.0,
    "FLOORED_MODULO": lambda a, b: a - math.floor(a / b) * b if b else 0.0,
    "WRAP": wrapped,
    "SNAP": lambda a, b: math.floor(a / b) * b if b else 0.0,
    "PINGPONG": lambda a, b: abs(fraction((a - b) / (b * 2)) * b * 2 - b) if b else 0.0,
    "SINE": math.sin,
    "COSINE": math.cos,
    "TANGENT": math.tan,
    "ARCSINE": lambda a: math.asin(min(max(a, -1), 1)),
    "ARCCOSINE": lambda a: math.acos(min(max(a, -1), 1)),
    "ARCTANGENT": math.atan,
    "ARCTAN2": lambda a, b: math.atan2(a, b) if a or b else 0.0,
    "SINH": math.sinh,
    "COSH": math.cosh,
    "TANH": math.tanh,
    "RADIANS": math.radians,
    "DEGREES": math.degrees,
}
# Where one may divide by zero, take roots of what is negative, or stand on a step; all exact
NUMBERS = (-2.0, -1.75, -1.0, -0.5, 0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0)


def triples():
    a, b, c = np.meshgrid(NUMBERS, NUMBERS, (-1.0, 0.0, 0.5, 2.0))
    return np.stack([a.ravel(), b.ravel(), c.ravel()])


def math_node(operation, inputs, **more):
    names = ("Value", "Value_001", "Value_002")
    properties = {"operation": operation, **more}
    return Node("Math", "", dict(zip(names, inputs, strict=True)), properties)


@pytest.mark.parametrize("operation", FORMULAS)
def test_math_is_the_formula_also_where_that_is_not_defined(operation):
    formula = FORMULAS[operation]
    numbers = triples()
    count = formula.__code__.co_argcount if hasattr(formula, "__code__") else None
    count = {"MINIMUM": 2, "MAXIMUM": 2}.get(operation, count or 1)
    at = context(points(vectors((0, 0, 1)).repeat(numbers.shape[1], axis=1), position=numbers))
    found = of(math_node(operation, GIVEN), "Value", at)
    expected = [formula(*given[:count]) for given in numbers.T]
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)

    # Constants are folded to the same.
    for given, number in list(zip(numbers.T, expected, strict=True))[::37]:
        folded = of(math_node(operation, [float(x) for x in given]), "Value", at)
        assert folded.shape == (1,)
        np.testing.assert_allclose(folded, number, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("operation", FORMULAS)
def test_math_is_finite_for_numbers_of_many_sizes(operation):
    with np.errstate(all="ignore"):
        found = of(math_node(operation, GIVEN), "Value", many_sizes())
    assert np.isfinite(found).all()


def many_sizes():
    """Return a context whose points have coordinates up to the largest that nodes give."""
    sizes = (0.0, 1e-19, 1.0, 50.0, 1e3, 1e19, 1e30)
    sizes = np.array([*sizes, *(-x for x in sizes)])
    numbers = np.stack([each.ravel() for each in np.meshgrid(sizes, sizes, (0.0, 1e19, 1e30))])
    normals = vectors((0, 0, 1)).repeat(numbers.shape[1], axis=1)
    return context(points(normals, position=numbers))


@pytest.mark.parametrize("operation", vector_nodes.VECTOR_MATH)
def test_vector_math_is_finite_for_numbers_of_many_sizes(operation):
    inputs = {"Vector": POSITION, "Vector_001": SWAPPED, "Vector_002": POSITION, "Scale": GIVEN[0]}
    node = Node("VectorMath", "", inputs, {"operation": operation})
    with np.errstate(all="ignore"):
        if operation in vector_nodes.NUMBERS:
            found = of(node, "Value", many_sizes())
        else:
            found = of(node, "Vector", many_sizes(), "whole")
    assert np.isfinite(found).all()


@pytest.mark.parametrize("is_extended", [False, True])
def test_curves_are_finite_for_numbers_of_many_sizes(is_extended):
    table = np.float32([[0.1, 0.9, 0.3]] * 3)
    choices = {"table": table, "span": (-1.0, 1.0), "is_extended": is_extended}
    node = Node("VectorCurve", "", {"Vector": POSITION, "Fac": GIVEN[1]}, choices)
    with np.errstate(all="ignore"):
        found = of(node, "Vector", many_sizes(), "whole")
        grey = of(node, "Vector", many_sizes())
    assert np.isfinite(found).all()
    assert np.isfinite(grey).all()


def test_math_makes_no_warnings_where_it_is_defined_by_zero():
    numbers = triples()
    at = context(points(vectors((0, 0, 1)).repeat(numbers.shape[1], axis=1), position=numbers))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for operation in ("DIVIDE", "LOGARITHM", "SQRT", "INVERSE_SQRT", "MODULO", "ARCSINE"):
            of(math_node(operation, GIVEN), "Value", at)


def test_math_can_be_clamped():
    at = context(seen_from(1.0))
    for clamped, expected in ((True, 1.0), (False, 5.0)):
        node = math_node("ADD", (2.0, 3.0, 0.0), use_clamp=clamped)
        np.testing.assert_allclose(of(node, "Value", at), expected)


# --- Clamp, Mix, parts of vectors ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "low", "high", "expected"),
    (
        ("MINMAX", 0.2, 0.6, (0.2, 0.5, 0.6)),
        ("MINMAX", 0.6, 0.2, (0.2, 0.2, 0.2)),
        ("RANGE", 0.6, 0.2, (0.2, 0.5, 0.6)),
    ),
)
def test_clamp_limits(kind, low, high, expected):
    at = context(seen_from(0.1, 0.5, 0.9))
    facing = Link(
        math_node("SUBTRACT", (1.0, Link(Node("LayerWeight", "", {"Blend": 0.5}), "Facing"), 0.0)),
        "Value",
    )
    node = Node("Clamp", "", {"Value": facing, "Min": low, "Max": high}, {"clamp_type": kind})
    np.testing.assert_allclose(of(node, "Result", at), expected, rtol=1e-5)


A, B = (0.2, 0.5, 0.8), (0.6, 0.1, 1.5)
# Blend type -> formula of factor and two channels
BLENDS = {
    "MIX": lambda f, a, b: a * (1 - f) + b * f,
    "ADD": lambda f, a, b: a + f * b,
    "SUBTRACT": lambda f, a, b: a - f * b,
    "MULTIPLY": lambda f, a, b: a * (1 - f + f * b),
    "SCREEN": lambda f, a, b: 1 - (1 - f + f * (1 - b)) * (1 - a),
    "DARKEN": lambda f, a, b: a * (1 - f) + min(a, b) * f,
    "LIGHTEN": lambda f, a, b: a * (1 - f) + max(a, b) * f,
}


@pytest.mark.parametrize("blend", BLENDS)
@pytest.mark.parametrize("factor", (0.0, 0.3, 1.0, 2.0))
@pytest.mark.parametrize("clamped", (False, True))
def test_colours_blend(blend, factor, clamped):
    at = context(seen_from(0.7))
    expected = [BLENDS[blend](min(factor, 1), a, b) for a, b in zip(A, B, strict=True)]
    if clamped:
        expected = np.clip(expected, 0, 1)
    new = Node(
        "Mix",
        "",
        {"Factor_Float": factor, "A_Color": A, "B_Color": B},
        {"data_type": "RGBA", "blend_type": blend, "clamp_result": clamped},
    )
    old = Node(
        "MixRGB",
        "",
        {"Fac": factor, "Color1": A, "Color2": B},
        {"blend_type": blend, "use_clamp": clamped},
    )
    for node, output in ((new, "Result_Color"), (old, "Color")):
        found = of(node, output, at, "colour")
        np.testing.assert_allclose(found[:, 0], expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("clamped", "expected"), ((True, 5.0), (False, 8.0)))
def test_numbers_and_vectors_mix(clamped, expected):
    at = context(seen_from(0.7))
    inputs = {"Factor_Float": 2.0, "A_Float": 2.0, "B_Float": 5.0}
    node = Node("Mix", "", inputs, {"data_type": "FLOAT", "clamp_factor": clamped})
    np.testing.assert_allclose(of(node, "Result_Float", at), expected)
    inputs = {"Factor_Vector": (0.0, 0.5, 1.0), "A_Vector": (1.0,) * 3, "B_Vector": (3.0,) * 3}
    properties = {"data_type": "VECTOR", "factor_mode": "NON_UNIFORM"}
    found = of(Node("Mix", "", inputs, properties), "Result_Vector", at, "vector")
    np.testing.assert_allclose(found[:, 0], (1, 2, 3))


def test_vectors_are_taken_apart_and_put_together():
    place = np.array([[1.0, 4], [2, 5], [3, 6]], np.float32)
    at = context(points(vectors((0, 0, 1), (0, 0, 1)), position=place))
    for given, row in zip(GIVEN, place, strict=True):
        np.testing.assert_array_equal(of(given.node, given.output, at), row)
    parts = {"X": GIVEN[2], "Y": 7.0, "Z": GIVEN[0]}
    found = of(Node("CombineXYZ", "", parts), "Vector", at, "vector")
    np.testing.assert_array_equal(found, [[3, 6], [7, 7], [1, 4]])
