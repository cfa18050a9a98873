"""camera -> View.  The camera's own space and its window, for shaders that ask for them.

As in Cycles, and unlike Blender's cameras, z grows along the view; panoramas have it up.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec, dot, normalize
from ..optics import Panorama, panoramas
from ..scene import Camera


@dataclass(frozen=True, eq=False)
class View:
    """axes (3, 3), a row each, and the eye (3, 1) about the local origin [m].

    low and size (2,) of the window, on the plane at distance 1 where `is_perspective`; pixel
    (2,), the size of one there; clip [m]: how far along z before the camera's rays they count as
    begun, as Blender's begin at the near clipping plane.  All are of the picture's unit square
    where there is a panorama.
    """

    axes: NDArray[np.float32]
    eye: Vec
    low: NDArray[np.float32]
    size: NDArray[np.float32]
    pixel: NDArray[np.float32]
    is_perspective: bool
    clip: np.float32 = F32(0)
    panorama: Panorama | None = None

    def point(self, position: Vec) -> Vec:
        """Return positions (3, N) about the local origin in the camera's space."""
        return self.turn(position - self.eye)

    def turn(self, direction: Vec) -> Vec:
        """Return directions (3, N) of the world in the camera's space."""
        return np.stack([dot(axis[:, None], direction) for axis in self.axes])

    def point_back(self, position: Vec) -> Vec:
        """Return positions (3, N) in the camera's space about the local origin."""
        return self.turn_back(position) + self.eye

    def turn_back(self, direction: Vec) -> Vec:
        """Return directions (3, N) in the camera's space in the world."""
        return np.stack([dot(axis[:, None], direction) for axis in self.axes.T])

    def window(self, place: Vec) -> Vec:
        """Return where places (3, N) in the camera's space are in the window, x and y 0 to 1.

        Of a panorama it is the whole of it, whatever part the picture shows (Cycles).
        """
        if self.panorama is not None:
            u, v = panoramas.place(self.panorama, normalize(place.copy()))
            return np.stack([u, v, np.zeros_like(u)])
        x, y = place[0], place[1]
        if self.is_perspective:
            depth = np.where(place[2] != 0, place[2], F32(1))
            x, y = x / depth, y / depth
        out = np.zeros_like(place)
        out[0] = (x - self.low[0]) / self.size[0]
        out[1] = (y - self.low[1]) / self.size[1]
        return out

    def depth(self, place: Vec) -> Scalar:
        """Return how deep (n,) [m] places (3, n) in the camera's space are in the picture.

        Along the view; for panoramas, the distance (Cycles).
        """
        return place[2] if self.panorama is None else np.sqrt(dot(place, place))

    def footprint(self, place: Vec) -> Scalar:
        """Return how wide (N,) [m] a pixel is at places (3, N) in the camera's space."""
        if self.panorama is not None:
            return self._round_footprint(self.panorama, place)
        if not self.is_perspective:
            return np.full(place.shape[1], F32(0.5) * (self.pixel[0] + self.pixel[1]))
        run: Vec = np.divide(place, np.where(place[2] != 0, place[2], F32(1)))
        total = np.zeros(place.shape[1], F32)
        middle: Vec = np.divide(run, np.sqrt(dot(run, run)))
        for row in range(2):
            side = run.copy()
            side[row] += self.pixel[row]
            side /= np.sqrt(dot(side, side))
            side -= middle
            total += np.sqrt(dot(side, side))
        return total * F32(0.5) * np.sqrt(dot(place, place))

    def _round_footprint(self, panorama: Panorama, place: Vec) -> Scalar:
        u, v = panoramas.place(panorama, normalize(place.copy()))
        middle, right, up = (
            normalize(panoramas.direction(panorama, u + dx, v + dy)[0])
            for dx, dy in ((0, 0), (self.pixel[0], 0), (0, self.pixel[1]))
        )
        right -= middle
        up -= middle
        total = np.sqrt(dot(right, right)) + np.sqrt(dot(up, up))
        return total * F32(0.5) * np.sqrt(dot(place, place))


def axes(camera: Camera) -> NDArray[np.float64]:
    """Return the axes (3, 3) of the space in which shaders see, a row each in the world.

    Blender's: z runs along the view, but panoramas have the view along x and z up, and mirror balls
    x to the right, y to the back and z up.
    """
    right, up, back = camera.to_world[:, :3].T
    if camera.panorama is None:
        return np.stack([right, up, -back])
    if camera.panorama.kind == "MIRRORBALL":
        return np.stack([right, back, up])
    return np.stack([-back, -right, up])


def compile_view(camera: Camera, origin: NDArray[np.float64]) -> View:
    """Return the view of a camera about `origin` (3,) [m]."""
    left, right, bottom, top = camera.window
    size = np.array([right - left, top - bottom])
    return View(
        axes(camera).astype(F32),
        (camera.to_world[:, 3] - origin).astype(F32)[:, None],
        np.array([left, bottom], F32),
        size.astype(F32),
        (size / (camera.width, camera.height)).astype(F32),
        camera.projection == "PERSP",
        panorama=camera.panorama,
    )
