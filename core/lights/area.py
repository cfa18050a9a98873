"""rectangle, ellipse + u, v -> a point on them, its gain and pdf.  Area lights with spread.

They emit on one side, uniformly over their area.  Far points sample the area.  Near ones sample the
solid angle of the rectangle, where area sampling would be noisy; an ellipse then rejects what falls
into the corners.  The spread is a grid of slats in front of the lamp (Cycles, D10594).
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar, Vec, add_scaled, dot
from ..sampling.warp import concentric_disk
from ..scene import Lamp
from . import spherical
from .kind import (
    ONE_SIDE,
    TINY,
    Hull,
    LampKind,
    Region,
    Rows,
    Sampled,
    Source,
    around,
    brightness,
    missed,
    position,
    reciprocal,
)

# Nearer than this many diagonals to its centre, points sample the solid angle
NEAR = 1.0
# Below this single precision makes the solid angle wrong by more than 2e-4 [sr]
SMALLEST_ANGLE = F32(1e-3)
HALF, ONE = F32(0.5), F32(1)
GRAZING, CLOSEST, BIG = F32(1e-8), F32(1e-24), F32(1e6)


class _Shape(NamedTuple):
    """A lamp's rectangle in the world: full sides u and v, and its normal n, all (3,)."""

    u: NDArray[np.float64]
    v: NDArray[np.float64]
    n: NDArray[np.float64]
    area: float


def _shape(lamp: Lamp) -> _Shape | None:
    """Return the lamp's rectangle, None if it is degenerate; shear is taken out."""
    matrix = lamp.to_world[:, :3]
    u, v = matrix[:, 0] * lamp.size[0], matrix[:, 1] * lamp.size[1]
    width, height = np.linalg.norm(u), np.linalg.norm(v)
    n = _cross(u, v)
    n *= -1.0 if n @ matrix[:, 2] > 0.0 else 1.0
    length = np.linalg.norm(n)
    if not (matrix[:, 2].any() and length > 1e-6 * width * height > 0.0):
        return None
    n /= length
    across = _cross(n, u)
    v = across * (height / width) * (1.0 if across @ v > 0.0 else -1.0)
    area = width * height * (np.pi / 4 if lamp.ellipse else 1.0)
    return _Shape(u, v, n, float(area))


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    # For three numbers numpy's own takes ten times as long, and there may be 1,000 lamps
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _has_no_slats(lamp: Lamp) -> bool:
    # Blender's 180 degrees are in single precision
    return bool(F32(lamp.spread) >= F32(np.pi))


def classify(lamp: Lamp) -> LampKind | None:
    """Return the kind of an area lamp, None if it has no area."""
    if _shape(lamp) is None:
        return None
    if lamp.spread <= 0.0:
        return BEAM_ELLIPSE if lamp.ellipse else BEAM
    if _has_no_slats(lamp):
        return ELLIPSE if lamp.ellipse else RECTANGLE
    return ELLIPSE_SPREAD if lamp.ellipse else RECTANGLE_SPREAD


# Parameters: centre 0:3, side u 3:6, side v 6:9, normal 9:12, and the numbers below.
# "Scaled" is in units of the diagonal: the solid angle has no scale, and nothing overflows.
AREA, NEAR_SQUARED = 12, 13
INV_UU, INV_VV = 14, 15  # 1/|u|^2, 1/|v|^2: position along the side, its centre 0, its ends +-1/2
WIDTH, HEIGHT, INV_DIAGONAL = 16, 17, 18  # scaled, scaled, 1/m
TAN_SPREAD, SPREAD_GAIN = 19, 20


def _compile(lamp: Lamp, origin: NDArray[np.float64]) -> list[float]:
    shape = _shape(lamp)
    assert shape is not None
    uu, vv = shape.u @ shape.u, shape.v @ shape.v
    diagonal = np.sqrt(uu + vv)
    sizes = [np.sqrt(uu) / diagonal, np.sqrt(vv) / diagonal, 1.0 / diagonal]
    row = [*position(lamp, origin), *shape.u, *shape.v, *shape.n, shape.area]
    row += [(NEAR * diagonal) ** 2, 1.0 / uu, 1.0 / vv, *sizes]

    # Integral of cos (1 - tan / tan(half)) over the cone is 1; Cycles' series where it is narrow
    half = 0.5 * max(lamp.spread, 0.0)
    if lamp.spread > 0.0 and not _has_no_slats(lamp):
        row += [np.tan(half), 1.0 / (np.tan(half) - half) if half > 0.05 else 3.0 / half**3]
    return [float(value) for value in row]


def _source(lamp: Lamp, origin: NDArray[np.float64]) -> Source:
    shape = _shape(lamp)
    assert shape is not None
    spread = (shape.u @ shape.u + shape.v @ shape.v) / (16.0 if lamp.ellipse else 12.0)
    strength = shape.area * brightness(lamp)
    return Source(position(lamp, origin), float(spread), strength, shape.n, ONE_SIDE)


