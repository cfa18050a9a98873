"""camera rays -> points, surface by surface.  Looking straight on through what is transparent.

As the camera's paths do, but without chance: whoever looks decides which rays go on behind what
they have met.
"""

import numpy as np

from ..arrays import F32, Ids, Index, Scalar, Vec, take
from ..bsdf import CAMERA
from ..geometry import surface
from ..geometry.surface import Points
from ..plan import Plan
from ..shading import Arrival
from ..statistics import Tally


class Gaze:
    """Rays (N,) of the camera on their way: which of them still look, `ray` (n,), and `far` (n,).

    origin and unit direction (3, N); far (N,) [m] from there, None is no limit; time (N,) or None.
    passed: how many surfaces they have behind them.
    """

    def __init__(
        self, origin: Vec, direction: Vec, far: Scalar | None, time: Scalar | None
    ) -> None:
        self.ray: Index = np.arange(direction.shape[1])
        self.passed = -1
        self.far = far
        self._origin, self._direction, self._time = origin, direction, time
        self._left: Ids | None = None
        self._travelled = np.zeros(direction.shape[1], F32)

    def meet(self, plan: Plan, tally: Tally) -> tuple[Points, Arrival] | None:
        """Return what rays meet next, and how they arrive there; those that meet nothing end.

        None if nobody meets anything, or more surfaces than may be passed lie behind.
        """
        self.passed += 1
        if not self.ray.size or self.passed > plan.transparent_max_bounces:
            return None
        assert plan.accel is not None and plan.triangles is not None
        way = self._origin, self._direction
        hits = plan.accel.closest(*way, self.far, self._left, None, tally, self._time)
        found = np.flatnonzero(hits.triangle >= 0)
        if not found.size:
            return None
        points = surface.resolve(plan.triangles, *way, hits, found, self._time)
        self.ray, self._travelled = self.ray.take(found), self._travelled.take(found)
        self.far = take(self.far, found)
        count = np.full(found.size, self.passed, np.int16)
        arrival = Arrival(CAMERA, self.passed, self._travelled, passed=count)
        return plan.surfaces.bend(points, arrival), arrival

    def go_on(self, points: Points, some: Index, far: Scalar | None = None) -> None:
        """Let the rays `some` (m,) of those that have met `points` look on, so far (m,) behind."""
        points = points.take(some)
        self.ray = self.ray.take(some)
        self._origin = points.position - points.geometric * points.offset
        self._direction, self._left, self._time = points.arriving, points.triangle, points.time
        self._travelled = self._travelled.take(some) + points.distance
        self.far = far
