"""axes -> curves and slopes.  What more samples, pixels, triangles, lights ... cost.

Each value is rendered in turn with all others, round after round, on one thread; a time is the
processor time of sampling, its median over the rounds.  The slope is that of a straight line
through the logarithms: 1 is in proportion, 0 is free.  On more threads the interpreter is what they
share, see `interpreter.py`: how often it is taken says what more of them would gain.
"""

import os
from collections.abc import Callable, Sequence
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np

from .axes import AXES
from .interpreter import Watch, predictions

if TYPE_CHECKING:
    from .process import Worker

CORES = (2, 4, 8, 16, 64)  # of machines that are predicted
LAST = 3  # points at the end of a curve that have a slope of their own
# What threads and processes work on: an axis and its value, long enough that processes pay
SHARED = {"Cornell box": ("samples", 128), "32 node graphs": ("node graphs", 32)}


def measure_scaling(
    workers: dict[str, "Worker"], rounds: int, quick: bool, say: Callable[[str], None]
) -> dict[str, Any]:
    """Return `axes`, a curve for each engine, and `workers`, how threads and processes share."""
    found = []
    for axis in AXES:
        say(axis.name)
        values = axis.values[:5] if quick else axis.values
        engines: dict[str, list[dict[str, Any]]] = {}
        for engine, worker in workers.items():
            measured: dict[int, list[dict[str, Any]]] = {value: [] for value in values}
            for number in range(rounds):
                for value in values[:: 1 if number % 2 == 0 else -1]:
                    way = {"engine": engine, "axis": axis.name, "value": value}
                    measured[value].append(worker.call("scale", **way))
            engines[engine] = [point(value, each) for value, each in measured.items()]
        slopes = {engine: slope(points, axis.offset) for engine, points in engines.items()}
        ends = {engine: slope(each[-LAST:], axis.offset) for engine, each in engines.items()}
        row = {"name": axis.name, "offset": axis.offset, "engines": engines}
        found.append(row | {"slopes": slopes, "last_slopes": ends})
    return {"axes": found, "workers": measure_workers(workers["PENUMBRA"], rounds, say)}


def point(value: int, measured: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the medians of what was measured for a value."""
    parts = {
        name: median(each["parts"][name] for each in measured) for name in measured[0]["parts"]
    }
    seconds = {key: median(each[key] for each in measured) for key in ("sampling", "rest")}
    return {
        "value": value,
        **seconds,
        "parts": parts,
        "all": [each["sampling"] for each in measured],
    }


def slope(points: Sequence[dict[str, Any]], offset: int = 0) -> float:
    """Return the slope of sampling over values, of the line through their logarithms."""
    values = np.log([each["value"] + offset for each in points])
    return float(np.polyfit(values, np.log([each["sampling"] for each in points]), 1)[0])


def measure_workers(
    worker: "Worker", rounds: int, say: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Return how busy the interpreter is with one worker, and what that predicts for more."""
    lock = worker.call("lock")
    counts = range(1, (os.cpu_count() or 1) + 1)
    rows = []
    for name, (axis, value) in SHARED.items():
        say(f"threads and processes: {name}")
        way = {"engine": "PENUMBRA", "axis": axis, "value": value}
        points = {f"{kind} {n}": [] for n in counts for kind in ("THREADS", "PROCESSES")[:n]}
        watch = None if lock["address"] is None else Watch(lock["pid"], lock["address"])
        try:
            for _ in range(rounds):
                for key, each in points.items():
                    kind, number = key.split()
                    each.append(worker.call("scale", threads=int(number), workers=kind, **way))
        finally:
            if watch is not None:
                watch.close()
        rows.append({"name": name} | shared(points, watch))
    return rows


def shared(points: dict[str, list[dict[str, Any]]], watch: Watch | None) -> dict[str, Any]:
    """Return the medians of runs by kind and number of workers, and what they predict.

    The interpreter is taken by one thread for the share `taken`; where processes work, this one
    only hands out and adds up: `handed` is its share of all processor time.
    """
    runs = [summary(key, each, watch) for key, each in points.items()]
    taken = runs[0]["taken"]
    handed = next((run["own"] / run["sampling"] for run in runs[::-1] if run["processes"]), None)
    return {
        "runs": runs,
        "taken": taken,
        "handed": handed,
        "threads": predictions(taken, CORES),
        "processes": predictions(handed, CORES),
    }


def summary(key: str, runs: Sequence[dict[str, Any]], watch: Watch | None) -> dict[str, Any]:
    """Return the medians of runs of one kind and number of workers."""
    kind, number = key.split()
    shares = [watch.share(run["begin"], run["end"]) for run in runs] if watch else []
    seen = [share for share in shares if share is not None]
    return {
        "workers": kind,
        "count": int(number),
        "processes": runs[0]["processes"],
        "wall": median(run["end"] - run["begin"] for run in runs),
        "sampling": median(run["sampling"] for run in runs),
        "own": median(run["own"] for run in runs),
        "taken": median(seen) if seen else None,
    }


def print_scaling(scaling: dict[str, Any]) -> None:
    """Print the tables, as README shows them."""
    print("\n| from | to | engine | seconds | slope | at the end |\n|---|---|---|---|---|---|")
    for axis in scaling["axes"]:
        for engine, points in axis["engines"].items():
            first, last = points[0], points[-1]
            seconds = f"{first['sampling']:.3f} to {last['sampling']:.3f}"
            slopes = f"{axis['slopes'][engine]:.2f} | {axis['last_slopes'][engine]:.2f}"
            ends = f"{first['value']:,} {axis['name']} | {last['value']:,}"
            print(f"| {ends} | {engine.title()} | {seconds} | {slopes} |")
    for row in scaling["workers"]:
        print(f"\n{row['name']}: {_sentence(row)}")
        for run in row["runs"]:
            taken = "" if run["taken"] is None else f", interpreter taken {run['taken']:.1%}"
            cpu = f"{run['sampling']:.2f} s of processors, {run['wall']:.2f} s{taken}"
            print(f"  {run['count']} {run['workers'].lower()}: {cpu}")


def _sentence(row: dict[str, Any]) -> str:
    parts = []
    for kind in ("threads", "processes"):
        found = [f"{count}: {value:.1f}" for count, value in row[kind].items()]
        if found:
            parts.append(f"{kind} on so many cores are faster than one by {', '.join(found)}")
    return "; ".join(parts) or "nothing is known of its interpreter"
