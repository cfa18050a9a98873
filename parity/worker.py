"""requests on stdin -> scenes and renders.  A process with bpy in it that does as it is told.

One request and one answer are a line of JSON each. The settings are those of both engines, so
that the pictures can only differ by what the engines make of the scene.
"""

import json
import os
import sys
import tempfile
from pathlib import Path
from time import perf_counter
from typing import Any

import bpy
import numpy as np
import OpenImageIO

from . import stage
from .fingerprint import fingerprint
from .scenes import SCENES

# What both engines are told, where a scene does not say otherwise.
COMMON: dict[str, Any] = {
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "time_limit": 0.0,
    "pixel_filter_type": "BLACKMAN_HARRIS",
    "filter_width": 1.5,
    "film_exposure": 1.0,
    "light_sampling_threshold": 0.0,
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 0.0,
    "blur_glossy": 0.0,
    "caustics_reflective": True,
    "caustics_refractive": True,
    "max_bounces": 12,
    "diffuse_bounces": 4,
    "glossy_bounces": 4,
    "transmission_bounces": 12,
    "transparent_max_bounces": 8,
}
# Tabulated points have no blue noise: seeds are independent, which the statistics rest on.
CYCLES = {"device": "CPU", "use_light_tree": True, "sampling_pattern": "TABULATED_SOBOL"}

_open: list[str] = []  # the name of the scene that is open, if one is


def open_scene(name: str) -> dict[str, Any]:
    """Build a scene in an empty file; return what identifies all that it consists of."""
    import penumbra

    entry = SCENES[name]
    _open.clear()
    stage.start(entry.width, entry.height)
    penumbra.register()
    scene = bpy.context.scene
    try:
        entry.build(stage)
    except stage.Missing as missing:
        return {"absent": str(missing)}
    for key, value in (COMMON | CYCLES | entry.settings).items():
        for options in (scene.cycles, scene.penumbra):
            if hasattr(options, key):
                setattr(options, key, value)
    _open.append(name)
    return {"fingerprint": fingerprint(scene)}


def render_scene(engine: str, samples: int, seed: int, threads: int, pixels: str) -> dict[str, Any]:
    """Render; write the pixels (H, W, 4) to the .npy file `pixels`; return what was measured."""
    from penumbra.addon import report

    if not _open:
        raise RuntimeError("no scene is open: the process was started anew")
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    for options in (scene.cycles, scene.penumbra):
        options.samples, options.seed = samples, seed
    report.clear()
    start = perf_counter()
    bpy.ops.render.render()
    seconds = perf_counter() - start
    np.save(pixels, _pixels(scene))
    answer: dict[str, Any] = {"seconds": seconds, "notes": []}
    if engine == "PENUMBRA":
        rows = report.frames[-1]["not_honoured"]
        answer["notes"] = [f"{row['owner']}: {row['what']}" for row in rows]
    return answer


def _pixels(scene: bpy.types.Scene) -> np.ndarray:
    """Return the render result (H, W, 4), premultiplied, the top row first."""
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGBA", "32"
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "picture.exr")
        bpy.data.images["Render Result"].save_render(path, scene=scene)
        picture = OpenImageIO.ImageBuf(path).get_pixels()
    return np.ascontiguousarray(picture, np.float32)


def version() -> dict[str, Any]:
    """Return the versions that the pictures depend on."""
    import penumbra

    return {"blender": bpy.app.version_string, "penumbra": penumbra.__version__}


def main() -> None:
    """Answer requests until stdin ends."""
    # Blender prints to stdout: keep the real one for the answers.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    calls = {"open": open_scene, "render": render_scene, "version": version}
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = calls[request.pop("call")](**request)
        except Exception as error:  # the parent decides; it gets the reason
            answer = {"error": f"{type(error).__name__}: {error}".strip()}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
