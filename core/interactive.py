"""scenes, one after the other -> pictures that get better.  What the rendered viewport shows.

One thread renders the scene that was asked for last.  First comes a coarse picture, as fine as a
twentieth of a second allows, then finer ones, then sample upon sample at full resolution.  A newer
scene ends all of that but the first coarse picture, so that something moves while a user drags;
what has not changed is not compiled again (`kept`).

Nothing here waits for the thread: pictures are taken when there are some.
"""

import logging
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import F32
from .compile import compile_plan
from .geometry.mesh import bounds
from .kept import Kept
from .plan import Plan
from .render import Picture, Progress, render
from .sampling.patterns import PATTERNS
from .scene import Camera, Cancelled, Note, Scene, SceneError
from .settings import UNLIMITED, Settings

FIRST = 0.05  # seconds that the first picture may take to sample
COARSEST = 16  # pixels, the side of its largest blocks
SPEED = 1e6  # samples per second, until it is known
BATCH = 1 << 16  # slots in flight: what somebody waits for ends soon, and begins at once
REFRESH, REFRESH_MOST = 0.12, 1.0  # seconds between pictures, at first and later
LARGEST = 65000.0  # that a float16 holds

# A local origin is kept while the camera is within so many times the distance it looks at: then
# positions near it are rounded by a thousandth of that, less than a pixel.
REACH = 1 << 12

_log = logging.getLogger("penumbra")


@dataclass(frozen=True, eq=False)
class Asked:
    """What is to be shown: a scene, by which settings, and how.

    look_at: distance [m] of what the user looks at; pixel_size: no finer than this; number: counts
    what was asked for.
    """

    scene: Scene
    settings: Settings
    threads: int = 0
    look_at: float = 1.0
    pixel_size: int = 1
    number: int = 0


@dataclass(frozen=True, eq=False)
class Shown:
    """A picture of what was asked for as `number`.

    pixels (h, w, 4) float32 premultiplied, the bottom row first, None if there is only an `error`;
    pixel i of a row begins at x = rectangle[0] + i size of the viewport, which is `frame` wide and
    high; size is the side of its pixels.  samples 0 is a coarse picture.
    """

    number: int
    pixels: NDArray[np.float32] | None
    rectangle: tuple[int, int, int, int] = (0, 0, 0, 0)
    frame: tuple[int, int] = (1, 1)
    size: int = 1
    samples: int = 0
    of: int = 0
    complete: bool = False
    error: str = ""
    notes: tuple[Note, ...] = ()
    statistics: dict[str, Any] | None = None


