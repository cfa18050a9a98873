"""pixels -> rays.  Where a camera ray starts and where it goes.

A ray is linear in its raster position, so three vectors are all there is to a camera.  The pixel
filter is importance-sampled: a sample's position is drawn from the filter and all samples of a
pixel weigh the same (Ernst et al. 2006, "Filter Importance Sampling").
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .arrays import F32, Scalar, Vec, dot, normalize
from .sampling.tables import compile_inverse, lookup
from .scene import Camera
from .settings import Settings

FILTER_ENTRIES = 1 << 13


@dataclass(frozen=True, eq=False)
class CompiledCamera:
    """Rays start at start_0 + x start_x + y start_y and run along the same of `run`, (3, 1) each.

    x, y are raster positions from the lower left corner [pixels]; `near` and `far` [m] are
    distances along the view axis, near 0 if the scene does not come that near, far None if it
    does not reach that far; `offsets` is the inverse of the pixel filter's distribution [pixels].
    """

    start: tuple[Vec, Vec, Vec]
    run: tuple[Vec, Vec, Vec]
    is_perspective: bool
    near: np.float32
    far: np.float32 | None
    offsets: NDArray[np.float32]

    def rays(self, x: Scalar, y: Scalar, u: Scalar, v: Scalar) -> tuple[Vec, Vec, Scalar | None]:
        """Return origin (3, N) or (3, 1), unit direction (3, N) and reach (N,) or None of rays.

        x, y (N,) are the lower left corners of pixels; u, v in [0, 1) place the sample.
        """
        px = self.offsets.take((u * F32(FILTER_ENTRIES)).astype(np.int32), mode="clip")
        py = self.offsets.take((v * F32(FILTER_ENTRIES)).astype(np.int32), mode="clip")
        px += x
        py += y
        if not self.is_perspective:
            origin = self.start[1] * px
            origin += self.start[2] * py
            origin += self.start[0]
            direction = np.empty_like(origin)
            direction[:] = self.run[0]
            far = None if self.far is None else np.full(x.shape, self.far - self.near, F32)
            return origin, direction, far

        # The raster direction has length 1 along the view axis: near and far are multiples of it.
        direction = self.run[1] * px
        direction += self.run[2] * py
        direction += self.run[0]
        origin = self.start[0]
        if self.near > 0:
            origin = origin + direction * self.near
        if self.far is None:
            return origin, normalize(direction), None
        length = np.sqrt(dot(direction, direction))
        return origin, normalize(direction), length * (self.far - self.near)


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
    step_x = axis_x * (right - left) / camera.width
    step_y = axis_y * (top - bottom) / camera.height
    corner = axis_x * left + axis_y * bottom
    zero = np.zeros(3)
    if camera.projection == "PERSP":
        start, run = (eye, zero, zero), (corner - axis_z, step_x, step_y)
    else:
        start = (eye + corner - axis_z * camera.clip_start, step_x, step_y)
        run = (-axis_z, zero, zero)
    return CompiledCamera(
        start=_columns(start),
        run=_columns(run),
        is_perspective=camera.projection == "PERSP",
        near=F32(camera.clip_start if _comes_near(camera, box) else 0.0),
        far=F32(camera.clip_end) if _reaches(camera, box) else None,
        offsets=_filter_offsets(settings),
    )


def _columns(vectors: tuple[NDArray[np.float64], ...]) -> tuple[Vec, Vec, Vec]:
    a, b, c = (vector.astype(F32)[:, None] for vector in vectors)
    return a, b, c


def _comes_near(camera: Camera, box: NDArray[np.float64] | None) -> bool:
    # Can anything lie between the eye and the near clipping plane, along the longest ray?
    if box is None or camera.projection != "PERSP":
        return True
    eye = camera.to_world[:, 3]
    distance = np.linalg.norm(eye - np.clip(eye, box[0], box[1]))
    longest = np.linalg.norm([np.abs(camera.window[:2]).max(), np.abs(camera.window[2:]).max(), 1])
    return bool(distance <= 1.01 * camera.clip_start * longest)


def _reaches(camera: Camera, box: NDArray[np.float64] | None) -> bool:
    # Does any corner of the scene lie behind the far clipping plane?
    if box is None:
        return False
    corners = np.stack(np.meshgrid(*box.T)).reshape(3, -1)
    depth = -(camera.to_world[:, 2] @ (corners - camera.to_world[:, 3:]))
    return bool(depth.max() > camera.clip_end)


def _filter_offsets(settings: Settings) -> NDArray[np.float32]:
    # Blender's widths: Gaussian is cut at 1.5 widths, Blackman-Harris spans 2, Box is one pixel.
    width = settings.filter_width
    kind = settings.pixel_filter_type
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

    # Tabulate the middles of equal shares: one gather places a sample.
    inverse = compile_inverse(density, -reach, reach, FILTER_ENTRIES)
    shares = (np.arange(FILTER_ENTRIES, dtype=F32) + F32(0.5)) / F32(FILTER_ENTRIES)
    return lookup(inverse, shares) + F32(0.5)
