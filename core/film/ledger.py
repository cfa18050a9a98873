"""layer, lights -> Ledger.  Which row of a sample's book each bit of light and data goes to.

A sample that is asked for more than its light keeps a book: rows that slots add to like to their
radiance.  Light belongs to the closure that scattered it first, on the way from the eye, and is
direct or indirect; besides to its light's group.  What nobody asks for goes to spare rows.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids
from ..layer import Layer, Mist
from ..scene import DIFFUSE as DIFFUSE_RAY
from ..scene import Instance, Material
from .cryptomatte import Matte
from .film import MIDDLES, rows
from .passes import needs_middles, sums_of, wanted

# What the light of a path was scattered by first: nothing yet, or one of these
UNSCATTERED, DIFFUSE, GLOSSY, TRANSMISSION = range(4)
LOBES = ("diffuse", "glossy", "transmission")

# What surfaces tell besides, where occlusion asks for it: the mean normal of matte closures
MATTE_NORMAL = "matte_normal"

# Whoever has no material shows Blender's own
DEFAULT_NAME = "default_surface"


@dataclass(frozen=True, eq=False)
class Ledger:
    """The rows of `names` of the film's sums: `size`, and behind them three to spare.

    lobes (4, 2): the first row of light by what scattered it and whether it is indirect; emission
    and environment: of what the eye sees directly.  Groups, None where there are none: the first
    row of light from light l or, the last one, the world (L + 1,), and of instances that glow (I,).
    shown: names of what surfaces tell of themselves.  has_middles: whether the middles of pixels
    are looked at, of which objects (I,) and materials (M,) have `numbers`.  mattes:
    the cryptomattes wanted; whose part a hit is, is instance x materials + material.
    """

    names: tuple[str, ...]
    size: int
    lobes: NDArray[np.intp]
    emission: int
    environment: int
    light_groups: Ids | None
    instance_groups: Ids | None
    sorts_light: bool
    shown: tuple[str, ...]
    has_middles: bool
    mattes: tuple[Matte, ...]
    materials: int
    numbers: tuple[NDArray[np.float32], NDArray[np.float32]]
    alpha_threshold: float
    mist: Mist
    occlusion_distance: float

    def row(self, name: str) -> int | None:
        """Return the first row of a sum, None if nobody asks for it."""
        if name not in self.names:
            return None
        return rows(self.names[: self.names.index(name)])

    @property
    def owners(self) -> int:
        """How many owners parts of pixels can have."""
        return len(self.numbers[0]) * self.materials

    @property
    def looks_once(self) -> bool:
        """Whether something is told by one surface only of those behind each other."""
        return any(
            name in ("normal", "uv", "speed") or name.startswith("aov") for name in self.names
        )


def lobe_of(kind: int) -> int:
    """Return the sort of light that closures shown as rays of a kind reflect."""
    return DIFFUSE if kind == DIFFUSE_RAY else GLOSSY


def surface_facts(layer: Layer, guides: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return what surfaces must tell of themselves: colours by lobe, normals, the user's values.

    guides: sums that the denoiser wants.
    """
    sums = tuple(dict.fromkeys((*sums_of(wanted(layer)), *guides)))
    own = *LOBES, "normal", "albedo", "bearing"
    facts = [name for name in sums if name in own or name.startswith("aov")]
    facts += [f"aov_alpha:{name}" for name, is_colour in layer.aovs if is_colour]
    return (*facts, MATTE_NORMAL) if "occlusion" in sums else tuple(facts)


def compile_ledger(
    layer: Layer,
    instances: Sequence[Instance],
    materials: Sequence[Material | None],
    lamp_groups: Sequence[str],
    glowing: Ids | None,
    world_group: str,
    found: Collection[int],
    guides: tuple[str, ...] = (),
) -> Ledger | None:
    """Return the book for a layer's passes, None if all it asks for is the light as a whole.

    Lights are lamps, of groups by name, then triangles of the instances `glowing` (n,).  found: the
    lobes that any surface has; light of others is not looked for.  guides: sums that the denoiser
    wants.
    """
    passes = wanted(layer)
    sums = dict.fromkeys((*sums_of(passes), *guides))
    names = tuple(name for name in sums if name not in MIDDLES)
    if not names and not layer.mattes and not needs_middles(passes):
        return None
    size = rows(names)
    spare = size

    def row(name: str) -> int:
        return rows(names[: names.index(name)]) if name in names else spare

    lobes = np.full((4, 2), spare, np.intp)
    for number, lobe in enumerate(LOBES, 1):
        if number not in found:
            continue
        lobes[number] = row(f"{lobe}_direct"), row(f"{lobe}_indirect")
    light_groups = instance_groups = None
    if layer.light_groups:
        of_instances = [row(f"group:{instance.light_group}") for instance in instances]
        instance_groups = np.array(of_instances, np.int32)
        of_lamps = np.array([row(f"group:{group}") for group in lamp_groups], np.int32)
        of_meshes = instance_groups[:0] if glowing is None else instance_groups.take(glowing)
        of_world = np.array([row(f"group:{world_group}")], np.int32)
        light_groups = np.concatenate([of_lamps, of_meshes, of_world])
        if (light_groups == spare).all() and (instance_groups == spare).all():
            light_groups = instance_groups = None
    indices = (
        np.array([instance.label.index for instance in instances], F32),
        np.array([0 if m is None else m.index for m in materials], F32),
    )
    ends = row("emission"), row("environment")
    return Ledger(
        names,
        size,
        lobes,
        *ends,
        light_groups,
        instance_groups,
        bool((lobes < spare).any()) or min(ends) < spare or light_groups is not None,
        surface_facts(layer, guides),
        needs_middles(passes),
        tuple(_matte(kind, instances, materials) for kind in layer.mattes),
        len(materials),
        indices,
        layer.alpha_threshold,
        layer.mist,
        layer.occlusion_distance,
    )


def _matte(kind: str, instances: Sequence[Instance], materials: Sequence[Material | None]) -> Matte:
    if kind == "CryptoMaterial":
        names = [DEFAULT_NAME if m is None else m.name for m in materials]
        return Matte(kind, tuple(names), 1, len(materials))
    own = [i.name if kind == "CryptoObject" else i.asset or i.name for i in instances]
    return Matte(kind, tuple(own), len(materials), len(instances))


__all__ = [
    "DIFFUSE",
    "GLOSSY",
    "LOBES",
    "MATTE_NORMAL",
    "TRANSMISSION",
    "UNSCATTERED",
    "Ledger",
    "compile_ledger",
    "lobe_of",
    "surface_facts",
]
