"""a scene, contenders -> its entry of the JSON.  Render in turn, put together times and errors.

Renders are interleaved, the order of the contenders alternates, seconds are medians and errors are
means over the repeats (each with its own seed).  A renderer that is neither Cycles nor Penumbra
takes part if it can express the scene and its mean is Cycles'; why not is written down otherwise.
"""

import sys
from collections.abc import Sequence
from statistics import fmean, median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..parity.results import flip
from .contenders import OTHERS, Contender
from .errors import METRICS, SHOWN, Curve, measure, ratio_at_equal_error
from .process import Worker, WorkerError
from .reference import Reference, reference
from .scenes import Scene

FEWEST = 4  # points with an error, for a ratio
SAME = 0.01  # how far the means of another renderer's channels may be off
CHECKED = 64  # samples of the picture that is checked, at least


def bench_scene(
    scene: Scene,
    contenders: Sequence[Contender],
    workers: dict[str, Worker],
    threads: int,
    repeats: int,
    blender: str,
) -> dict[str, Any]:
    """Return one scene's entry of the JSON; opens a worker for an engine that has none."""
    # Open the scene in all processes and warm them up.
    contenders = [each for each in contenders if each.competes(scene)]
    absent: dict[str, str] = {}
    start_up: dict[str, dict[str, float]] = {}
    size, truth = (0, 0), None
    for engine in dict.fromkeys(each.engine for each in contenders):
        try:
            workers.setdefault(engine, Worker())
            size, seconds = workers[engine].open(scene)
            first, _ = workers[engine].render(engine, scene, 1, 0, threads)
            start_up[engine] = {"open": seconds, "warm_up": first["seconds"]}
            if engine == "CYCLES" and scene.reference:
                say(f"{scene.name}: reference, {scene.reference} samples of Cycles")
                truth = reference(scene, workers["CYCLES"], threads, blender)
            if engine in OTHERS and truth:
                check(engine, scene, workers[engine], threads, truth)
        except WorkerError as error:
            if engine not in OTHERS:
                raise
            say(f"{scene.name}: without {engine}: {error}")
            why = str(error).removeprefix("NotExpressed: ")
            absent |= {each.name: why for each in contenders if each.engine == engine}
            contenders = [each for each in contenders if each.engine != engine]
            workers.pop(engine).close()

    runs = _render(scene, contenders, workers, threads, repeats, truth)

    # Put together times, errors and ratios.
    result: dict[str, Any] = {"name": scene.name, "title": scene.title, "size": size}
    result |= {"settings": scene.settings, "target": scene.target}
    result |= {"start_up": start_up, "absent": absent}
    if truth:
        result["reference"] = {
            "samples": scene.reference,
            "seconds": truth.seconds,
            "squared_error": truth.noise,
            "flip": truth.flip,
        }
    result["engines"] = {
        each.name: [
            summarise(point, found, size[0] * size[1], truth.noise if truth else None)
            for point, found in zip(each.points(scene), runs[each.name], strict=True)
        ]
        for each in contenders
    }
    result["ratios"] = {
        each.name: ratios(result["engines"], each.name)
        for each in contenders
        if each.name != "CYCLES"
    }
    result["ratio"] = result["ratios"]["PENUMBRA"]
    result["reached"] = reached(scene.target, result["ratio"])
    return result


def _render(
    scene: Scene,
    contenders: Sequence[Contender],
    workers: dict[str, Worker],
    threads: int,
    repeats: int,
    truth: Reference | None,
) -> dict[str, list[list[dict[str, Any]]]]:
    """Render in turn; return what was measured, by contender, point and repeat."""
    points = {each.name: each.points(scene) for each in contenders}
    runs: dict[str, list[list[dict[str, Any]]]] = {n: [[] for _ in p] for n, p in points.items()}
    for repeat in range(repeats):
        for k in range(max(map(len, points.values()))):
            for each in contenders[:: 1 if (repeat + k) % 2 == 0 else -1]:
                if k >= len(points[each.name]):
                    continue
                samples, settings = points[each.name][k]
                at = settings.get("adaptive_threshold", samples)
                say(f"{scene.name}: {repeat + 1}/{repeats} {each.name} {at}")
                answer, picture = workers[each.engine].render(
                    each.engine, scene, samples, repeat + 1, threads, settings
                )
                if truth:
                    answer |= compare(picture, truth.picture)
                runs[each.name][k].append(answer)
    return runs


