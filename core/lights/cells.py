"""points that light falls on, lights -> cells.  Where the tables of the choice among lights differ.

A fine grid, finer where lights and receivers are, tells where a point is.  Its parts are gathered
to boxes, which are halved where many receivers are and the lights' shares change most.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Scalar, Vec
from .kind import TINY
from .tree import CENTRE, SPREAD, STRENGTH

STEPS = 4096  # of a coordinate, each of which lies in one layer of the fine grid
FINE = 18  # log2 of the number of parts of the fine grid
FLATTEST = 1e-3  # of the largest extent: flatter scenes are cut as if they were so thick
BATCH = 0.5  # share of the boxes that may be halved before all are looked at again

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Cells:
    """A partition of the box of a scene into C cells.

    low, scale (3, 1) lead from points to steps; fine (3, STEPS) from steps to numbers that add up
    to that of a part of the fine grid; cell (2^FINE,) from there to the cell.  Receivers of a cell
    have the mean centre (3, C) and the mean square distance spread (C,) from it.
    """

    low: NDArray[np.float32]
    scale: NDArray[np.float32]
    fine: NDArray[np.int32]
    cell: Ids
    centre: Vec
    spread: Scalar


def spread_over(
    vertices: NDArray[np.float32], corners: NDArray[np.int32], count: int
) -> NDArray[np.float32]:
    """Return points (3, count) on triangles (F, 3): half by area, half on each triangle alike."""
    a, b, c = (vertices.take(column, axis=0).T for column in corners.T)
    b, c = b - a, c - a
    scale = np.float32(1 / max(float(np.abs(b).max()), float(np.abs(c).max()), 1e-30))
    normal = np.cross((b * scale).T, (c * scale).T).astype(np.float64)
    total = np.cumsum(np.sqrt((normal * normal).sum(axis=1)))
    share = (np.arange(count // 2) + 0.5) / (count // 2)
    by_area = np.searchsorted(total, share * total[-1], side="right")
    alike = (share * len(corners)).astype(np.int64)
    number = np.minimum(np.concatenate([by_area, alike]), len(corners) - 1)

    # Roberts' R2 sequence, folded into the triangle
    u, v = (
        np.arange(number.size) * step % 1.0 for step in (0.7548776662466927, 0.5698402909980532)
    )
    fold = u + v > 1
    u, v = np.where(fold, 1 - u, u), np.where(fold, 1 - v, v)
    points = a.take(number, axis=1) + b.take(number, axis=1) * u + c.take(number, axis=1) * v
    return points.astype(np.float32)


def compile_cells(
    box: Floats, receivers: Floats, lights: Floats, nodes: NDArray[np.float32], budget: int
) -> Cells:
    """Cut a box (2, 3) with receivers (3, R) in it into at most `budget` cells.

    lights (3, n): their places; nodes (14, G) of their tree, a few that make up all.
    """
    low, size = box[0], np.maximum(box[1] - box[0], 1e-30)
    counts = _counts(receivers, size)
    layer = np.empty((3, STEPS), np.int32)
    place = np.empty(receivers.shape, np.int64)
    for axis in range(3):
        scale = STEPS / size[axis]
        step, light = (
            np.clip((there[axis] - low[axis]) * scale, 0, STEPS - 1).astype(np.int64)
            for there in (receivers, lights)
        )
        layer[axis] = _layers(step, light, int(counts[axis]))
        place[axis] = layer[axis].take(step)

    thickness = float(((size / counts) ** 2).sum()) / 12
    boxes, centre, spread = _halve(place, receivers, counts, nodes, thickness, budget)
    cell = np.zeros(counts[::-1], np.int32)
    for number, (x0, x1, y0, y1, z0, z1) in enumerate(boxes):
        cell[z0:z1, y0:y1, x0:x1] = number
    layer[1] *= counts[0]
    layer[2] *= counts[0] * counts[1]
    return Cells(
        low.astype(np.float32)[:, None],
        (STEPS / size).astype(np.float32)[:, None],
        layer,
        cell.ravel(),
        centre.astype(np.float32),
        spread.astype(np.float32),
    )


def _counts(receivers: Floats, size: Floats) -> NDArray[np.int64]:
    """Return how many layers (3,) the fine grid has: its parts are cubes to most receivers."""
    extent = np.minimum(receivers.std(axis=1) * 4, size)
    extent = np.maximum(extent, FLATTEST * extent.max())
    counts = np.ones(3, np.int64)
    for _ in range(FINE):
        counts[np.argmax(np.where(counts < STEPS, extent / counts, -1.0))] *= 2
    return counts


def _layers(receivers: NDArray[np.int64], lights: NDArray[np.int64], count: int) -> Ids:
    """Return the layer (STEPS,) of each step: a third of them evenly, by receivers, by lights."""
    density = np.full(STEPS, 1 / STEPS)
    for steps in (receivers, lights):
        if steps.size:
            density += np.bincount(steps, minlength=STEPS) / steps.size
    share = np.cumsum(density)
    share -= density / 2
    return (share / (share[-1] * (1 + 1e-9)) * count).astype(np.int32)


def _halve(
    place: NDArray[np.int64],
    receivers: Floats,
    counts: NDArray[np.int64],
    nodes: NDArray[np.float32],
    thickness: float,
    budget: int,
) -> tuple[list[list[int]], Floats, Floats]:
    """Return boxes of the fine grid [x0, x1, y0, y1, z0, z1], each to be laid over those before.

    And the mean of their receivers (3, C), and the mean square distance from it (C,).
    """
    boxes = [[0, int(counts[0]), 0, int(counts[1]), 0, int(counts[2])]]
    bounds = np.array(boxes, np.int64).T.copy()
    owner = np.zeros(place.shape[1], np.int64)
    fresh = np.zeros(1, np.int64)
    uneven = np.zeros(budget)
    while True:
        number = np.bincount(owner, minlength=len(boxes))
        centre, variance = _moments(receivers, owner, number)
        spread = variance.sum(axis=0) + thickness
        room = budget - len(boxes)
        if room <= 0:
            break
        middle, width = _moments(place.astype(np.float64), owner, number)
        uneven[fresh] = _unevenness(centre.take(fresh, axis=1), spread.take(fresh), nodes)
        gain = np.sqrt(number) * uneven[: len(boxes)]
        gain *= (width > 1e-6).any(axis=0)
        best = np.argsort(-gain, kind="stable")[: max(1, min(room, int(BATCH * len(boxes))))]
        best = best[gain.take(best) > 0]
        if not best.size:
            break

        # Cut each at the mean of its receivers, across their largest variance
        axis = np.argmax(np.where(width > 1e-6, variance, -1.0), axis=0)
        new = np.full(len(boxes), -1)
        new[best] = len(boxes) + np.arange(best.size)
        cut = np.floor(middle[axis, np.arange(axis.size)]).astype(np.int64) + 1
        right = bounds[:, best].copy()
        column = np.arange(best.size)
        right[2 * axis[best], column] = cut[best]
        bounds[2 * axis[best] + 1, best] = cut[best]
        bounds = np.concatenate([bounds, right], axis=1)
        boxes += right.T.tolist()
        goes = place[axis[owner], np.arange(owner.size)] >= cut[owner]
        goes &= new[owner] >= 0
        owner = np.where(goes, new[owner], owner)
        fresh = np.concatenate([best, new[best]])
    return boxes, centre, spread


def _moments(
    values: Floats, owner: NDArray[np.int64], number: NDArray[np.int64]
) -> tuple[Floats, Floats]:
    """Return the means (3, C) and variances (3, C) of values (3, R) by their owners (R,)."""
    mean = np.stack([np.bincount(owner, row, number.size) for row in values]) / number
    centred = values - mean.take(owner, axis=1)
    centred *= centred
    return mean, np.stack([np.bincount(owner, row, number.size) for row in centred]) / number


def _unevenness(centre: Floats, spread: Floats, nodes: NDArray[np.float32]) -> Floats:
    """Return how much the shares of lights change inside of each box (C,), from 0 to 1."""
    squared = nodes[SPREAD][:, None] + spread.astype(F32)
    for there, here in zip(nodes[CENTRE], centre.astype(F32), strict=True):
        way = there[:, None] - here
        way *= way
        squared += way
    np.reciprocal(np.maximum(squared, TINY), out=squared)
    given = nodes[STRENGTH][:, None] * squared
    total = np.maximum(given.sum(axis=0), TINY)
    squared *= spread.astype(F32)
    given *= squared
    return given.sum(axis=0) / total
