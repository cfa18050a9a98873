"""points, u, v -> lights.  Which of many lights to sample at a point, by what they can give there.

The box of the scene is cut into cells, small ones where lights are.  For each cell the tree of the
lights is opened where that tells most, as lightcuts are (Walter et al. 2005), up to `SLOTS` parts;
the table of a cell has the probabilities of its parts, one row for each of six directions of the
normal and one without.  Inside of a part lights are chosen by strength.  So the cost does not grow
with the number of lights.  What a part gives is estimated from sums as in Conty Estevez & Kulla
2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting"; no light has probability 0
anywhere, so that the choice is unbiased however poor the estimate.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Scalar, Vec
from .cells import STEPS, Cells, compile_cells
from .kind import TINY
from .tree import (
    CENTRE,
    FIRST,
    NODE_ROWS,
    PAIRS,
    SECOND,
    SPREAD,
    STRENGTH,
    WEAKEST,
    Sources,
    Tree,
    compile_tree,
)

SLOTS = 64  # parts of a cell's table, a power of two
DISTANT_SLOTS = 4  # of them for lights that have no place
CELLS, CELLS_PER_LIGHT = 4096, 256  # at most
TOP = 128  # parts of the tree by which cells are cut
SIDES = 7  # six directions of the normal, and none

# Of each choice this share is made without the normal, and each part has at least this one
WITHOUT_NORMAL, LEAST = 0.05, 2.0**-18

# Mean of the normals of one side, most of which lie along an axis; and the second moments
NORMAL_MEAN, NORMAL_ALONG, NORMAL_ACROSS = 0.9, 0.81, 0.095

# Steps of the running sum that lead to a leaf, for each light; leaves passed until bisection
GUIDES, GUIDED = 4, 2


@dataclass(frozen=True, eq=False)
class LightGrid:
    """Tables for the choice among n lights; see `compile_grid`.

    low, scale, fine: see `Cells`; row: the first row of a cell.  Tables of C cells, flattened:
    lower (C * SIDES, SLOTS + 1), where the parts begin in [0, 1]; start (C, SLOTS + 1), the first
    leaf of each part.  total (n + 1,): running sum of strength of the leaves; guide (G,): the
    first leaf to look at for each of G equal steps of that sum; light (n,): which light a leaf is;
    leaf (n,): which leaf a light is.
    """

    low: NDArray[np.float32]
    scale: NDArray[np.float32]
    fine: NDArray[np.int32]
    row: Ids
    lower: NDArray[np.float32]
    start: Ids
    total: NDArray[np.float64]
    guide: Ids
    light: Ids
    leaf: Ids

    def place(self, position: Vec, normal: Vec | None) -> Ids:
        """Return the row of the table (N,) for points (3, N) with this unit normal (3, N)."""
        step = position - self.low
        step *= self.scale
        np.minimum(np.maximum(step, F32(0), out=step), F32(STEPS - 1), out=step)
        steps = step.astype(np.int32)
        fine = self.fine[0].take(steps[0])
        fine += self.fine[1].take(steps[1])
        fine += self.fine[2].take(steps[2])
        row = self.row.take(fine)
        if normal is None:
            row += np.int32(SIDES - 1)
            return row

        # The side is twice the number of the longest axis, one more on its negative side
        size = np.abs(normal)
        longest = (size[1] > size[0]).astype(np.int32)
        np.maximum(size[0], size[1], out=size[0])
        longest += (size[2] > size[0]) * (np.int32(2) - longest)
        row += longest
        row += longest
        longest *= np.int32(normal.shape[1])
        longest += np.arange(normal.shape[1], dtype=np.int32)
        row += (normal < 0).ravel().take(longest)
        return row

    def choose(self, place: Ids, u: Scalar, v: Scalar) -> tuple[Ids, Scalar]:
        """Choose a light (N,) for each row of the table by u, v, which are used up, with its pmf.

        Unbiased.
        """
        # Find the part by bisection
        at = place * np.int32(SLOTS + 1)
        first = at
        step = SLOTS
        while step > 1:
            step //= 2
            at = at + np.int32(step) * (self.lower.take(at + np.int32(step)) <= u)
        share = self.lower.take(at + np.int32(1))
        share -= self.lower.take(at)
        at -= first
        at += (place // np.int32(SIDES)) * np.int32(SLOTS + 1)

        # Choose inside of it
        low = self.total.take(self.start.take(at))
        mass = self.total.take(self.start.take(at + np.int32(1)))
        mass -= low
        low += mass * v
        leaf = self.leaf_at(low)
        pmf = (self.total.take(leaf + np.int32(1)) - self.total.take(leaf)) / mass
        return self.light.take(leaf), share * pmf.astype(F32)

    def leaf_at(self, at: NDArray[np.float64]) -> Ids:
        """Return the leaves (N,) at which the running sum first exceeds `at` (N,)."""
        step = (at * (self.guide.size / self.total[-1])).astype(np.int32)
        leaf = self.guide.take(step, mode="clip")
        for _ in range(GUIDED):
            leaf += self.total.take(leaf + np.int32(1)) <= at
        late = np.flatnonzero(self.total.take(leaf + np.int32(1)) <= at)
        if late.size:
            found = np.searchsorted(self.total, at.take(late), side="right")
            leaf[late] = found - 1
        return leaf

    def pmf(self, place: Ids, light: Ids) -> Scalar:
        """Return the probability (N,) with which `choose` takes lights (N,) there."""
        leaf = self.leaf.take(light)
        first = (place // np.int32(SIDES)) * np.int32(SLOTS + 1)
        at = first
        step = SLOTS
        while step > 1:
            step //= 2
            at = at + np.int32(step) * (self.start.take(at + np.int32(step)) <= leaf)
        mass = self.total.take(self.start.take(at + np.int32(1)))
        mass -= self.total.take(self.start.take(at))
        pmf = (self.total.take(leaf + 1) - self.total.take(leaf)) / mass
        at -= first
        at += place * np.int32(SLOTS + 1)
        share = self.lower.take(at + np.int32(1))
        share -= self.lower.take(at)
        return share * pmf.astype(F32)


def compile_grid(
    sources: Sources, distant: NDArray[np.bool_], receivers: NDArray[np.float32] | None
) -> LightGrid:
    """Build the tables for n lights, some of them `distant` (n,).

    `receivers` (3, R) are some of the points that light falls on; None if nobody knows.
    """
    # Build the tree of what has a place
    local, far = np.flatnonzero(~distant), np.flatnonzero(distant)
    near = sources.take(local)
    tree = compile_tree(near) if local.size else None
    top = tree.node.take(_top(tree), axis=1) if tree else np.zeros((NODE_ROWS, 1), F32)
    if receivers is None or not receivers.size:
        receivers = _around(near)

    # Cut up the scene, and weigh the parts of the tree in each cell
    box = np.stack([receivers.min(axis=1), receivers.max(axis=1)]).astype(np.float64)
    budget = min(CELLS, CELLS_PER_LIGHT * local.size) if tree else 1
    cells = compile_cells(box, receivers.astype(np.float64), near.centre, top, budget)
    weights = np.zeros((SIDES, SLOTS, cells.spread.size), F32)
    start = np.zeros((cells.spread.size, SLOTS + 1), np.int32)
    order, total = np.zeros(0, np.int32), np.zeros(1)
    if tree:
        slots = SLOTS - min(DISTANT_SLOTS, far.size)
        cut = _cut(tree, cells.centre, cells.spread, slots)
        _weigh(tree, cut, cells, start, weights)
        order, total = local.astype(np.int32).take(tree.order), tree.total
    if far.size:
        order, total = _add_distant(sources, far, start, weights, order, total)
    leaf = np.empty_like(order)
    leaf[order] = np.arange(order.size, dtype=np.int32)
    return LightGrid(
        cells.low,
        cells.scale,
        cells.fine,
        cells.cell * np.int32(SIDES),
        _lower(weights, start),
        start.ravel(),
        total,
        guide(total),
        order,
        leaf,
    )


def guide(total: NDArray[np.float64]) -> Ids:
    """Return the first leaf (G,) of each of G equal steps of a running sum (n + 1,).

    Source: Chen & Asau 1974, "On Generating Random Variates from an Empirical Distribution".
    """
    steps = GUIDES * (total.size - 1)
    edge = np.arange(steps) * (total[-1] / steps) * (1 - 1e-9)  # for the rounding of both
    return (np.searchsorted(total, edge, side="right") - 1).astype(np.int32)


def _around(near: Sources) -> NDArray[np.float32]:
    """Return points around lights, for want of better."""
    corners = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]).T
    if not near.count:
        return corners.astype(F32)
    size = np.ptp(near.centre, axis=1).max() + 1.0
    some = near.centre[:, :: -(-near.count // 4096), None]
    return (some + 0.25 * size * corners[:, None]).reshape(3, -1).astype(F32)


def _top(tree: Tree) -> NDArray[np.int32]:
    """Return nodes (G,) that make up all lights, told apart as from far away."""
    node = tree.node[:, tree.root]
    spread = np.full(1, max(float(node[SPREAD]), 1e-30), F32)
    cut = _cut(tree, node[CENTRE][:, None], spread, TOP)[:, 0]
    return cut[cut >= 0]


def _way(node: NDArray[np.float32], centre: Vec, spread: Scalar) -> tuple[Vec, Scalar, Scalar]:
    """Return the way from nodes to cells, in units of their root mean square distance.

    And the square of that distance, and the share of the square that their own extents have.
    """
    way = centre - node[CENTRE]
    own = node[SPREAD] + spread
    squared = way[0] * way[0]
    squared += way[1] * way[1]
    squared += way[2] * way[2]
    squared += own
    np.maximum(squared, F32(1e-30), out=squared)
    way *= np.reciprocal(np.sqrt(squared))
    return way, squared, own / squared


def _importance(node: NDArray[np.float32], way: Vec, squared: Scalar, own: Scalar) -> Scalar:
    """Estimate what nodes (14, N) give to cells that do not look away [W/m2]."""
    along = node[FIRST][0] * way[0]
    along += node[FIRST][1] * way[1]
    along += node[FIRST][2] * way[2]
    second = node[SECOND]
    across = own * F32(1 / 3) * (second[0] + second[1] + second[2])
    for row, (i, j) in zip(second, PAIRS, strict=True):
        across += (row * way[i]) * (way[j] if i == j else F32(2) * way[j])
    along += np.sqrt(np.maximum(across, F32(0)))
    along *= F32(0.5) * node[STRENGTH]
    return np.maximum(along, F32(1e-4) * node[STRENGTH]) / squared


def _cut(tree: Tree, centre: Vec, spread: Scalar, slots: int) -> NDArray[np.int32]:
    """Return the nodes (slots, C) that each cell tells apart, -1 for none."""
    cells, count = spread.size, tree.order.size
    cut = np.full((min(slots, count), cells), -1, np.int32)
    cut[0] = tree.root
    error = np.zeros(cut.shape, F32)
    error[0] = tree.root < count
    column = np.arange(cells)
    for used in range(1, len(cut)):
        worst = np.argmax(error[:used], axis=0)
        open_ = np.flatnonzero(error[worst, column] > 0)
        if not open_.size:
            break
        slot = worst.take(open_)
        node = cut[slot, open_]
        for child, where in ((tree.left, slot), (tree.right, np.full(open_.size, used))):
            node_there = child.take(node)
            cut[where, open_] = node_there
            part = tree.node.take(node_there, axis=1)
            way, squared, own = _way(part, centre.take(open_, axis=1), spread.take(open_))
            doubt = _importance(part, way, squared, own)
            doubt *= np.sqrt(part[SPREAD] / squared)
            doubt *= node_there < count
            error[where, open_] = doubt
    return cut


def _weigh(
    tree: Tree,
    cut: NDArray[np.int32],
    cells: Cells,
    start: NDArray[np.int32],
    weights: NDArray[np.float32],
) -> None:
    """Set where parts start (C, SLOTS + 1), and their weights (SIDES, SLOTS, C)."""
    # Put the parts in the order of their lights
    count = tree.order.size
    begin = np.where(cut < 0, count, tree.first.take(np.maximum(cut, 0)))
    order = np.argsort(begin, axis=0)
    cut = np.take_along_axis(cut, order, axis=0)
    start[:] = count
    start[:, : len(cut)] = np.take_along_axis(begin, order, axis=0).T
    for slot, nodes in enumerate(cut):
        part = tree.node.take(np.maximum(nodes, 0), axis=1)
        way, squared, own = _way(part, cells.centre, cells.spread)
        value = _importance(part, way, squared, own)
        value *= nodes >= 0
        _add_sides(weights[:, slot], value, way, own)


def _add_sides(weights: NDArray[np.float32], value: Scalar, way: Vec, own: Scalar) -> None:
    """Set weights (SIDES, C) to values (C,) times the cosine of receivers of each side."""
    weights[SIDES - 1] = value
    across = (F32(1) - own) * F32(NORMAL_ACROSS) + own * F32(1 / 3)
    for axis in range(3):
        second = way[axis] * way[axis]
        second *= F32(NORMAL_ALONG - NORMAL_ACROSS)
        second += across
        np.sqrt(second, out=second)
        first = way[axis] * F32(NORMAL_MEAN)
        half = value * F32(0.5)
        weights[2 * axis] = half * np.maximum(second - first, F32(0))
        weights[2 * axis + 1] = half * np.maximum(second + first, F32(0))


def _add_distant(
    sources: Sources,
    far: NDArray[np.integer],
    start: NDArray[np.int32],
    weights: NDArray[np.float32],
    order: Ids,
    total: NDArray[np.float64],
) -> tuple[Ids, NDArray[np.float64]]:
    """Append lights `far`, in groups of like strength: they give the same to all cells."""
    far = far.take(np.argsort(-sources.strength.take(far), kind="stable"))
    groups = np.array_split(far, min(DISTANT_SLOTS, far.size))
    first = SLOTS - len(groups)
    end = order.size
    for slot, group in enumerate(groups, first):
        start[:, slot] = end
        end += group.size
        part = sources.take(group)
        irradiance = max(float(part.strength.sum()), 1e-30)
        way = (part.axis * part.strength).sum(axis=1) / irradiance
        own = np.full(1, max(1.0 - way @ way, 0.0), F32)
        _add_sides(weights[:, slot], np.full(1, irradiance, F32), way.astype(F32)[:, None], own)
    start[:, SLOTS] = end

    # Only ratios within a group count: make the sum like that before, for its digits
    strength = sources.strength.take(far)
    strength = np.maximum(strength, max(WEAKEST * strength.mean(), 1e-300))
    strength *= (total[-1] or 1.0) / strength.sum()
    total = np.concatenate([total, total[-1] + np.cumsum(strength)])
    return np.concatenate([order, far.astype(np.int32)]), total


def _lower(weights: NDArray[np.float32], start: NDArray[np.int32]) -> NDArray[np.float32]:
    """Return where parts begin in [0, 1] (C * SIDES * (SLOTS + 1),), in steps of 2^-24."""
    # Share, and give each part its least, in place: this is most of the memory of all
    free = weights[SIDES - 1]
    own = np.maximum(free.sum(axis=0), TINY)
    least = (np.diff(start).T > 0) * F32(LEAST)
    least += free * (F32(WITHOUT_NORMAL) / own)
    for side in weights:
        side *= F32(1 - WITHOUT_NORMAL) / np.maximum(side.sum(axis=0), TINY)
        side += least

    # Sum up
    for slot in range(1, SLOTS):
        weights[:, slot] += weights[:, slot - 1]
    weights /= weights[:, -1:].copy()
    weights *= F32(2.0**24)
    np.rint(weights, out=weights)
    lower = np.zeros((start.shape[0], SIDES, SLOTS + 1), F32)
    np.multiply(weights.transpose(2, 0, 1), F32(2.0**-24), out=lower[:, :, 1:])
    return lower.ravel()
