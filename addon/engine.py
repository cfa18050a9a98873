"""F12 -> picture.  Blender's thread: exports, hands over to the core, shows what comes back.

Blender punishes engines that fail: an exception in `render` leaves a blank picture and a
successful operator, and a render layer without a result crashes it when a multilayer EXR is
written.  So `render` catches everything, reports ERROR, and ends a result in any case.
"""

import logging
import math
from dataclasses import replace
from time import perf_counter
from typing import Any

import bpy
import numpy as np

from .. import __version__, core
from ..core.film.cryptomatte import metadata as matte_metadata
from ..core.images.shelf import Shelf
from ..core.kept import KEEP_NOTHING, KeepNothing
from ..core.scene import Cancelled, Scene, SceneError
from ..core.settings import Settings
from . import report, viewport
from .export import export_scene, export_view, read_frame
from .export.layers import blender_name, blender_passes, channel_type
from .preferences import limit_memory, thread_count
from .properties import read_preview_settings, read_settings
from .switch import switch

ENGINE = "PENUMBRA"

progress_listener = None  # None, or called with the progress at every tick (headless use)

_WATCHED = not bpy.app.background  # does anybody see the picture before it is finished?
shelf = Shelf()  # images of the last renders, as long as the file is open

_log = logging.getLogger("penumbra")
_STATUS_INTERVAL = 0.2  # [s]
_FIRST_PICTURE = 0.3  # [s]
_PICTURE_INTERVAL = 2.0  # [s] between pictures once the render has run for a while
_PICTURE_SHARE = 0.02  # of the time may go into showing pictures


