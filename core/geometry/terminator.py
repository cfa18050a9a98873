"""points, light directions -> where shadow rays start.  The shadow terminator of smooth meshes.

Shading normals pretend a curved surface, flat triangles cast its shadows: near the terminator
facets would show.  There, shadow rays start from the curved surface that the corner normals
imply, faded in as the light grazes the triangle, just as in Blender.
Source: Hanika 2021, "Hacking the Shadow Terminator", Ray Tracing Gems II, chapter 4.
"""

import numpy as np

from ..arrays import F32, Ids, Index, Scalar, Vec, dot, take
from .mesh import Triangles
from .objects import CUTOFF
from .surface import Points

TINY = F32(1e-6)


def raise_starts(
    triangles: Triangles, points: Points, start: Vec, to_light: Vec, cos_light: Scalar
) -> Vec:
    """Return shadow-ray starts (3, N), raised at smooth points that light grazes.

    cos_light (N,) is the cosine of the light at the shading normal, to_light (3, N) any length.
    """
    assert points.smooth is not None
    length = np.sqrt(np.maximum(dot(to_light, to_light), F32(1e-30)))
    cos_flat = dot(points.geometric, to_light)
    cos_flat /= length

    # Fade in below the cutoff; facing away from the shading normal nothing is lit anyway.
    cutoff = _cutoff(triangles, points)
    amount = np.where(
        cos_light < cutoff,
        F32(2) - (cos_flat + cos_light) / cutoff,
        F32(1) - cos_flat / cutoff,
    )
    raises = points.smooth & (amount > 0) & (cos_light > 0)
    if isinstance(cutoff, np.ndarray):
        raises &= cutoff > TINY
    grazing = np.flatnonzero(raises)
    if not grazing.size:
        return start
    lift = _lift(triangles, points, grazing)
    lift *= np.minimum(amount.take(grazing), F32(1))
    raised = start.copy()
    raised[:, grazing] += lift
    return raised


def _cutoff(triangles: Triangles, points: Points) -> Scalar | np.float32:
    """Return the cosine at which raising sets in; `TINY` where an object wants none."""
    table = None if triangles.objects is None else triangles.objects.terminator_geometry
    if table is None:
        return F32(CUTOFF)
    assert points.instance is not None
    return np.maximum(table.take(points.instance), TINY)


def shift(triangles: Triangles, instance: Ids | None, normal: Vec, direction: Vec) -> Scalar | None:
    """Return the factor (n,) on light from unit directions (3, n), None where no object asks.

    normal (3, n): of the closure on objects `instance` (n,); light from behind keeps its own.
    Blender's "Shading Offset" of an object makes the cosine fall faster.  Darkens: biased.
    Source: Appleseed, after Blender's manual.
    """
    table = None if triangles.objects is None else triangles.objects.terminator_shading
    if table is None:
        return None
    assert instance is not None
    speed = F32(1) / (F32(1) - F32(0.5) * np.minimum(table.take(instance), F32(1.999)))
    cosine = np.minimum(dot(normal, direction), F32(1))
    front = np.maximum(cosine, F32(1e-6))
    fallen = np.maximum(np.cos(np.arccos(front) * speed), F32(0)) / front
    return np.where((cosine >= 0) & (speed > 1), fallen, F32(1))


def bump_shadow(
    smooth: Vec, normal: Vec, wi: Vec, softening: str, is_diffuse: bool, is_sampled: bool
) -> Scalar:
    """Return what closures with normals (3, N) of their own keep of light from unit wi (3, N).

    smooth (3, N): the shading normals; softening: of `SOFTENINGS` or NONE; is_sampled: the
    direction was chosen by the closure.  Nothing comes from behind the smooth surface; matte
    closures fade before they get there.
    """
    towards, apart, across = dot(smooth, wi), dot(smooth, normal), dot(normal, wi)
    kept = np.ones_like(towards)
    if is_diffuse or not is_sampled:
        kept[towards * apart * across < 0] = 0
    if is_diffuse and softening in SOFTENINGS:
        kept *= SOFTENINGS[softening](towards, apart, across)
    return kept


def _microfacet(towards: Scalar, apart: Scalar, across: Scalar) -> Scalar:
    """Return the shadowing of microfacets that are as rough as the normal is bent.

    Source: Conty Estevez, Lecocq and Stein 2019, "A Microfacet-Based Shadowing Function to Solve
    the Bump Terminator Problem", Ray Tracing Gems, chapter 12.
    """
    one = F32(1)
    cosine, tilt = np.minimum(np.abs(towards), one), np.minimum(np.abs(apart), one)
    tan_tilt = one / np.maximum(tilt * tilt, F32(1e-12)) - one
    alpha = np.minimum(F32(0.125) * tan_tilt, one)
    squared = np.maximum(cosine * cosine, F32(1e-12))
    return F32(2) / (one + np.sqrt(one + alpha * (one / squared - one)))


def _cubic(towards: Scalar, apart: Scalar, across: Scalar) -> Scalar:
    """Return a cubic of the share of light that the smooth surface gets of what the bent one does.

    Source: Chiang, Li and Burley 2019, "Taming the Shadow Terminator", SIGGRAPH Talks.
    """
    bent = across * apart
    bent = np.copysign(np.maximum(np.abs(bent), F32(1e-12)), bent)
    share: Scalar = np.clip(towards / bent, F32(0), F32(1))
    return share * (F32(1) + share - share * share)


# How matte closures fade towards the terminator: (cosines of the light at the shading normal, of
# the shading normal and the closure's, of the light at the closure's) -> what is kept.
SOFTENINGS = {"MICROFACET": _microfacet, "CUBIC": _cubic}


def _lift(triangles: Triangles, points: Points, index: Index) -> Vec:
    """Return the way (3, n) from the triangles up to the surface their normals imply."""
    assert points.u is not None and points.v is not None
    triangle = points.triangle.take(index)
    u, v = points.u.take(index), points.v.take(index)
    w = (F32(1) - u - v, u, v)
    time = take(points.time, index)
    p = triangles.places(triangle, time)
    table = triangles.corner_normals(triangle, time)
    n = [table[3 * k : 3 * k + 3] for k in range(3)]

    # Turn the normals to the viewer's side.
    normal = n[0] * w[0] + n[1] * w[1] + n[2] * w[2]
    side = np.copysign(F32(1), dot(normal, points.geometric.take(index, axis=1)))
    n = [corner * side for corner in n]
    normal *= side

    # Height of the parabola through the corners ...
    a = dot(n[2] - n[0], p[0] - p[2])
    b = dot(n[2] - n[1], p[1] - p[2])
    c = dot(n[1] - n[0], p[1] - p[0])
    parabola = a * w[0] * (w[0] - 1) + (a + b + c) * w[0] * w[1] + b * w[1] * (w[1] - 1)

    # ... and of the envelope of the tangent planes at the corners, whichever is higher.
    here = p[0] * w[0] + p[1] * w[1] + p[2] * w[2]
    heights = []
    for k in range(3):
        one, two = p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]
        height = np.maximum(np.maximum(dot(one, n[k]), dot(two, n[k])), 0)
        heights.append(np.maximum(dot(p[k] - here, n[k]) + height, 0))
    envelope = np.minimum(np.minimum(heights[0], heights[1]), heights[2])
    return normal * np.maximum(envelope, parabola * F32(0.5))
