"""directions, closures -> Label.  As what kind of ray counts what several closures may send.

For Blender all closures of a point share the light of a direction, whichever of them sampled it,
and the ray counts as one of the kind of that closure.  Here each closure sends light of its own.
So the kind is drawn anew, with the probabilities with which closures of each kind would have sent
a ray there: bounce limits, visibility by kind of ray and Light Path nodes then see what they see
in Blender.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar, Vec
from ..bsdf import DIFFUSE, GLOSSY
from ..sampling.dimensions import ROULETTE, dimension
from ..sampling.draws import Draws
from ..shading import LobeAt, Shaded


@dataclass(frozen=True, eq=False)
class Label:
    """As what rays count: is_matte (n,), else glossy; pdf (n,) [1/sr] of all closures together."""

    is_matte: NDArray[np.bool_]
    pdf: Scalar

    @property
    def kind(self) -> NDArray[np.uint8]:
        """The bit (n,) of each ray."""
        return np.where(self.is_matte, np.uint8(DIFFUSE), np.uint8(GLOSSY))

    def take(self, index: Index) -> "Label":
        """Return the labels at `index`."""
        return Label(self.is_matte.take(index), self.pdf.take(index))


@dataclass(frozen=True, eq=False)
class Senders:
    """The closures of a program's points; `own` sends rays from `some` (n,) of them, or all."""

    shaded: Shaded
    own: LobeAt
    some: Index | None

    def label(
        self, direction: Vec, pdf: Scalar | None, draws: Draws, depth: int, slot: Index | None
    ) -> Label | None:
        """Return as what rays (3, n) of the density `pdf` count, None if there is one kind only."""
        if self.own.module.IS_DELTA or self.own.odds is None:
            return None
        sends = [lobe for lobe in self.shaded.lobes if not lobe.module.IS_DELTA]
        if len({lobe.module.RAY_KIND for lobe in sends}) < 2:
            return None

        # How densely all closures send rays there, and matte ones.
        every = np.zeros(direction.shape[1], F32)
        matte = np.zeros(direction.shape[1], F32)
        for lobe in sends:
            here = lobe if self.some is None else lobe.take(self.some)
            is_own = lobe.number == self.own.number and pdf is not None
            density = pdf if is_own else here.density(direction)
            assert density is not None and here.odds is not None
            density = density * here.odds
            every += density
            if lobe.module.RAY_KIND == DIFFUSE:
                matte += density

        _, chance = draws.pair(dimension(ROULETTE, depth), slot)
        return Label(chance * every < matte, every)
