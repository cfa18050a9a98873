"""glowing triangle + u, v -> a point on it, its gain and pdf.  Meshes that emit, as lights.

They emit on both sides, uniformly over their area; which sides are *sampled* is a choice of the
material, the other is left to rays that run into it.  Far points sample the area, near ones the
solid angle: Peters 2021, "BRDF Importance Sampling for Polygonal Lights", section 3, whose half
angles need no arccosine; here in terms of height x area and of barycentrics, so that neither small
triangles nor needles lose digits.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, TWO_PI, Ids, Index, Scalar, Vec, cross, dot
from ..sampling.warp import uniform_hemisphere, uniform_triangle
from .kind import BOTH_SIDES, ONE_SIDE, TINY, Kind, Rows, Sampled, reciprocal
from .tree import Sources

# Nearer to its first corner than this many of its longest edge, points sample the solid angle
NEAR = 1.5

# Half solid angles [sr] above which the half space is sampled; for points with heights of less
# than 1/1000 of the size, where single precision goes
LIMIT, FLAT_LIMIT, FLAT = F32(0.8 * np.pi), F32(0.4 * np.pi), F32(1e-6)

# Which side is sampled: that to which the normal points, the other, or both
FRONT, BACK, FRONT_BACK = 1, 2, 3

# Parameters: a corner 0:3, the edges to the next 3:6 and to the last 6:9, unit normal 9:12, and
AREA, NEAR_SQUARED, SIDE = 12, 13, 14  # SIDE is 1, -1 or 0, for both
ROWS = 15

ZERO, HALF, ONE, TWO = F32(0), F32(0.5), F32(1), F32(2)
CLOSEST = F32(1e-15)  # a length whose squares fit


@dataclass(frozen=True, eq=False)
class Emitters:
    """Which of the scene's triangles are lights.

    triangle (M,): their numbers; radiance (3, M) [W/(sr m2)]; seen_by (M,) mask bits; sides (M,):
    FRONT, BACK or FRONT_BACK; receivers and blockers (M,) uint64, light linking masks.
    """

    triangle: Ids
    radiance: Vec
    seen_by: Ids
    sides: Ids
    receivers: NDArray[np.uint64]
    blockers: NDArray[np.uint64]


def compile_rows(
    vertices: NDArray[np.float32], corners: NDArray[np.int32], emitters: Emitters
) -> Rows:
    """Return the parameters (P, M) of the triangles; edges are differences in float64.

    vertices (V, 3) about the local origin [m] and corners (F, 3) are those of the scene.
    """
    corners = corners.take(emitters.triangle, axis=0)
    a, b, c = (vertices.take(column, axis=0).T.astype(np.float64) for column in corners.T)
    b -= a
    c -= a
    normal = np.empty_like(a)
    normal[0] = b[1] * c[2] - b[2] * c[1]
    normal[1] = b[2] * c[0] - b[0] * c[2]
    normal[2] = b[0] * c[1] - b[1] * c[0]
    length = np.sqrt(dot(normal, normal))
    longest = np.maximum(np.maximum(dot(b, b), dot(c, c)), dot(b - c, b - c))

    rows = np.empty((ROWS, a.shape[1]), F32)
    rows[0:3], rows[3:6], rows[6:9] = a, b, c
    rows[9:12] = normal / np.maximum(length, 1e-300)
    rows[AREA] = 0.5 * length
    rows[NEAR_SQUARED] = NEAR**2 * longest
    rows[SIDE] = (emitters.sides == FRONT).astype(F32) - (emitters.sides == BACK)
    return rows


def sources(rows: Rows, colour: Vec) -> Sources:
    """Return what choosing triangles is based on."""
    one, other = rows[3:6].astype(np.float64), rows[6:9].astype(np.float64)
    square = (one * one + other * other - one * other).sum(axis=0)
    side = rows[SIDE].astype(np.float64)
    return Sources(
        rows[0:3] + (one + other) / 3,
        square / 18,
        rows[AREA] * np.abs(colour).mean(axis=0, dtype=np.float64),
        (rows[9:12] * np.where(side == 0, 1.0, side)).astype(np.float64),
        np.where(side == 0, BOTH_SIDES, ONE_SIDE).astype(np.int32),
    )


class _Near(NamedTuple):
    """The points that sample the solid angle, and what they see."""

    points: Index  # which of all
    rows: Rows
    base: Vec
    height: Scalar
    seen: "_Angle"
    wide: Index  # which of `points` sample the half space instead
    angle: Scalar  # [sr] that is sampled


class _Angle(NamedTuple):
    """Spherical triangles: of the directions a, b, c to the corners, with these distances."""

    a: Scalar
    b: Scalar
    c: Scalar
    ab_plus: Scalar  # 1 + cos of the arc ab
    others: Scalar  # cos of the arc ac + cos of bc
    volume: Scalar  # a . (b x c)
    half: Scalar  # half the solid angle [sr]


def _height(rows: Rows, base: Vec) -> Scalar:
    """Return the height (N,) above the plane of the triangle, 0 on sides that are not sampled."""
    below = dot(rows[9:12], base)
    height = np.abs(below)
    height *= below * rows[SIDE] <= ZERO
    return height


def _near(rows: Rows, base: Vec, height: Scalar) -> _Near | None:
    """Return the points so near that they sample the solid angle; None if there are none."""
    points = np.flatnonzero(dot(base, base) < rows[NEAR_SQUARED])
    if not points.size:
        return None
    if rows.shape[1] > 1:
        rows = rows.take(points, axis=1)
    base, height = base.take(points, axis=1), height.take(points)
    seen = _angle(rows, base, height)

    # Close above a triangle its corners' directions say little: take the half space
    limit = np.where(height * height < FLAT * rows[NEAR_SQUARED], FLAT_LIMIT, LIMIT)
    wide = np.flatnonzero(seen.half > limit)
    angle = TWO * seen.half
    angle[wide] = TWO_PI
    return _Near(points, rows, base, height, seen, wide, angle)


def _one_plus_cosine(a: Vec, edge: Vec, b: Vec, scale: Scalar) -> Scalar:
    """Return 1 + cos of the angle between a and b = a + edge; scale is 1 / (|a| |b|).

    Where they are nearly opposite, as seen from beside the edge, it is sine^2 / (1 - cos).
    """
    plus = dot(a, b)
    plus *= scale
    plus += ONE
    across = cross(a, edge)
    across *= scale
    out: Scalar = np.where(plus < HALF, dot(across, across) / np.maximum(TWO - plus, ONE), plus)
    return out


def _angle(rows: Rows, base: Vec, height: Scalar) -> _Angle:
    """Return the solid angles of triangles; rows and base have the same number of columns.

    tan(half) = a . (b x c) / (1 + ab + ac + bc), Van Oosterom & Strackee 1983; the product is
    twice the area times the height.
    """
    to_b, to_c = base + rows[3:6], base + rows[6:9]
    a, b, c = (np.maximum(np.sqrt(dot(way, way)), CLOSEST) for way in (base, to_b, to_c))
    inv_a, inv_b, inv_c = np.reciprocal(a), np.reciprocal(b), np.reciprocal(c)
    volume = TWO * rows[AREA] * inv_a
    volume *= height * inv_b
    volume *= inv_c
    ab_plus = _one_plus_cosine(base, rows[3:6], to_b, inv_a * inv_b)
    others = dot(base, to_c)
    others *= inv_a
    bc = dot(to_b, to_c)
    bc *= inv_b
    others += bc
    others *= inv_c
    half = np.arctan2(volume, ab_plus + others)
    half *= volume > ZERO
    return _Angle(a, b, c, ab_plus, others, volume, half)


def _by_angle(near: _Near, u: Scalar, v: Scalar) -> tuple[Scalar, Scalar]:
    """Return the coordinates along both edges of points uniform in solid angle."""
    rows, base, seen = near.rows, near.base, near.seen

    # Cut off the share u of the solid angle by an arc from b to a point d of the arc ac: the
    # direction half way from a to d is x a + y c, up to scale
    turn = u * seen.half
    sine = np.sin(turn)
    sine /= np.maximum(seen.volume, TINY)
    x = np.cos(turn)
    x -= seen.others * sine
    y = seen.ab_plus * sine

    # Reflect a there, and find d on the edge: its share of the corner c
    cosine = dot(base, base + rows[6:9])
    cosine /= seen.a * seen.c
    x += y
    y /= np.maximum(x, TINY)
    of_a = (ONE - TWO * y) * seen.c
    of_c = TWO * y * (ONE - y + cosine * y) * seen.a
    np.maximum(of_a, ZERO, out=of_a)
    np.maximum(of_c, ZERO, out=of_c)
    share = np.divide(of_c, np.maximum(of_a + of_c, TINY))

    # Go from b towards d, uniformly in the cosine of the arc
    to_d = rows[6:9] * share
    to_d += base
    to_b = base + rows[3:6]
    d = np.maximum(np.sqrt(dot(to_d, to_d)), CLOSEST)
    plus = _one_plus_cosine(to_b, to_d - to_b, to_d, np.reciprocal(seen.b * d))
    minus = TWO - plus
    np.maximum(minus, ZERO, out=minus)
    part = v * (TWO - v * minus)
    part /= np.maximum(plus, TINY)
    np.sqrt(part, out=part)
    of_b = ONE - part
    of_b += minus * (part - v)
    of_b = np.maximum(of_b, ZERO) * d
    of_d = np.multiply(part, seen.b)
    of_d /= np.maximum(of_b + of_d, TINY)
    np.minimum(of_d, ONE, out=of_d)
    return ONE - of_d, of_d * share


def _go_wide(near: _Near, x: Scalar, y: Scalar, u: Scalar, v: Scalar) -> Scalar:
    """Replace x, y at the wide points; return 1 where they lie in the triangle, else 0.

    A direction uniform in the half space towards the triangle is followed to its plane.
    """
    wide = near.wide
    rows = near.rows.take(wide, axis=1) if near.rows.shape[1] > 1 else near.rows
    base, height = near.base.take(wide, axis=1), near.height.take(wide)
    points = near.points.take(wide)
    direction = uniform_hemisphere(u.take(points), v.take(points))
    reach = height / direction[2]

    # Measure along the first edge and square to it
    length = np.sqrt(dot(rows[3:6], rows[3:6]))
    along: Vec = np.divide(rows[3:6], length)
    across = cross(rows[9:12], along)
    part = direction[1] * reach - dot(across, base)
    part /= dot(across, rows[6:9])
    first = direction[0] * reach - dot(along, base)
    first -= part * dot(along, rows[6:9])
    first /= length
    inside: Scalar = ((first >= ZERO) & (part >= ZERO) & (first + part <= ONE)).astype(F32)
    x[wide] = first * inside
    y[wide] = part * inside
    return inside


def sample_place(
    rows: Rows, point: Vec, u: Scalar, v: Scalar, with_pdf: bool = False
) -> tuple[Sampled, Vec]:
    """Sample a point of a triangle; return also its coordinates (2, N) along both edges; unbiased.

    They are the barycentrics of the second and the third corner, as Embree has them.
    """
    base: Vec = rows[0:3] - point
    height = _height(rows, base)
    place = uniform_triangle(u, v)
    near = _near(rows, base, height)
    inside = None
    if near:
        x, y = _by_angle(near, u.take(near.points), v.take(near.points))
        if near.wide.size:
            inside = _go_wide(near, x, y, u, v)
        place[0][near.points], place[1][near.points] = x, y

    # Lead to that point, and weigh it by the solid angle it stands for
    to_light = rows[3:6] * place[0]
    to_light += rows[6:9] * place[1]
    to_light += base
    squared = dot(to_light, to_light)
    distance = np.sqrt(squared)
    squared *= distance
    gain = height * rows[AREA]
    gain /= np.maximum(squared, TINY, out=squared)
    if near:
        gain[near.points] = near.angle
    pdf = reciprocal(gain) if with_pdf else None
    if near and inside is not None:
        gain[near.points.take(near.wide)] *= inside
    return Sampled(to_light, gain, pdf, distance), place


def _sample(rows: Rows, point: Vec, u: Scalar, v: Scalar, with_pdf: bool = False) -> Sampled:
    return sample_place(rows, point, u, v, with_pdf)[0]


def pdf(rows: Rows, origin: Vec, t: Scalar) -> Scalar:
    """Return the density (N,) [1/sr] with which `sample` from `origin` finds what rays hit at t.

    0 where the side that is hit is not sampled.
    """
    base: Vec = rows[0:3] - origin
    height = _height(rows, base)
    weight = height * rows[AREA]
    near = _near(rows, base, height)
    density: Scalar = t * t
    density *= t
    if near:
        weight[near.points] = near.angle
        density[near.points] = ONE
    density /= np.maximum(weight, TINY)
    density *= weight > ZERO
    return density


def _intersect(rows: Rows, origin: Vec, direction: Vec) -> tuple[Scalar, Scalar, Scalar]:
    """Meet either side of a triangle (Moeller & Trumbore 1997)."""
    base = rows[0:3] - origin
    cosine = dot(rows[9:12], direction)
    grazing = np.abs(cosine) < F32(1e-8)
    cosine = np.where(grazing, ONE, cosine)
    t = dot(rows[9:12], base) / cosine
    hit = direction * t
    hit -= base

    # Solve for the coordinates along the edges
    uu, uv, vv = dot(rows[3:6], rows[3:6]), dot(rows[3:6], rows[6:9]), dot(rows[6:9], rows[6:9])
    along_u, along_v = dot(rows[3:6], hit), dot(rows[6:9], hit)
    scale = np.reciprocal(np.maximum(F32(4) * rows[AREA] * rows[AREA], TINY))
    x = (vv * along_u - uv * along_v) * scale
    y = (uu * along_v - uv * along_u) * scale
    inside = (x >= ZERO) & (y >= ZERO) & (x + y <= ONE) & (t > ZERO) & ~grazing
    gain: Scalar = inside.astype(F32)
    density = pdf(rows, origin, np.where(inside, t, ZERO))
    return np.where(inside, t, F32(np.inf)), gain, density * inside


TRIANGLE = Kind("triangle", _sample, _intersect)
