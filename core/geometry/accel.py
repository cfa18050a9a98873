"""rays -> hits, rays -> occluded.  Embree; nothing else of the project imports it.

A scene is a short list of parts, each an Embree scene whose primitives are numbers of the one
triangle table.  embreex has no ray masks, no instances and no near distance; see `surface` for
how rays leave a triangle without hitting it again.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import embreex
import numpy as np
from embreex import rtcore, rtcore_scene
from embreex.mesh_construction import TriangleMesh
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec
from ..scene import Cancelled
from ..statistics import Tally
from . import embree
from .mesh import Triangles

FAR = F32(1e37)  # beyond every scene, and still finite when squared in float64
CHUNK = 1 << 18  # triangles uploaded per call: about 0.15 s, in which nobody else can run


@dataclass(frozen=True, eq=False)
class Hits:
    """Closest hits: t (N,), triangle (N,) or -1, barycentrics u and v (N,)."""

    t: Scalar
    triangle: Ids
    u: Scalar
    v: Scalar


@dataclass(frozen=True, eq=False)
class Part:
    """An Embree scene; its geometry g, triangle p is triangle first[g] + p of the table.

    `shared` are the arrays that Embree reads and that must live as long as it.
    """

    scene: rtcore_scene.EmbreeScene
    first: NDArray[np.int32]
    shared: tuple[Any, ...]

    def closest(self, origin: Vec, direction: Vec, far: Scalar | None) -> Hits:
        """Return the closest hits of rays (3, N) up to `far` (N,), which is overwritten."""
        origin = np.broadcast_to(origin, direction.shape)
        found = self.scene.run(origin.T, direction.T, dists=far, output=1)
        triangle = found["primID"]
        if len(self.first) > 1:
            # Geometry -1 (a miss) reads the last entry; the sum is made -1 again.
            base = self.first.take(found["geomID"], mode="wrap")
            triangle = np.where(triangle < 0, np.int32(-1), triangle + base)
        return Hits(found["tfar"], triangle, found["u"], found["v"])

    def free(self, origin: Vec, direction: Vec, far: Scalar) -> NDArray[np.int32]:
        """Return -1 for each ray that meets nothing before `far`, else 0; a far < 0 is met."""
        return self.scene.run(origin.T, direction.T, dists=far, query="OCCLUDED")


@dataclass(frozen=True, eq=False)
class Accel:
    """What rays hit."""

    parts: tuple[Part, ...]

    def closest(
        self, origin: Vec, direction: Vec, far: Scalar | None, left: Ids | None, tally: Tally
    ) -> Hits:
        """Return the closest hits of rays (3, N) that leave triangles `left` (N,) or None.

        A hit of the very triangle that a ray has left is no hit: it is traced again from
        beyond ("ignore the polygon we come from").
        """
        start = perf_counter()
        hits = self._closest(origin, direction, far)
        tally.embree += perf_counter() - start
        if left is not None:
            again = np.flatnonzero(hits.triangle == left)
            if again.size:
                self._trace_again(origin, direction, far, again, hits, tally)
        return hits

    def free(self, origin: Vec, direction: Vec, far: Scalar, tally: Tally) -> Scalar:
        """Return 1 for each ray that meets nothing before `far` (N,) x direction, else 0."""
        start = perf_counter()
        free = self.parts[0].free(origin, direction, far)
        for part in self.parts[1:]:
            free &= part.free(origin, direction, far)  # -1 has all bits set, 0 none
        tally.embree += perf_counter() - start
        return np.negative(free, out=free).astype(F32)

    def _closest(self, origin: Vec, direction: Vec, far: Scalar | None) -> Hits:
        hits = self.parts[0].closest(origin, direction, None if far is None else far.copy())
        for part in self.parts[1:]:
            nearer = part.closest(origin, direction, hits.t.copy())
            better = np.flatnonzero(nearer.triangle >= 0)
            for name in ("t", "triangle", "u", "v"):
                getattr(hits, name)[better] = getattr(nearer, name).take(better)
        return hits

    def _trace_again(
        self,
        origin: Vec,
        direction: Vec,
        far: Scalar | None,
        again: Index,
        hits: Hits,
        tally: Tally,
    ) -> None:
        tally.self_hits += again.size
        o, d = origin.take(again, axis=1), direction.take(again, axis=1)
        skip = hits.t.take(again) * F32(1 + 2.0**-20)
        o += d * skip
        start = perf_counter()
        rest = None if far is None else far.take(again) - skip
        beyond = self._closest(o, d, rest)
        tally.embree += perf_counter() - start
        hits.t[again] = beyond.t + skip
        for name in ("triangle", "u", "v"):
            getattr(hits, name)[again] = getattr(beyond, name)


def compile_accel(
    triangles: Triangles | None, is_quick: bool, should_stop: Callable[[], bool]
) -> tuple[Accel | None, float]:
    """Build Embree's tree over the triangles; return it and the seconds that took.

    `is_quick` is for pictures that need few rays: a faster build, slower rays.
    Raises: Cancelled.
    """
    if triangles is None:
        return None, 0.0
    start = perf_counter()
    device = rtcore.EmbreeDevice()
    scene = rtcore_scene.EmbreeScene(device)
    library = embree.open_library(str(Path(embreex.__file__).parent))
    handle = embree.handle(scene, device)
    if library is not None and handle is not None:
        embree.build(
            library, scene, handle, triangles.vertices, triangles.corners, is_quick, should_stop
        )
        scene.is_committed = 1
        first = [0]
    else:
        first = _upload(scene, triangles, should_stop)
    part = Part(scene, np.array(first, np.int32), (triangles.vertices, triangles.corners))
    return Accel((part,)), perf_counter() - start


def _upload(
    scene: rtcore_scene.EmbreeScene, triangles: Triangles, should_stop: Callable[[], bool]
) -> list[int]:
    """Upload through embreex in chunks; return the first triangle of each.

    Holds the interpreter, about 0.5 us a triangle and as much again for the build at the end.
    """
    first = []
    for lo, hi in _chunks(triangles):
        if should_stop():
            raise Cancelled
        corners = triangles.corners[lo:hi]
        low, high = int(corners.min()), int(corners.max()) + 1
        TriangleMesh(scene, triangles.vertices[low:high], corners - np.int32(low))
        first.append(lo)

    # The first query builds the tree; it must be over before worker threads start.
    scene.run(np.zeros((1, 3), F32), np.ones((1, 3), F32))
    return first


def _chunks(triangles: Triangles) -> list[tuple[int, int]]:
    # Chunks pay if neighbours in the table use neighbouring vertices, else vertices go up twice.
    count = triangles.count
    bounds = [(lo, min(lo + CHUNK, count)) for lo in range(0, count, CHUNK)]
    if len(bounds) == 1:
        return bounds
    spans = 0
    for lo, hi in bounds:
        corners = triangles.corners[lo:hi]
        spans += int(corners.max()) - int(corners.min()) + 1
    return bounds if spans <= 1.5 * len(triangles.vertices) else [(0, count)]
