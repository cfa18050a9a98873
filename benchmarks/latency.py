"""edits -> seconds until something is seen.  What a user of the viewport waits for.

Runs in a worker.  Measured from the change to the first picture of it: reading the scene,
compiling, building and sampling, as the rendered viewport does it, but without Blender's window,
which looks for pictures 30 times a second.  A cancel is measured from the wish to the picture that
is kept.
"""

import threading
from collections.abc import Callable
from dataclasses import replace
from statistics import median
from time import perf_counter
from typing import Any

import bpy
import numpy as np

from . import built

SIZE = 960, 540
SAMPLES = 1 << 20  # more than there is time for
# Name in the table -> scene: Blender's own, or one of `built`
SCENES = {"default scene": "", "500 K triangles": "big_mesh-viewport"}
PATIENCE = 120.0  # [s]


class _View:
    """A viewport without a window: what is known of the scene, and the renderer."""

    def __init__(self, threads: int) -> None:
        from penumbra.addon.export import Known
        from penumbra.core.interactive import Renderer

        self.threads = threads
        self.known = Known()
        self.scene: Any = None
        self.camera = _camera()
        self.came = threading.Condition()
        self.pictures: list[tuple[int, int, float]] = []  # number, samples, when
        self.renderer = Renderer(self._take)

    def _take(self, shown: Any) -> None:
        assert not shown.error, shown.error
        with self.came:
            self.pictures.append((shown.number, shown.samples, perf_counter()))
            self.came.notify_all()

    def read(self) -> None:
        """Read what has changed."""
        from penumbra.addon.export import export_content
        from penumbra.addon.viewport import _keep_equal

        depsgraph = bpy.context.evaluated_depsgraph_get()
        self.known.forget_changed(depsgraph.updates)
        new = export_content(depsgraph, self.camera, [], known=self.known)
        self.scene = new if self.scene is None else _keep_equal(new, self.scene)

    def show(self, start: float) -> tuple[float, float]:
        """Ask for a picture; return the seconds to the first one, and to one of all pixels."""
        from penumbra.core.interactive import Asked

        scene = replace(self.scene, camera=self.camera)
        number = self.renderer.ask(Asked(scene, _settings(), self.threads, 10.0))
        first = self._wait(lambda row: row[0] == number)
        whole = self._wait(lambda row: row[0] == number and row[1] > 0)
        return first - start, whole - start

    def _wait(self, wanted: Callable[[tuple[int, int, float]], bool]) -> float:
        with self.came:
            if not self.came.wait_for(lambda: any(map(wanted, self.pictures)), PATIENCE):
                raise RuntimeError(f"there was no picture in {PATIENCE:.0f} s")
            return next(when for row in self.pictures if wanted(row) for when in row[2:])

    def close(self) -> None:
        """End the renderer's thread."""
        self.renderer.close()
        self.renderer.join()


def _settings() -> Any:
    from penumbra.core.settings import Settings

    return Settings(samples=SAMPLES, use_adaptive_sampling=False, use_denoising=False)


def _camera() -> Any:
    from penumbra.addon.export.view import frame_window
    from penumbra.core.scene import Camera

    scene = bpy.context.scene
    eye, render = scene.camera, scene.render
    return Camera(
        to_world=np.array(eye.matrix_world, np.float64)[:3],
        window=frame_window(eye.data, render, *SIZE, 0.0),
        width=SIZE[0],
        height=SIZE[1],
        clip_start=eye.data.clip_start,
        clip_end=eye.data.clip_end,
    )


def _moved(camera: Any) -> Any:
    """Return the camera a little to the right."""
    place = camera.to_world.copy()
    place[:, 3] += 0.05 * place[:, 0]
    return replace(camera, to_world=place)


def _cancel(view: _View) -> float:
    """Return the seconds between the wish to stop and the picture."""
    from penumbra import core

    plan = core.compile_plan(replace(view.scene, camera=view.camera), _settings())
    wish = threading.Event()
    threading.Timer(0.5, wish.set).start()
    wished = 0.0

    def tick(_progress: Any) -> bool:
        return wish.is_set()

    def note() -> None:
        nonlocal wished
        wish.wait()
        wished = perf_counter()

    watch = threading.Thread(target=note)
    watch.start()
    picture = core.render(plan, view.threads, tick)
    picture.combined()
    end = perf_counter()
    watch.join()
    return end - wished


def measure(threads: int, repeats: int) -> dict[str, dict[str, float]]:
    """Return medians [s] by scene and by what is waited for."""
    found = {}
    for name, scene in SCENES.items():
        if scene:
            built.build(scene)
        else:
            bpy.ops.wm.read_factory_settings()
        bpy.context.view_layer.update()
        node = bpy.data.materials[0].node_tree.nodes["Principled BSDF"]
        rows: dict[str, list[float]] = {}
        for repeat in range(repeats + 1):
            times = _once(node, threads, repeat)
            for what, seconds in times.items() if repeat else ():  # the first one loads modules
                rows.setdefault(what, []).append(seconds)
        found[name] = {what: median(seconds) for what, seconds in rows.items()}
    return found


def _once(node: Any, threads: int, repeat: int) -> dict[str, float]:
    view, times = _View(threads), {}
    try:
        start = perf_counter()
        view.read()
        times["first picture"], times["first whole picture"] = view.show(start)

        start = perf_counter()
        view.camera = _moved(view.camera)
        times["camera move"], _ = view.show(start)

        start = perf_counter()
        node.inputs["Base Color"].default_value = (0.1 * (repeat % 9), 0.5, 0.2, 1)
        view.read()
        times["material edit"], _ = view.show(start)
    finally:
        view.close()
    times["cancel"] = _cancel(view)
    return times
