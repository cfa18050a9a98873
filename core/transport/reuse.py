"""first hits, second hits -> light for all pixels of a tile.  Re-use of paths.

What a scattered ray finds costs a whole path of further rays.  If the ray left a matte surface,
the neighbouring pixels of its tile could have found the same place: each of them gets the light
that comes from there, for one ray that tells whether it sees the place.  The pixels of a tile are
weighted against each other by the densities with which they would have found it (the balance
heuristic), so it is unbiased whatever the surfaces are; noise becomes alike within tiles.
Source: Bekaert, Sbert and Halton 2002, "Accelerating Path Tracing by Re-Using Paths".

The matte closures of both hits take part, whose light goes to all directions alike but for what
layers above them let through; what other closures send stays with the path.  Clamps are those of
who found the light.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Vec, normalize
from ..bsdf import DIFFUSE
from ..geometry.surface import Points
from ..plan import Plan
from ..shading import Shaded
from ..statistics import Tally
from ..tiles import SIZE, Tiles
from .radiance import Radiance
from .roulette import FAINT
from .samples import NEARLY
from .state import Paths

# Surfaces of more saturated colours keep to themselves: the darkest channel of what their paths
# carry tells others too little
LEAST_CHANNEL = F32(0.02)

TINY = F32(1e-30)

# More than rounding, between channels
COLOURED = F32(1e-5)

# Rows of first hits: where rays start, the normals of the matte closure and of the triangle, the
# closure's weight, and the probability with which it sends a ray
START, NORMAL, GEOMETRIC, WEIGHT = (slice(row, row + 3) for row in (0, 3, 6, 9))
CHANCE, ROWS = 12, 13


class Reuse:
    """What the paths of one wave tell each other: first hits depart, send, and second hits meet."""

    def __init__(self, tiles: Tiles, copies: int, slots: int) -> None:
        self._tiles, self._copies = tiles, copies
        self._first = np.zeros((ROWS, SIZE, tiles.count), F32)  # all 0 where nothing is shared
        self._sent = np.full(slots, -1)  # where in the tiles the rays of slots belong

    def depart(self, points: Points, shaded: tuple[Shaded, ...], paths: Paths) -> None:
        """Remember the matte closures of first hits."""
        first = self._first.reshape(ROWS, -1)
        for each in shaded:
            lobe = each.matte
            if lobe is None or lobe.smooth is not None:
                continue
            index = np.arange(points.size) if each.index is None else each.index
            place = self._tiles.place.take(paths.slots(index))
            weight = np.broadcast_to(lobe.weight, (3, each.size))
            most = weight.max(axis=0)
            some = np.flatnonzero((weight.min(axis=0) > LEAST_CHANNEL * most) & (place >= 0))
            if not some.size:
                continue

            # A ray is sent if the closure is chosen and is not too faint: see `scatter`
            share = np.ones(1, F32) if lobe.share is None else lobe.share
            chance = np.minimum(share, most * (F32(1) / FAINT))
            index, place = index.take(some), place.take(some)
            for rows, values in (
                (START, points.above.take(index, axis=1)),
                (NORMAL, lobe.frame.normal.take(some, axis=1)),
                (GEOMETRIC, points.geometric.take(index, axis=1)),
                (WEIGHT, weight.take(some, axis=1)),
                (slice(CHANCE, ROWS), chance.take(some)[None]),
            ):
                for row, value in zip(first[rows], values, strict=True):
                    row[place] = value

    def send(self, root: Index, slot: Index, copy: int) -> None:
        """Remember that slots (n,), of pixel samples `root` (n,), are on the way from matte ones.

        `copy`: as which of the rays that the closures send.
        """
        missing = int(slot.max(initial=-1)) + 1 - self._sent.size
        if missing > 0:
            self._sent = np.concatenate([self._sent, np.full(missing, -1)])
        place = self._tiles.place.take(root)
        takes_part = (place >= 0) & (self._first[CHANCE].take(place, mode="clip") > 0)
        member, tile = np.divmod(place, max(self._tiles.count, 1))
        column = (member * self._copies + copy) * self._tiles.count + tile
        self._sent[slot] = np.where(takes_part, column, -1)

    def meet(
        self,
        plan: Plan,
        paths: Paths,
        points: Points,
        shaded: tuple[Shaded, ...],
        radiance: Radiance,
        tally: Tally,
    ) -> tuple[Paths, Index]:
        """Return the paths with slots of their own for what matte closures of second hits send.

        And the slots they had (n,), in the order of the new ones.
        """
        # Which of the paths take part, and where in the tiles they belong
        slot = paths.slots(np.arange(paths.size))
        fits = np.zeros(paths.size, bool)
        for each in shaded:
            if each.matte is not None:
                fits[slice(None) if each.index is None else each.index] = True
        column = np.where(fits, self._sent.take(slot, mode="clip"), -1)
        column[slot >= self._sent.size] = -1
        some = np.flatnonzero(column >= 0)
        column = column.take(some)
        if not some.size or not self._tiles.count:
            return paths, some

        first = self._first
        if self._copies > 1:
            first = np.tile(first, self._copies)
        second = np.zeros((6, SIZE, first.shape[2]), F32)
        for row, values in zip(second, (*points.above, *points.geometric), strict=True):
            row.reshape(-1)[column] = values.take(some)
        form = _forms(plan, first, second, tally)
        sent = _seen_from(form, first[START], points, shaded, some, column)
        factor = _finders(first[CHANCE], form)

        # Whose own ray does not count, by rounding, keeps what it found
        good = np.flatnonzero(factor.reshape(-1).take(column) > 0)
        some, column = some.take(good), column.take(good)
        share = np.divide(factor, np.maximum(first[WEIGHT], TINY), dtype=F32)
        parent, matte_slot = slot.take(some), slot.copy()
        exchange = Exchange(self._tiles, column, sent, share, first[WEIGHT], self._copies)
        matte_slot[some] = radiance.branch(parent, exchange)
        return replace(paths, matte_slot=matte_slot), parent


@dataclass(frozen=True, eq=False)
class Exchange:
    """How the light of second hits is shared out, T tiles and their copies.

    column (n,): where in (SIZE, T) the slots that gather it stand; form (1 or 3, SIZE, SIZE, T): of
    each pixel and each second hit; share (3, SIZE, T): by what a second hit's light, which has the
    colour of the path it came by, is multiplied; weight (3, SIZE, T) of the pixels.
    """

    tiles: Tiles
    column: Index
    form: NDArray[np.float32]
    share: NDArray[np.float32]
    weight: NDArray[np.float32]
    copies: int

    def __call__(self, total: Vec, start: int, end: int) -> None:
        """Share out what slots start..end have of light (3, slots) to the pixels' slots."""
        there = np.flatnonzero(self.tiles.members.reshape(-1) >= 0)
        slots = self.tiles.members.reshape(-1).take(there)
        for number, channel in enumerate(total):
            light = np.zeros(self.share.shape[1:], F32)
            light.reshape(-1)[self.column] = channel[start:end]
            light *= self.share[number]
            found = np.zeros_like(light)
            forms = self.form[number % len(self.form)]
            for j, one in enumerate(light):
                found += forms[:, j] * one
            found *= self.weight[number]
            if self.copies > 1:
                found = found.reshape(SIZE, self.copies, -1).sum(axis=1)
            channel[slots] += found.reshape(-1).take(there)