def check(engine: str, scene: Scene, worker: Worker, threads: int, truth: Reference) -> None:
    """Raise WorkerError if the means of the channels are not those of the reference."""
    samples = max(CHECKED, *scene.samples)
    _, picture = worker.render(engine, scene, samples, 1, threads)
    off = off_by(picture, truth.picture)
    if not np.abs(off).max() <= SAME:
        means = ", ".join(f"{100 * each:+.2f} %" for each in off)
        raise WorkerError(f"its picture is not Cycles': the channels' means are off by {means}")


def off_by(picture: NDArray[np.float32], truth: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return by how much the means of a picture's channels differ, as a share of the brightest."""
    means = [each.reshape(-1, 3).mean(axis=0, dtype=np.float64) for each in (picture, truth)]
    return (means[0] - means[1]) / max(float(means[1].max()), 1e-12)


def compare(picture: NDArray[np.float32], truth: NDArray[np.float32]) -> dict[str, Any]:
    """Return a picture's squared errors, its HDR-FLIP where that is installed, and its mean."""
    return {
        "squared": measure(picture - truth, truth),
        "flip": flip(truth, picture),
        "mean": float(picture.mean() / truth.mean() - 1),
    }


def summarise(
    at: tuple[int, dict[str, Any]],
    runs: list[dict[str, Any]],
    pixels: int,
    noise: dict[str, float] | None,
) -> dict[str, Any]:
    """Return a point of a curve from its repeats; the reference's noise is subtracted."""
    seconds = median(run["seconds"] for run in runs)
    samples, settings = at
    point: dict[str, Any] = {
        "samples": samples,
        "seconds": seconds,
        "all_seconds": [run["seconds"] for run in runs],
        "parts": parts(runs),
    }
    if "adaptive_threshold" in settings:
        point["threshold"] = settings["adaptive_threshold"]
    else:
        point["samples_per_second"] = pixels * samples / seconds
    if noise:
        squared = {m: fmean(run["squared"][m] for run in runs) - noise[m] for m in METRICS}
        point["error"] = {m: max(value, 0.0) for m, value in squared.items()}
        point["error"]["rmse"] **= 0.5
        if runs[0]["flip"] is not None:
            point["error"]["flip"] = fmean(run["flip"] for run in runs)
        point["limited_by_reference"] = squared["relmse_trimmed"] < noise["relmse_trimmed"]
        point["mean_difference"] = fmean(run["mean"] for run in runs)
    statistics = runs[len(runs) // 2]["statistics"]
    if statistics:
        vertices = statistics["path_vertices"]
        stages = {"embree": statistics["embree_seconds"], **statistics["stage_seconds"]}
        if vertices:
            point["ns_per_vertex"] = {name: 1e9 * s / vertices for name, s in stages.items()}
        point["statistics"] = statistics
        point["not_honoured"] = runs[0]["not_honoured"]
    return point


def parts(runs: list[dict[str, Any]]) -> dict[str, float]:
    """Return the medians of the parts of a render's time, and of the rest that is none of them."""
    if not all(run["parts"] for run in runs):
        return {}
    found = {name: median(run["parts"][name] for run in runs) for name in runs[0]["parts"]}
    rest = median(run["seconds"] - sum(run["parts"].values()) for run in runs)
    return found | {"rest": max(rest, 0.0)}


def ratios(engines: dict[str, list[dict[str, Any]]], name: str) -> dict[str, Any]:
    """Return Cycles' time over a contender's: at equal samples, and at equal error by metric."""
    cycles, other = engines["CYCLES"], engines[name]
    result: dict[str, Any] = {}
    if all(cycles[-1].get(key) == other[-1].get(key) for key in ("samples", "threshold")):
        result["equal_samples"] = cycles[-1]["seconds"] / other[-1]["seconds"]
    for metric in SHOWN:
        if not all(metric in point.get("error", ()) for point in (*cycles, *other)):
            continue
        curves = [
            Curve([p["seconds"] for p in points], [p["error"][metric] for p in points])
            for points in (cycles, other)
        ]
        if all(curve.is_one(FEWEST) for curve in curves):
            result[metric] = ratio_at_equal_error(*curves)
    return result


def reached(target: float | None, ratio: dict[str, Any]) -> bool | None:
    """Tell whether the ratio at equal relMSE is the target's or more; None if either lacks."""
    if target is None or "relmse" not in ratio:
        return None
    return bool(ratio["relmse"]["ratio"] >= target)


def say(text: str) -> None:
    """Show what is being done, on stderr."""
    print(text, file=sys.stderr, flush=True)
