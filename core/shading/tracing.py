"""shading points, directions -> hits.  Rays that shaders trace themselves.

Bevel, Ambient Occlusion and Raycast look around from the point that is shaded.  Objects whose
shaders look at themselves alone are in an Embree scene of their own besides; where it holds
several, hits of others are passed over.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec, take
from ..geometry.accel import Accel, Hits
from ..geometry.mesh import INSTANCE, MATERIAL, OFFSET, Triangles
from ..geometry.objects import EVERY_RAY
from ..geometry.part import with_traits
from ..sampling.dimensions import dimension
from ..sampling.draws import Draws
from ..statistics import Tally

# How far a shader looks: not at all, at the whole scene, at its own object besides
NOWHERE, EVERYWHERE, OWN = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Probe:
    """What N points need to trace rays: random numbers, and who counts them.

    slot (N,) of each point, None is 0 ... N - 1; depth: bounces before; is_sharp (N,), None is
    all: whether what paths did so far leaves details to be seen.
    """

    draws: Draws
    slot: Index | None
    depth: int
    tally: Tally
    is_sharp: NDArray[np.bool_] | None = None

    def take(self, index: Index) -> "Probe":
        """Return what the points at `index` (M,) need."""
        slot = index if self.slot is None else self.slot.take(index)
        return replace(self, slot=slot, is_sharp=take(self.is_sharp, index))

    def pair(self, purpose: int, item: int, split: int) -> tuple[Scalar, Scalar]:
        """Return the item-th of `split` pairs of random numbers (N,) in [0, 1)."""
        # Item 1 of the camera's purposes, which have no other use.
        place = dimension(purpose, self.depth, 1)
        return self.draws.pair(place, self.slot, item, split)


@dataclass(frozen=True, eq=False)
class Tracer:
    """What rays of shaders meet: the scene as shadow rays see it, all of it, the objects alone."""

    accel: Accel
    whole: Accel
    own: Accel | None
    triangles: Triangles

    def instance(self, triangle: Ids) -> Ids:
        """Return the objects (N,) of triangles (N,)."""
        return self.triangles.ids[:, INSTANCE - MATERIAL].take(triangle)

    def is_free(
        self, origin: Vec, direction: Vec, far: Scalar, tally: Tally, time: Scalar | None
    ) -> Scalar:
        """Return 1 for each ray (N,) that meets nothing opaque before `far`, else 0.

        time (N,), None if nothing moves, as in all that follow.
        """
        tally.rays_shadow += far.size
        return self.accel.free(origin, direction, far, tally, time=time)

    def closest(
        self,
        origin: Vec,
        direction: Vec,
        far: Scalar,
        left: Ids | None,
        tally: Tally,
        time: Scalar | None,
    ) -> Hits:
        """Return the closest hits of rays (N,), of whatever the scene has."""
        tally.rays_shadow += far.size
        return self.whole.closest(origin, direction, far, left, None, tally, time)

    def hits_of(
        self,
        instance: Ids,
        origin: Vec,
        direction: Vec,
        far: Scalar,
        left: Ids | None,
        tally: Tally,
        time: Scalar | None,
    ) -> Iterator[tuple[Index, Hits]]:
        """Yield which rays (N,) hit the objects `instance` (N,), and where; nearest first.

        Triangles `left` (N,) that rays start from do not count.
        """
        assert self.own is not None
        ray = np.arange(far.size)
        last = np.full(far.size, -1, np.int32) if left is None else left
        way = np.zeros(far.size, F32)
        while ray.size:
            tally.rays_shadow += ray.size
            hits = self.own.closest(origin, direction, far, None, None, tally, time)
            found = np.flatnonzero(hits.triangle >= 0)
            hits = hits.take(found)
            ray, way, last = ray.take(found), way.take(found), last.take(found)
            time = take(time, found)
            is_own = self.instance(hits.triangle) == instance.take(ray)
            is_own &= hits.triangle != last
            some = np.flatnonzero(is_own)
            if some.size:
                each = hits.take(some)
                yield ray.take(some), Hits(each.t + way.take(some), each.triangle, each.u, each.v)

            # Go on behind what was hit
            direction, last = direction.take(found, axis=1), hits.triangle
            step = hits.t * F32(1 + 2.0**-20) + self.triangles.columns(last, time)[OFFSET]
            origin = origin.take(found, axis=1) + direction * step
            way, far = way + step, far.take(found) - step
            left_over = np.flatnonzero(far > 0)
            ray, last, time = ray.take(left_over), last.take(left_over), take(time, left_over)
            way, far = way.take(left_over), far.take(left_over)
            origin, direction = (each.take(left_over, axis=1) for each in (origin, direction))


def compile_tracer(accel: Accel, own: Accel | None) -> Tracer:
    """Return how shaders trace rays in a scene; `own` are the objects that look at themselves."""
    parts = tuple(
        with_traits(part, replace(part.traits, seen_by=EVERY_RAY)) for part in accel.parts
    )
    return Tracer(accel, Accel(parts, accel.triangles), own, accel.triangles)


def looks(function: Any, static: tuple[Any, ...]) -> int:
    """Return how far a step looks: NOWHERE, EVERYWHERE or OWN."""
    reach = getattr(function, "reach", None)
    return NOWHERE if reach is None else reach(static)
