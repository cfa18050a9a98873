"""context -> Value.  What shaders read of the triangle that was hit: its edges, its coordinates."""

from collections.abc import Callable

import numpy as np

from ...arrays import F32, Scalar, Vec, cross, dot
from ...geometry.spaces import MIRRORED
from ...scene import Node
from ..context import Context
from ..graph import Graph
from ..values import VECTOR, Array, Value, read
from .arithmetic import ONE, ZERO, nonzero


def parametric(context: Context) -> Vec:
    """Return the weights (3, n) of the first two corners, and 0."""
    a, b, c = context.corners
    n = cross(b - a, c - a)
    scale = ONE / nonzero(dot(n, n))
    ac = context.local - a
    second = dot(cross(ac, c - a), n) * scale
    third = dot(cross(b - a, ac), n) * scale
    out = np.zeros_like(a)
    np.subtract(ONE - second, third, out=out[0])

    # A mirrored object has its last two corners swapped
    out[1] = np.where(context.fact(MIRRORED) > 0, third, second)
    return out


def _wireframe(graph: Graph, node: Node, output: str) -> Value:
    is_in_pixels = graph.choice(node, "use_pixel_size", False)
    return read(_near_edge, graph.number(node, "Size", 0.01), static=(is_in_pixels,))


def _near_edge(context: Context, size: Array, is_in_pixels: bool) -> Scalar:
    """Return 1 (n,) where an edge is nearer than half of `size` [m], or so many pixels."""
    width = size * _pixel(context) if is_in_pixels else size
    reach = width * F32(0.5)
    reach *= reach
    corners = context.corners
    near = np.zeros(context.size, bool)
    for corner, other in zip(corners, (corners[2], *corners[:2]), strict=True):
        edge = corner - other
        area = cross(edge, context.local - corner)
        near |= dot(area, area) < dot(edge, edge) * reach
    return near.astype(F32)


def _pixel(context: Context) -> Scalar:
    """Return how wide a pixel is (n,) [m], in the plane that faces the viewer.

    Cycles takes two axes in the plane of the surface, which have no meaning, and their mean.
    """
    normal, wo = context.geometric, context.wo
    first = np.stack([normal[2] - normal[1], normal[0] - normal[2], normal[1] - normal[0]])
    long = dot(first, first)
    fallback = np.stack([normal[2] - normal[1], normal[0] + normal[2], -normal[1] - normal[0]])
    first = np.where(long > 0, first, fallback)
    first *= ONE / np.sqrt(np.maximum(dot(first, first), F32(1e-30)))
    second = cross(normal, first)
    sines = [np.sqrt(np.maximum(ONE - dot(axis, wo) ** 2, ZERO)) for axis in (first, second)]
    return context.view.footprint(context.seen) * F32(0.5) * (sines[0] + sines[1])


PARAMETRIC = read(parametric, kind=VECTOR)
TRIANGLE: dict[str, Callable[[Graph, Node, str], Value]] = {"Wireframe": _wireframe}
OF_VIEWER = (_near_edge,)  # steps that depend on the viewer's direction
