"""points (D, N) -> points of cells.  The random points of Voronoi cells, and which are near.

Each grid cell has one point.  Where the 3^D cells around are many, the 2^D whose middles are
nearest are looked at for all points of a batch; a further cell only where its near side is closer
than what was found: with the same result.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import F32, Index
from ..values import Array
from .hashing import Integers, cell_fractions, hash_floats
from .white_noise import white_noise

_ONE, _LARGEST = F32(1), F32(np.finfo(np.float32).max)
_SLACK = F32(1.00001)  # for the rounding of bounds
Codes = NDArray[np.int8]
Cells = NDArray[Any]  # int32, or float32 of whole numbers


def _square(part: Array, exponent: Array) -> Array:
    return part * part


def _length(part: Array, exponent: Array) -> Array:
    return np.abs(part)


def _raised(part: Array, exponent: Array) -> Array:
    return np.abs(part) ** exponent


# Metric -> what a component adds to a size that grows with the distance, and how they are joined
METRICS: dict[str, tuple[Callable[[Array, Array], Array], np.ufunc]] = {
    "EUCLIDEAN": (_square, np.add),
    "MANHATTAN": (_length, np.add),
    "CHEBYCHEV": (_length, np.maximum),
    "MINKOWSKI": (_raised, np.add),
}


@dataclass(frozen=True, eq=False)
class Metric:
    """A metric by its name, and the exponent (1,) or (N,) of MINKOWSKI's; in one dimension idle."""

    name: str
    exponent: Array

    def term(self, part: Array) -> Array:
        """Return what a component contributes to the size."""
        return METRICS[self.name][0](part, self.exponent)

    def join(self, terms: Iterable[Array]) -> Array:
        """Return the sizes of terms, of all axes, that broadcast."""
        return reduce(METRICS[self.name][1], terms)

    def size(self, parts: Iterable[Array]) -> Array:
        """Return what grows with the distance, of its components."""
        return self.join(self.term(part) for part in parts)

    def distance(self, size: Array) -> Array:
        """Return the distances of sizes."""
        if self.name in ("MANHATTAN", "CHEBYCHEV"):
            return size
        if self.name == "EUCLIDEAN":
            return np.sqrt(size)
        with np.errstate(over="ignore"):
            return np.minimum(size ** (_ONE / self.exponent), _LARGEST)

    def take(self, index: Index) -> "Metric":
        """Return the metric at some of the points."""
        exponent = self.exponent
        return self if exponent.size == 1 else Metric(self.name, exponent.take(index))


def cell_points(cells: Sequence[Cells]) -> list[Array]:
    """Return where points are in cells of D = 1 to 4 numbers: D numbers, 0 to 1."""
    if cells[0].dtype.kind == "i":
        return cell_fractions(cells)
    if len(cells) < 4:
        return list(white_noise(cells, len(cells) > 1))[: len(cells)]
    return [hash_floats([*cells[4 - turn :], *cells[: 4 - turn]]) for turn in range(4)]


def cell_colour(cells: Sequence[Cells]) -> Array:
    """Return the colours (3, N) of cells of D = 1 to 4 numbers."""
    if cells[0].dtype.kind != "i":
        return white_noise(cells, True)
    if len(cells) == 2:
        cells = [*cells, np.zeros_like(cells[0])]
    return np.stack(cell_fractions(cells)[:3])


def split(points: Array, is_float: bool = False) -> tuple[Cells, Array]:
    """Return the cells (D, N) that points are in, and where in them (D, N).

    Cells are float if it is their bits as such that are hashed.  In one dimension they always are.
    """
    floor = np.floor(points)
    if is_float or len(points) == 1:
        return floor, points - floor
    with np.errstate(invalid="ignore"):
        return floor.astype(np.int32), points - floor


def _shapes(count: int, dimensions: int) -> list[tuple[int, ...]]:
    """Return the shapes in which steps along each axis broadcast; the first axis stands last."""
    return [
        tuple(count if place == axis else 1 for place in reversed(range(dimensions)))
        for axis in range(dimensions)
    ]


