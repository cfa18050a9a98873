"""arrays -> arrays.  Arithmetic that is defined everywhere, as Blender defines it.

What a function has no value for is 0.  Products end at `values.LARGEST`.
Source: what Cycles' Math nodes return, number by number.
"""

import numpy as np

from ...arrays import F32
from ..values import LARGEST, Array

ZERO, ONE, TWO = F32(0), F32(1), F32(2)


def limited(x: Array) -> Array:
    """Return numbers none of which is beyond the largest."""
    return np.clip(x, -LARGEST, LARGEST)


def nonzero(x: Array) -> Array:
    """Return numbers with 1 for each 0."""
    return np.where(x != 0, x, ONE)


def multiply(a: Array, b: Array) -> Array:
    """Return a b."""
    return limited(a * b)


def multiply_add(a: Array, b: Array, c: Array) -> Array:
    """Return a b + c."""
    return limited(a * b + c)


def divide(a: Array, b: Array) -> Array:
    """Return a / b, 0 where b is 0."""
    return np.where(b != 0, limited(a / nonzero(b)), ZERO)


def power(a: Array, b: Array) -> Array:
    """Return a^b, 0 where that is not real; 0^0 is 1, and 0 to other powers 0."""
    whole = b == np.floor(b)
    size = np.power(np.abs(nonzero(a)), b)
    odd = whole & (np.mod(b, TWO) == 1)
    signed = limited(np.where((a < 0) & odd, -size, size))
    unreal = ((a < 0) & ~whole) | ((a == 0) & (b != 0))
    return np.where(unreal, ZERO, signed)


def logarithm(a: Array, b: Array) -> Array:
    """Return the logarithm of a to the base b."""
    good = (a > 0) & (b > 0)
    return divide(np.log(np.where(good, a, ONE)), np.log(np.where(good, b, ONE)))


def square_root(a: Array) -> Array:
    """Return the root of a, 0 where a is negative."""
    return np.sqrt(np.maximum(a, ZERO))


def inverse_root(a: Array) -> Array:
    """Return one over the root of a, 0 where a is not positive."""
    return np.where(a > 0, ONE / np.sqrt(np.where(a > 0, a, ONE)), ZERO)


def modulo(a: Array, b: Array) -> Array:
    """Return the rest of a / b with the sign of a."""
    return np.where(b != 0, np.fmod(a, nonzero(b)), ZERO)


def floored_modulo(a: Array, b: Array) -> Array:
    """Return the rest of a / b with the sign of b."""
    return np.where(b != 0, a - multiply(np.floor(divide(a, b)), b), ZERO)


def wrap(a: Array, high: Array, low: Array) -> Array:
    """Return a brought into [low, high) by whole steps."""
    span = high - low
    return np.where(span != 0, a - multiply(span, np.floor(divide(a - low, span))), low)


def snap(a: Array, b: Array) -> Array:
    """Return the multiple of b below a."""
    return multiply(np.floor(divide(a, b)), b)


def pingpong(a: Array, b: Array) -> Array:
    """Return a mirrored again and again into [0, b]."""
    part = divide(a - b, b * TWO)
    return np.where(b != 0, np.abs((part - np.floor(part)) * b * TWO - b), ZERO)


def compare(a: Array, b: Array, c: Array) -> Array:
    """Return 1 where a and b are at most c apart."""
    near = np.abs(a - b) <= np.maximum(c, F32(2.0**-23))
    return ((a == b) | near).astype(F32)


def smooth_minimum(a: Array, b: Array, c: Array) -> Array:
    """Return the lesser of a and b, rounded where they are less than c apart."""
    h = np.maximum(c - np.abs(a - b), ZERO) / nonzero(c)
    return np.minimum(a, b) - np.where(c != 0, h * h * h * c * F32(1 / 6), ZERO)


def smooth_maximum(a: Array, b: Array, c: Array) -> Array:
    """Return the greater of a and b, rounded where they are less than c apart."""
    return -smooth_minimum(-a, -b, c)


def round_half_up(a: Array) -> Array:
    """Return the nearest whole number."""
    return np.floor(a + F32(0.5))


def fraction(a: Array) -> Array:
    """Return what is above the next lower whole number."""
    return a - np.floor(a)


def less(a: Array, b: Array) -> Array:
    """Return 1 where a < b."""
    return (a < b).astype(F32)


def greater(a: Array, b: Array) -> Array:
    """Return 1 where a > b."""
    return (a > b).astype(F32)


def arc_sine(a: Array) -> Array:
    """Return the angle [rad] of a sine, which is limited to what sines can be."""
    return np.arcsin(np.clip(a, -ONE, ONE))


def arc_cosine(a: Array) -> Array:
    """Return the angle [rad] of a cosine, which is limited to what cosines can be."""
    return np.arccos(np.clip(a, -ONE, ONE))


def arc_tangent_2(a: Array, b: Array) -> Array:
    """Return the angle [rad] of the point (b, a), 0 for the origin."""
    return np.where((a == 0) & (b == 0), ZERO, np.arctan2(a, b))


def exponential(a: Array) -> Array:
    """Return e^a."""
    return limited(np.exp(a))


def hyperbolic_sine(a: Array) -> Array:
    """Return sinh a."""
    return limited(np.sinh(a))


def hyperbolic_cosine(a: Array) -> Array:
    """Return cosh a."""
    return limited(np.cosh(a))


def radians(a: Array) -> Array:
    """Return degrees in radians."""
    return a * F32(np.pi / 180)


def degrees(a: Array) -> Array:
    """Return radians in degrees."""
    return limited(a * F32(180 / np.pi))
