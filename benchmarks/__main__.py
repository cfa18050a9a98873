"""arguments -> tables.  Render the benchmark scenes with both engines in turn and compare.

Method: both engines open the same file with the same settings, each in a process of its own that
stays; one uncounted sample warms it up.  Renders are interleaved, the order of the engines
alternates, seconds are medians and errors are means over the repeats (each with its own seed).
"""

import argparse
import json
import os
import platform
import sys
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean, median
from typing import Any

from .costs import FILE as COSTS_FILE
from .costs import measure_costs, print_costs
from .errors import METRICS, Curve, measure, ratio_at_equal_error
from .process import Worker, WorkerError
from .reference import reference
from .scenes import EXAMPLES, SCENES, Scene
from .table import print_latency, print_scene, print_summary

ENGINES = ("CYCLES", "PENUMBRA")


def bench_scene(
    scene: Scene, workers: dict[str, Worker], threads: int, repeats: int, blender: str
) -> dict[str, Any]:
    """Return one scene's entry of the JSON."""
    # Open the scene in both processes and warm them up.
    for engine, worker in workers.items():
        size = worker.open(scene)
        worker.render(engine, scene, 1, 0, threads)
    truth = None
    if scene.reference:
        say(f"{scene.name}: reference, {scene.reference} samples of Cycles")
        truth = reference(scene, workers["CYCLES"], threads, blender)

    # Render in turn.
    points: dict[str, list[list[dict[str, Any]]]] = {
        e: [[] for _ in scene.points()] for e in ENGINES
    }
    for repeat in range(repeats):
        for k, (samples, settings) in enumerate(scene.points()):
            for engine in ENGINES[:: 1 if (repeat + k) % 2 == 0 else -1]:
                at = settings.get("adaptive_threshold", samples)
                say(f"{scene.name}: {repeat + 1}/{repeats} {engine} {at}")
                answer, picture = workers[engine].render(
                    engine, scene, samples, repeat + 1, threads, settings
                )
                if truth:
                    answer["squared"] = measure(picture - truth.picture, truth.picture)
                    answer["mean"] = float(picture.mean() / truth.picture.mean() - 1)
                points[engine][k].append(answer)

    # Put together times, errors and ratios.
    result: dict[str, Any] = {"name": scene.name, "size": size, "settings": scene.settings}
    result["target"] = scene.target
    if truth:
        result["reference"] = {
            "samples": scene.reference,
            "seconds": truth.seconds,
            "squared_error": truth.noise,
        }
    pixels = size[0] * size[1]
    result["engines"] = {
        engine: [
            summarise(point, runs, pixels, truth.noise if truth else None)
            for point, runs in zip(scene.points(), points[engine], strict=True)
        ]
        for engine in ENGINES
    }
    result["ratio"] = ratios(result["engines"], bool(truth))
    result["reached"] = reached(scene.target, result["ratio"])
    return result


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
    }
    if settings:
        point["threshold"] = settings["adaptive_threshold"]
    else:
        point["samples_per_second"] = pixels * samples / seconds
    if noise:
        squared = {m: fmean(run["squared"][m] for run in runs) - noise[m] for m in METRICS}
        point["error"] = {m: max(value, 0.0) for m, value in squared.items()}
        point["error"]["rmse"] **= 0.5
        point["limited_by_reference"] = squared["relmse_trimmed"] < noise["relmse_trimmed"]
        point["mean_difference"] = fmean(run["mean"] for run in runs)
    statistics = runs[len(runs) // 2]["statistics"]
    if statistics:
        vertices = max(1, statistics["path_vertices"])
        stages = {"embree": statistics["embree_seconds"], **statistics["stage_seconds"]}
        point["ns_per_vertex"] = {name: 1e9 * s / vertices for name, s in stages.items()}
        point["statistics"] = statistics
        point["not_honoured"] = runs[0]["not_honoured"]
    return point


def ratios(engines: dict[str, list[dict[str, Any]]], has_error: bool) -> dict[str, Any]:
    """Return Cycles' time over Penumbra's: at equal samples, and at equal error by metric."""
    cycles, penumbra = engines["CYCLES"], engines["PENUMBRA"]
    result: dict[str, Any] = {"equal_samples": cycles[-1]["seconds"] / penumbra[-1]["seconds"]}
    for metric in METRICS if has_error else ():
        curves = [
            Curve([p["seconds"] for p in points], [p["error"][metric] for p in points])
            for points in (cycles, penumbra)
        ]
        if min(len(curve.log_error) for curve in curves) >= 4:
            result[metric] = ratio_at_equal_error(*curves)
    return result


def bench_costs(worker: Worker, options: argparse.Namespace, versions: dict[str, Any]) -> int:
    """Measure and print what each feature costs; return 0."""
    rounds = options.repeats or (1 if options.quick else 5)
    blend = str(EXAMPLES / f"{COSTS_FILE}.blend")
    results = measure_costs(worker, blend, rounds, options.quick, say)
    print_costs(results)
    if options.json:
        document = {"schema": 1, **versions, "quick": options.quick, "rounds": rounds}
        text = json.dumps(document | {"costs": results}, indent=1)
        options.json.write_text(text + "\n", encoding="utf-8")
    return 0


def reached(target: float | None, ratio: dict[str, Any]) -> bool | None:
    """Tell whether the ratio at equal relMSE is the target's or more; None if either lacks."""
    if target is None or "relmse" not in ratio:
        return None
    return bool(ratio["relmse"]["ratio"] >= target)


def say(text: str) -> None:
    """Show what is being done, on stderr."""
    print(text, file=sys.stderr, flush=True)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the benchmarks; return 0, 1 if a render failed, 2 for bad arguments."""
    names = [scene.name for scene in SCENES]
    parser = argparse.ArgumentParser(prog="dev.py bench", description=__doc__.split("\n")[0])
    parser.add_argument("--scene", action="append", choices=names, help="only this one; repeatable")
    parser.add_argument("--quick", action="store_true", help="smaller pictures, fewer samples")
    parser.add_argument("--repeats", type=int, help="of each render (3; 1 if quick)")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="all by default")
    parser.add_argument("--json", type=Path, help="write all numbers here (see README.md)")
    parser.add_argument("--latency", action="store_true", help="only what the viewport takes")
    parser.add_argument("--save", type=Path, metavar="FOLDER", help="only write .blend files there")
    parser.add_argument("--costs", action="store_true", help="only what each feature costs")
    options = parser.parse_args(argv)
    if options.threads < 1 or (options.repeats is not None and options.repeats < 1):
        parser.error("--threads and --repeats need at least 1")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json {options.json}: there is no such folder")
    if options.save and not options.save.is_dir():
        parser.error(f"--save {options.save}: there is no such folder")

    chosen = [s for s in SCENES if not options.scene or s.name in options.scene]
    chosen = [] if options.latency else chosen
    repeats = options.repeats or (1 if options.quick else 3)
    workers: dict[str, Worker] = {}
    results: list[dict[str, Any]] = []
    latency: dict[str, dict[str, float]] = {}
    try:
        workers = {engine: Worker() for engine in ENGINES}
        versions = [worker.call("version") for worker in workers.values()][0]
        if options.costs:
            return bench_costs(workers["PENUMBRA"], options, versions)
        if options.save:
            for scene in chosen:
                workers["CYCLES"].open(scene)
                path = options.save.resolve() / f"{scene.name}.blend"
                workers["CYCLES"].call("save", path=str(path))
            return 0
        for scene in chosen:
            entry = scene.quick() if options.quick else scene
            result = bench_scene(entry, workers, options.threads, repeats, versions["blender"])
            print_scene(result)
            results.append(result)
        if options.latency or not options.scene:
            say("latency")
            latency = workers["PENUMBRA"].call("latency", threads=options.threads, repeats=repeats)
    except WorkerError as error:
        say(f"benchmark failed: {error}")
        return 1
    finally:
        for worker in workers.values():
            worker.close()
    if results:
        print_summary(results)
    if latency:
        print_latency(latency)
    if options.json:
        machine = {"processor": platform.processor() or platform.machine(), "system": sys.platform}
        document = {"schema": 1, **versions, **machine, "threads": options.threads}
        document |= {"quick": options.quick, "repeats": repeats, "scenes": results}
        document["latency"] = latency
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
