"""pixels -> rays.  Where a camera ray starts and where it goes.

A ray of a pinhole is linear in its raster position, so three vectors are all there is to it.  A
lens moves its start over an aperture and keeps what is in focus where it is (Cook, Porter and
Carpenter 1984, "Distributed Ray Tracing", section 4); a panorama bends it by a map of its own.  The
pixel filter is importance-sampled: a sample's position is drawn from the filter and all samples of
a pixel weigh the same (Ernst et al. 2006, "Filter Importance Sampling").
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar, Vec, add_scaled, check, dot, normalize, take
from ..geometry.view import axes
from ..optics import Aperture, Eye, Panorama, panoramas
from ..sampling.tables import compile_inverse, lookup
from ..scene import Camera
from ..settings import Settings
from .aperture import opening
from .eyes import look

FILTER_ENTRIES = 1 << 13


class CameraRays(NamedTuple):
    """What the camera sends: origin (3, N) or (3, 1), unit direction (3, N), far (N,) or None [m].

    slot (N,): the samples that have these rays, None if all do; outside of a round picture
    there are none.
    """

    origin: Vec
    direction: Vec
    far: Scalar | None
    slot: Index | None = None


@dataclass(frozen=True, eq=False)
class CompiledCamera:
    """Rays start at start_0 + x start_x + y start_y and run along the same of `run`, (3, 1) each.

    x, y are raster positions from the lower left corner [pixels]; `near` and `far` [m] are
    distances along the view axis, near 0 if the scene does not come that near, far None if it
    does not reach that far; `offsets` is the inverse of the pixel filter's distribution [pixels].

    aperture: None for a pinhole; `lens` is half of its width, half of its height and the distance
    that is sharp [m], (3, 1) in all; its points are in the plane of `sides`, right and up, (3, 1)
    each, if the picture is flat.  panorama: None for a flat picture; else `map` is (low, step) of
    the picture's x and y by raster position, `run` the axes of its space, and near and far are
    distances from the eye.  eye: one of two, None if there is one.

    Of a camera that moves all vectors may be (3, N), one for each ray; see `camera_motion`.
    """

    start: tuple[Vec, ...]
    run: tuple[Vec, ...]
    is_perspective: bool
    near: np.float32
    far: np.float32 | None
    offsets: NDArray[np.float32]
    sides: tuple[Vec, ...] = ()
    lens: tuple[Vec, ...] = ()
    aperture: Aperture | None = None
    panorama: Panorama | None = None
    map: NDArray[np.float32] | None = None
    eye: Eye | None = None

    def rays(
        self,
        x: Scalar,
        y: Scalar,
        u: Scalar,
        v: Scalar,
        lens_u: Scalar | None = None,
        lens_v: Scalar | None = None,
    ) -> CameraRays:
        """Return the rays of samples of pixels.

        x, y (N,) are the lower left corners of pixels; u, v in [0, 1) place the sample, lens_u and
        lens_v in [0, 1) its ray in the aperture, if there is one.
        """
        found = self.through(x + self.placed(u), y + self.placed(v), lens_u, lens_v)
        check("camera", origin=found.origin, direction=found.direction)
        return found

    def placed(self, u: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return how far from the corner of its pixel [pixels] u in [0, 1) places a sample."""
        entry = (u * F32(FILTER_ENTRIES)).astype(np.intp)
        return self.offsets.take(entry, mode="clip")

    def through(
        self, px: Scalar, py: Scalar, lens_u: Scalar | None = None, lens_v: Scalar | None = None
    ) -> CameraRays:
        """Return the rays through raster positions px, py (N,), which may be overwritten."""
        if self.panorama is not None:
            return self._around(px, py, lens_u, lens_v)
        point = None
        if self.aperture is not None:
            assert lens_u is not None and lens_v is not None
            right, up = opening(self.aperture, self.lens[0][:2], lens_u, lens_v)
            point = self.sides[0] * right
            point += self.sides[1] * up
        if not self.is_perspective:
            return self._parallel(px, py, point)

        # The raster direction has length 1 along the view axis: near and far are multiples of it.
        direction = self.run[1] * px
        add_scaled(direction, self.run[2], py)
        direction += self.run[0]
        if point is not None or self.eye is not None:
            return self._through(direction, point)
        origin = self.start[0]
        if self.near > 0:
            origin = origin + direction * self.near
        if self.far is None:
            return CameraRays(origin, normalize(direction), None)
        length = np.sqrt(dot(direction, direction))
        return CameraRays(origin, normalize(direction), length * (self.far - self.near))

    def _parallel(self, px: Scalar, py: Scalar, point: Vec | None) -> CameraRays:
        """Return orthographic rays, through points (3, N) of the aperture."""
        origin = self.start[1] * px
        origin += self.start[2] * py
        origin += self.start[0]
        direction = np.empty_like(origin)
        direction[:] = self.run[0]
        if self.aperture is not None and point is not None:
            # Every ray has an aperture of its own; origins are on the near clipping plane.
            nearness = F32(1) / self.lens[0][2]
            direction -= point * nearness
            normalize(direction)
            origin += point * (F32(1) - self.near * nearness)
        far = None if self.far is None else np.full(px.shape, self.far - self.near, F32)
        return CameraRays(origin, direction, far)

    def _through(self, direction: Vec, point: Vec | None) -> CameraRays:
        """Return perspective rays through points (3, N) of the aperture, or of one of two eyes."""
        length = np.sqrt(dot(direction, direction))
        origin: Vec = np.zeros_like(direction)
        if self.aperture is not None and point is not None:
            direction -= point * (F32(1) / self.lens[0][2])
            origin = point
        normalize(direction)
        if self.eye is not None:
            aside, direction = look(self.eye, direction)
            origin += aside
        # The clipping planes are as far as on the ray through the middle of the lens (Cycles).
        origin += direction * (length * self.near)
        origin += self.start[0]
        far = None if self.far is None else length * (self.far - self.near)
        return CameraRays(origin, direction, far)

    def _around(
        self, px: Scalar, py: Scalar, lens_u: Scalar | None, lens_v: Scalar | None
    ) -> CameraRays:
        """Return panoramic rays."""
        assert self.panorama is not None and self.map is not None
        (low_x, step_x), (low_y, step_y) = self.map
        px *= step_x
        px += low_x
        py *= step_y
        py += low_y
        direction, inside = panoramas.direction(self.panorama, px, py)

        # Leave out what is outside of the picture
        index, camera = None, self
        if inside is not None and not inside.all():
            index = np.flatnonzero(inside)
            direction = direction.take(index, axis=1)
            lens_u, lens_v = take(lens_u, index), take(lens_v, index)
            camera = self._of(index)

        # Move the start about the eye, in the space of the panorama
        origin = None
        if self.aperture is not None:
            assert lens_u is not None and lens_v is not None
            point = opening(self.aperture, camera.lens[0][:2], lens_u, lens_v)
            origin = facing(normalize(direction), point)
        return camera.leaving(direction, origin)._replace(slot=index)

    def leaving(self, direction: Vec, origin: Vec | None) -> CameraRays:
        """Return panoramic rays that leave points (3, N) of the aperture, None for the eye.

        direction (3, N): where they would go from the eye, of unit length if there is an aperture.
        It may be overwritten; both are in the space of the panorama.
        """
        if origin is not None:
            direction -= origin * (F32(1) / self.lens[0][2])
            normalize(direction)
        if self.eye is not None:
            aside, direction = look(self.eye, direction)
            origin = aside if origin is None else origin + aside

        # Turn all into the world, and start at the near clipping sphere
        direction = normalize(self._turned(direction))
        start = direction * self.near
        start += self.start[0]
        if origin is not None:
            start += self._turned(origin)
        far = None
        if self.far is not None:
            far = np.full(direction.shape[1], self.far - self.near, F32)
        return CameraRays(start, direction, far)

    def _of(self, index: Index) -> "CompiledCamera":
        """Return the camera of the rays at `index`."""
        run, start, lens = (
            tuple(v if v.shape[1] == 1 else v.take(index, axis=1) for v in vectors)
            for vectors in (self.run, self.start, self.lens)
        )
        return replace(self, run=run, start=start, lens=lens)

    def _turned(self, vector: Vec) -> Vec:
        turned: Vec = self.run[0] * vector[0]
        turned += self.run[1] * vector[1]
        turned += self.run[2] * vector[2]
        return turned


