"""a render -> bytes that its stages exchange; a machine -> nanoseconds of a byte, of an addition.

How fast could a stage be?  It has to read the arrays that it is handed and to write those that it
returns, once each: this takes as long as copying so many bytes, in arrays of a batch's size, of
which as many take turns as stages have; and for what it looks up, as long as taking rows at random
from a table of as many triangles.  What it takes above that are its passes between; how many there
are is told in additions of two arrays, numpy's plainest pass.
"""

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import fields, is_dataclass
from importlib import import_module
from time import perf_counter
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from . import clocks

ARRAYS = 36  # float32, of a batch's size: the rows of about three (3, N) vectors for each stage
REPEATS = 40
ROW = 32  # bytes of a triangle's row in the table that hits read


def roof(size: int, rows: int) -> dict[str, float]:
    """Return nanoseconds to move a byte, to add a pair of numbers, and to take one of `rows`.

    In arrays of `size`.
    """
    arrays = np.zeros((ARRAYS, size), np.float32)

    table = np.ones((rows, ROW // 4), np.float32)
    index = np.random.default_rng(1).integers(0, rows, (ARRAYS // 3, size))
    taken = np.empty((size, ROW // 4), np.float32)

    def best(work: Any) -> float:
        found = []
        for _ in range(REPEATS):
            start = perf_counter()
            for number in range(ARRAYS // 3):
                work(number, *arrays[3 * number : 3 * number + 3])
            found.append(perf_counter() - start)
        return 1e9 * min(found) / (ARRAYS // 3 * size)

    return {
        "byte": best(lambda k, a, b, c: np.copyto(c, a)) / 8,
        "addition": best(lambda k, a, b, c: np.add(a, b, out=c)),
        "row": best(lambda k, a, b, c: table.take(index[k], axis=0, out=taken, mode="clip")),
        "size": size,
    }


def stages(axis: str, value: int) -> dict[str, Any]:
    """Return what a render of an axis' scene takes in each stage, and the roof beside it.

    Seconds and counts as in the statistics; `bytes` by stage.
    """
    import bpy

    found = clocks.scale("PENUMBRA", axis, value)
    with _counting() as traffic:
        bpy.ops.render.render()
    sizes = traffic.pop("batch")
    return found | {"bytes": traffic, "roof": roof(max(sizes), found["triangles"])}


@contextmanager
def _counting() -> Iterator[dict[str, Any]]:
    """Count the bytes that the stages of all renders meanwhile exchange."""
    from penumbra.core.geometry.accel import Accel
    from penumbra.core.shading import SurfaceTable
    from penumbra.core.transport import path

    render = import_module("penumbra.core.render")
    traffic: dict[str, Any] = {"batch": set()}
    traffic |= dict.fromkeys(("camera", "surface", "shading", "lights", "scatter", "film"), 0)

    def add(stage: str, size: int, things: Iterable[Any]) -> None:
        traffic[stage] += _bytes(things, size)

    def counted(owner: Any, name: str, stage: str, size_of: Any) -> Any:
        before = getattr(owner, name)

        def call(*arguments: Any, **more: Any) -> Any:
            size = size_of(arguments)
            add(stage, size, arguments)
            result = before(*arguments, **more)
            add(stage, size, [result])
            return result

        return patch.object(owner, name, call)

    def resolved(before: Any) -> Any:
        def call(plan: Any, rays: Any, paths: Any, hits: Any, found: Any) -> Any:
            add("surface", rays.size, [rays.direction, hits])
            points = before(plan, rays, paths, hits, found)
            add("surface", points.size, [points])
            return points

        return call

    def traced(before: Any) -> Any:
        def call(plan: Any, rays: Any, paths: Any, draws: Any, *more: Any) -> Any:
            traffic["batch"].add(rays.size)
            add("camera", rays.size, [rays, paths, draws])
            found = before(plan, rays, paths, draws, *more)
            add("film", rays.size, [found])
            return found

        return call

    with ExitStack() as stack:
        stack.enter_context(patch.object(path, "_resolve", resolved(path._resolve)))
        stack.enter_context(patch.object(render, "trace", traced(render.trace)))
        for owner, name, stage, size_of in (
            (SurfaceTable, "shade", "shading", lambda a: a[1].size),
            (path.direct, "add", "lights", lambda a: a[1].size),
            (Accel, "free", "lights", lambda a: a[2].shape[1]),
            (path, "scatter", "scatter", lambda a: a[2].size),
        ):
            stack.enter_context(counted(owner, name, stage, size_of))
        yield traffic


def _bytes(things: Iterable[Any], size: int) -> int:
    """Return the bytes of all arrays in things that have a number for each of `size` points."""
    found: dict[int, int] = {}
    seen: set[int] = set()
    rest = list(things)
    while rest:
        thing = rest.pop()
        if id(thing) in seen:
            continue
        seen.add(id(thing))
        if isinstance(thing, np.ndarray):
            if _is_of(thing, size):
                found[thing.__array_interface__["data"][0]] = thing.nbytes
        elif isinstance(thing, list | tuple):
            rest += thing
        elif is_dataclass(thing) and type(thing).__name__ not in (
            "Plan",
            "Numbers",
            "SurfaceTable",
        ):
            rest += [getattr(thing, item.name) for item in fields(thing)]
    return sum(found.values())


def _is_of(array: NDArray[Any], size: int) -> bool:
    return bool(array.ndim) and array.shape[-1] == size and array.strides[-1] != 0
