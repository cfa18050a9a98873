"""a mesh's vertices and edges -> numbers of vertices.  What shaders ask of the shape around them.

Pointiness tells ridges from creases by the angles of the edges that meet at a vertex; islands are
what hangs together by edges.  Both as Cycles computes them, which takes all edges, not those of
triangles only.
"""

from typing import cast

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32

Floats = NDArray[np.float32]
Integers = NDArray[np.int32]


def pointiness(positions: Floats, normals: Floats, edges: Integers) -> Floats:
    """Return the pointiness (V,) of vertices: 0.5 where flat, more on ridges.

    positions and normals (V, 3), edges (E, 2).  Vertices in the same place count as one.
    """
    _, first, one = np.unique(positions, axis=0, return_index=True, return_inverse=True)
    one, count = one.reshape(-1), len(first)
    normal = _length_one(_sums(one, normals, count))

    # Each edge once, however many share its ends
    pairs = np.sort(one[edges], axis=1)
    pairs = np.unique(pairs, axis=0) if len(pairs) else pairs
    places = positions.take(first, axis=0)
    start, end = pairs.T
    along = _length_one(places.take(end, axis=0) - places.take(start, axis=0))
    ends = np.concatenate([start, end])
    degree = np.bincount(ends, minlength=count)
    sums = _sums(ends, np.concatenate([along, -along]), count)
    cosine = (normal * sums).sum(axis=1) / np.maximum(degree, 1)
    raw = np.where(degree > 0, np.arccos(np.clip(cosine, -1, 1)) / np.pi, 0)

    # The mean with the neighbours'
    around = np.bincount(ends, raw.take(np.concatenate([end, start])), minlength=count)
    return cast(Floats, ((raw + around) / (degree + 1)).take(one).astype(F32))


def _sums(
    index: NDArray[np.intp], vectors: NDArray[np.floating], count: int
) -> NDArray[np.float64]:
    columns = [np.bincount(index, vectors[:, axis], minlength=count) for axis in range(3)]
    return np.stack(columns, axis=1)


def _length_one(vectors: NDArray[np.floating]) -> NDArray[np.float64]:
    length = np.sqrt((vectors.astype(np.float64) ** 2).sum(axis=1, keepdims=True))
    return vectors / np.where(length > 0, length, 1)


def islands(count: int, edges: Integers) -> Integers:
    """Return for each of `count` vertices the one that stands for its island.

    Joined by rank, edge by edge, since which one it is matters to those who hash it.  Source:
    Galler and Fischer 1964, "An Improved Equivalence Algorithm".
    """
    parent, rank = list(range(count)), [0] * count

    def root(x: int) -> int:
        while parent[x] != x:
            parent[x] = x = parent[parent[x]]
        return x

    for a, b in edges.tolist():
        a, b = root(a), root(b)
        if a == b:
            continue
        if rank[a] < rank[b]:
            a, b = b, a
        parent[b] = a
        rank[a] += rank[a] == rank[b]
    return np.array([root(x) for x in range(count)], np.int32)
