"""file.blend, options -> picture files.  Renders without a window, for `dev.py render`.

Every picture is written beside its target and then renamed, so that a file with the asked
name is always whole.  Blender's own chatter is silenced (`--verbose` keeps it); what is said
here goes to stderr.  The process ends with `os._exit`, as bpy may hang when it is unloaded.
Exit codes: 0 pictures written; 1 render failed; 2 bad arguments or input; 130 interrupted.
"""

import contextlib
import faulthandler
import json
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn

import bpy

import penumbra

from ..tools.arguments import FORMATS, BadInput, RenderJob, check_target, frame_path, parse
from . import engine, properties, report

REPORT_SCHEMA = 1
DRAWN_EVERY = {True: 0.1, False: 5.0}  # seconds between progress lines: on a terminal or not


class RenderFailed(Exception):
    """Blender or the engine gave no picture; the message is one line that says why."""


class Console:
    """The terminal: one progress line, and whole lines above it."""

    def __init__(self) -> None:
        self.number = os.dup(2)
        self.terminal = os.isatty(self.number)
        self.drawn, self.width, self.prefix = time.monotonic(), 0, ""

    def write(self, text: str) -> None:
        """Write now; a terminal that has gone away is no reason to lose the picture."""
        with contextlib.suppress(OSError):
            os.write(self.number, text.encode("utf-8", "replace"))

    def say(self, text: str) -> None:
        """Write one line, in place of the progress line if there is one."""
        self.write(f"\r{text:{self.width}}\n" if self.width else text + "\n")
        self.width = 0

    def show(self, progress: Any) -> None:
        """Show the progress of the engine, not too often."""
        now = time.monotonic()
        if now - self.drawn < DRAWN_EVERY[self.terminal]:
            return
        self.drawn = now
        left = "" if progress.remaining is None else f"  ETA {clock(progress.remaining)}"
        text = (
            f"{self.prefix}{100 * progress.fraction:3.0f} %"
            f"  sample {progress.sample:.0f} of {progress.samples}"
            f"  {clock(progress.seconds)}{left}"
            f"  {progress.rays_per_second / 1e6:.1f} M rays/s"
            f"  {progress.memory / 2**20:.0f} MB"
        )
        if self.terminal:
            self.write(f"\r{text:{self.width}}")
            self.width = len(text)
        else:
            self.say(text)

    def silence_blender(self) -> None:
        """Send what Blender prints nowhere; Python's own stderr keeps to the terminal."""
        sys.stderr = os.fdopen(self.number, "w", 1, "utf-8", "replace")
        faulthandler.enable(self.number)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        os.close(nowhere)


def clock(seconds: float) -> str:
    """Return a duration [s] as 0:07, 12:34 or 1:02:03."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


class Draft:
    """A file beside its target; it becomes the target at once and whole if the block ends well.

    Where Blender writes a file for each view, these do, with `suffixes` to their names.  Otherwise
    the end of the process removes it: see `leave`.  Raises BadInput.
    """

    current: "Path | None" = None

    def __init__(self, target: Path, suffixes: Iterable[str] = ("",)) -> None:
        self.target, self.suffixes = target, tuple(suffixes)
        for suffix in self.suffixes:
            check_target(suffixed(target, suffix))

    def __enter__(self) -> Path:
        folder, suffix = self.target.parent, self.target.suffix
        try:
            number, name = tempfile.mkstemp(suffix, ".penumbra-", folder)
        except OSError as error:
            raise BadInput(f"{self.target} cannot be written: {error.strerror}") from None
        os.close(number)
        Draft.current = Path(name)
        return Draft.current

    def __exit__(self, kind: object, _error: object, _trace: object) -> None:
        if kind is None and Draft.current is not None:
            # Give it the rights that a new file has.
            mask = os.umask(0)
            os.umask(mask)
            for suffix in self.suffixes:
                part = suffixed(Draft.current, suffix)
                part.chmod(0o666 & ~mask)
                part.replace(suffixed(self.target, suffix))
            self.remove()

    @staticmethod
    def remove() -> None:
        """Remove what is left of the current draft."""
        if Draft.current is not None:
            for part in Draft.current.parent.glob(f"{Draft.current.stem}*"):
                part.unlink(missing_ok=True)
            Draft.current = None


def suffixed(path: Path, suffix: str) -> Path:
    """Return a path with a view's suffix to its name, as Blender appends it."""
    return path.with_name(f"{path.stem}{suffix}{path.suffix}")


def view_suffixes(render: bpy.types.RenderSettings) -> dict[str, str]:
    """Return the suffix of each view's file by its name, {"": ""} if there is one file in all."""
    if not render.use_multiview or render.image_settings.views_format != "INDIVIDUAL":
        return {"": ""}
    views = render.views if render.views_format == "MULTIVIEW" else render.stereo_views
    return {view.name: view.file_suffix for view in views if view.use}


def first_line(error: Exception) -> str:
    """Return Blender's message as one line: `Error: ...` is its own prefix."""
    lines = [line.removeprefix("Error: ").strip() for line in str(error).splitlines()]
    return "; ".join(filter(None, lines)) or type(error).__name__


