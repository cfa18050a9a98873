"""rays, a transparent part -> how much light they let pass.  From surface to surface.

What passes is a product, so the order of surfaces does not matter, and parts are walked one after
the other.  Embree has no near distance here: each step starts again a little behind the last
hit, and a hit of the very same triangle is passed over by a larger step.  Surfaces that lie upon
each other are in parts of their own (see `layers`), so that a step skips none.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..arrays import EPSILON, F32, Ids, Index, Scalar, Vec, dot, take
from .mesh import OFFSET, Triangles
from .part import Hits, Part

# What surfaces let pass, (n,) or (3, n): of triangles (n,) at barycentrics u, v (n,) that rays
# meet at t (n,), in lengths of their direction; the last arguments are the rays' numbers (n,), and
# how many surfaces of the same part and of those before they have met already (n,).
Shade = Callable[[Ids, Scalar, Scalar, Scalar, Index, Ids], Scalar | Vec]

GROWTH = F32(4)  # of a step that did not get past the rounding of its triangle


class Passage:
    """What N rays have let pass: through (N,) or, once a surface has a colour, (3, N)."""

    def __init__(self, through: Scalar, limit: int | Ids, shade: Shade) -> None:
        self.through: Scalar | Vec = through
        self._limit = np.broadcast_to(np.asarray(limit, np.int32), through.shape)
        self._met = np.zeros(through.size, np.int32)
        self._shade = shade

    def alive(self) -> Index:
        """Return the rays that still carry light."""
        return np.flatnonzero(_largest(self.through) > 0)

    def meet(self, ray: Index, hits: Hits) -> NDArray[np.bool_]:
        """Let rays (n,) pass the surfaces they hit; tell which still carry light.

        Beyond `limit` surfaces there is none (Cycles, bvh/shadow_all).
        """
        before = self._met.take(ray)
        met = before + np.int32(1)
        self._met[ray] = met
        value = self._shade(hits.triangle, hits.u, hits.v, hits.t, ray, before)
        if value.ndim > self.through.ndim:
            self.through = np.repeat(self.through[None], 3, axis=0)
        value = self.through.take(ray, axis=-1) * value
        value *= met <= self._limit.take(ray)

        # Channel by channel: faster than indexing all three at once.
        for channel, new in zip(np.atleast_2d(self.through), np.atleast_2d(value), strict=True):
            channel[ray] = new
        return _largest(value) > 0


def walk(
    triangles: Triangles,
    part: Part,
    origin: Vec,
    direction: Vec,
    far: Scalar,
    left: Ids,
    ray: Index,
    passage: Passage,
    time: Scalar | None = None,
) -> None:
    """Take rays (3, n) that leave triangles `left` (n,) or -1 through a part, up to `far` (n,).

    `ray` (n,) are their numbers in `passage`; time (n,), None if nothing moves.
    """
    here, rest = origin, far.copy()
    start, step = np.zeros(ray.size, F32), np.ones(ray.size, F32)
    while ray.size:
        hits = part.closest(here, direction, rest, time)
        found = np.flatnonzero(hits.triangle >= 0)
        if not found.size:
            return
        hits, ray, start = hits.take(found), ray.take(found), start.take(found)
        hits.t[:] += start

        # Pass each surface once; a triangle that is met again was not left behind.
        going = hits.triangle == left.take(found)
        step = np.where(going, step.take(found) * GROWTH, F32(1))
        new = np.flatnonzero(~going)
        going[new] = passage.meet(ray.take(new), hits.take(new))

        # Go on behind it, by the rounding of the triangle and of the distance.
        on = np.flatnonzero(going)
        ray, left, start, step = (
            ray.take(on),
            hits.triangle.take(on),
            hits.t.take(on),
            step.take(on),
        )
        on = found.take(on)
        origin, direction = origin.take(on, axis=1), direction.take(on, axis=1)
        far, time = far.take(on), take(time, on)
        length = np.sqrt(np.maximum(dot(direction, direction), F32(1e-30)))
        start += step * (triangles.columns(left, time)[OFFSET] / length + F32(2) * EPSILON * start)
        here, rest = origin + direction * start, far - start


def _largest(value: Scalar | Vec) -> Scalar:
    if value.ndim == 1:
        return value
    largest: Scalar = np.maximum(np.maximum(value[0], value[1]), value[2])
    return largest
