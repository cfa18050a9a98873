"""Surfaces -> Programs.  Materials that differ in their constants only share one program.

The steps of all materials with the same graph are the same; where their constants differ, these
become columns of a table, gathered by material.  So a hundred plain materials cost one pass over
the batch, and a number that all of them share is never gathered at all.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import CHECKED, F32, Ids, check
from .context import Context
from .values import FLOAT, SEVERAL, Array, Value, walk

NOTHING: Mapping[int, Array] = {}


@dataclass(frozen=True, eq=False)
class Program:
    """The outputs of K materials with one graph, and how to compute them.

    columns: for each value of the graph that is a constant, but not the same one in all
    materials, its rows of `table` (C, K) float32.
    """

    outputs: tuple[Value | None, ...]
    order: tuple[Value, ...]
    columns: dict[int, slice]
    table: NDArray[np.float32]

    def __reduce__(self) -> tuple[Any, ...]:
        """Tell how another process makes it again: there values are other objects."""
        rows = [self.columns.get(id(item)) for item in self.order]
        return _again, (self.order, rows, self.outputs, self.table)

    def run(
        self,
        wanted: Sequence[Value],
        order: Sequence[Value],
        context: Context,
        column: Ids | None,
        given: Mapping[int, Array] = NOTHING,
    ) -> list[Array]:
        """Return the arrays of the values `wanted` at the points of a context.

        `order` is `walk(wanted)`; column (n,) int32 is the material's column of the table, None
        where there is one; given: arrays of steps that are not in the order, by the values' ids.
        Constants come back with the shape (1,) or (3, 1).
        """
        known: dict[int, Array] = dict(given)
        for item in order:
            rows = self.columns.get(id(item))
            if rows is not None:
                assert column is not None
                array = self.table[rows].take(column, axis=1)
                known[id(item)] = array[0] if item.kind == FLOAT else array
            elif item.constant is not None:
                known[id(item)] = item.constant
            else:
                assert item.function is not None
                args = [known[id(arg)] for arg in item.args]
                if item.reads:
                    args.insert(0, context)  # type: ignore[arg-type]
                known[id(item)] = item.function(*args, *item.static)
                _check(item, known[id(item)], context)
        return [known[id(item)] for item in wanted]


def _again(
    order: tuple[Value, ...],
    rows: Sequence[slice | None],
    outputs: tuple[Value | None, ...],
    table: NDArray[np.float32],
) -> Program:
    pairs = zip(order, rows, strict=True)
    return Program(outputs, order, {id(item): row for item, row in pairs if row is not None}, table)


def _check(item: Value, array: Array, context: Context) -> None:
    """With PENUMBRA_CHECK=1, assert that a step has made what it promised."""
    if not CHECKED or item.kind == SEVERAL:
        return
    name = getattr(item.function, "__name__", repr(item.function))
    check(f"shading step {name}", result=array)
    shapes = ((1,), (context.size,)) if item.kind == FLOAT else ((3, 1), (3, context.size))
    if array.shape not in shapes:
        raise TypeError(f"Shading step {name}: {item.kind} of shape {array.shape}")


def structure(outputs: Sequence[Value | None]) -> Hashable:
    """Return what two graphs have in common if they differ in constants only."""
    order = walk(output for output in outputs if output is not None)
    number = {id(item): place for place, item in enumerate(order)}
    nodes = tuple(
        (item.kind, item.function, item.static, tuple(number[id(arg)] for arg in item.args))
        for item in order
    )
    return nodes, tuple(None if output is None else number[id(output)] for output in outputs)


def merge(members: Sequence[Sequence[Value | None]]) -> Program:
    """Return one program for graphs of the same `structure`, in the order of its columns."""
    graphs = [walk(output for output in outputs if output is not None) for outputs in members]
    columns: dict[int, slice] = {}
    rows: list[NDArray[np.float32]] = []
    start = 0
    for place, item in enumerate(graphs[0]):
        if item.constant is None:
            continue
        each = np.stack([_column(graph[place]) for graph in graphs], axis=1)
        if (each != each[:, :1]).any():
            columns[id(item)] = slice(start, start + len(each))
            rows.append(each)
            start += len(each)
    table = np.concatenate(rows) if rows else np.zeros((0, len(members)), F32)
    return Program(tuple(members[0]), tuple(graphs[0]), columns, table)


def _column(item: Value) -> NDArray[np.float32]:
    assert item.constant is not None
    return np.ascontiguousarray(item.constant.reshape(-1), F32)