def around(cell: Cells, local: Array, randomness: Array, reach: int) -> list[Array]:
    """Return the ways from points to those of all cells as far as `reach`.

    D arrays (K, N), K = (2 reach + 1)^D; cells in the order in which the first axis runs fastest.
    """
    dimensions, size = cell.shape
    steps = np.arange(-reach, reach + 1, dtype=np.int32)[:, None]
    shapes = [(*shape, size) for shape in _shapes(len(steps), dimensions)]
    parts = cell_points(
        [(row + steps).reshape(shape) for row, shape in zip(cell, shapes, strict=True)]
    )
    for part, row, shape in zip(parts, local, shapes, strict=True):
        part *= randomness
        part += (steps.astype(F32) - row).reshape(shape)
    return [part.reshape(-1, size) for part in parts]


@dataclass(frozen=True, eq=False)
class Near:
    """The nearest points: sizes (N,) by the metric; codes and the start of them stand for cells."""

    size: Array
    code: Codes
    start: Integers

    @property
    def offset(self) -> Integers:
        """The offsets (D, N) of the cells of these points."""
        dimensions = len(self.start)
        key = self.code.astype(np.intp) << dimensions
        for axis, row in enumerate(self.start):
            key -= row << np.int32(axis)
        return _OFFSETS[dimensions].take(key, axis=1)


def _offsets(dimensions: int) -> Integers:
    """Return the offsets (D, 3^D 2^D) by 2^D code + start, whose bit is set where it is -1."""
    codes, starts = np.indices((3**dimensions, 2**dimensions)).reshape(2, -1)
    rows = []
    for axis in range(dimensions):
        digit, start = codes // 3**axis % 3, -(starts >> axis & 1)
        # The lower cell, the upper one, or the one on the other side
        rows.append(np.choose(digit, (start, start + 1, -1 - 2 * start)))
    return np.array(rows, np.int32)


_OFFSETS = {dimensions: _offsets(dimensions) for dimensions in (1, 2, 3, 4)}


def nearest(
    cell: Cells, local: Array, randomness: Array, metric: Metric, is_second: bool = False
) -> Near:
    """Return which cells' points are nearest, or second nearest, to points in cells."""
    dimensions, count = cell.shape
    if dimensions < 3 + is_second:
        return _nearest_of_all(cell, local, randomness, metric, is_second)
    is_low = local < F32(0.5)
    start = np.negative(is_low.astype(np.int32))

    # Look at the 2^D nearest cells; digits 0, 1 of a code are the lower and upper one on an axis.
    parts = _ways(cell + start, start.astype(F32) - local, randomness)
    sizes = metric.size(parts).reshape(-1, count)
    first = np.full(count, _LARGEST)
    second = first.copy() if is_second else first[:0]
    code, code_2 = np.zeros(count, np.int8), np.zeros(second.size, np.int8)
    for digits, size in zip(product((0, 1), repeat=dimensions), sizes, strict=True):
        _update(_code(digits), size, first, second, code, code_2, is_second)

    # Look at another cell where its near side is closer than the point that was found.
    high = _ONE - local
    gaps = (local * is_low, high * ~is_low, np.maximum(local, high))
    limit = (second if is_second else first) * _SLACK
    least = metric.term(gaps[2].min(axis=0))
    some = np.flatnonzero(least < limit)
    if some.size:
        found = first, second, code, code_2
        _look_further(some, cell, local, start, gaps, randomness, metric, found)
    return Near(second, code_2, start) if is_second else Near(first, code, start)


def _nearest_of_all(
    cell: Cells, local: Array, randomness: Array, metric: Metric, is_second: bool
) -> Near:
    """Return the same, having looked at all 3^D cells: faster where they are few."""
    count = cell.shape[1]
    sizes = metric.size(around(cell, local, randomness, 1))
    first, code = np.full(count, _LARGEST), np.zeros(count, np.int8)
    second, code_2 = first.copy(), code.copy()
    for place, size in enumerate(sizes):
        _update(np.int8(place), size, first, second, code, code_2, is_second)
    start = np.broadcast_to(np.int32(-1), cell.shape)
    return Near(second, code_2, start) if is_second else Near(first, code, start)


