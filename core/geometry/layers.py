"""transparent triangles -> layers.  Triangles that lie upon each other, told apart.

Embree returns one hit of each ray, so of two surfaces in the same place only one is met; yet both
take their share of the light (Cycles counts each).  Such triangles are found by probing: short
rays through each one from both sides.  Of a pair that is found, the later one moves to the next
layer; a layer is a part in which nothing lies upon anything else.  The points probed are the
middles of the pieces that a triangle is cut into: what covers none of them can be missed.
"""

from collections.abc import Callable

import numpy as np

from ..arrays import F32, Ids
from .mesh import NX, NZ, OFFSET, Triangles
from .part import Part

# Up to so many triangles are cut into so many pieces along each side; more are probed whole.
PIECES = ((1 << 14, 4), (1 << 17, 2))

NEAR = F32(2)  # rounding errors of a triangle, within which another is in the same place

MOST_LAYERS, MOST_ROUNDS = 16, 8
CHUNK = 1 << 15


def compile_layers(
    triangles: Triangles, number: Ids, build: Callable[[Ids], Part]
) -> tuple[Part, ...]:
    """Return parts of the triangles `number` (n,), sorted; `build` makes one part of some."""
    layers: list[Part] = []
    while number.size:
        part, moved = build(number), []
        for _ in range(MOST_ROUNDS):
            above = _lying_upon_others(triangles, number, part)
            if not above.size or len(layers) == MOST_LAYERS - 1:
                break
            moved.append(above)
            number = np.setdiff1d(number, above, assume_unique=True)
            part = build(number)
        layers.append(part)
        number = np.sort(np.concatenate(moved)) if moved else number[:0]
    return tuple(layers)


def _lying_upon_others(triangles: Triangles, number: Ids, part: Part) -> Ids:
    """Return the later one of each two triangles that a probe finds in one place."""
    points = _middles(next((n for most, n in PIECES if number.size <= most), 1))
    found = []
    for low in range(0, number.size, CHUNK):
        some = number[low : low + CHUNK]
        for u, v in points:
            for side in (F32(1), F32(-1)):
                hit = _probe(triangles, some, part, u, v, side)
                other = np.flatnonzero((hit >= 0) & (hit != some))
                found.append(np.maximum(hit.take(other), some.take(other)))
    return np.unique(np.concatenate(found))


def _middles(n: int) -> list[tuple[float, float]]:
    """Return the barycentrics of the middles of the n x n pieces of a triangle."""
    rows = [(i, j) for i in range(n) for j in range(n - i)]
    upright = [((i + 1 / 3) / n, (j + 1 / 3) / n) for i, j in rows]
    return upright + [((i + 2 / 3) / n, (j + 2 / 3) / n) for i, j in rows if i + j < n - 1]


def _probe(
    triangles: Triangles, some: Ids, part: Part, u: float, v: float, side: np.float32
) -> Ids:
    columns = triangles.columns(some)
    corners = triangles.corners.take(some, axis=0)
    a, b, c = (triangles.vertices.take(corners[:, k], axis=0).T for k in range(3))
    direction = columns[NX : NZ + 1] * -side
    reach = columns[OFFSET] * NEAR
    origin = a * F32(1 - u - v) + b * F32(u) + c * F32(v) - direction * reach
    hits = part.closest(origin, direction, reach * F32(2))
    return hits.triangle
