"""points -> closures.  The lobes at a batch of hits, grouped by closure type.

Constant materials are compiled into tables with a column for each material; running them is a
gather.  Groups hold indices into the batch, so each type's arithmetic runs over whole arrays.
"""

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar, Vec
from ..bsdf import REGISTRY
from ..geometry.surface import Points
from .surfaces import Surface


@dataclass(frozen=True, eq=False)
class Group:
    """Points that have a lobe of one closure type.

    index (n,) into the batch, None for all of it; weight (3, n); parameters (P, n); lobe counts
    the lobes of a material.
    """

    module: ModuleType
    index: Index | None
    weight: Vec
    parameters: Vec
    lobe: int = 0

    def take(self, index: Index) -> "Group":
        """Return the part of the group that `index` counts from its first point."""
        return Group(
            self.module,
            index if self.index is None else self.index.take(index),
            self.weight.take(index, axis=1),
            self.parameters.take(index, axis=1),
            self.lobe,
        )


@dataclass(frozen=True, eq=False)
class Closures:
    """All lobes at a batch of points; `single` if no point has more than one."""

    groups: tuple[Group, ...]
    single: bool

    def attenuate(self, throughput: Vec | None) -> None:
        """Multiply all weights by their path's throughput (3, N); None is 1."""
        if throughput is None:
            return
        for group in self.groups:
            some = throughput if group.index is None else throughput.take(group.index, axis=1)
            np.multiply(group.weight, some, out=group.weight)


@dataclass(frozen=True, eq=False)
class SurfaceTable:
    """M materials of up to K lobes.

    modules: the closure types that occur; kind (K, M) int8 counts into them, -1 is no lobe;
    weight (K, 3, M), parameters (K, P, M) float32; emission (3, M) or None if nothing emits.
    """

    modules: tuple[ModuleType, ...]
    kind: NDArray[np.int8]
    weight: NDArray[np.float32]
    parameters: NDArray[np.float32]
    emission: NDArray[np.float32] | None

    @property
    def has_specular(self) -> bool:
        """Whether any closure scatters into single directions only."""
        return any(module.IS_DELTA for module in self.modules)

    def run(self, points: Points) -> Closures:
        """Return the lobes at `points`."""
        groups = []
        for lobe in range(len(self.kind)):
            kind = self.kind[lobe]
            for number, module in enumerate(self.modules):
                if not (kind == number).any():
                    continue
                index = None
                material = points.material
                if not (kind == number).all():
                    index = np.flatnonzero(kind.take(material) == number)
                    if not index.size:
                        continue
                    material = material.take(index)
                count = len(module.PARAMETERS)
                groups.append(
                    Group(
                        module,
                        index,
                        self.weight[lobe].take(material, axis=1),
                        self.parameters[lobe, :count].take(material, axis=1),
                        lobe,
                    )
                )
        return Closures(tuple(groups), len(self.kind) == 1)


def choose_lobe(closures: Closures, size: int, u: Scalar) -> Closures:
    """Keep one lobe of each of `size` points, chosen by u (N,) in proportion to its weight.

    The weights of those that stay are divided by their probability: unbiased.
    """
    if closures.single:
        return closures
    total = np.zeros(size, F32)
    shares = []
    for group in closures.groups:
        share = group.weight[0] + group.weight[1] + group.weight[2]
        shares.append(share)
        if group.index is None:
            total += share
        else:
            total[group.index] += share
    target = u * total
    below = np.zeros(size, F32)
    kept = []
    for group, share in zip(closures.groups, shares, strict=True):
        index = np.arange(size) if group.index is None else group.index
        low = below.take(index)
        high = low + share
        below[index] = high
        aim = target.take(index)
        chosen = np.flatnonzero((aim >= low) & (aim < high))
        if chosen.size:
            scale = total.take(index.take(chosen)) / share.take(chosen)
            kept.append(
                Group(
                    group.module,
                    index.take(chosen),
                    group.weight.take(chosen, axis=1) * scale,
                    group.parameters.take(chosen, axis=1),
                )
            )
    return Closures(tuple(kept), True)


def compile_table(surfaces: list[Surface]) -> SurfaceTable:
    """Lay the lobes of all materials out as columns."""
    names = list(dict.fromkeys(lobe.closure for s in surfaces for lobe in s.lobes))
    modules = tuple(REGISTRY[name] for name in names)
    lobes = max((len(s.lobes) for s in surfaces), default=0)
    width = max((len(module.PARAMETERS) for module in modules), default=0)
    kind = np.full((lobes, len(surfaces)), -1, np.int8)
    weight = np.zeros((lobes, 3, len(surfaces)), F32)
    parameters = np.zeros((lobes, width, len(surfaces)), F32)
    emission = np.zeros((3, len(surfaces)), F32)
    for column, surface in enumerate(surfaces):
        emission[:, column] = surface.emission
        for row, lobe in enumerate(surface.lobes):
            kind[row, column] = names.index(lobe.closure)
            weight[row, :, column] = lobe.weight
            parameters[row, : len(lobe.parameters), column] = lobe.parameters
    return SurfaceTable(modules, kind, weight, parameters, emission if emission.any() else None)
