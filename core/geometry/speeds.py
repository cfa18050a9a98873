"""points -> speeds.  How far surfaces move in the picture from frame to frame.

Each point is followed with its object and its triangle to the frames before and after, and looked
at by the cameras of these.  In pixels, as compositors read them: from this frame to the one before,
and from the one after to this one.  The surroundings are too far away for anything but the turns
and zooms of the camera.  Source: Cycles, primitive_motion_vector.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec, take
from ..scene import Camera
from .mesh import Triangles
from .motion import Movement
from .surface import Points
from .view import View, compile_view


@dataclass(frozen=True, eq=False)
class Speeds:
    """The views of the frames before, at and after, the size (2, 1) of their pictures [pixels].

    movement: of what moves, whose times 0 and 1 are the other frames; None if only the camera
    does.
    """

    views: tuple[View, View, View]
    size: NDArray[np.float32]
    movement: Movement | None

    def at(self, triangles: Triangles, points: Points) -> NDArray[np.float32]:
        """Return the speeds (4, n) of points [pixels per frame]."""
        before = self._followed(triangles, points, 0.0)
        after = self._followed(triangles, points, 1.0)
        places = before, points.position, after
        return self._between(view.point(p) for view, p in zip(self.views, places, strict=True))

    def far_away(self, direction: Vec) -> NDArray[np.float32]:
        """Return the speeds (4, n) of what is in directions (3, n), at any distance."""
        return self._between(view.turn(direction) for view in self.views)

    def _between(self, places: Iterable[Vec]) -> NDArray[np.float32]:
        """Return the speeds (4, n) between places (3, n) in the spaces of the three cameras."""
        before, here, after = (
            view.window(place)[:2] * self.size
            for view, place in zip(self.views, places, strict=True)
        )
        return np.concatenate([before - here, here - after])

    def _followed(self, triangles: Triangles, points: Points, when: float) -> Vec:
        """Return where points (3, n) are at another time."""
        if self.movement is None:
            return points.position
        assert points.instance is not None and points.u is not None and points.v is not None
        some = np.flatnonzero(self.movement.moves.take(points.instance))
        if not some.size:
            return points.position
        corners = triangles.corners.take(points.triangle.take(some), axis=0).T
        time: Scalar = np.full(some.size, when, F32)
        instance = points.instance.take(some)
        a, b, c = self.movement.places(list(corners), instance, time)
        u, v = take(points.u, some), take(points.v, some)
        position = points.position.copy()
        position[:, some] = a * (F32(1) - u - v) + b * u + c * v
        return position


def compile_speeds(
    cameras: Sequence[Camera], origin: NDArray[np.float64], movement: Movement | None
) -> Speeds:
    """Return how things move in the pictures of three cameras, one of each frame.

    Everything is about `origin` (3,) [m].
    """
    before, here, after = (compile_view(camera, origin) for camera in cameras)
    size = np.array([[cameras[1].width], [cameras[1].height]], F32)
    return Speeds((before, here, after), size, movement)