def _hull(lamp: Lamp, origin: NDArray[np.float64]) -> Hull | None:
    shape = _shape(lamp)
    if shape is None or lamp.spread <= 0.0:
        return None
    corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    vertices = position(lamp, origin) + [a * shape.u + b * shape.v for a, b in corners]
    return vertices, np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def _region(lamp: Lamp, origin: NDArray[np.float64]) -> Region | None:
    """Return the half space that it faces, and those around what its slats let pass."""
    shape = _shape(lamp)
    assert shape is not None
    normals, lateness = shape.n[None], np.zeros(1)
    if not _has_no_slats(lamp):
        half = 0.5 * max(lamp.spread, 0.0)
        x, y = around()
        aside = x * (shape.u / np.linalg.norm(shape.u)) + y * (shape.v / np.linalg.norm(shape.v))
        normals = np.vstack([normals, np.sin(half) * shape.n - np.cos(half) * aside])
        extent = 0.5 * (np.abs(aside @ shape.u) + np.abs(aside @ shape.v))
        lateness = np.concatenate([lateness, np.cos(half) * extent])
    return Region(normals, normals @ position(lamp, origin) - lateness)


def _local(rows: Rows, vector: Vec) -> tuple[Scalar, Scalar]:
    """Return the coordinates of a vector along the sides, in units of the sides."""
    return dot(rows[3:6], vector) * rows[INV_UU], dot(rows[6:9], vector) * rows[INV_VV]


def _window(
    rows: Rows, base: Vec, height: Scalar, spread: bool
) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Return the bounds s0, s1, t0, t1 of the part of the rectangle that sends light to a point."""
    if not spread:
        one = np.full(1, HALF)
        return -one, one, -one, one
    s, t = _local(rows, base)
    z = height * rows[INV_DIAGONAL] * rows[TAN_SPREAD]
    a, b = z / rows[WIDTH], z / rows[HEIGHT]
    s0, t0 = np.maximum(-a - s, -HALF), np.maximum(-b - t, -HALF)
    return s0, np.maximum(np.minimum(a - s, HALF), s0), t0, np.maximum(np.minimum(b - t, HALF), t0)


def _part(
    rows: Rows, base: Vec, height: Scalar, ellipse: bool
) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Return centre and size, s, t, ds, dt, of what far points sample of a lamp with a spread.

    That is the window of a rectangle; of an ellipse, itself or the lit circle if that is smaller.
    """
    if not ellipse:
        s0, s1, t0, t1 = _window(rows, base, height, True)
        return HALF * (s0 + s1), HALF * (t0 + t1), s1 - s0, t1 - t0
    s, t = _local(rows, base)
    z = np.minimum(F32(2) * height * rows[INV_DIAGONAL] * rows[TAN_SPREAD], BIG)
    a, b = z / rows[WIDTH], z / rows[HEIGHT]
    circle = a * b < ONE
    zero = F32(0)
    return (
        np.where(circle, -s, zero),
        np.where(circle, -t, zero),
        np.where(circle, a, ONE),
        np.where(circle, b, ONE),
    )


def _inside(s: Scalar, t: Scalar) -> Scalar:
    """Return 1 in the ellipse and 0 outside."""
    inside: Scalar = (s * s + t * t <= F32(0.25 * (1 + 1e-5))).astype(F32)
    return inside


def _attenuation(rows: Rows, s: Scalar, t: Scalar, height: Scalar) -> Scalar:
    """Return the share of radiance that passes the slats, s and t counted from the point lit."""
    x, y, z = s * rows[WIDTH], t * rows[HEIGHT], height * rows[INV_DIAGONAL]
    tangent = np.sqrt(x * x + y * y) / np.maximum(z, spherical.SMALL)
    passed: Scalar = np.maximum(rows[TAN_SPREAD] - tangent, F32(0)) * rows[SPREAD_GAIN]
    return passed


class _Near(NamedTuple):
    """The points so near that they sample the solid angle, and what they see; scaled."""

    points: Index
    x: Scalar  # of the centre of the lamp
    y: Scalar
    width: Scalar  # of the lamp
    height: Scalar
    seen: spherical.Rectangle


def _near(rows: Rows, base: Vec, height: Scalar, spread: bool) -> _Near | None:
    """Return the points so near that they sample the solid angle; None if there are none."""
    points = np.flatnonzero((dot(base, base) < rows[NEAR_SQUARED]) & (height > 0))
    if not points.size:
        return None

    # See the window of the lamp from there
    if rows.shape[1] > 1:
        rows = rows.take(points, axis=1)
    base, height = base.take(points, axis=1), height.take(points)
    s, t = _local(rows, base)
    s0, s1, t0, t1 = _window(rows, base, height, spread)
    w, h = rows[WIDTH], rows[HEIGHT]
    x, y = s * w, t * h
    z = height * rows[INV_DIAGONAL]
    seen = spherical.rectangle(x + s0 * w, x + s1 * w, y + t0 * h, y + t1 * h, z)

    # Leave those that see too little of it
    use = np.flatnonzero(seen.angle > SMALLEST_ANGLE)
    if use.size == points.size:
        return _Near(points, x, y, w, h, seen)
    if rows.shape[1] > 1:
        w, h = w.take(use), h.take(use)
    return _Near(points.take(use), x.take(use), y.take(use), w, h, seen.take(use))


