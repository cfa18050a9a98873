"""notes, statistics -> what the user is told at the end of a frame.

`frames` keeps one entry per rendered frame, view layer and view, in the form of the JSON report
(schema 1): frame, output, view_layer, view, resolution, samples, complete, plan (in plain words),
not_honoured (a list of {owner, what}) and statistics.  `errors` keeps the messages of frames that
failed.
"""

import json
from collections.abc import Sequence
from typing import Any

from ..core.scene import Note

frames: list[dict[str, Any]] = []
errors: list[str] = []

_LISTED = 8  # notes spelled out in Blender's info area; the JSON report has all


def clear() -> None:
    """Forget what earlier renders left."""
    frames.clear()
    errors.clear()


def sentence(notes: Sequence[Note]) -> str:
    """Return one line that names what the picture does not honour; '' if there is nothing."""
    if not notes:
        return ""
    count = len(notes)
    head = "1 thing is" if count == 1 else f"{count} things are"
    listed = "; ".join(f"{note.owner}: {note.what}" for note in notes[:_LISTED])
    more = f"; and {count - _LISTED} more" if count > _LISTED else ""
    return f"Penumbra: {head} not honoured: {listed}{more}"


def as_rows(notes: Sequence[Note]) -> list[dict[str, str]]:
    """Return notes in the form of the JSON report."""
    return [{"owner": note.owner, "what": note.what} for note in notes]


def latest_rows() -> list[dict[str, str]]:
    """Return what the last frame does not honour, in the form of the JSON report."""
    return list(frames[-1]["not_honoured"]) if frames else []


def metadata(entry: dict[str, Any], version: str, seed: int, offset: int) -> dict[str, str]:
    """Return the fields of the picture file for an entry of `frames`.

    Keys only ever get more.  With several view layers or views the last one to be rendered
    wins the plain keys, and `penumbra/statistics/<layer>` has the numbers of each.
    """
    statistics = json.dumps(entry["statistics"])
    return {
        "penumbra/version": version,
        "penumbra/seed": str(seed),
        "penumbra/sample_offset": str(offset),
        "penumbra/samples": str(entry["samples"]),
        "penumbra/statistics": statistics,
        f"penumbra/statistics/{entry['view_layer']}": statistics,
    }
