"""bounce -> next bounce.  What travels: paths in flight, one column for each live path.

A *slot* is one branch of one pixel sample; it never moves, while paths are compacted.  Slots are
unique within a wave, so light is added with `radiance[:, slot] += light`, without atomics.
"""

from dataclasses import dataclass, fields
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec, take
from ..bsdf import CAMERA, CLEAR


@dataclass(frozen=True, eq=False)
class Rays:
    """What Embree is asked: origin (3, N), or (3, 1) for all rays, and unit direction (3, N).

    far (N,) [m] or None; left (N,) int32, the triangles the rays come from, or None.
    """

    origin: Vec
    direction: Vec
    far: Scalar | None = None
    left: Ids | None = None

    @property
    def size(self) -> int:
        """The number of rays."""
        return self.direction.shape[1]

    def take(self, index: Index) -> "Rays":
        """Return the rays at `index` (M,), of rays that each have an origin."""
        return Rays(
            self.origin.take(index, axis=1),
            self.direction.take(index, axis=1),
            take(self.far, index),
            take(self.left, index),
        )


@dataclass(frozen=True, eq=False)
class Paths:
    """N live paths after some bounces: what they carry, ray by ray.

    throughput (3, N), None is 1; slot (N,), None is 0..N-1; kind (N,) uint8, bits of
    `bsdf.kinds`, or None for camera rays; count (3, N) int16, diffuse, glossy and transmission
    bounces so far, None if all bounces of the scene are of one kind; last (N,) bool: at the next
    surface only emission counts, and what is seen through it; None is False.

    pdf (N,) [1/sr]: the density of the direction, infinite where it was the only one; None where
    all are.  least_pdf (N,): the smallest pdf of the path so far, None where no closure asks.  The
    rest is None unless surfaces are transparent: total (N,) int16, all bounces, passed (N,)
    int16, surfaces that were passed straight, travelled (N,) [m] since the last bounce; shown (N,)
    bool: the passes that show one surface have had theirs.  lobe (N,) uint8: what scattered the
    path first, see `film.ledger`, None where nobody asks.  time (N,), 0 to 1 while the shutter is
    open, None unless something moves.  matte_slot (N,): the slots of what matte closures send on,
    None is the same, see `reuse`.
    """

    size: int
    throughput: Vec | None = None
    slot: Index | None = None
    kind: NDArray[np.uint8] | None = None
    count: NDArray[np.int16] | None = None
    last: NDArray[np.bool_] | None = None
    pdf: Scalar | None = None
    least_pdf: Scalar | None = None
    place: Ids | None = None
    receiver: NDArray[np.uint8] | None = None
    total: NDArray[np.int16] | None = None
    passed: NDArray[np.int16] | None = None
    travelled: Scalar | None = None
    shown: NDArray[np.bool_] | None = None
    lobe: NDArray[np.uint8] | None = None
    time: Scalar | None = None
    matte_slot: Index | None = None

    @property
    def kinds(self) -> NDArray[np.uint8]:
        """Bits of the kinds of the rays (N,)."""
        return np.full(self.size, CAMERA, np.uint8) if self.kind is None else self.kind

    @property
    def is_straight(self) -> NDArray[np.bool_]:
        """Whether (N,) the camera looks straight on, through what is transparent to the film."""
        return (self.kinds & np.uint8(CAMERA | CLEAR)) != 0

    @property
    def scattered_by(self) -> NDArray[np.uint8]:
        """What scattered the paths first (N,), as far as passes know: not glass as good as none."""
        if self.lobe is None:
            return np.zeros(self.size, np.uint8)
        return np.where(self.is_straight, np.uint8(0), self.lobe)

    def slots(self, index: Index) -> Index:
        """Return the slots of the paths at `index`."""
        return index if self.slot is None else self.slot.take(index)

    def shows(self, index: Index) -> Scalar | np.float32:
        """Return how much the viewer sees, in the mean of the channels, at `index` (M,)."""
        if self.throughput is None:
            return F32(1)
        mean: Scalar = self.throughput.take(index, axis=1).mean(axis=0)
        return mean

    def take(self, index: Index) -> "Paths":
        """Return the paths at `index` (M,); slots that were implied become explicit."""
        there = {name: array for name, array in vars(self).items() if array is not None}
        taken = {
            name: array.take(index, axis=-1) for name, array in there.items() if name != "size"
        }
        return Paths(index.size, **{"slot": index, **taken})


def join(pieces: list[tuple[Rays, Paths]]) -> tuple[Rays, Paths]:
    """Return all rays and paths of `pieces`, which have the same fields, as one."""
    if len(pieces) == 1:
        return pieces[0]
    rays = {name: _joined([getattr(r, name) for r, _ in pieces]) for name in _names(Rays)}
    paths = {name: _joined([getattr(p, name) for _, p in pieces]) for name in _names(Paths)[1:]}
    return Rays(**rays), Paths(sum(p.size for _, p in pieces), **paths)


@cache
def _names(kind: type) -> list[str]:
    return [item.name for item in fields(kind)]


def _joined(arrays: list[Any]) -> Any:
    return None if arrays[0] is None else np.concatenate(arrays, axis=-1)
