"""rays -> hits, rays -> occluded.  Embree; nothing else of the project imports it.

A scene is a short list of parts, each an Embree scene of triangles that the same rays meet in the
same way: all plain triangles are the first part.  embreex has no ray masks, no instances and no
near distance; see `surface` for how rays leave a triangle without hitting it again.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from time import perf_counter

import embreex
import numpy as np
from embreex import rtcore, rtcore_scene
from embreex.mesh_construction import TriangleMesh
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec, take
from ..scene import EVERY_SET, SHADOW, Cancelled
from ..statistics import Tally
from . import embree
from .layers import compile_layers
from .mesh import Triangles
from .moving import MovingPart, moving_part
from .objects import PLAIN, Traits
from .part import FAR, Hits, Part, Sets, no_hits
from .walk import Passage, Shade, walk

CHUNK = 1 << 18  # triangles uploaded per call: about 0.15 s, in which nobody else can run

Kinds = NDArray[np.uint8]  # (N,) bits of ray kinds

__all__ = ["FAR", "Accel", "Hits", "Part", "Shade", "compile_accel", "compile_own"]


@dataclass(frozen=True, eq=False)
class Accel:
    """What rays hit; `triangles` are those of its parts."""

    parts: tuple[Part, ...]
    triangles: Triangles

    @cached_property
    def opaque(self) -> tuple[Part, ...]:
        """The parts that stop shadow rays."""
        parts = (part for part in self.parts if part.traits.seen_by & SHADOW)
        return tuple(part for part in parts if not part.traits.is_transparent)

    @cached_property
    def transparent(self) -> tuple[Part, ...]:
        """The parts that shadow rays may pass."""
        parts = (part for part in self.parts if part.traits.seen_by & SHADOW)
        return tuple(part for part in parts if part.traits.is_transparent)

    def only_catchers(self) -> "Accel":
        """Return what rays hit if nothing but the shadow catchers is there."""
        return Accel(tuple(part for part in self.parts if part.traits.is_catcher), self.triangles)

    def closest(
        self,
        origin: Vec,
        direction: Vec,
        far: Scalar | None,
        left: Ids | None,
        kinds: Kinds | None,
        tally: Tally,
        time: Scalar | None = None,
    ) -> Hits:
        """Return the closest hits of rays (3, N) that leave triangles `left` (N,) or None.

        `kinds` (N,) are bits of the kinds of the rays, None for camera rays; time (N,), None if
        nothing moves, as in all that follow.  A hit of the very
        triangle that a ray has left is no hit: it is traced again from beyond ("ignore the
        polygon we come from").
        """
        start = perf_counter()
        hits = self._closest(origin, direction, far, kinds, time)
        tally.embree += perf_counter() - start
        if left is not None:
            again = np.flatnonzero(hits.triangle == left)
            if again.size:
                tally.self_hits += again.size
                start = perf_counter()
                o, d = origin.take(again, axis=1), direction.take(again, axis=1)
                skip = hits.t.take(again) * F32(1 + 2.0**-20)
                o += d * skip
                rest = None if far is None else far.take(again) - skip
                beyond = self._closest(o, d, rest, take(kinds, again), take(time, again))
                np.add(beyond.t, skip, out=beyond.t)
                hits.put(again, beyond)
                tally.embree += perf_counter() - start
        return hits

    def free(
        self,
        origin: Vec,
        direction: Vec,
        far: Scalar,
        tally: Tally,
        blockers: Sets = EVERY_SET,
        time: Scalar | None = None,
    ) -> Scalar:
        """Return 1 for each ray that meets nothing opaque before `far` (N,) x direction, else 0.

        `blockers` is a mask of the light linking sets that cast shadows, or one for each ray.
        A far < 0 gives 0.
        """
        start = perf_counter()
        free = None
        for part in self.opaque:
            index = part.blocks(blockers)
            if index is not None and not index.size:
                continue
            if index is None:
                seen = part.free(origin, direction, far, time)
                free = seen if free is None else np.bitwise_and(free, seen, out=free)
            else:
                free = _nothing_met(far) if free is None else free
                some = np.broadcast_to(origin, direction.shape).take(index, axis=1)
                way = some, direction.take(index, axis=1), far.take(index)
                seen = part.free(*way, take(time, index))
                free[index] &= seen  # -1 has all bits set, 0 none
        free = _nothing_met(far) if free is None else free
        tally.embree += perf_counter() - start
        return np.negative(free, out=free).astype(F32)

    def unmet(
        self, origin: Vec, direction: Vec, far: Scalar, kind: int, tally: Tally
    ) -> NDArray[np.bool_]:
        """Tell which rays (3, N) of a kind meet no surface at all before `far` (N,) x direction.

        What lets light through counts as well; a far < 0 gives False.
        """
        start = perf_counter()
        free = _nothing_met(far)
        for part in self.parts:
            if part.traits.seen_by & kind:
                seen = part.free(origin, direction, far, None)
                np.bitwise_and(free, seen, out=free)
        tally.embree += perf_counter() - start
        unmet: NDArray[np.bool_] = free != 0
        return unmet

    def transmittance(
        self,
        origin: Vec,
        direction: Vec,
        far: Scalar,
        tally: Tally,
        shade: Shade,
        limit: int | Ids,
        left: Ids | None = None,
        blockers: Sets = EVERY_SET,
        time: Scalar | None = None,
    ) -> Scalar | Vec:
        """Return how much light rays let pass before `far` (N,): (N,), or (3, N) if coloured.

        `shade` gives what each transparent surface lets pass; behind more than `limit` of them,
        for all or (N,), it is dark.  Triangles `left` (N,) that rays start from do not count.
        """
        visible = self.free(origin, direction, far, tally, blockers, time)
        passage = Passage(visible, limit, shade)
        origin = np.broadcast_to(origin, direction.shape)
        before = np.full(visible.size, -1, np.int32) if left is None else left
        start = perf_counter()
        for part in self.transparent:
            ray, some = passage.alive(), part.blocks(blockers)
            if some is not None:
                ray = np.intersect1d(ray, some, assume_unique=True)
            o, d = origin.take(ray, axis=1), direction.take(ray, axis=1)
            way = o, d, far.take(ray), before.take(ray)
            walk(self.triangles, part, *way, ray, passage, take(time, ray))
        tally.embree += perf_counter() - start
        return passage.through

    def _closest(
        self,
        origin: Vec,
        direction: Vec,
        far: Scalar | None,
        kinds: Kinds | None,
        time: Scalar | None,
    ) -> Hits:
        hits: Hits | None = None
        for part, index in self._seen(kinds):
            if index is None and hits is None:
                hits = part.closest(origin, direction, None if far is None else far.copy(), time)
                continue
            hits = no_hits(far, direction.shape[1]) if hits is None else hits
            if index is None:
                nearer = part.closest(origin, direction, hits.t.copy(), time)
            else:
                o = origin.take(index, axis=1) if origin.shape[1] > 1 else origin
                way = o, direction.take(index, axis=1), hits.t.take(index)
                nearer = part.closest(*way, take(time, index))
            better = np.flatnonzero(nearer.triangle >= 0)
            if better.size:
                hits.put(better if index is None else index.take(better), nearer.take(better))
        return no_hits(far, direction.shape[1]) if hits is None else hits

    def _seen(self, kinds: Kinds | None) -> Iterator[tuple[Part, Index | None]]:
        """Yield the parts that rays see, and which rays do; None is all."""
        for part in self.parts:
            index = part.seen_by(kinds)
            if index is None or index.size:
                yield part, index


def _nothing_met(far: Scalar) -> NDArray[np.int32]:
    return np.negative(far >= 0, dtype=np.int32)


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
    parts: list[Part] = []
    for which, traits in enumerate(triangles.traits):
        number = None
        if triangles.part is not None:
            number = np.flatnonzero(triangles.part == which).astype(np.int32)
        build = partial(_part, device, triangles, traits, is_quick, should_stop)
        move = partial(_moving, device, triangles, traits, should_stop)
        if traits.is_transparent and traits.seen_by & SHADOW:
            if number is None:
                number = np.arange(triangles.count, dtype=np.int32)
            layers = compile_layers(triangles, number, build)
            # What lies upon each other in the frame itself does so at any time.
            parts += [move(layer.number) for layer in layers] if traits.moves else layers
        else:
            parts.append(move(number) if traits.moves else build(number))
    return Accel(tuple(parts), triangles), perf_counter() - start


def compile_own(
    accel: Accel,
    instances: NDArray[np.bool_],
    is_quick: bool,
    should_stop: Callable[[], bool],
) -> Accel:
    """Return the triangles of some `instances` (I,), which all rays see.

    What moves is a part besides what rests.  Raises: Cancelled.
    """
    triangles = accel.triangles
    number = np.flatnonzero(instances.take(triangles.ids[:, 2])).astype(np.int32)
    device = rtcore.EmbreeDevice()
    moves = np.zeros(number.size, bool)
    if triangles.movement is not None:
        moves = triangles.movement.moves.take(triangles.ids[:, 2].take(number))
    parts: list[Part] = []
    resting, moving = number[~moves], number[moves]
    if resting.size:
        parts.append(_part(device, triangles, PLAIN, is_quick, should_stop, resting))
    if moving.size:
        parts.append(_moving(device, triangles, PLAIN, should_stop, moving))
    return Accel(tuple(parts), triangles)


def _part(
    device: rtcore.EmbreeDevice,
    triangles: Triangles,
    traits: Traits,
    is_quick: bool,
    should_stop: Callable[[], bool],
    number: Ids | None,
) -> Part:
    """Build the tree of the triangles `number`, None for all; the vertices are shared."""
    corners = triangles.corners if number is None else triangles.corners.take(number, axis=0)
    vertices = triangles.vertices
    scene = rtcore_scene.EmbreeScene(device)
    library = embree.open_library(str(Path(embreex.__file__).parent))
    handle = embree.handle(scene, device)
    first = [0]
    if library is not None and handle is not None:
        embree.build(library, scene, handle, vertices, corners, is_quick, should_stop)
        scene.is_committed = 1
    else:
        first = _upload(scene, vertices, corners, should_stop)
    kept = vertices, corners
    return Part(scene, np.array(first, np.int32), kept, number, traits, (triangles, is_quick))


def remade(triangles: Triangles, is_quick: bool | None, traits: Traits, number: Ids | None) -> Part:
    """Build a part again, in another process; is_quick is None if it moves."""
    device = rtcore.EmbreeDevice()
    if is_quick is None:
        return _moving(device, triangles, traits, lambda: False, number)
    return _part(device, triangles, traits, is_quick, lambda: False, number)


def can_move() -> bool:
    """Tell whether Embree can be asked for places at times: only through its own C interface."""
    device = rtcore.EmbreeDevice()
    library = embree.open_library(str(Path(embreex.__file__).parent))
    return (
        library is not None and embree.handle(rtcore_scene.EmbreeScene(device), device) is not None
    )


def _moving(
    device: rtcore.EmbreeDevice,
    triangles: Triangles,
    traits: Traits,
    should_stop: Callable[[], bool],
    number: Ids | None,
) -> MovingPart:
    """Build the tree of the triangles `number`, None for all, which move."""
    if number is None:
        number = np.arange(triangles.count, dtype=np.int32)
    scene = rtcore_scene.EmbreeScene(device)
    library = embree.open_library(str(Path(embreex.__file__).parent))
    handle = embree.handle(scene, device)
    assert library is not None and handle is not None, "see can_move"
    part = moving_part(library, scene, handle, triangles, traits, should_stop, number)
    scene.is_committed = 1
    return replace(part, made_from=(triangles, None))


def _upload(
    scene: rtcore_scene.EmbreeScene,
    vertices: NDArray[np.float32],
    corners: NDArray[np.int32],
    should_stop: Callable[[], bool],
) -> list[int]:
    """Upload through embreex in chunks; return the first triangle of each.

    Holds the interpreter, about 0.5 us a triangle and as much again for the build at the end.
    """
    first = []
    for lo, hi in _chunks(corners, len(vertices)):
        if should_stop():
            raise Cancelled
        some = corners[lo:hi]
        low, high = int(some.min()), int(some.max()) + 1
        TriangleMesh(scene, vertices[low:high], some - np.int32(low))
        first.append(lo)

    # The first query builds the tree; it must be over before worker threads start.
    scene.run(np.zeros((1, 3), F32), np.ones((1, 3), F32))
    return first


def _chunks(corners: NDArray[np.int32], vertices: int) -> list[tuple[int, int]]:
    # Chunks pay if neighbours in the table use neighbouring vertices, else vertices go up twice.
    count = len(corners)
    bounds = [(lo, min(lo + CHUNK, count)) for lo in range(0, count, CHUNK)]
    if len(bounds) == 1:
        return bounds
    spans = 0
    for lo, hi in bounds:
        spans += int(corners[lo:hi].max()) - int(corners[lo:hi].min()) + 1
    return bounds if spans <= 1.5 * vertices else [(0, count)]
