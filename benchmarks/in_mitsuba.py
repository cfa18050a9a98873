"""the open scene -> Mitsuba 3's picture of it.  The path tracer of its wheel, on the CPU.

`scalar_rgb` needs nothing but the wheel; `llvm_ad_rgb` is faster, and needs an LLVM of the machine
that the wheel gets on with (it ends the process where it does not).
"""

import importlib.util
import tempfile
from pathlib import Path
from time import perf_counter
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .mitsuba_scene import NotExpressed, describe


def render(
    mode: str, settings: dict[str, Any], samples: int, seed: int, threads: int
) -> tuple[NDArray[np.float32], dict[str, float]]:
    """Return the picture (H, W, 3), the lowest row first, and the seconds of each part.

    Raises NotExpressed if Mitsuba is not installed, or the scene has what is not exported.
    """
    if importlib.util.find_spec("mitsuba") is None:
        raise NotExpressed("Mitsuba is not installed")
    import drjit as dr
    import mitsuba as mi

    if mi.variant() != mode:
        mi.set_variant(mode)
    mi.set_log_level(mi.LogLevel.Error)
    dr.set_thread_count(threads)
    for name, value in settings.items():
        setattr(bpy.context.scene.cycles, name, value)

    start = perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        found = describe(mi, samples, Path(folder))
        told = perf_counter()
        scene = mi.load_dict(found)
    built = perf_counter()
    picture = np.array(mi.render(scene, spp=samples, seed=seed), np.float32)
    parts = {"export": told - start, "build": built - told, "sampling": perf_counter() - built}
    return np.ascontiguousarray(picture[::-1, :, :3]), parts
