"""command line -> RenderJob.  What `dev.py render` was asked, checked as far as bpy is not needed.

It is read twice: by `dev.py`, which may run on any Python from 3.8 on, so that a slip is
told before anything is installed; and by `addon/headless.py` inside the environment.
Frame numbers in file names follow Blender: the last run of `#` in the name is the number.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from pathlib import Path
from typing import NamedTuple, NoReturn

FORMATS = {
    ".png": "PNG",
    ".exr": "OPEN_EXR",
    ".jpg": "JPEG",
    ".jpeg": "JPEG",
    ".tif": "TIFF",
    ".tiff": "TIFF",
    ".webp": "WEBP",
    ".bmp": "BMP",
    ".tga": "TARGA",
    ".hdr": "HDR",
}
LAST_FRAME = 1048574
MAGIC = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")


class BadInput(Exception):
    """What the user gave cannot be rendered; the message is one line that says why."""


class RenderJob(NamedTuple):
    """One `dev.py render`: what to read, what to change in it and where the pictures go."""

    file: Path
    output: Path
    frames: tuple[int, ...]
    animation: bool
    start: int | None
    end: int | None
    scene: str | None
    samples: int | None
    seed: int | None
    threads: int | None
    report: Path | None
    verbose: bool

    def frame_numbers(self, current: int, start: int, end: int, step: int) -> list[int]:
        """Return the frames to render, given those that the file names.  Raises BadInput."""
        if self.frames:
            return list(self.frames)
        if not self.animation:
            return [current]
        start = start if self.start is None else self.start
        end = end if self.end is None else self.end
        if end < start:
            raise BadInput(f"the last frame, {end}, is before the first, {start}")
        return list(range(start, end + 1, step))

    def is_numbered(self) -> bool:
        """Tell whether each picture gets its frame number even where the name has no `#`."""
        return self.animation or len(self.frames) > 1

    def check(self) -> None:
        """Look at what must be there before anything is started.  Raises BadInput."""
        check_blend(self.file)
        for target in (self.output, *([self.report] if self.report else [])):
            check_target(target)


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        print(f"{self.prog}: {message} (--help shows what can be said)", file=sys.stderr)
        raise SystemExit(2)


def _at_least(low: int, high: int):
    def number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{value} is not within {low} to {high}")
        return value

    return number


_frame = _at_least(-LAST_FRAME, LAST_FRAME)


def _frames(text: str) -> tuple[int, ...]:
    numbers = []
    for part in text.split(","):
        first, dots, last = part.partition("..")
        start, end = _frame(first), _frame(last if dots else first)
        if end < start:
            raise argparse.ArgumentTypeError(f"range {part!r} ends before it starts")
        numbers.extend(range(start, end + 1))
    return tuple(numbers)


def _picture(text: str) -> Path:
    suffix = Path(text).suffix.lower()
    if suffix not in FORMATS:
        known = ", ".join(FORMATS)
        found = f"{suffix!r} of {text!r}" if suffix else f"{text!r}, which has none,"
        raise argparse.ArgumentTypeError(f"the extension {found} is not one of {known}")
    return Path(text).absolute()


def _path(text: str) -> Path:
    return Path(text).absolute()


def parser() -> argparse.ArgumentParser:
    """Return the parser of `dev.py render`; it exits with 2 and one line on bad arguments."""
    result = _Parser(prog="dev.py render", description="Render a .blend file with Penumbra.")
    add = result.add_argument
    add("file", metavar="FILE.blend", type=_path, help="the file to render")
    add("-o", "--output", required=True, metavar="OUT", type=_picture,
        help="the picture; `####` becomes the frame number; the extension is the format: "
        + ", ".join(FORMATS))  # fmt: skip
    add("-f", "--frame", metavar="N", dest="frames", type=_frames, default=(),
        help="one frame, a list as 1,5,9 or a range as 1..10; else the current frame")  # fmt: skip
    add("-s", "--start", metavar="N", type=_frame, help="first frame of the animation")
    add("-e", "--end", metavar="N", type=_frame, help="last frame of the animation")
    add("-a", "--animation", action="store_true", help="all frames from start to end")
    add("--scene", metavar="NAME", help="the scene to render, if not the one last shown")
    add("--samples", metavar="N", type=_at_least(1, 1 << 24), help="samples for each pixel")
    add("--seed", metavar="N", type=_at_least(0, 2**31 - 1), help="another noise pattern")
    add("--threads", metavar="N", type=_at_least(0, 1024), help="threads; 0 is all cores")
    add("--report", metavar="FILE", type=_path, help="write what was rendered as JSON")
    add("--verbose", action="store_true", help="show also what Blender itself prints")
    return result


def parse(argv: list[str]) -> RenderJob:
    """Read the arguments after `render`; exits with 2 and one line on stderr if they are bad."""
    options = parser()

    # argparse would take a list that begins with a minus for an option.
    words: list[str] = []
    for word in argv:
        if words and words[-1] in ("-f", "--frame"):
            words[-1] = "--frame=" + word
        else:
            words.append(word)

    found = options.parse_args(words)
    ranged = found.animation or found.start is not None or found.end is not None
    if found.frames and ranged:
        options.error("-f does not go together with -a, -s and -e")
    if None not in (found.start, found.end) and found.end < found.start:
        options.error(f"the last frame, {found.end}, is before the first, {found.start}")
    found.animation = ranged
    return RenderJob(**vars(found))


def frame_path(output: Path, frame: int, numbered: bool) -> Path:
    """Return the file of one frame: the last run of `#` becomes its number, as in Blender.

    Without any, `numbered` puts four digits before the extension.
    """
    runs = list(re.finditer("#+", output.name))
    if runs:
        start, end = runs[-1].span()
    elif numbered:
        start = end = len(output.stem)
    else:
        return output
    digits = (end - start) or 4
    number = f"{'-' if frame < 0 else ''}{abs(frame):0{digits}d}"
    return output.with_name(output.name[:start] + number + output.name[end:])


def check_blend(path: Path) -> None:
    """Look whether `path` can be a .blend file, compressed or not.  Raises BadInput."""
    if path.is_dir():
        raise BadInput(f"{path} is a folder, not a .blend file")
    try:
        with path.open("rb") as file:
            head = file.read(8)
    except FileNotFoundError:
        raise BadInput(f"{path} does not exist") from None
    except OSError as error:
        raise BadInput(f"{path} cannot be read: {error.strerror}") from None
    if not head.startswith(MAGIC):
        raise BadInput(f"{path} is not a .blend file")


def check_target(path: Path) -> None:
    """Look whether a file could be written at `path`.  Raises BadInput."""
    if not path.parent.is_dir():
        raise BadInput(f"{path} cannot be written: there is no folder {path.parent}")
    if path.is_dir():
        raise BadInput(f"{path} cannot be written: it is a folder")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise BadInput(f"{path} cannot be written: permission denied")