def _forms(
    plan: Plan, first: NDArray[np.float32], second: NDArray[np.float32], tally: Tally
) -> NDArray[np.float32]:
    """Return cos cos / distance^2 (SIZE, SIZE, T) of pixels and second hits that see each other.

    first (ROWS, SIZE, T), second (6, SIZE, T): places and normals, 0 where there is none.
    """
    assert plan.accel is not None
    count = first.shape[2]
    forms = np.empty((SIZE, SIZE, count), F32)
    start = np.ascontiguousarray(first[START])
    for j in range(SIZE):
        # The geometry between all pixels and the hit of pixel j
        way = second[:3, j, None] - start
        squared = np.maximum(_dots(way, way), TINY)
        leaving = _dots(first[NORMAL], way)
        arriving = _dots(second[3:, j, None], way)
        faces = (leaving > 0) & (arriving < 0) & (_dots(first[GEOMETRIC], way) > 0)
        faces &= first[CHANCE] > 0
        leaving /= squared
        arriving /= squared
        form = leaving * arriving
        np.negative(form, out=form)
        form *= faces
        own = form[j].copy()

        # Who sees it: the finder does
        far = np.where(faces & (own > 0), NEARLY, F32(-1))
        far[j] = -1
        rays = start.reshape(3, -1), way.reshape(3, -1), far.reshape(-1)
        form *= plan.accel.unmet(*rays, DIFFUSE, tally).reshape(SIZE, count)
        form[j] = own
        tally.rays_shadow += int(np.count_nonzero(far > 0))
        forms[:, j] = form
    return forms