def _sample(
    rows: Rows,
    point: Vec,
    u: Scalar,
    v: Scalar,
    with_pdf: bool = False,
    *,
    ellipse: bool,
    spread: bool,
) -> Sampled:
    """Sample a point of a lamp; unbiased."""
    base = rows[:3] - point
    height = np.maximum(-dot(rows[9:12], base), F32(0))

    # Choose by area: position from the centre in units of the sides, and the area it stands for
    s, t = concentric_disk(u, v) * HALF if ellipse else (u - HALF, v - HALF)
    area = rows[AREA]
    if spread:
        middle_s, middle_t, size_s, size_t = _part(rows, base, height, ellipse)
        s, t = middle_s + size_s * s, middle_t + size_t * t
        area = area * size_s * size_t

    # Choose again, by solid angle, where the point is near
    near = _near(rows, base, height, spread)
    if near:
        x, y = spherical.sample(near.seen, u.take(near.points), v.take(near.points))
        s[near.points] = (x - near.x) / near.width
        t[near.points] = (y - near.y) / near.height

    # Lead to that point, and weigh it by the solid angle it stands for
    to_light = rows[3:6] * s
    add_scaled(to_light, rows[6:9], t)
    to_light += base
    squared = dot(to_light, to_light)
    distance = np.sqrt(squared)
    weight = height * area
    squared *= distance
    weight /= np.maximum(squared, TINY, out=squared)
    if near:
        weight[near.points] = near.seen.angle
    pdf = reciprocal(weight) if with_pdf else None

    # Take away what the slats hide, and the corners around the ellipse
    if spread:
        middle_s, middle_t = _local(rows, base)
        weight *= _attenuation(rows, middle_s + s, middle_t + t, height)
    if ellipse and (spread or near):
        weight *= _inside(s, t)
    return Sampled(to_light, weight, pdf, distance)


def _intersect(
    rows: Rows, origin: Vec, direction: Vec, *, ellipse: bool, spread: bool
) -> tuple[Scalar, Scalar, Scalar]:
    """Meet the lit side of a lamp."""
    base = rows[:3] - origin
    height = np.maximum(-dot(rows[9:12], base), F32(0))
    cosine = np.maximum(-dot(rows[9:12], direction), F32(0))

    # Find where the ray crosses the plane, in units of the sides
    distance = height / np.maximum(cosine, GRAZING)
    s, t = _local(rows, direction * distance - base)
    hit = (_inside(s, t) > 0) if ellipse else (np.abs(s) <= HALF) & (np.abs(t) <= HALF)
    hit &= (cosine > GRAZING) & (height > 0)

    # Find the density with which `sample` would have come here
    area = rows[AREA]
    if spread:
        _, _, size_s, size_t = _part(rows, base, height, ellipse)
        area = area * size_s * size_t
    weight = cosine * area / np.maximum(distance * distance, CLOSEST)
    near = _near(rows, base, height, spread)
    if near:
        weight[near.points] = near.seen.angle

    # See the radiance that the slats let pass
    gain = hit.astype(F32)
    if spread:
        middle_s, middle_t = _local(rows, base)
        gain *= _attenuation(rows, middle_s + s, middle_t + t, height)
    return np.where(hit, distance, F32(np.inf)), gain, reciprocal(weight * hit)


def _sample_beam(
    rows: Rows,
    point: Vec,
    u: Scalar,
    v: Scalar,
    with_pdf: bool = False,
    *,
    ellipse: bool,
) -> Sampled:
    """Go straight to a lamp of spread 0: parallel light, irradiance pi times its radiance."""
    base = rows[:3] - point
    height = -dot(rows[9:12], base)
    s, t = _local(rows, base)
    lit = _inside(s, t) if ellipse else ((np.abs(s) <= HALF) & (np.abs(t) <= HALF)).astype(F32)
    lit *= height > 0
    pdf = np.zeros_like(lit) if with_pdf else None
    return Sampled(-height * rows[9:12], F32(np.pi) * lit, pdf, np.abs(height))


def _intersect_beam(rows: Rows, origin: Vec, direction: Vec) -> tuple[Scalar, Scalar, Scalar]:
    return missed(origin, direction)


def _kind(name: str, ellipse: bool, spread: bool) -> LampKind:
    return LampKind(
        name,
        partial(_sample, ellipse=ellipse, spread=spread),
        partial(_intersect, ellipse=ellipse, spread=spread),
        _compile,
        _source,
        _hull,
        _region,
    )


RECTANGLE = _kind("rectangle", False, False)
RECTANGLE_SPREAD = _kind("rectangle with spread", False, True)
ELLIPSE = _kind("ellipse", True, False)
ELLIPSE_SPREAD = _kind("ellipse with spread", True, True)
BEAM = replace(
    RECTANGLE, name="beam", sample=partial(_sample_beam, ellipse=False), intersect=_intersect_beam
)
BEAM_ELLIPSE = replace(BEAM, name="round beam", sample=partial(_sample_beam, ellipse=True))
