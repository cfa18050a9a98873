"""functions, arguments -> Value.  A number of a shader, not computed yet: a constant, or a step.

Shader nodes are written as arithmetic on values.  What depends on constants alone is computed at
once; the rest becomes a graph of steps, each a function on whole batches, that `program` puts in
order.  A step that reads something of the hit point gets the `Context` as its first argument.
"""

from collections.abc import Callable, Iterable
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32

FLOAT, VECTOR, COLOUR = "float", "vector", "colour"
LARGEST = F32(1e30)  # number of a shader: far below the largest float32, so that sums are finite
SEVERAL = "several"  # results of one function, before they are picked
Number = Union["Value", float, tuple[float, ...]]
Array = NDArray[np.float32]


class Value:
    """A scalar (N,), or a vector or colour (3, N), of a batch of points.

    Constants have the shape (1,) or (3, 1); `function` takes the context if `reads`, then the
    arrays of `args`, then `static`, which never depends on the point.
    """

    __slots__ = ("args", "constant", "function", "kind", "reads", "static")

    def __init__(
        self,
        kind: str,
        constant: Array | None = None,
        function: Callable[..., Any] | None = None,
        args: tuple["Value", ...] = (),
        static: tuple[Any, ...] = (),
        reads: bool = False,
    ) -> None:
        self.kind, self.constant, self.function = kind, constant, function
        self.args, self.static, self.reads = args, static, reads

    @property
    def is_constant(self) -> bool:
        """Whether the value is the same at all points."""
        return self.constant is not None

    def is_exactly(self, number: float) -> bool:
        """Whether all components are the constant `number`."""
        return self.constant is not None and bool((self.constant == F32(number)).all())

    def largest(self) -> float:
        """Return the largest component of a constant, infinity of anything else."""
        return np.inf if self.constant is None else float(self.constant.max())

    def __mul__(self, other: Number) -> "Value":
        other = value(other)
        for one, rest in ((self, other), (other, self)):
            kind = _wider(one, rest)
            if one.is_exactly(1) and rest.kind == kind:
                return rest
            if one.is_exactly(0):
                return constant(0.0, kind)
        return step(np.multiply, self, other)

    def __add__(self, other: Number) -> "Value":
        other = value(other)
        for one, rest in ((self, other), (other, self)):
            if one.is_exactly(0) and rest.kind == _wider(one, rest):
                return rest
        return step(np.add, self, other)

    def __sub__(self, other: Number) -> "Value":
        other = value(other)
        if other.is_exactly(0) and self.kind == _wider(self, other):
            return self
        return step(np.subtract, self, other)

    def __truediv__(self, other: Number) -> "Value":
        return step(np.divide, self, value(other))

    __radd__, __rmul__ = __add__, __mul__

    def __rsub__(self, other: Number) -> "Value":
        return value(other) - self

    def __rtruediv__(self, other: Number) -> "Value":
        return value(other) / self


def constant(number: Any, kind: str | None = None) -> Value:
    """Return a constant; of three numbers a colour, if `kind` does not say otherwise."""
    array = np.atleast_1d(np.asarray(number, F32))
    if kind is None:
        kind = FLOAT if array.size == 1 else COLOUR
    if kind != FLOAT:
        array = np.broadcast_to(array.reshape(-1, 1), (3, 1))
    return Value(kind, array)


def value(number: Number) -> Value:
    """Return a number as a value."""
    return number if isinstance(number, Value) else constant(number)


def step(
    function: Callable[..., Array],
    *numbers: Number,
    kind: str | None = None,
    static: tuple[Any, ...] = (),
) -> Value:
    """Return function(*numbers, *static), computed now if all numbers are constants.

    `kind` is that of the result; left out, it is the widest among the arguments.
    """
    args = tuple(value(number) for number in numbers)
    if kind is None:
        kind = FLOAT
        for arg in args:
            kind = arg.kind if kind == FLOAT else kind
    if all(arg.is_constant for arg in args):
        with np.errstate(all="ignore"):
            result = function(*(arg.constant for arg in args), *static)
        return constant(result, kind)
    return Value(kind, None, function, args, static)


