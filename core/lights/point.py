"""point, spot + u, v -> a point on them, its gain and pdf.  Lamps that shine from a place.

With radius 0 they are true points.  With soft falloff they are a disk that faces the point lit,
else a sphere, both of radiance I / (pi r^2): a sphere gives I / d^2 at any distance, the disk a
little less when near.  The cone of a spot is measured in its own scaled space (Cycles).
"""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, INV_PI, Scalar, Vec, dot, frame
from ..sampling.warp import concentric_disk, uniform_cone
from ..scene import Lamp
from .kind import (
    ALL_SIDES,
    ONE_SIDE,
    TINY,
    Hull,
    Kind,
    LampKind,
    Region,
    Rows,
    Sampled,
    Source,
    around,
    brightness,
    everywhere,
    missed,
    position,
    reciprocal,
)

# Below this a radius is 0 [m]: its square would leave single precision
SMALLEST_RADIUS = 1e-9

# Parameters: centre 0:3, radius, and for spots what follows
RADIUS = 3
TO_LOCAL, COS_CONE, SMOOTH = 4, 13, 14
GRAZING, PI = F32(1e-6), F32(np.pi)


def classify(lamp: Lamp) -> LampKind | None:
    """Return the kind of a point or spot lamp, None for a spot that is squeezed flat."""
    if lamp.kind == "SPOT" and _to_local(lamp) is None:
        return None
    table = SPOTS if lamp.kind == "SPOT" else POINTS
    return table[
        "point" if lamp.radius < SMALLEST_RADIUS else "disk" if lamp.soft_falloff else "sphere"
    ]


def _to_local(lamp: Lamp) -> NDArray[np.float64] | None:
    """Return the matrix (3, 3) that turns world directions to those of the lamp, up to scale."""
    matrix = lamp.to_world[:, :3]
    size = np.abs(matrix).max()
    if not size > 0.0 or not abs(np.linalg.det(matrix / size)) > 1e-18:
        return None
    return np.linalg.inv(matrix / size)


def _compile_point(lamp: Lamp, origin: NDArray[np.float64]) -> list[float]:
    return [*map(float, position(lamp, origin)), float(lamp.radius)]


def _compile_spot(lamp: Lamp, origin: NDArray[np.float64]) -> list[float]:
    to_local = _to_local(lamp)
    assert to_local is not None
    cosine = np.cos(0.5 * lamp.spot_angle)
    smooth = 1.0 / max((1.0 - cosine) * lamp.spot_blend, 1e-12)
    to_local = to_local / np.abs(to_local).max()
    return [*_compile_point(lamp, origin), *map(float, to_local.ravel()), float(cosine), smooth]


def _source_point(lamp: Lamp, origin: NDArray[np.float64]) -> Source:
    spread = 0.5 * lamp.radius**2
    return Source(position(lamp, origin), spread, brightness(lamp), np.zeros(3), ALL_SIDES)


def _source_spot(lamp: Lamp, origin: NDArray[np.float64]) -> Source:
    axis = -lamp.to_world[:, 2] / np.linalg.norm(lamp.to_world[:, 2])
    sides = ONE_SIDE if lamp.spot_angle <= np.pi else ALL_SIDES
    return _source_point(lamp, origin)._replace(axis=axis, sides=sides)


def _hull(lamp: Lamp, origin: NDArray[np.float64]) -> Hull | None:
    if lamp.radius < SMALLEST_RADIUS:
        return None
    corners = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    halves = [half for a, b, c, d in sides for half in ((a, b, c), (a, c, d))]
    return position(lamp, origin) + corners * lamp.radius * 1.001, np.array(halves, np.int32)


def _region_spot(lamp: Lamp, origin: NDArray[np.float64]) -> Region | None:
    """Return the half spaces around the cones from all points of the lamp."""
    to_local = _to_local(lamp)
    half = 0.5 * lamp.spot_angle
    if to_local is None or half > 0.5 * np.pi:
        return None

    # Ways to the lamp that point along its +z, and lie within planes that touch the cone
    x, y = around()
    planes = np.hstack([-np.cos(half) * x, -np.cos(half) * y, np.full(x.shape, np.sin(half))])
    normals = -np.vstack([planes, [[0.0, 0.0, 1.0]]]) @ to_local
    lengths = np.linalg.norm(normals, axis=1)
    normals /= lengths[:, None]
    return Region(normals, normals @ position(lamp, origin) - lamp.radius)