class Renderer:
    """Renders on a thread of its own what was asked for last, until `close`."""

    def __init__(self, on_picture: Callable[[Shown], None] = lambda shown: None) -> None:
        """`on_picture` is called on the renderer's thread with each new picture."""
        self.shown: Shown | None = None
        self.status = ""  # what is being done that has no picture yet
        self._on_picture = on_picture
        self._kept = Kept()
        self._speed = SPEED
        self._origin: NDArray[np.float64] | None = None
        self._count = 0
        self._next: Asked | None = None
        self._wake = threading.Condition()
        self._stop = threading.Event()  # what is being refined
        self._closed = False
        self._paused = False
        self._thread: threading.Thread | None = None

    def ask(self, asked: Asked) -> int:
        """Ask for another picture than so far; return its number."""
        with self._wake:
            self._count += 1
            self._next = replace(asked, number=self._count)
            self._stop.set()
            if self._thread is None and not self._closed:
                self._thread = threading.Thread(
                    target=self._run, name="penumbra-viewport", daemon=True
                )
                self._thread.start()
            self._wake.notify_all()
            return self._count

    @property
    def asked(self) -> int:
        """The number of what was asked for last."""
        return self._count

    @property
    def is_busy(self) -> bool:
        """Whether there is more to come."""
        if self._closed or not self._count:
            return False
        shown = self.shown
        done = shown is not None and (shown.complete or bool(shown.error))
        return not (done and shown is not None and shown.number == self._count)

    @property
    def is_paused(self) -> bool:
        """Whether it waits instead of refining."""
        return self._paused

    def pause(self, paused: bool) -> None:
        """Stop refining, or go on; what is asked for anew still gets its first pictures."""
        self._paused = paused
        with self._wake:
            self._wake.notify_all()

    def close(self) -> None:
        """End the thread soon; do not wait for it."""
        with self._wake:
            self._closed = True
            self._next = None
            self._stop.set()
            self._wake.notify_all()

    def join(self, timeout: float | None = None) -> bool:
        """Wait for the thread's end after `close`; return whether it has ended."""
        if self._thread is not None:
            self._thread.join(timeout)
        return self._thread is None or not self._thread.is_alive()

    # The thread

    def _run(self) -> None:
        while True:
            with self._wake:
                while self._next is None and not self._closed:
                    self._wake.wait()
                if self._closed:
                    self._kept = Kept()
                    return
                asked, self._next = self._next, None
                assert asked is not None
                self._stop = threading.Event()
            try:
                self._render(asked)
            except Cancelled:
                pass
            except SceneError as error:
                self._fail(asked, str(error))
            except MemoryError:
                self._fail(asked, "There is not enough memory for this scene")
            except Exception as error:  # noqa: BLE001  (a thread that ends would freeze the view)
                if self._closed:
                    return
                _log.exception("Penumbra failed in the viewport")
                self._fail(asked, f"{type(error).__name__}: {error}")

    def _fail(self, asked: Asked, message: str) -> None:
        if not self._closed:
            self._publish(Shown(asked.number, None, error=message))

    def _publish(self, shown: Shown) -> None:
        self.shown = shown
        self.status = ""
        self._on_picture(shown)

    def _render(self, asked: Asked) -> None:
        """Render what is asked until it is done, or something else is asked for."""
        stop = self._stop
        x0, y0, x1, y1 = asked.scene.camera.rectangle()
        pixels = (x1 - x0) * (y1 - y0)

        # Coarse pictures: the first is shown in any case.
        size = min(COARSEST, _power_of_two(math.sqrt(pixels / (FIRST * self._speed))))
        size = max(size, asked.pixel_size)
        before: Shown | None = None
        while size > asked.pixel_size:
            coarse = self._compile(asked, size, samples=1)
            start = perf_counter()
            ends = None if before is None else stop
            picture = render(coarse, asked.threads, self._ask_if_closed, ends)
            if picture.complete:
                self._measure(picture, perf_counter() - start)
                before = _shown(asked, picture, coarse, size, 0)
                self._publish(before)
            if stop.is_set():
                return
            size //= 2

        # All samples of the size that is asked for.
        size = asked.pixel_size
        plan = self._compile(asked, size)
        refiner = _Refiner(self, asked, plan, before, stop)
        picture = render(plan, asked.threads, refiner, None if before is None else stop)
        if picture.complete:
            self._publish(_shown(asked, picture, plan, size, picture.samples))

    def _compile(self, asked: Asked, size: int, samples: int | None = None) -> Plan:
        """Return the plan for pixels of `size`; a compilation is ended only by `close`."""
        scene, settings = asked.scene, asked.settings
        if scene.instances and not scene.stars:
            scene = replace(scene, camera=_nearer(scene.camera, self._box(scene)))
        camera = coarser(scene.camera, size)
        if samples is not None:
            settings = replace(settings, samples=samples, use_denoising=False)
        if not PATTERNS[settings.pattern].progressive and settings.samples >= UNLIMITED:
            settings = replace(settings, pattern="SOBOL")
        x0, y0, x1, y1 = coarser(camera, COARSEST).rectangle()
        plan = compile_plan(
            replace(scene, camera=camera),
            settings,
            self._say,
            lambda: self._closed,
            self._kept,
            self._keep_origin(scene, asked.look_at),
            float((x1 - x0) * (y1 - y0)),
        )
        self.status = ""
        return replace(plan, batch=min(plan.batch, BATCH), measures=(), workers="THREADS")

    def _say(self, text: str) -> None:
        self.status = text

    def _box(self, scene: Scene) -> NDArray[np.float64] | None:
        return self._kept.step("box", (scene.instances,), lambda: bounds(scene.instances))

    def _keep_origin(self, scene: Scene, look_at: float) -> NDArray[np.float64]:
        """Return the local origin: that of before, unless the camera has gone far away."""
        eye, box = scene.camera.to_world[:, 3], self._box(scene)
        if self._origin is not None and box is not None:
            still_there = (self._origin >= box[0]).all() and (self._origin <= box[1]).all()
            if still_there and np.linalg.norm(eye - self._origin) <= REACH * look_at:
                return self._origin
        self._origin = eye if box is None else np.clip(eye, box[0], box[1])
        return self._origin

    def _measure(self, picture: Picture, seconds: float) -> None:
        # The last one counts: what is in view changes.
        samples = picture.film.counts.sum()
        self._speed = max(float(samples) / max(seconds, 1e-4), 1e3)

    def _ask_if_closed(self, progress: Progress) -> bool:
        return self._closed


