"""instances, materials -> objects, traits.  What rays must know of the objects they meet.

Triangles that the same rays meet in the same way belong to one part of the scene; most scenes
have nothing but plain triangles, which are one part and cost nothing here.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..scene import CAMERA, DIFFUSE, EVERY_SET, GLOSSY, SHADOW, TRANSMISSION, Instance

CUTOFF = 0.1  # Blender's default "Shading Terminator Geometry Offset", a cosine
EVERY_RAY = CAMERA | DIFFUSE | GLOSSY | TRANSMISSION | SHADOW


@dataclass(frozen=True, eq=False)
class Objects:
    """Flags of I instances, in the scene's order.

    seen_by (I,) uint8, bits of the ray kinds; receiver_set and blocker_set (I,) uint8; receivers
    and blockers (I,) uint64, the masks of what glows; holdout, catcher and moves (I,) bool;
    terminator_geometry and terminator_shading (I,) float32, None where all are Blender's default.
    """

    seen_by: NDArray[np.uint8]
    receiver_set: NDArray[np.uint8]
    blocker_set: NDArray[np.uint8]
    receivers: NDArray[np.uint64]
    blockers: NDArray[np.uint64]
    holdout: NDArray[np.bool_]
    catcher: NDArray[np.bool_]
    moves: NDArray[np.bool_]
    terminator_geometry: NDArray[np.float32] | None
    terminator_shading: NDArray[np.float32] | None

    @property
    def catches(self) -> NDArray[np.bool_]:
        """Which objects (I,) show nothing but shadows to the camera; a holdout shows none."""
        return self.catcher & ~self.holdout

    @property
    def matter_to_hits(self) -> bool:
        """Whether a hit has to be told which object it lies on."""
        return bool(
            self.receiver_set.any()
            or self.holdout.any()
            or self.catcher.any()
            or (self.receivers != EVERY_SET).any()
            or (self.blockers != EVERY_SET).any()
            or self.terminator_geometry is not None
            or self.terminator_shading is not None
        )


@dataclass(frozen=True)
class Traits:
    """What the triangles of one part have in common: which rays meet them, and how.

    seen_by, bits of the ray kinds; is_transparent: shadow rays may pass; blocker_set is 0 where
    no light asks for it; moves: while the shutter is open.
    """

    seen_by: int = EVERY_RAY
    is_transparent: bool = False
    blocker_set: int = 0
    is_catcher: bool = False
    moves: bool = False


PLAIN = Traits()


def compile_objects(instances: Sequence[Instance], blurs: bool = True) -> Objects:
    """Return the flags of the instances as tables; nothing moves unless it `blurs`."""
    return Objects(
        np.array([i.seen_by.mask for i in instances], np.uint8),
        np.array([i.receiver_set for i in instances], np.uint8),
        np.array([i.blocker_set for i in instances], np.uint8),
        np.array([i.receivers for i in instances], np.uint64),
        np.array([i.blockers for i in instances], np.uint64),
        np.array([i.is_holdout for i in instances], np.bool_),
        np.array([i.is_shadow_catcher for i in instances], np.bool_),
        np.array([blurs and i.moves for i in instances], np.bool_),
        _unless_all([i.terminator_geometry for i in instances], CUTOFF),
        _unless_all([i.terminator_shading for i in instances], 0.0),
    )


def _unless_all(values: list[float], default: float) -> NDArray[np.float32] | None:
    """Return the values as a table, None if all are as float32 the default."""
    table = np.array(values, np.float32)
    return table if (table != np.float32(default)).any() else None


def sort_into_parts(
    objects: Objects,
    instance: NDArray[np.int32],
    material: NDArray[np.int32],
    transparent: Collection[int],
    links_shadows: bool,
) -> tuple[tuple[Traits, ...], NDArray[np.uint16] | None]:
    """Return the traits that occur and whose each triangle has (F,), None if all are the first.

    instance and material (F,) are numbers of the triangles; `transparent` are the numbers of the
    materials that shadow rays may pass; blockers are told apart if `links_shadows`.  Plain
    triangles are the first part, transparent ones the last.
    """
    codes = np.zeros((len(objects.seen_by), 4), np.uint8)
    codes[:, 0], codes[:, 2], codes[:, 3] = objects.seen_by, objects.catcher, objects.moves
    if links_shadows:
        codes[:, 1] = objects.blocker_set
    unique, of_instance = np.unique(codes, axis=0, return_inverse=True)
    all_traits = [
        Traits(int(seen_by), is_transparent, int(blocker_set), bool(is_catcher), bool(moves))
        for seen_by, blocker_set, is_catcher, moves in unique
        for is_transparent in (False, True)
    ]
    if len(unique) == 1 and not transparent:
        return (all_traits[0],), None

    # Number them by object and material, then leave out what no triangle has.
    number = np.multiply(of_instance.reshape(-1), 2).astype(np.uint16).take(instance)
    is_transparent = np.zeros(int(material.max()) + 1, np.uint16)
    is_transparent[[m for m in transparent if m < len(is_transparent)]] = 1
    number += is_transparent.take(material)
    used = np.flatnonzero(np.bincount(number, minlength=len(all_traits)))
    order = sorted(used, key=lambda n: _rank(all_traits[n], int(n)))
    traits = tuple(all_traits[n] for n in order)
    if len(traits) == 1:
        return traits, None
    new = np.zeros(len(all_traits), np.uint16)
    new[order] = np.arange(len(order))
    return traits, new.take(number)


def _rank(traits: Traits, number: int) -> tuple[bool, bool, bool, int]:
    return traits.is_transparent, traits.moves, traits != PLAIN, number
