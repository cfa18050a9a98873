"""rays with times, what moves -> hits.  A part of the scene that Embree places at each ray's time.

Each mesh is a scene of its own, with its vertices at steps of time, and each object an instance of
it with its affine at such steps; Embree goes straight from step to step, exactly as `motion` does.
Only rays that cross the boxes around what moves are asked.
"""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Scalar, Vec
from . import embree
from .mesh import Triangles
from .objects import Traits
from .packets import Queries
from .part import Hits, Part, no_hits

MOST_BOXES = 4  # each costs every ray about 15 ns
ROUNDING = 1e-5  # by so much of their size and distance boxes are larger than what is in them


@dataclass(frozen=True, eq=False)
class MovingPart(Part):
    """Instances of Embree scenes; `number` are the triangles of all, one instance after the other.

    first (n,): which of these is the first of each; handle: the RTCScene; boxes (B, 2, 3) bound
    everything at all times.
    """

    queries: Queries | None = None
    handle: int = 0
    boxes: NDArray[np.float32] | None = None

    def closest(
        self, origin: Vec, direction: Vec, far: Scalar | None, time: Scalar | None = None
    ) -> Hits:
        """Return the closest hits of rays (3, N) at times (N,) up to `far` (N,)."""
        assert self.queries is not None and self.number is not None and time is not None
        hits = no_hits(far, direction.shape[1])
        some = self._near(origin, direction, far)
        if not some.size:
            return hits
        origin = np.broadcast_to(origin, direction.shape).take(some, axis=1)
        rest = None if far is None else far.take(some)
        direction, time = direction.take(some, axis=1), time.take(some)
        t, u, v, primitive, instance = self.queries.closest(
            self.handle, origin, direction, rest, time
        )
        met = np.flatnonzero((primitive >= 0) & np.isfinite(t))
        triangle = self.first.take(instance.take(met)) + primitive.take(met)
        found = Hits(t.take(met), self.number.take(triangle), u.take(met), v.take(met))
        hits.put(some.take(met), found)
        return hits

    def free(
        self, origin: Vec, direction: Vec, far: Scalar, time: Scalar | None = None
    ) -> NDArray[np.int32]:
        """Return -1 for each ray that meets nothing before `far`, else 0; a far < 0 is met."""
        assert self.queries is not None and time is not None
        free = np.negative(far >= 0, dtype=np.int32)
        some = self._near(origin, direction, far)
        if some.size:
            origin = np.broadcast_to(origin, direction.shape).take(some, axis=1)
            way = origin, direction.take(some, axis=1), far.take(some), time.take(some)
            free[some] = self.queries.free(self.handle, *way)
        return free

    def _near(self, origin: Vec, direction: Vec, far: Scalar | None) -> NDArray[np.intp]:
        """Return which rays cross a box on their way (Kay and Kajiya 1986, with care for 0)."""
        assert self.boxes is not None
        crosses: NDArray[np.bool_] | None = None
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = np.reciprocal(direction)
            for low, high in self.boxes:
                begin = np.zeros(direction.shape[1], F32)
                end = np.full_like(begin, np.inf) if far is None else far.copy()
                for axis in range(3):
                    one = (low[axis] - origin[axis]) * inverse[axis]
                    two = (high[axis] - origin[axis]) * inverse[axis]
                    np.maximum(begin, np.minimum(one, two), out=begin)
                    np.minimum(end, np.maximum(one, two, out=one), out=end)
                # NaN, of a ray in the plane of a side: nothing is there.
                inside = begin <= end
                crosses = inside if crosses is None else np.logical_or(crosses, inside, out=crosses)
        assert crosses is not None
        return np.flatnonzero(crosses)


def moving_part(
    library: ctypes.CDLL,
    scene: Any,
    handle: int,
    triangles: Triangles,
    traits: Traits,
    should_stop: Callable[[], bool],
    number: Ids,
) -> MovingPart:
    """Build the triangles `number` (n,) that move, in embreex's empty `scene` with that handle."""
    movement = triangles.movement
    assert movement is not None
    instance = triangles.ids[:, 2].take(number)
    order = np.argsort(instance, kind="stable")
    number, instance = number.take(order), instance.take(order)
    which, first = np.unique(instance, return_index=True)
    shapes, affines = movement.vertices, movement.affines
    pieces: list[tuple[int, NDArray[np.float32]]] = []
    kept: list[Any] = [shapes.rows]
    scenes: dict[tuple[int, bytes], int] = {}
    boxes = []
    for one, some in zip(which, np.split(number, first[1:]), strict=True):
        # Objects that show the same triangles of the same mesh share a scene.
        local = triangles.corners.take(some, axis=0) - shapes.base[one]
        key = int(shapes.first[one]), local.tobytes()
        begin, count = shapes.first[one], shapes.count[one]
        ends = (begin + step * count for step in range(shapes.steps[one] + 1))
        steps = [shapes.rows[low : low + count] for low in ends]
        if key not in scenes:
            scenes[key] = embree.new_scene(library, handle, steps, local, should_stop)
            kept.append(local)
        rows = affines.rows[affines.first[one] :][: affines.steps[one] + 1]
        pieces.append((scenes[key], rows))
        boxes.append(_box(steps, rows))
    embree.build_instances(library, scene, handle, pieces, should_stop)
    for each in scenes.values():
        library.rtcReleaseScene(each)  # its instances hold it
    return MovingPart(
        scene,
        first.astype(np.int32),
        tuple(kept),
        number,
        traits,
        queries=Queries(library),
        handle=handle,
        boxes=_joined(np.array(boxes)),
    )


def _box(steps: list[NDArray[np.float32]], rows: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return the box (2, 3) that vertices (V, 3) at some steps are in under all affines (n, 12).

    What goes straight between them stays inside.
    """
    low = np.min([each.min(axis=0) for each in steps], axis=0).astype(np.float64)
    high = np.max([each.max(axis=0) for each in steps], axis=0).astype(np.float64)
    matrix = rows.reshape(-1, 3, 4).astype(np.float64)
    middle = matrix[:, :, :3] @ (0.5 * (low + high)) + matrix[:, :, 3]
    half = np.abs(matrix[:, :, :3]) @ (0.5 * (high - low))
    return np.stack([(middle - half).min(axis=0), (middle + half).max(axis=0)])


def _joined(boxes: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return few boxes (B, 2, 3) around many, a little larger."""
    middle = boxes.mean(axis=1)
    order = np.argsort(middle[:, np.ptp(middle, axis=0).argmax()])
    parts = np.array_split(boxes[order], min(MOST_BOXES, len(boxes)))
    joined = np.array([[part[:, 0].min(axis=0), part[:, 1].max(axis=0)] for part in parts])
    room = ROUNDING * np.abs(joined).max(axis=(1, 2), keepdims=True)
    joined += room * np.array([[-1.0], [1.0]])
    return joined.astype(F32)
