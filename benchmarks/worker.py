"""requests on stdin -> renders.  A process with bpy in it that renders what it is asked to.

One request and one answer are a line of JSON each.  The wall time is that of
`bpy.ops.render.render`, with export and build; opening the file and reading pixels are outside.
"""

import json
import os
import sys
import tempfile
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import bpy
import numpy as np

from . import bounds, built, clocks, costs
from .contenders import DEFAULTS, OTHERS

# What both engines are told, so that nothing but the samples decides about the error.
COMMON = {"use_adaptive_sampling": False, "use_denoising": False, "time_limit": 0.0}
COMMON |= {"sample_clamp_direct": 0.0, "sample_clamp_indirect": 0.0, "blur_glossy": 0.0}
COMMON |= {"pixel_filter_type": "BLACKMAN_HARRIS", "filter_width": 1.5}
PARTS = ("export", "compile", "build", "sampling")  # of Penumbra's statistics


def open_scene(scene: str, blend: str | None, percentage: int) -> dict[str, Any]:
    """Open the file, or build the scene of this name; return the picture's size."""
    if blend is None:
        built.build(scene)
    else:
        bpy.ops.wm.open_mainfile(filepath=blend)
    render = bpy.context.scene.render
    render.resolution_percentage = percentage
    size = [max(1, v * percentage // 100) for v in (render.resolution_x, render.resolution_y)]
    return {"size": size}


def render_scene(
    engine: str, settings: dict[str, Any], samples: int, seed: int, threads: int, pixels: str
) -> dict[str, Any]:
    """Render; write the pixels (H, W, 3) to the .npy file `pixels`; return what was measured."""
    if engine in OTHERS:
        return _render_elsewhere(OTHERS[engine], settings, samples, seed, threads, pixels)
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    scene.render.use_persistent_data = False
    scene.view_layers[0].use_pass_combined = True
    options = scene.cycles if engine == "CYCLES" else scene.penumbra
    own = DEFAULTS if engine == "PENUMBRA" else {}
    for name, value in (COMMON | own | settings | {"samples": samples, "seed": seed}).items():
        setattr(options, name, value)
    if engine == "CYCLES":
        scene.cycles.device, scene.cycles.use_light_tree = "CPU", True
        _use_best_pattern(options)

    start, seconds, said = clocks.listened(perf_counter)
    if pixels:
        np.save(pixels, _pixels())
    answer: dict[str, Any] = {"seconds": seconds, "statistics": {}, "parts": {}}
    if engine == "CYCLES":
        answer["parts"] = parts_of_cycles(start, said)
    if engine == "PENUMBRA":
        from penumbra.addon import report

        answer["statistics"] = report.frames[-1]["statistics"]
        answer["parts"] = {part: answer["statistics"][f"{part}_seconds"] for part in PARTS}
        answer["not_honoured"] = report.frames[-1]["not_honoured"]
    return answer


def parts_of_cycles(start: float, said: list[tuple[float, str]]) -> dict[str, float]:
    """Return how long Cycles read, built and sampled, by when it said what; {} if it did not."""
    builds = [when for when, text in said if "Updating" in text or "Loading" in text]
    samples = [when for when, text in said if "Sample " in text]
    if not builds or len(samples) < 2:
        return {}
    return {
        "export": builds[0] - start,
        "build": samples[0] - builds[0],
        "sampling": samples[-1] - samples[0],
    }


def _render_elsewhere(
    mode: str, settings: dict[str, Any], samples: int, seed: int, threads: int, pixels: str
) -> dict[str, Any]:
    """Render with Mitsuba; the time is that of reading the scene, building and sampling."""
    from . import in_mitsuba

    start = perf_counter()
    picture, parts = in_mitsuba.render(mode, settings, samples, seed, threads)
    seconds = perf_counter() - start
    np.save(pixels, picture)
    return {"seconds": seconds, "statistics": {}, "parts": parts}


def cost_of(blend: str, feature: str, state: str, size: int) -> dict[str, Any]:
    """Render a state of a feature, of `costs`; return the CPU time, with export and build."""
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    scene.render.engine = "PENUMBRA"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    for name, value in (COMMON | {"pixel_filter_type": "BOX", "samples": costs.SAMPLES}).items():
        setattr(scene.penumbra, name, value)
    costs.BY_NAME[feature].apply(state, scene)
    start = process_time()
    bpy.ops.render.render()
    return {"cpu_seconds": process_time() - start}


def _use_best_pattern(options: Any) -> None:
    """Give Cycles the sampling pattern that it would choose by itself, in any Blender."""
    try:
        options.sampling_pattern = "AUTOMATIC"
    except TypeError:  # Blender 4.2 does not know that name yet
        options.sampling_pattern = "TABULATED_SOBOL"


def _pixels() -> np.ndarray:
    """Return the render result's colours (H, W, 3), through an EXR of 32 bits."""
    scene = bpy.context.scene
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "picture.exr")
        bpy.data.images["Render Result"].save_render(path, scene=scene)
        picture = bpy.data.images.load(path)
        width, height = picture.size
        flat = np.empty(width * height * picture.channels, np.float32)
        picture.pixels.foreach_get(flat)
        bpy.data.images.remove(picture)
    return flat.reshape(height, width, -1)[..., :3]


def save_scene(path: str) -> dict[str, Any]:
    """Write the open scene, with its picture if it has one, to a .blend file."""
    bpy.ops.file.pack_all()
    bpy.ops.wm.save_as_mainfile(filepath=path, compress=True)
    return {}


def latency(threads: int, repeats: int) -> dict[str, Any]:
    """Return what users of the viewport wait for, by scene."""
    from .latency import measure

    return measure(threads, repeats)


def version() -> dict[str, Any]:
    """Return the versions that the numbers depend on."""
    import penumbra

    penumbra.register()
    return {"blender": bpy.app.version_string, "penumbra": penumbra.__version__}


def main() -> None:
    """Answer requests until stdin ends."""
    # Blender prints to stdout: keep the real one for the answers.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    calls = {"open": open_scene, "save": save_scene, "render": render_scene, "version": version}
    calls["cost"] = cost_of
    calls["latency"] = latency
    calls |= {"scale": clocks.scale, "lock": clocks.lock, "stages": bounds.stages}
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = calls[request.pop("call")](**request)
        except Exception as error:  # the parent decides; it gets the reason
            answer = {"error": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