class PenumbraRenderEngine(bpy.types.RenderEngine):
    """Blender's handle on a render; one per frame, or one per animation with persistent data."""

    bl_idname = ENGINE
    bl_label = "Penumbra"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_eevee_viewport = True
    bl_use_custom_freestyle = False
    bl_use_gpu_context = False
    bl_use_shading_nodes_custom = False
    bl_use_spherical_stereo = True

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render one frame of one view layer; nothing is raised."""
        job = _Job(self, depsgraph)
        try:
            job.run()
        except Cancelled:
            self.update_stats("", "Cancelled")
        except SceneError as error:
            job.fail(str(error))
        except Exception as error:  # noqa: BLE001  (Blender would drop it: the user must see it)
            _log.exception("Penumbra failed")
            job.fail(f"{type(error).__name__}: {error}")
        finally:
            job.close()

    _session: viewport.Session | None = None

    def update_render_passes(
        self, scene: bpy.types.Scene | None = None, renderlayer: bpy.types.ViewLayer | None = None
    ) -> None:
        """Tell Blender, and its compositor, which passes a view layer has."""
        for name, channels in blender_passes(scene, renderlayer):
            kind = channel_type(channels)
            self.register_pass(scene, renderlayer, name, len(channels), channels, kind)

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Something that the viewport shows has changed, if Blender draws with this engine."""
        if self._session is not None and not self._session.is_closed:
            self._session.update(depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draw what there is of the rendered viewport; nothing is raised."""
        if self._session is None or self._session.is_closed:
            self._session = viewport.open_session(self)
        self._session.draw(self, context, depsgraph)

    def __del__(self) -> None:
        """Blender frees the engine: end its thread."""
        if self._session is not None:
            self._session.close()
            self._session = None


class _Job:
    """One call of `render`: a view layer, with all its views."""

    def __init__(self, engine: PenumbraRenderEngine, depsgraph: bpy.types.Depsgraph) -> None:
        self.engine = engine
        self.depsgraph = depsgraph
        self.layer = depsgraph.view_layer.name
        self.view = ""
        self.result: bpy.types.RenderResult | None = None
        self.ended = False

    def run(self) -> None:
        """Export once, then compile and sample each view."""
        engine, depsgraph = self.engine, self.depsgraph
        self.say("Reading the scene")
        start = perf_counter()
        read = read_preview_settings if engine.is_preview else read_settings
        settings = limit_memory(read(depsgraph.scene_eval, depsgraph.view_layer_eval))
        views = [view.name for view in engine.get_result().views]
        scene = None
        for self.view in views:
            engine.active_view_set(self.view)
            scene = self.export(scene)
            self.sample(scene, settings, perf_counter() - start)
            start = perf_counter()

    def export(self, scene: Scene | None) -> Scene:
        """Return the scene seen by the active view; all but the camera is read once."""
        engine, depsgraph = self.engine, self.depsgraph
        frame = read_frame(engine, depsgraph.scene_eval.render)
        if scene is None:
            return export_scene(
                engine, depsgraph, frame, engine.test_break, None if engine.is_preview else shelf
            )
        notes = list(scene.notes)
        camera = export_view(engine, depsgraph, frame, notes, engine.test_break)
        return replace(scene, camera=camera, notes=tuple(dict.fromkeys(notes)))

    def sample(self, scene: Scene, settings: Settings, export_seconds: float) -> None:
        """Render one view, write it to Blender's result, and tell how it went."""
        engine = self.engine
        plan = core.compile_plan(
            scene,
            settings,
            announce=self.say,
            should_stop=engine.test_break,
            kept=KEEP_NOTHING if engine.is_preview else KeepNothing(shelf),
        )
        render = self.depsgraph.scene_eval.render
        self.say("Sampling")
        threads = thread_count(render)
        picture = core.render(plan, threads, on_tick=_Ticker(self), lingers=False)
        self.write(picture)
        self.write_passes(picture)
        self.end()
        statistics = dict(picture.statistics, export_seconds=export_seconds)
        if not engine.is_preview:
            self.tell(picture, statistics, settings)

    def tell(self, picture: Any, statistics: dict[str, Any], settings: Settings) -> None:
        """Add to the report, to the picture's metadata and to Blender's info area."""
        engine, scene, plan = self.engine, self.depsgraph.scene, picture.plan
        notes = (*plan.notes, *picture.notes)
        entry = {
            "frame": scene.frame_current,
            "output": bpy.path.abspath(scene.render.frame_path(frame=scene.frame_current)),
            "view_layer": self.layer,
            "view": self.view,
            "resolution": list(picture.combined().shape[1::-1]),
            "samples": picture.samples,
            "complete": picture.complete,
            "plan": plan.describe(),
            "not_honoured": report.as_rows(notes),
            "statistics": statistics,
        }
        report.frames.append(entry)
        offset = settings.sample_range()[0]
        result = engine.get_result()
        fields = report.metadata(entry, __version__, settings.seed, offset)
        for matte in plan.ledger.mattes if plan.ledger is not None else ():
            fields |= matte_metadata(f"{self.layer}.{matte.kind}", matte.names)
        for key, value in fields.items():
            result.stamp_data_add_field(key, value)
        sentence = report.sentence(notes)
        if sentence:
            engine.report({"INFO"}, sentence)

    def say(self, text: str) -> None:
        """Show what is going on in Blender's status line."""
        self.engine.update_stats("", f"{self.layer} | {text}")

    # Blender's result: begun when there is something to show, ended exactly once per view

    def begin(self) -> bpy.types.RenderResult:
        if self.result is None:
            size = self.engine.get_result()
            self.result = self.engine.begin_result(
                0,
                0,
                size.resolution_x,
                size.resolution_y,
                layer=self.layer,
                view=self.view,
            )
        return self.result

    def write(self, picture: Any) -> None:
        """Put a picture (H, W, 4) into the Combined pass, row 0 at the bottom on both sides."""
        self.put("Combined", picture.combined())

    def write_passes(self, picture: Any) -> None:
        """Put all other passes where Blender wants them; what is not drawn stays 0."""
        for pass_, pixels in picture.passes():
            self.put(blender_name(pass_), pixels)
        for name, pixels in picture.mattes():
            self.put(name, pixels)

    def put(self, name: str, pixels: Any) -> None:
        """Put an array (H, W, C) into a pass."""
        found = self.begin().layers[0].passes.find_by_name(name, self.view)
        if found is None:
            raise RuntimeError(f"Blender has no room for the pass {name!r}")
        found.rect.foreach_set(np.ascontiguousarray(pixels, np.float32).reshape(-1))

    def end(self, cancel: bool = False) -> None:
        self.engine.end_result(self.begin(), cancel=cancel, do_merge_results=cancel)
        self.result = None
        self.ended = True

    def close(self) -> None:
        """End the open result, or an empty one if there was none at all."""
        if self.result is not None or not self.ended:
            self.end(cancel=True)

    def fail(self, message: str) -> None:
        """Make Blender know that there is no picture; an icon without one is told to the log."""
        if self.engine.is_preview:
            _log.error("Preview: %s", message)
            return
        report.errors.append(message)
        self.engine.error_set(message)
        self.engine.report({"ERROR"}, message)


class _Ticker:
    """Called by the core about every 50 ms; tells the user, and the core if it is to stop."""

    def __init__(self, job: _Job) -> None:
        self.job = job
        self.next_status = 0.0
        self.next_picture = perf_counter() + _FIRST_PICTURE if _WATCHED else math.inf
        self.interval = _FIRST_PICTURE

    def __call__(self, progress: Any) -> bool:
        if progress_listener is not None:
            progress_listener(progress)
        now = perf_counter()
        if now >= self.next_status:
            self.next_status = now + _STATUS_INTERVAL
            self.show_status(progress)
        if now >= self.next_picture:
            self.show_picture(progress)
        return self.job.engine.test_break()

    def show_status(self, progress: Any) -> None:
        engine = self.job.engine
        engine.update_progress(progress.fraction)
        megabytes = progress.memory / 2**20
        engine.update_memory_stats(memory_used=megabytes, memory_peak=megabytes)
        self.job.say(status(progress))

    def show_picture(self, progress: Any) -> None:
        """Update Blender's picture; the next one is due later, and no sooner than it costs."""
        start = perf_counter()
        self.job.write(progress.picture())
        self.job.engine.update_result(self.job.result)
        end = perf_counter()
        self.interval = min(2.0 * self.interval, _PICTURE_INTERVAL)
        self.next_picture = end + max(self.interval, (end - start) / _PICTURE_SHARE)


def status(progress: Any) -> str:
    """Return the progress in words: samples, remaining time, memory, speed."""
    parts = [f"Sample {int(progress.sample)}/{progress.samples}"]
    if progress.remaining is not None:
        minutes, seconds = divmod(round(progress.remaining), 60)
        hours, minutes = divmod(minutes, 60)
        clock = f"{hours}:{minutes:02}:{seconds:02}" if hours else f"{minutes:02}:{seconds:02}"
        parts.append(f"Remaining {clock}")
    parts.append(f"Memory {progress.memory / 2**20:.0f} MB")
    parts.append(f"{progress.rays_per_second / 1e6:.1f} M rays/s")
    return " | ".join(parts)


@bpy.app.handlers.persistent
def _loaded(_path: str) -> None:
    shelf.clear()  # another file has other images


_register, _unregister = switch(PenumbraRenderEngine)


def register() -> None:
    """Make Blender know the engine."""
    _register()
    bpy.app.handlers.load_post.append(_loaded)


def unregister() -> None:
    """Take the engine away; Blender stops running renders of it."""
    if _loaded in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(_loaded)
    shelf.clear()
    _unregister()
