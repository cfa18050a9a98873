"""things of three sizes -> bytes of each triangle, pixel, texel and process.

Each size is a process of its own, one after the other (`footprint.py`); what a unit takes is the
slope of bytes over units, so that what processes have in common drops out.  Beside it the whole of
one large scene: does it fit?
"""

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .footprint import MAKERS
from .process import WorkerError

# Sizes by the first word of what is made
SIZES = {
    "triangle": (500_000, 1_000_000, 2_000_000),
    "pixel": (1 << 20, 2 << 20, 4 << 20),
    "texel": (1 << 20, 1 << 22, 1 << 24),
    "worker": (2, 3, 4),
}
QUICK = {
    "triangle": (50_000, 100_000, 200_000),
    "pixel": (1 << 17, 1 << 18, 1 << 19),
    "texel": (1 << 18, 1 << 20, 1 << 22),
    "worker": (2, 3, 4),
}
LARGE, LARGE_QUICK = 20_000_000, 1_000_000  # triangles, of the scene that has to fit
LIMIT = 8 << 30  # bytes, into which it has to fit
BIGGEST = tuple(name for name in MAKERS if name.startswith("triangle"))


def measure_memory(quick: bool, say: Callable[[str], None]) -> dict[str, Any]:
    """Return what things take: `units`, a row for each, and `large`, the whole of one scene."""
    units = []
    for name in MAKERS:
        say(name)
        sizes = (QUICK if quick else SIZES)[name.partition(":")[0].split()[0]]
        units.append(row(name, [made(name, size) for size in sizes]))
    large = []
    for name in BIGGEST:
        count = LARGE_QUICK if quick else LARGE
        say(f"{count:,} triangles, {name.partition(': ')[2]}")
        large.append(whole(name, made(name, count)))
    return {"units": units, "large": large, "limit": LIMIT}


def made(name: str, size: int) -> dict[str, Any]:
    """Make a thing in a process of its own; return what it says; raises WorkerError."""
    command = [sys.executable, "-m", f"{__package__}.footprint", name, str(size)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        last = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
        raise WorkerError(f"memory of {name}, {size}: {last[0]}")
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer


def row(name: str, found: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the slopes of what was found for three sizes: bytes for each unit, by step."""
    units = [each["units"] for each in found]
    steps = {
        step: {
            what: float(np.polyfit(units, [each["steps"][step][what] for each in found], 1)[0])
            for what in ("kept", "peak")
        }
        for step in found[0]["steps"]
    }
    return {"name": name, "units": units, "steps": steps, "found": list(found)}


def whole(name: str, found: dict[str, Any]) -> dict[str, Any]:
    """Return what the process of a large scene took in all, at most [bytes], by step."""
    peaks = {step: found["start"] + each["peak"] for step, each in found["steps"].items()}
    return {"name": name, "units": found["units"], "start": found["start"], "peaks": peaks}


def print_memory(memory: dict[str, Any]) -> None:
    """Print the tables, as README shows them."""
    print("\n| what | step | bytes kept | at most |\n|---|---|---|---|")
    for each in memory["units"]:
        for step, of in each["steps"].items():
            print(f"| {each['name']} | {step} | {of['kept']:,.0f} | {of['peak']:,.0f} |")
    limit = memory["limit"]
    print(f"\n| triangles | | largest, GiB | in | fits {limit >> 30} |\n|---|---|---|---|---|")
    for each in memory["large"]:
        step = max(each["peaks"], key=each["peaks"].__getitem__)
        name = each["name"].partition(": ")[2]
        most, fits = each["peaks"][step], "yes" if each["peaks"][step] <= limit else "no"
        print(f"| {each['units']:,} | {name} | {most / 2**30:.2f} | {step} | {fits} |")
