"""scene -> converged picture.  Rendered by Cycles in two halves of different seeds, and kept.

The folder `cache` beside this file is not tracked; a file's name holds a hash of the .blend or the
code that builds the scene, the settings, the size, the sample count and Blender's version, so that
a changed scene is rendered anew.
"""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..parity.results import flip
from . import built
from .errors import measure
from .scenes import Scene

CACHE = Path(__file__).resolve().parent / "cache"
SEEDS = (1000003, 2000003)


@dataclass(frozen=True)
class Reference:
    """The converged picture (H, W, 3) and its own squared errors by metric."""

    picture: NDArray[np.float32]
    noise: dict[str, float]
    seconds: float
    flip: float | None = None  # HDR-FLIP between the halves


def reference(scene: Scene, cycles: Any, threads: int, blender: str) -> Reference:
    """Return the reference from the cache, or render it with the worker `cycles`."""
    path = CACHE / f"{scene.name}-{key(scene, blender)}.npz"
    if not path.exists():
        CACHE.mkdir(exist_ok=True)
        halves, seconds = [], 0.0
        for seed in SEEDS:
            answer, picture = cycles.render("CYCLES", scene, scene.reference // 2, seed, threads)
            halves.append(picture)
            seconds += answer["seconds"]
        partial = path.with_suffix(".partial.npz")
        np.savez(partial, a=halves[0], b=halves[1], seconds=seconds)
        partial.replace(path)
    with np.load(path) as kept:
        a, b, seconds = kept["a"], kept["b"], float(kept["seconds"])
    mean = (a + b) / 2
    return Reference(mean, measure((a - b) / 2, mean), seconds, flip(a, b))


def key(scene: Scene, blender: str) -> str:
    """Return a hash of all that the reference depends on, and of nothing else."""
    blend = scene.blend()
    digest = hashlib.sha256(blend.read_bytes() if blend else built.fingerprint(scene.name))
    rest = [scene.settings, scene.percentage, scene.reference, SEEDS, blender]
    digest.update(json.dumps(rest, sort_keys=True).encode())
    return digest.hexdigest()[:16]