def facing(direction: Vec, point: Vec) -> Vec:
    """Return points (3, N) of an aperture (2, N) that faces directions (3, N).

    Its first side lies in the plane of the direction and the x axis (Cycles).
    """
    x, y, z = direction
    sine = np.hypot(y, z)
    scale = np.reciprocal(np.maximum(sine, F32(1e-30)))
    y, z = y * scale, z * scale
    y += sine == 0
    first, second = point
    slope = x * first
    return np.stack([sine * first, z * second - slope * y, -slope * z - y * second])


def compile_camera(
    camera: Camera,
    settings: Settings,
    origin: NDArray[np.float64],
    box: NDArray[np.float64] | None,
) -> CompiledCamera:
    """Place the camera about the local `origin` (3,) [m]; `box` (2, 3) bounds the geometry."""
    left, right, bottom, top = camera.window
    axis_x, axis_y, axis_z = camera.to_world[:, :3].T
    eye = camera.to_world[:, 3] - origin
    width, height = (right - left) / camera.width, (top - bottom) / camera.height
    corner = axis_x * left + axis_y * bottom
    zero = np.zeros(3)
    if camera.projection == "PERSP":
        start, run = (eye, zero, zero), (corner - axis_z, axis_x * width, axis_y * height)
    elif camera.projection == "PANO":
        x, y, z = axes(camera)
        start, run = (eye, zero, zero), (x, y, z)
    else:
        start = (eye + corner - axis_z * camera.clip_start, axis_x * width, axis_y * height)
        run = (-axis_z, zero, zero)
    is_round = camera.panorama is not None
    is_pinhole = not is_round and camera.aperture is None and camera.eye is None
    keeps_near = not is_pinhole or _comes_near(camera, box)
    lens: tuple[Vec, ...] = ()
    sides: tuple[Vec, ...] = ()
    if camera.aperture is not None:
        lens = _columns((np.array([*camera.aperture.half, camera.aperture.focus]),))
        sides = () if is_round else _columns((axis_x, axis_y))
    return CompiledCamera(
        start=_columns(start),
        run=_columns(run),
        is_perspective=camera.projection == "PERSP",
        near=F32(camera.clip_start if keeps_near else 0.0),
        far=F32(camera.clip_end) if _reaches(camera, box) else None,
        offsets=_filter_offsets(settings.pixel_filter_type, settings.filter_width),
        sides=sides,
        lens=lens,
        aperture=camera.aperture,
        panorama=camera.panorama,
        map=np.array([(left, width), (bottom, height)], F32) if is_round else None,
        eye=camera.eye,
    )