def several(
    function: Callable[..., tuple[Array, ...]], *numbers: Number, kinds: tuple[str, ...]
) -> tuple[Value, ...]:
    """Return what a function gives that has several results, of these kinds."""
    args = tuple(value(number) for number in numbers)
    if all(arg.is_constant for arg in args):
        results = function(*(arg.constant for arg in args))
        return tuple(constant(result, kind) for result, kind in zip(results, kinds, strict=True))
    together = Value(SEVERAL, None, function, args)
    return tuple(
        Value(kind, None, _pick, (together,), (place,)) for place, kind in enumerate(kinds)
    )


def _pick(results: tuple[Array, ...], place: int) -> Array:
    return np.atleast_1d(results[place])


def read(
    function: Callable[..., Array],
    *numbers: Number,
    kind: str = FLOAT,
    static: tuple[Any, ...] = (),
) -> Value:
    """Return a step whose function reads the context, its first argument."""
    args = tuple(value(number) for number in numbers)
    return Value(kind, None, function, args, static, reads=True)


def clamp(number: Value, low: float = 0.0, high: float = 1.0) -> Value:
    """Return the value limited to [low, high]."""
    if np.isinf(high):
        return step(np.maximum, number, low)
    return step(_clip, number, static=(F32(low), F32(high)))


def positive(number: Value) -> Value:
    """Return the value without what is below 0."""
    return clamp(number, 0.0, np.inf)


def _clip(x: Array, low: np.float32, high: np.float32) -> Array:
    return np.minimum(np.maximum(x, low), high)


def mix(a: Number, b: Number, share: Number) -> Value:
    """Return a (1 - share) + b share."""
    share = value(share)
    if share.is_exactly(0) and value(a).kind == _wider(value(a), value(b)):
        return value(a)
    if share.is_exactly(1) and value(b).kind == _wider(value(a), value(b)):
        return value(b)
    a = value(a)
    return a + (value(b) - a) * share


def grey(number: Value) -> Value:
    """Return a value as a scalar: the luminance of a colour, the mean of a vector (Blender)."""
    if number.function is _repeat:
        return number.args[0]
    if number.kind == COLOUR:
        return step(_luminance, number, kind=FLOAT)
    return step(mean, number, kind=FLOAT) if number.kind == VECTOR else number


def average(number: Value) -> Value:
    """Return the mean of the components as a scalar."""
    if number.function is _repeat:
        return number.args[0]
    return number if number.kind == FLOAT else step(mean, number, kind=FLOAT)


def mean(x: Array) -> Array:
    """Return the mean (N,) of the three components."""
    return (x[0] + x[1] + x[2]) * F32(1 / 3)


def _luminance(x: Array) -> Array:
    # Rec. 709 primaries
    return x[0] * F32(0.2126729) + x[1] * F32(0.7151522) + x[2] * F32(0.0721750)


def widened(number: Value, kind: str) -> Value:
    """Return a value as `kind`: a scalar is repeated in all components."""
    if number.kind == kind or kind == FLOAT:
        return grey(number) if kind == FLOAT else number
    if number.kind != FLOAT:
        return step(np.positive, number, kind=kind)
    return step(_repeat, number, kind=kind)


def _repeat(x: Array) -> Array:
    return np.broadcast_to(x, (3, x.size))


def walk(outputs: Iterable[Value]) -> list[Value]:
    """Return all values that `outputs` are made of, each once, arguments before what uses them."""
    order: list[Value] = []
    seen: set[int] = set()
    stack: list[tuple[Value, bool]] = [(output, False) for output in reversed(list(outputs))]
    while stack:
        item, is_ready = stack.pop()
        if is_ready:
            order.append(item)
        elif id(item) not in seen:
            seen.add(id(item))
            stack.append((item, True))
            stack.extend((arg, False) for arg in reversed(item.args))
    return order


def rewritten(
    outputs: Iterable[Value], change: Callable[[Value, Value], Value]
) -> Callable[[Value], Value]:
    """Return a function from outputs to the same with other values in the place of some.

    change(item, made) gives what stands for a value; `made` is the value of changed arguments, the
    value itself if they are its own.
    """
    copies: dict[int, Value] = {}
    for item in walk(outputs):
        args = tuple(copies[id(arg)] for arg in item.args)
        made = item
        if any(a is not b for a, b in zip(args, item.args, strict=True)):
            made = Value(item.kind, item.constant, item.function, args, item.static, item.reads)
        copies[id(item)] = change(item, made)
    return lambda output: copies[id(output)]


def _wider(a: Value, b: Value) -> str:
    return b.kind if a.kind == FLOAT else a.kind