def _falloff(rows: Rows, to_light: Vec) -> Scalar:
    """Return the share (N,) of a spot's light that goes back along `to_light` (3, N)."""
    x = dot(rows[TO_LOCAL : TO_LOCAL + 3], to_light)
    y = dot(rows[TO_LOCAL + 3 : TO_LOCAL + 6], to_light)
    z = dot(rows[TO_LOCAL + 6 : TO_LOCAL + 9], to_light)
    cosine = z / np.maximum(np.sqrt(x * x + y * y + z * z), TINY)
    step = (cosine - rows[COS_CONE]) * rows[SMOOTH]
    step = np.minimum(np.maximum(step, F32(0)), F32(1))
    share: Scalar = step * step * (F32(3) - F32(2) * step)
    return share


def _sample_point(rows: Rows, point: Vec, u: Scalar, v: Scalar, with_pdf: bool = False) -> Sampled:
    """Go to the light: nothing to choose."""
    to_light = rows[:3] - point
    squared = dot(to_light, to_light)
    gain = np.reciprocal(np.maximum(squared, TINY))
    pdf = np.zeros_like(gain) if with_pdf else None
    return Sampled(to_light, gain, pdf, np.sqrt(squared, out=squared))


def _sample_disk(rows: Rows, point: Vec, u: Scalar, v: Scalar, with_pdf: bool = False) -> Sampled:
    """Sample the disk that faces the point, by area; unbiased."""
    to_light = rows[:3] - point
    squared = dot(to_light, to_light)
    distance = np.sqrt(squared)
    tangent, bitangent = frame(np.divide(to_light, np.maximum(distance, TINY)))

    # The disk is square to the way to its centre: Pythagoras gives the distance
    x, y = concentric_disk(u, v) * rows[RADIUS]
    tangent *= x
    bitangent *= y
    to_light += tangent
    to_light += bitangent
    squared += x * x + y * y
    length = np.sqrt(squared)
    gain = np.divide(distance, np.maximum(squared * length, TINY))
    pdf = reciprocal(gain * (PI * rows[RADIUS] * rows[RADIUS])) if with_pdf else None
    return Sampled(to_light, gain, pdf, length)


def _cone(rows: Rows, squared: Scalar) -> tuple[Scalar, Scalar]:
    """Return 1 - cos of the half angle [1] of spheres, and 1 + cos, from outside or on them."""
    sine_squared = np.minimum(rows[RADIUS] * rows[RADIUS] / np.maximum(squared, TINY), F32(1))
    plus = F32(1) + np.sqrt(F32(1) - sine_squared)
    return np.maximum(sine_squared / plus, TINY), plus


def _sample_sphere(rows: Rows, point: Vec, u: Scalar, v: Scalar, with_pdf: bool = False) -> Sampled:
    """Sample the solid angle of the sphere, all directions from inside of it; unbiased."""
    axis = rows[:3] - point
    squared = dot(axis, axis)
    distance = np.sqrt(squared)
    axis /= np.maximum(distance, TINY)
    axis[2] += distance == 0  # any axis will do at the centre
    radius = np.broadcast_to(rows[RADIUS], squared.shape)
    inside = squared <= radius * radius

    # Choose a direction in the cone, or in all space
    minus, plus = _cone(rows, squared)
    minus = np.where(inside, F32(2), minus)
    x, y, cosine = uniform_cone(u, v, minus)
    tangent, bitangent = frame(axis)
    to_light = axis * cosine
    tangent *= x
    bitangent *= y
    to_light += tangent
    to_light += bitangent

    # Go to the sphere: to its near side from outside, to its far side from inside
    across = distance * np.sqrt(x * x + y * y)
    half = np.sqrt(np.maximum((radius - across) * (radius + across), F32(0)))
    length = distance * cosine + np.where(inside, half, -half)
    to_light *= length
    pdf = F32(0.5) * INV_PI / minus if with_pdf else None
    gain = F32(2) / np.maximum(plus * squared, TINY)
    gain = np.where(inside, F32(4) / (radius * radius), gain)
    return Sampled(to_light, gain, pdf, np.maximum(length, F32(0)))


