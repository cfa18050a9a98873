"""rays, one Embree scene -> hits.  A part of the scene: triangles that the same rays meet."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec, repeated
from ..scene import CAMERA, EVERY_SET, SHADOW, TRANSMISSION
from .objects import EVERY_RAY, PLAIN, Traits

FAR = F32(1e37)  # beyond every scene, and still finite when squared in float64

NO_RAYS = np.zeros(0, np.intp)

Sets = int | NDArray[np.uint64]  # a mask of light linking sets for all rays, or one for each


@dataclass(frozen=True, eq=False)
class Hits:
    """Closest hits: t (N,), triangle (N,) or -1, barycentrics u and v (N,)."""

    t: Scalar
    triangle: Ids
    u: Scalar
    v: Scalar

    def put(self, index: Index, other: "Hits") -> None:
        """Overwrite the hits at `index` (M,) with M others."""
        for name in ("t", "triangle", "u", "v"):
            getattr(self, name)[index] = getattr(other, name)

    def take(self, index: Index) -> "Hits":
        """Return the hits at `index` (M,)."""
        names = ("t", "triangle", "u", "v")
        return Hits(*(getattr(self, name).take(index) for name in names))


def no_hits(far: Scalar | None, size: int) -> Hits:
    """Return the hits of `size` rays that meet nothing before `far` (N,)."""
    t = np.full(size, FAR) if far is None else far.copy()
    return Hits(t, np.full(size, -1, np.int32), np.zeros(size, F32), np.zeros(size, F32))


@dataclass(frozen=True, eq=False)
class Part:
    """An Embree scene (of embreex); its primitive p of geometry g is number first[g] + p of it.

    That is a triangle of the table, or where some triangles are in other parts, counts into
    `number`, those of this one.  `shared` are the arrays that Embree reads and that must live as
    long as it.  made_from: the table, and how the tree was built, see `accel.remade`.
    """

    scene: Any
    first: NDArray[np.int32]
    shared: tuple[Any, ...]
    number: Ids | None = None
    traits: Traits = PLAIN
    made_from: tuple[Any, ...] = ()

    def closest(
        self, origin: Vec, direction: Vec, far: Scalar | None, time: Scalar | None = None
    ) -> Hits:
        """Return the closest hits of rays (3, N) up to `far` (N,), which is overwritten.

        Only parts that move ask for the rays' times (N,).
        """
        origin = repeated(origin, direction.shape[1])
        found = self.scene.run(origin.T, direction.T, dists=far, output=1)
        triangle = found["primID"]
        if len(self.first) > 1:
            # Geometry -1 (a miss) reads the last entry; the sum is made -1 again.
            base = self.first.take(found["geomID"], mode="wrap")
            triangle = np.where(triangle < 0, np.int32(-1), triangle + base)
        if self.number is not None:
            triangle = np.where(triangle < 0, np.int32(-1), self.number.take(triangle, mode="wrap"))
        return Hits(found["tfar"], triangle, found["u"], found["v"])

    def free(
        self, origin: Vec, direction: Vec, far: Scalar, time: Scalar | None = None
    ) -> NDArray[np.int32]:
        """Return -1 for each ray that meets nothing before `far`, else 0; a far < 0 is met."""
        origin = repeated(origin, direction.shape[1])
        return self.scene.run(origin.T, direction.T, dists=far, query="OCCLUDED")

    def seen_by(self, kinds: NDArray[np.uint8] | None) -> Index | None:
        """Return which rays of the bits `kinds` (N,), None is camera rays, see it; None is all.

        A transmitted ray counts as nothing else (Cycles, path_state_ray_visibility).
        """
        mask = self.traits.seen_by
        if mask | SHADOW == EVERY_RAY:
            return None
        if kinds is None:
            return None if mask & CAMERA else NO_RAYS
        sees = np.where(kinds & TRANSMISSION, mask & TRANSMISSION, kinds & np.uint8(mask)) != 0
        return None if sees.all() else np.flatnonzero(sees)

    def blocks(self, blockers: Sets) -> Index | None:
        """Return which rays it shades, by the masks of the sets that block them; None is all."""
        if isinstance(blockers, int):
            yes = blockers == EVERY_SET or blockers >> self.traits.blocker_set & 1
            return None if yes else NO_RAYS
        does = (blockers >> np.uint64(self.traits.blocker_set)) & np.uint64(1)
        return None if does.all() else np.flatnonzero(does)


def with_traits(part: Part, traits: Traits) -> Part:
    """Return a part as other rays see it."""
    return replace(part, traits=traits)