def _finders(chance: NDArray[np.float32], form: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the chance of each hit's finder over the sum of chance x form of all, (SIZE, T)."""
    factor = np.zeros(chance.shape, F32)
    for j in range(SIZE):
        density = np.einsum("jk,jk->k", chance, form[:, j])  # noqa: TID251
        good = np.flatnonzero((form[j, j] > 0) & (density > 0))
        factor[j, good] = chance[j].take(good) / density.take(good)
    return factor


def _dots(a: NDArray[np.float32], b: NDArray[np.float32]) -> NDArray[np.float32]:
    dots: NDArray[np.float32] = np.einsum("ijk,ijk->jk", a, b)  # noqa: TID251
    return dots


def _seen_from(
    form: NDArray[np.float32],
    start: NDArray[np.float32],
    points: Points,
    shaded: tuple[Shaded, ...],
    some: Index,
    column: Index,
) -> NDArray[np.float32]:
    """Return the forms times what second hits send to others, of what they send to their finders.

    As (1 or 3, SIZE, SIZE, T).  Who sees a hit black could not have found its light: there the
    form becomes 0.  some, column (n,): which points take part, and where in the tiles they stand.
    """
    sent = form[None]
    number = np.full(points.size, -1)
    number[some] = np.arange(some.size)
    for each in shaded:
        if each.matte is None or each.matte.viewed is None:
            continue
        sent = form[None].copy() if sent.base is form else sent
        index = np.arange(points.size) if each.index is None else each.index
        number_there = number.take(index)
        there = np.flatnonzero(number_there >= 0)
        place = column.take(number_there.take(there))
        tile = place % start.shape[2]
        position = points.position.take(index.take(there), axis=1)
        wo = np.negative(points.arriving.take(index, axis=1))
        to_finder = np.maximum(each.matte.viewed.weight(wo), TINY)
        for i in range(SIZE):
            wo[:, there] = normalize(start[:, i].take(tile, axis=1) - position)
            ratio = each.matte.viewed.weight(wo) / to_finder
            ratio = np.where(to_finder > TINY, ratio, ratio.max(axis=0))  # black is black from all
            ratio = np.broadcast_to(ratio, (3, index.size)).take(there, axis=1)
            if len(sent) == 1 and np.ptp(ratio, axis=0).max(initial=0) > COLOURED:
                sent = np.repeat(sent, 3, axis=0)
            for channel, values in zip(sent[:, i], ratio, strict=False):
                channel.reshape(-1)[place] *= values
            black = np.flatnonzero(ratio.max(axis=0) <= 0)
            form[i].reshape(-1)[place.take(black)] = 0
    return sent