def _intersect_disk(rows: Rows, origin: Vec, direction: Vec) -> tuple[Scalar, Scalar, Scalar]:
    """Meet the disk that faces the origin of the ray."""
    axis = rows[:3] - origin
    squared = dot(axis, axis)
    distance = np.sqrt(squared)
    cosine = dot(axis, direction) / np.maximum(distance, TINY)
    t = np.divide(distance, np.maximum(cosine, GRAZING))
    across: Vec = direction * t
    across -= axis
    area = rows[RADIUS] * rows[RADIUS]
    hit = (dot(across, across) < area) & (cosine > 0)
    density = INV_PI / area
    gain = np.where(hit, density, F32(0))
    pdf = np.divide(gain * (t * t), np.maximum(cosine, GRAZING))
    return np.where(hit, t, F32(np.inf)), gain, pdf


def _intersect_sphere(rows: Rows, origin: Vec, direction: Vec) -> tuple[Scalar, Scalar, Scalar]:
    """Meet the sphere: its near side from outside, its far side from inside."""
    axis = rows[:3] - origin
    squared = dot(axis, axis)
    area = rows[RADIUS] * rows[RADIUS]
    inside = squared <= area
    along = dot(axis, direction)
    across = axis - direction * along
    gap = area - dot(across, across)
    half = np.sqrt(np.maximum(gap, F32(0)))
    hit = (gap >= 0) & (inside | (along > 0))
    t = np.maximum(along + np.where(inside, half, -half), F32(0))
    minus = np.where(inside, F32(2), _cone(rows, squared)[0])
    pdf = F32(0.5) * INV_PI / minus
    gain = np.where(hit, INV_PI / area, F32(0))
    return np.where(hit, t, F32(np.inf)), gain, pdf * hit


def _outside(rows: Rows, point: Vec) -> Scalar:
    axis = rows[:3] - point
    outside: Scalar = dot(axis, axis) > rows[RADIUS] * rows[RADIUS]
    return outside


def _sample_spot(
    rows: Rows,
    point: Vec,
    u: Scalar,
    v: Scalar,
    with_pdf: bool = False,
    *,
    shape: Kind,
    ball: bool,
) -> Sampled:
    """Sample the shape, dimmed by the angle to the axis; no cone inside of a sphere (Cycles)."""
    sampled = shape.sample(rows, point, u, v, with_pdf)
    falloff = _falloff(rows, sampled.to_light)
    gain = sampled.gain
    gain *= np.where(_outside(rows, point), falloff, F32(1)) if ball else falloff
    return sampled


def _intersect_spot(
    rows: Rows, origin: Vec, direction: Vec, *, shape: Kind, ball: bool
) -> tuple[Scalar, Scalar, Scalar]:
    """Meet the shape, dimmed by the angle to the axis; no cone inside of a sphere (Cycles)."""
    t, gain, pdf = shape.intersect(rows, origin, direction)
    falloff = _falloff(rows, direction)
    gain *= np.where(_outside(rows, origin), falloff, F32(1)) if ball else falloff
    return t, gain, pdf


def _intersect_point(rows: Rows, origin: Vec, direction: Vec) -> tuple[Scalar, Scalar, Scalar]:
    return missed(origin, direction)


def _spot(shape: LampKind, ball: bool = False) -> LampKind:
    return replace(
        shape,
        name=f"spot {shape.name}",
        compile=_compile_spot,
        sample=partial(_sample_spot, shape=shape, ball=ball),
        intersect=partial(_intersect_spot, shape=shape, ball=ball),
        source=_source_spot,
        region=_region_spot,
    )


POINT = LampKind(
    "point", _sample_point, _intersect_point, _compile_point, _source_point, _hull, everywhere
)
DISK = replace(POINT, name="disk", sample=_sample_disk, intersect=_intersect_disk)
SPHERE = replace(POINT, name="sphere", sample=_sample_sphere, intersect=_intersect_sphere)
POINTS = {"point": POINT, "disk": DISK, "sphere": SPHERE}
SPOTS = {"point": _spot(POINT), "disk": _spot(DISK), "sphere": _spot(SPHERE, ball=True)}