class _Refiner:
    """Called while the finest picture is sampled: shows it from time to time, and may pause."""

    def __init__(
        self,
        renderer: Renderer,
        asked: Asked,
        plan: Plan,
        before: Shown | None,
        stop: threading.Event,
    ) -> None:
        self.renderer, self.asked, self.plan = renderer, asked, plan
        self.before, self.stop = before, stop
        self.interval, self.next = REFRESH, perf_counter() + REFRESH
        self.is_whole = False

    def __call__(self, progress: Progress) -> bool:
        now = perf_counter()
        renderer = self.renderer
        if not self.is_whole and bool(progress.picture().film.counts.all()):
            # The first whole picture, at once.
            self.is_whole, self.next = True, now
            speed = progress.sample * progress.picture().film.counts.size
            renderer._speed = max(speed / max(progress.seconds, 1e-4), 1e3)
        if now >= self.next and (self.is_whole or self.before is not None):
            self.show(progress)
            cost = perf_counter() - now
            self.interval = min(self.interval * 1.3, REFRESH_MOST)
            self.next = now + max(self.interval, 20 * cost)
        self.wait()
        return renderer._closed or (self.stop.is_set() and (self.is_whole or bool(self.before)))

    def wait(self) -> None:
        """Wait while the renderer is paused and nothing else is asked for."""
        renderer = self.renderer
        while renderer._paused and self.is_whole and not self.stop.is_set():
            with renderer._wake:
                renderer._wake.wait(0.25)

    def show(self, progress: Progress) -> None:
        picture = progress.picture()
        samples = int(progress.sample)
        shown = _shown(self.asked, picture, self.plan, self.asked.pixel_size, samples)
        if not self.is_whole and self.before is not None:
            shown = _filled(shown, self.before, picture.film.counts)
        self.renderer._publish(replace(shown, complete=False))


def coarser(camera: Camera, size: int) -> Camera:
    """Return the camera with pixels that are `size` times as large; their corners stay in place."""
    if size == 1:
        return camera
    width, height = -(-camera.width // size), -(-camera.height // size)
    left, right, bottom, top = camera.window
    right = left + (right - left) * width * size / camera.width
    top = bottom + (top - bottom) * height * size / camera.height
    border = None
    if camera.border is not None:
        x0, y0, x1, y1 = camera.border
        border = x0 // size, y0 // size, -(-x1 // size), -(-y1 // size)
    window = left, right, bottom, top
    return replace(camera, width=width, height=height, window=window, border=border)


def _nearer(camera: Camera, box: NDArray[np.float64] | None) -> Camera:
    """Return an orthographic camera that starts where the scene does.

    Those of viewports start far behind the eye, where rays would lose their precision.
    """
    if camera.projection != "ORTHO" or box is None:
        return camera
    corners = np.stack(np.meshgrid(*box.T)).reshape(3, -1)
    depth = -(camera.to_world[:, 2] @ (corners - camera.to_world[:, 3:]))
    margin = 1e-3 * float(np.ptp(depth)) + 1e-6 * float(np.abs(depth).max())
    return replace(camera, clip_start=max(camera.clip_start, float(depth.min()) - margin))


def _power_of_two(number: float) -> int:
    """Return the least power of two that is not below a number."""
    return 1 << max(0, math.ceil(math.log2(max(number, 1.0))))


def _shown(asked: Asked, picture: Picture, plan: Plan, size: int, samples: int) -> Shown:
    x0, y0, x1, y1 = plan.rectangle
    pixels = np.minimum(picture.combined(), F32(LARGEST))
    of = plan.samples[1] - plan.samples[0]
    return Shown(
        asked.number,
        pixels,
        (x0 * size, y0 * size, x1 * size, y1 * size),
        (asked.scene.camera.width, asked.scene.camera.height),
        size,
        samples,
        of,
        picture.complete and samples > 0,
        notes=plan.notes,
        statistics=picture.statistics,
    )


def _filled(shown: Shown, before: Shown, counts: NDArray[np.int64]) -> Shown:
    """Return a picture with the coarser one where it has no sample yet."""
    assert shown.pixels is not None and before.pixels is not None
    height, width = shown.pixels.shape[:2]
    row = (shown.rectangle[1] + np.arange(height) * shown.size - before.rectangle[1]) // before.size
    column = shown.rectangle[0] + np.arange(width) * shown.size - before.rectangle[0]
    missing = counts.reshape(height, width) == 0
    rows, columns = np.nonzero(missing)
    pixels = shown.pixels
    pixels[rows, columns] = before.pixels[row[rows], (column // before.size)[columns]]
    return replace(shown, pixels=pixels)