def open_scene(job: RenderJob, console: Console) -> bpy.types.Scene:
    """Open the file; return the scene to render, made ready as the job says.  Raises BadInput."""
    try:
        bpy.ops.wm.open_mainfile(filepath=str(job.file), load_ui=False)
    except RuntimeError as error:
        raise BadInput(f"{job.file} cannot be opened: {first_line(error)}") from None
    if bpy.data.version[:2] > bpy.app.version[:2]:
        console.say(
            f"{job.file.name} was made by Blender {bpy.data.version[0]}.{bpy.data.version[1]}, "
            f"newer than this {bpy.app.version_string}: what is new in it is lost"
        )

    # Choose the scene.
    scene = bpy.context.scene
    if job.scene is not None:
        scene = bpy.data.scenes.get(job.scene)
        if scene is None:
            names = ", ".join(repr(each.name) for each in bpy.data.scenes)
            raise BadInput(f"{job.file} has no scene {job.scene!r}, only {names}")

    # Take over the settings of a file that was made for Cycles, then those of the job.
    if scene.render.engine == "CYCLES":
        properties.adopt_cycles(scene)
    scene.render.engine = "PENUMBRA"
    if job.samples is not None:
        scene.penumbra.samples = job.samples
        for layer in scene.view_layers:
            layer.samples = 0
    if job.seed is not None:
        scene.penumbra.seed = job.seed
    if job.threads is not None:
        scene.render.threads_mode = "FIXED" if job.threads else "AUTO"
        scene.render.threads = max(job.threads, 1)
    set_format(scene.render.image_settings, FORMATS[job.output.suffix.lower()])
    return scene


def set_format(image: bpy.types.ImageFormatSettings, file_format: str) -> None:
    """Write `file_format`; EXR is float32, unless the file itself already asks for an EXR."""
    if file_format == "OPEN_EXR" and image.file_format.startswith("OPEN_EXR"):
        return
    if hasattr(image, "media_type"):
        image.media_type = "IMAGE"
    image.file_format = file_format
    if file_format == "OPEN_EXR":
        image.color_depth = "32"


def render_frame(scene: bpy.types.Scene, frame: int, target: Path) -> list[dict[str, Any]]:
    """Render one frame to `target`; return its reports.  Raises BadInput, RenderFailed."""
    scene.frame_set(frame)
    if scene.camera is None:
        raise BadInput(f"scene {scene.name!r} has no camera in frame {frame}")
    before = len(report.frames)
    suffixes = view_suffixes(scene.render)
    with Draft(target, suffixes.values()) as path:
        # Blender 5 reads braces in a path as a template.
        plain = str(path)
        if bpy.app.version >= (5, 0):
            plain = plain.replace("{", "{{").replace("}", "}}")
        scene.render.filepath = plain
        scene.render.use_file_extension = False
        try:
            bpy.ops.render.render(write_still=True, scene=scene.name)
        except RuntimeError as error:
            raise RenderFailed(first_line(error)) from None
        reports = report.frames[before:]
        if not reports and not (scene.render.use_sequencer and scene.sequence_editor):
            raise RenderFailed(f"frame {frame}: Blender never called the engine")
        for suffix in suffixes.values():
            part = suffixed(path, suffix)
            if not part.exists() or part.stat().st_size == 0:
                raise RenderFailed(f"frame {frame}: Blender wrote no picture")
    return [
        {**each, "output": str(suffixed(target, suffixes.get(each["view"], "")))}
        for each in reports
    ]


def write_report(job: RenderJob, frames: list[dict[str, Any]]) -> None:
    """Write what was rendered so far, if the job asks for it."""
    if job.report is None:
        return
    whole = {
        "schema": REPORT_SCHEMA,
        "version": penumbra.__version__,
        "file": str(job.file),
        "frames": frames,
    }
    with Draft(job.report) as path:
        path.write_text(json.dumps(whole, indent=1) + "\n", "utf-8")


def run(job: RenderJob, console: Console) -> None:
    """Render all frames of the job.  Raises BadInput, RenderFailed."""
    job.check()
    penumbra.register()
    scene = open_scene(job, console)
    numbers = job.frame_numbers(
        scene.frame_current, scene.frame_start, scene.frame_end, scene.frame_step
    )
    frames: list[dict[str, Any]] = []
    write_report(job, frames)
    engine.progress_listener = console.show
    for index, frame in enumerate(numbers):
        console.prefix = f"frame {frame} ({index + 1} of {len(numbers)})  "
        target = frame_path(job.output, frame, job.is_numbered())
        start = time.monotonic()
        reports = render_frame(scene, frame, target)
        frames += reports
        write_report(job, frames)
        for each in reports:
            for note in each["not_honoured"]:
                console.say(f"not honoured: {note['owner']}: {note['what']}")
        written = ", ".join(dict.fromkeys(each["output"] for each in reports)) or str(target)
        console.say(f"wrote {written} in {clock(time.monotonic() - start)}")


def leave(code: int) -> NoReturn:
    """End the process at once, and with nothing half written."""
    Draft.remove()
    shutil.rmtree(bpy.app.tempdir, ignore_errors=True)  # Blender would at its own end
    os._exit(code)


def main(argv: list[str]) -> NoReturn:
    """Do what the arguments say and end the process with the exit code."""
    job = parse(argv)
    console = Console()

    def stop(number: int, _stack: object) -> None:
        console.say("Stopped.")
        leave(128 + number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    if not job.verbose:
        console.silence_blender()
    try:
        run(job, console)
    except BadInput as error:
        console.say(f"dev.py render: {error}")
        leave(2)
    except (RenderFailed, OSError) as error:
        console.say(f"dev.py render: {error}")
        leave(1)
    except BaseException:
        faulthandler.disable()
        sys.excepthook(*sys.exc_info())  # a mistake in Penumbra itself: show where
        leave(1)
    leave(0)


if __name__ == "__main__":
    main(sys.argv[1:])
