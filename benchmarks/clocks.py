"""axis, value -> what a render of it takes, in processor time.  The far side of `scaling.py`.

Wall time on a shared machine says what else it does.  So sampling is measured in processor time, of
this process and of those that it forks, from the moment when the scene is built.
"""

import os
import resource
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from time import monotonic, process_time, thread_time
from typing import Any
from unittest.mock import patch

from . import axes
from .interpreter import lock_address

PLAIN = {"use_adaptive_sampling": False, "use_denoising": False, "pixel_filter_type": "BOX"}
PLAIN |= {"sample_clamp_indirect": 0.0, "blur_glossy": 0.0}


def children() -> float:
    """Return the processor time of processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def scale(
    engine: str, axis: str, value: int, threads: int = 1, workers: str = "THREADS"
) -> dict[str, Any]:
    """Render the scene of a value; return seconds of processor time and of export and the like."""
    import bpy

    samples = axes.BY_NAME[axis].build(bpy, value)
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    options = scene.cycles if engine == "CYCLES" else scene.penumbra
    for name, wanted in (PLAIN | {"samples": samples}).items():
        setattr(options, name, wanted)
    if engine == "CYCLES":
        scene.cycles.device = "CPU"
        return _of_cycles()
    options.workers, options.path_reuse = workers, "OFF"
    options.light_samples = options.scatter_samples = 1
    return _of_penumbra()


def listened(clock: Callable[[], float]) -> tuple[float, float, list[tuple[float, str]]]:
    """Render; return when that began, how long it took, and when Blender said what meanwhile."""
    import bpy

    said: list[tuple[float, str]] = []
    listeners = bpy.app.handlers.render_stats
    listeners.append(lambda text, *_: said.append((clock(), str(text))))
    begin = clock()
    bpy.ops.render.render()
    taken = clock() - begin
    listeners.pop()
    return begin, taken, said


def _of_cycles() -> dict[str, Any]:
    """Return the processor time between what Cycles says of its first and its last sample."""
    _, whole, said = listened(process_time)
    found = [when for when, text in said if "Sample " in text]
    sampling = found[-1] - found[0] if len(found) > 1 else whole
    return {"sampling": sampling, "rest": whole - sampling, "parts": {}}


def _of_penumbra() -> dict[str, Any]:
    import bpy

    from penumbra.addon import report

    begin, before = process_time(), children()
    with _sampling() as found:
        bpy.ops.render.render()
    whole = process_time() - begin + children() - before
    statistics = report.frames[-1]["statistics"]
    parts = {part: statistics[f"{part}_seconds"] for part in ("export", "compile", "build")}
    keys = ("path_vertices", "triangles", "processes", "embree_seconds", "stage_seconds")
    found |= {key: statistics[key] for key in keys}
    return found | {"rest": whole - found["sampling"], "parts": parts}


@contextmanager
def _sampling() -> Iterator[dict[str, Any]]:
    """Measure the core's sampling: in all, in this process alone, and when it was."""
    from penumbra import core
    from penumbra.core import statistics
    from penumbra.core.geometry import accel

    found: dict[str, Any] = {}
    render = core.render

    def measured(*arguments: Any, **more: Any) -> Any:
        own, others = process_time(), children()
        with ExitStack() as stack:
            for module in (statistics, accel):  # stages are timed by the processor, too
                stack.enter_context(patch.object(module, "perf_counter", thread_time))
            found["begin"] = monotonic()
            picture = render(*arguments, **more)
            found["end"] = monotonic()
        found["own"] = process_time() - own
        found["sampling"] = found["own"] + children() - others
        return picture

    with patch.object(core, "render", measured):
        yield found


def lock() -> dict[str, Any]:
    """Return where this process keeps whether its interpreter is taken."""
    return {"pid": os.getpid(), "address": lock_address()}