def _ways(cell: Cells, way: Array, randomness: Array) -> list[Array]:
    """Return the ways to the points of cells and those above them: D arrays (2, ..., 2, N)."""
    dimensions, size = cell.shape
    shapes = [(*shape, size) for shape in _shapes(2, dimensions)]
    both = np.stack((cell, cell + np.int32(1)), axis=1)
    ways = np.stack((way, way + _ONE), axis=1)
    parts = cell_points([row.reshape(shape) for row, shape in zip(both, shapes, strict=True)])
    for part, row, shape in zip(parts, ways, shapes, strict=True):
        part *= randomness
        part += row.reshape(shape)
    return parts


def _code(digits: tuple[int, ...]) -> np.int8:
    """Return the number that stands for a cell; the digit of the first axis is the last one."""
    code = 0
    for digit in digits:
        code = code * 3 + digit
    return np.int8(code)


def _update(
    label: np.int8 | Codes,
    size: Array,
    first: Array,
    second: Array,
    code: Codes,
    code_2: Codes,
    is_second: bool,
) -> None:
    """Note a cell, (N,) or the same everywhere, where its point is nearer than what was found."""
    # By arithmetic on bytes: selections by masks that nobody can predict cost forty times as much.
    closer = (size < first).view(np.int8)
    if is_second:
        runner = np.maximum(first, size)
        between = ((size < second) | closer.view(bool)).view(np.int8)
        chosen = closer * code + (np.int8(1) - closer) * label
        code_2 += between * (chosen - code_2)
        np.minimum(second, runner, out=second)
    code += closer * (label - code)
    np.minimum(first, size, out=first)


def _look_further(
    some: Index,
    cell: Cells,
    local: Array,
    start: Integers,
    gaps: tuple[Array, Array, Array],
    randomness: Array,
    metric: Metric,
    found: tuple[Array, Array, Codes, Codes],
) -> None:
    """Update what was found at points `some` by the 3^D - 2^D cells that are further away."""
    dimensions = len(cell)
    is_second = found[1].size > 0

    # Pair points with the cells whose near sides are close enough, by all combinations of digits.
    here = metric.take(some)
    terms = here.term(np.stack([gap.take(some, axis=1) for gap in gaps]))
    bound = here.join(
        terms[:, axis].reshape(*shape, some.size)
        for axis, shape in enumerate(_shapes(3, dimensions))
    )
    is_close = bound < found[int(is_second)].take(some) * _SLACK
    is_close[(slice(0, 2),) * dimensions] = False
    count = 3**dimensions
    pairs = np.flatnonzero(is_close.reshape(count, -1).T.copy())
    if not pairs.size:
        return
    owner = pairs // count
    which = (pairs - owner * count).astype(np.int8)
    point = some.take(owner)

    # Find how near the points of these cells are.
    step = Near(found[0], which, start.take(point, axis=1)).offset
    parts = cell_points(list(cell.take(point, axis=1) + step))
    spread = randomness if randomness.size == 1 else randomness.take(point)
    ways = step.astype(F32) - local.take(point, axis=1)
    size = metric.take(point).size(
        [part * spread + way for part, way in zip(parts, ways, strict=True)]
    )

    # Pairs of one point follow each other: take the nearest of them, and the second nearest.
    is_first = np.ones(owner.size, bool)
    np.not_equal(owner[1:], owner[:-1], out=is_first[1:])
    starts, group = np.flatnonzero(is_first), np.cumsum(is_first) - 1
    point = point.take(starts)
    first, code = found[0].take(point), found[2].take(point)
    second, code_2 = found[1], found[3]
    if is_second:
        second, code_2 = second.take(point), code_2.take(point)
    for _ in range(1 + is_second):
        least = np.minimum.reduceat(size, starts)
        chosen = np.flatnonzero(size == least.take(group))
        label = np.zeros(point.size, np.int8)
        label[group.take(chosen)] = which.take(chosen)
        _update(label, least, first, second, code, code_2, is_second)
        size[chosen] = _LARGEST
    found[0][point], found[2][point] = first, code
    if is_second:
        found[1][point], found[3][point] = second, code_2