def _columns(vectors: tuple[NDArray[np.float64], ...]) -> tuple[Vec, ...]:
    return tuple(vector.astype(F32)[:, None] for vector in vectors)


def _comes_near(camera: Camera, box: NDArray[np.float64] | None) -> bool:
    # Can anything lie between the eye and the near clipping plane, along the longest ray?
    if box is None or camera.projection != "PERSP":
        return True
    eye = camera.to_world[:, 3]
    distance = np.linalg.norm(eye - np.clip(eye, box[0], box[1]))
    longest = np.linalg.norm([np.abs(camera.window[:2]).max(), np.abs(camera.window[2:]).max(), 1])
    return bool(distance <= 1.01 * camera.clip_start * longest)


def _reaches(camera: Camera, box: NDArray[np.float64] | None) -> bool:
    # Does any corner of the scene lie behind the far clipping plane, or sphere?
    if box is None:
        return False
    corners = np.stack(np.meshgrid(*box.T)).reshape(3, -1) - camera.to_world[:, 3:]
    aside = 0.0 if camera.eye is None else abs(camera.eye.offset)
    shortest = 1.0  # of what lies along the axis, to how far rays go
    if camera.aperture is not None:
        radius = camera.aperture.radius * max(1.0, 1.0 / camera.aperture.ratio)
        aside += radius
        shortest = camera.aperture.focus / (camera.aperture.focus + radius)
    if camera.projection == "PANO" or camera.eye is not None:
        depth = np.linalg.norm(corners, axis=0) + aside
    else:
        depth = -(camera.to_world[:, 2] @ corners)
    return bool(depth.max() > camera.clip_end * shortest)


def pixel_filter(
    kind: str, width: float
) -> tuple[float, Callable[[NDArray[np.float64]], NDArray[np.float64]]]:
    """Return how far a pixel filter reaches [pixels], and its density there, of any scale."""
    # Blender's widths: Gaussian is cut at 1.5 widths, Blackman-Harris spans 2, Box is one pixel.
    reach = {"BOX": 0.5, "GAUSSIAN": 1.5 * width, "BLACKMAN_HARRIS": width}[kind]

    def density(x: NDArray[np.float64]) -> NDArray[np.float64]:
        if kind == "BOX":
            return np.ones_like(x)
        if kind == "GAUSSIAN":
            return np.exp(-2.0 * (3.0 * x / reach) ** 2)
        phase = np.pi * (x / reach + 1.0)
        return (
            0.35875
            - 0.48829 * np.cos(phase)
            + 0.14128 * np.cos(2 * phase)
            - 0.01168 * np.cos(3 * phase)
        )

    return reach, density


@lru_cache(maxsize=8)
def _filter_offsets(kind: str, width: float) -> NDArray[np.float32]:
    # Tabulate the middles of equal shares: one gather places a sample.
    reach, density = pixel_filter(kind, width)
    inverse = compile_inverse(density, -reach, reach, FILTER_ENTRIES)
    shares = (np.arange(FILTER_ENTRIES, dtype=F32) + F32(0.5)) / F32(FILTER_ENTRIES)
    return lookup(inverse, shares) + F32(0.5)
