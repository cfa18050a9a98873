"""node -> Value.  Color Ramp and curves, which come as tables of their values.

A table has the values at even steps from 0 to 1; between them it is a straight line, or
the value of the step below.  Cycles reads ramps and curves from tables of 257 values, so the
picture has their precision, not that of the curve.
"""

from collections.abc import Callable

import numpy as np

from ...arrays import F32
from ...scene import Node
from ..graph import Graph
from ..values import COLOUR, FLOAT, VECTOR, Array, Value, step
from .arithmetic import ONE, ZERO, limited, multiply


class Table:
    """Values (R, K) at even steps, and how they go on; equal ones count as the same."""

    def __init__(
        self,
        values: Array,
        span: tuple[float, float] = (0.0, 1.0),
        is_stepped: bool = False,
        is_extended: bool = False,
    ) -> None:
        self.values = np.atleast_2d(np.ascontiguousarray(values, F32))
        self.rise = np.diff(self.values, axis=1)
        self.low, self.scale = F32(span[0]), F32(1 / ((span[1] - span[0]) or 1.0))
        self.is_stepped, self.is_extended = is_stepped, is_extended
        self._key = (self.values.shape, self.values.tobytes(), span, is_stepped, is_extended)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Table) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    def at(self, x: Array, row: int | slice = slice(None)) -> Array:
        """Return what one row (N,), or all of them (R, N), have at x (N,), always finite."""
        x = (x - self.low) * self.scale
        x = limited(x) if self.is_extended else np.clip(x, ZERO, ONE)
        last = self.values.shape[1] - 1
        x = x * F32(last)
        if self.is_stepped:
            return self.values[row].take(np.clip(x, ZERO, F32(last)).astype(np.int32), axis=-1)
        below = np.clip(x, ZERO, F32(last - 1)).astype(np.int32)
        part = x - below.astype(F32)
        value = self.values[row].take(below, axis=-1) + self.rise[row].take(below, axis=-1) * part
        return limited(value) if self.is_extended else value


def _ramp(graph: Graph, node: Node, output: str) -> Value | None:
    values = node.properties.get("table")
    if values is None:
        return None
    table = Table(values, is_stepped=graph.choice(node, "is_stepped", False))
    where = graph.number(node, "Fac", 0.5)
    if output == "Alpha":
        return step(_row, where, kind=FLOAT, static=(table, 3))
    return step(_rows, where, kind=COLOUR, static=(table,))


def _row(x: Array, table: Table, row: int) -> Array:
    return table.at(x, row)


def _rows(x: Array, table: Table) -> Array:
    return table.at(x, slice(0, 3))


def _curves(socket: str, factor: str, kind: str) -> Callable[[Graph, Node, str], Value | None]:
    def make(graph: Graph, node: Node, output: str) -> Value | None:
        values = node.properties.get("table")
        if values is None:
            return None
        is_extended = graph.choice(node, "is_extended", False)
        table = Table(values, node.properties["span"], is_extended=is_extended)
        share = graph.number(node, factor, 1.0)
        if kind == FLOAT:
            return step(_bent, graph.number(node, socket, 1.0), share, static=(table,))
        whole = graph.colour(node, socket) if kind == COLOUR else graph.whole(node, socket)
        return step(_bent_rows, whole, share, kind=kind, static=(table,))

    return make


def _bent(x: Array, share: Array, table: Table) -> Array:
    return _mixed(x, table.at(x, 0), share)


def _bent_rows(whole: Array, share: Array, table: Table) -> Array:
    bent = np.stack([table.at(x, row) for row, x in enumerate(whole)])
    return _mixed(whole, bent, share)


def _mixed(x: Array, bent: Array, share: Array) -> Array:
    return limited(multiply(ONE - share, x) + multiply(share, bent))


RAMPS: dict[str, Callable[[Graph, Node, str], Value | None]] = {
    "ValToRGB": _ramp,
    "RGBCurve": _curves("Color", "Fac", COLOUR),
    "VectorCurve": _curves("Vector", "Fac", VECTOR),
    "FloatCurve": _curves("Value", "Factor", FLOAT),
}
