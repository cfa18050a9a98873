"""3D viewport -> what it shows.  Blender's thread: exports what changed, draws what is there.

Each viewport has a session: what is known of its scene, and a renderer with a thread of its own
(core/interactive.py).  That thread never touches Blender; a timer of Blender's looks whether there
is a new picture, and asks for a redraw.  Only the camera is read at each redraw; the scene when
Blender says that something changed, and of it only that.  A session ends with its engine, which
Blender frees when the viewport shows something else.
"""

import logging
import weakref
from dataclasses import fields, replace
from typing import Any

import bpy
import gpu
from gpu_extras.presets import draw_texture_2d

from ..core.interactive import Asked, Renderer, Shown
from ..core.scene import Camera, Instance, Lamp, Note, Scene, SceneError
from .export import Known, export_content
from .export.viewport import export_region_camera, read_viewport, viewport_key
from .preferences import limit_memory, thread_count
from .properties import listeners, read_viewport_settings
from .report import as_rows

_REDRAW = 1 / 30  # seconds between two looks at the renderers
_PIXEL_SIZES = {"AUTO": 1, "1": 1, "2": 2, "4": 4, "8": 8}

_log = logging.getLogger("penumbra")
sessions: list["Session"] = []


class Session:
    """One viewport that shows rendered pictures."""

    def __init__(self, engine: bpy.types.RenderEngine) -> None:
        self.engine = weakref.ref(engine)
        self.renderer = Renderer()
        self.known = Known()
        self.is_stale = True
        self.scene: Scene | None = None
        self.asked_scene: Scene | None = None
        self.last: tuple[Any, ...] = ()  # what was asked for last, but the scene
        self.view_key: tuple[Any, ...] = ()
        self.depsgraph = 0
        self.of = ""  # the name of the scene
        self.error = ""
        self.wants_pause = False
        self.drawn: Shown | None = None
        self.texture: gpu.types.GPUTexture | None = None
        self.exports = 0  # counted for tests and for whoever looks for what is slow

    def update(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Blender says that something has changed.

        Not every change makes it draw the viewport, though: new nodes do not.
        """
        self.known.forget_changed(depsgraph.updates)
        self.is_stale = True
        _watch()

    def forget(self) -> None:
        """Everything may have changed."""
        self.known.forget()
        self.is_stale = True
        _watch()

    def draw(
        self,
        engine: bpy.types.RenderEngine,
        context: bpy.types.Context,
        depsgraph: bpy.types.Depsgraph,
    ) -> None:
        """Ask for another picture if there is reason to, and draw the one that is there."""
        try:
            self.ask(engine, context, depsgraph)
            self.error = ""
        except SceneError as error:
            self.error = str(error)
        except Exception as error:  # noqa: BLE001  (Blender would show nothing, and not say why)
            if str(error) != self.error:
                _log.exception("Penumbra failed in the viewport")
            self.error = str(error)
        self.paint(engine, context)
        engine.update_stats("Penumbra", self.status())

    def ask(
        self,
        engine: bpy.types.RenderEngine,
        context: bpy.types.Context,
        depsgraph: bpy.types.Depsgraph,
    ) -> None:
        """Read what has changed, and hand it to the renderer."""
        region, space, view = context.region, context.space_data, context.region_data
        self.of = depsgraph.scene.name
        scene = depsgraph.scene  # where changes of our settings are seen at once
        settings = limit_memory(read_viewport_settings(scene, depsgraph.view_layer))
        self.wants_pause = scene.penumbra.preview_pause
        self.wait_if_asked()
        notes: list[Note] = []
        camera = export_region_camera(engine, depsgraph, region, space, view, notes)

        # Read the scene, if anything but the view may be different.
        key = viewport_key(space)
        if depsgraph.as_pointer() != self.depsgraph:
            self.depsgraph = depsgraph.as_pointer()
            self.forget()
        if self.is_stale or key != self.view_key or self.scene is None:
            shows = read_viewport(space, scene.world)
            self.exports += 1
            # A scene that cannot be read is tried again when Blender draws, not by our timer.
            old, self.scene, self.is_stale = self.scene, None, False
            new = export_content(depsgraph, camera, notes, known=self.known, view=shows)
            # The frame matters to the noise alone; a still scene goes on while others move.
            frame = new.frame if settings.use_animated_seed else 0
            self.scene, self.view_key = _keep_equal(replace(new, frame=frame), old), key

        # Ask, if that makes a difference.
        render = scene.render
        asked = (
            _camera_key(camera),
            settings,
            thread_count(render),
            view.view_distance if view.view_perspective != "CAMERA" else 10 * camera.clip_start,
            _PIXEL_SIZES.get(render.preview_pixel_size, 1),
        )
        if asked != self.last or self.scene is not self.asked_scene:
            self.last, self.asked_scene = asked, self.scene
            whole = replace(self.scene, camera=camera)
            self.renderer.ask(Asked(whole, settings, *asked[2:]))
            _watch()

    def wait_if_asked(self) -> None:
        """Pause while the user wants it, or all threads are wanted for a final picture."""
        self.renderer.pause(self.wants_pause or bpy.app.is_job_running("RENDER"))

    def paint(self, engine: bpy.types.RenderEngine, context: bpy.types.Context) -> None:
        """Draw the newest picture into the region, through Blender's colour management."""
        shown = self.renderer.shown
        if shown is not self.drawn:
            self.drawn = shown
            self.texture = None if shown is None or shown.pixels is None else _texture(shown)
        if self.texture is None or self.drawn is None or self.error:
            return
        # A picture of a viewport that has another size by now is stretched.
        region, (width, height) = context.region, self.drawn.frame
        across, up = region.width / width, region.height / height
        x, y, _, _ = self.drawn.rectangle
        size = self.drawn.size
        gpu.state.blend_set("ALPHA_PREMULT")
        engine.bind_display_space_shader(context.scene)
        draw_texture_2d(
            self.texture,
            (x * across, y * up),
            self.texture.width * size * across,
            self.texture.height * size * up,
        )
        engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

    def status(self) -> str:
        """Return what is going on, in words."""
        shown, renderer = self.drawn, self.renderer
        if self.error:
            return self.error
        if shown is not None and shown.error:
            return shown.error
        if renderer.status and (shown is None or shown.number != renderer.asked):
            return renderer.status
        if shown is None:
            return "Starting"
        words = ["Done" if shown.complete else "Paused" if renderer.is_paused else ""]
        words += [f"Sample {shown.samples}/{shown.of}" if shown.samples else "First picture"]
        count = len(shown.notes)
        words += [f"{count} not honoured" if count else ""]
        return " | ".join(filter(None, words))

    def look(self, always: bool = False) -> bool:
        """Ask for a redraw if there is reason to, or `always`; return whether more may come."""
        engine = self.engine()
        if engine is None:
            self.close()
            return False
        self.wait_if_asked()
        is_behind = self.is_stale or self.renderer.shown is not self.drawn
        try:
            if always or is_behind:
                engine.tag_redraw()
        except ReferenceError:  # Blender has freed it
            self.close()
            return False
        return self.renderer.is_busy or is_behind

    def is_wanted(self) -> bool:
        """Is its scene still one that this engine renders?

        Where undo goes back to before the engine was chosen, Blender keeps the engine and does
        not draw with it.
        """
        engine, scene = self.engine(), bpy.data.scenes.get(self.of)
        chosen = scene is None or engine is None or scene.render.engine == engine.bl_idname
        return not self.of or chosen

    @property
    def is_closed(self) -> bool:
        """Whether it has ended; its engine may want another one."""
        return self not in sessions

    def close(self) -> None:
        """End the renderer's thread, without waiting for it."""
        self.renderer.close()
        self.texture = None
        if self in sessions:
            sessions.remove(self)


def open_session(engine: bpy.types.RenderEngine) -> Session:
    """Return a new session for the viewport of an engine."""
    session = Session(engine)
    sessions.append(session)
    return session


def _keep_equal(new: Scene, old: Scene | None) -> Scene:
    """Return the new scene with what of the old one is equal: it is not compiled again."""
    if old is None:
        return new
    instances = _kept(new.instances, old.instances)
    lamps = _kept(new.lamps, old.lamps)
    rest = ("world", "film_transparent", "frame", "notes")
    same = instances is old.instances and lamps is old.lamps
    if same and all(getattr(new, name) == getattr(old, name) for name in rest):
        return old
    return replace(new, instances=instances, lamps=lamps)


def _kept(new: tuple[Any, ...], old: tuple[Any, ...]) -> tuple[Any, ...]:
    if len(new) == len(old):
        kept = tuple(b if _key(a) == _key(b) else a for a, b in zip(new, old, strict=True))
        return old if kept == old else kept
    return new


_NAMES = {kind: [f.name for f in fields(kind)] for kind in (Instance, Lamp, Camera)}


def _key(item: Any) -> tuple[Any, ...]:
    values = (getattr(item, name) for name in _NAMES[type(item)])
    return tuple(v.tobytes() if hasattr(v, "tobytes") else v for v in values)


def _camera_key(camera: Camera) -> tuple[Any, ...]:
    return _key(camera)


def _texture(shown: Shown) -> gpu.types.GPUTexture:
    pixels = shown.pixels
    assert pixels is not None
    height, width = pixels.shape[:2]
    buffer = gpu.types.Buffer("FLOAT", pixels.size, pixels.reshape(-1))
    return gpu.types.GPUTexture((width, height), format="RGBA16F", data=buffer)


def latest_rows() -> list[dict[str, str]]:
    """Return what the viewports do not honour, in the form of the JSON report."""
    shown = [session.drawn for session in sessions if session.drawn is not None]
    return [row for each in shown for row in as_rows(each.notes)]


# Blender's timer, and what tells that everything may have changed


def redraw() -> None:
    """Let all viewports look whether they should ask for another picture."""
    for session in list(sessions):
        session.look(always=True)


def _watch() -> None:
    if not bpy.app.timers.is_registered(_look):
        bpy.app.timers.register(_look, persistent=True)


def _look() -> float | None:
    more = [session.look() for session in list(sessions)]
    return _REDRAW if any(more) else None


@bpy.app.handlers.persistent
def _forget(*_: Any) -> None:
    for session in list(sessions):
        if session.is_wanted():
            session.forget()
        else:
            session.close()


_HANDLERS = ("undo_post", "redo_post", "load_post")


def register() -> None:
    """Listen to what Blender does not tell viewports."""
    for name in _HANDLERS:
        getattr(bpy.app.handlers, name).append(_forget)
    listeners.append(redraw)


def unregister() -> None:
    """End all sessions."""
    for session in list(sessions):
        session.close()
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    if redraw in listeners:
        listeners.remove(redraw)
    for name in _HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if _forget in handlers:
            handlers.remove(_forget)
