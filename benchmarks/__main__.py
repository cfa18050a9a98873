"""arguments -> tables, JSON, page.  Render the benchmark scenes in turn and compare.

Method: all engines open the same file with the same settings, each in a process of its own that
stays; one uncounted sample warms it up.  `run.py` says how they take turns.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .contenders import VARIANTS, chosen
from .costs import FILE as COSTS_FILE
from .costs import measure_costs, print_costs
from .footprint import STATUS
from .machine import load, machine
from .memory import measure_memory, print_memory
from .page import merged, write_page
from .process import Worker, WorkerError
from .run import bench_scene, say
from .scaling import measure_scaling, print_scaling
from .scenes import EXAMPLES, SCENES, Scene
from .stages import measure_stages, print_stages
from .table import print_latency, print_scene, print_summary

ENGINES = ("CYCLES", "PENUMBRA")


def bench_costs(worker: Worker, options: argparse.Namespace, document: dict[str, Any]) -> None:
    """Measure and print what each feature costs."""
    rounds = options.repeats or (1 if options.quick else 7)
    blend = str(EXAMPLES / f"{COSTS_FILE}.blend")
    document |= {"rounds": rounds, "costs": []}
    document["costs"] = measure_costs(worker, blend, rounds, options.quick, say)
    print_costs(document["costs"])


def bench_growth(
    workers: dict[str, Worker], options: argparse.Namespace, document: dict[str, Any]
) -> None:
    """Measure and print what more of something costs, in time or in memory."""
    rounds = options.repeats or (1 if options.quick else 3)
    if options.scaling:
        document["scaling"] = measure_scaling(workers, rounds, options.quick, say)
        document["rounds"] = rounds
        print_scaling(document["scaling"])
        keep(options, document)
    if options.stages:
        document["stages"] = measure_stages(workers["PENUMBRA"], max(rounds, 3), say)
        print_stages(document["stages"])
        keep(options, document)
    if options.memory:
        document["footprints"] = measure_memory(options.quick, say)
        print_memory(document["footprints"])


def save(worker: Worker, scenes: Sequence[Scene], folder: Path) -> None:
    """Write the scenes as .blend files."""
    for scene in scenes:
        worker.open(scene)
        worker.call("save", path=str(folder.resolve() / f"{scene.name}.blend"))


def measure(
    options: argparse.Namespace, workers: dict[str, Worker], document: dict[str, Any]
) -> None:
    """Measure what is asked for, and put it into the document, which is kept after each scene."""
    scenes = [s for s in SCENES if not options.scene or s.name in options.scene]
    if options.save:
        return save(workers["CYCLES"], scenes, options.save)
    if options.costs:
        bench_costs(workers["PENUMBRA"], options, document)
        return keep(options, document)
    if options.scaling or options.stages or options.memory:
        bench_growth(workers, options, document)
        return keep(options, document)

    repeats = options.repeats or (1 if options.quick else 3)
    document |= {"threads": options.threads, "repeats": repeats, "scenes": [], "latency": {}}
    document["start_up"] = {engine: worker.start_seconds for engine, worker in workers.items()}
    blender, contenders = document["blender"], chosen(options.variants)
    for scene in [] if options.latency else scenes:
        entry = scene.quick() if options.quick else scene
        found = bench_scene(entry, contenders, workers, options.threads, repeats, blender)
        print_scene(found)
        document["scenes"].append(found)
        document["start_up"] |= {engine: each.start_seconds for engine, each in workers.items()}
        document["load_after"] = load()
        keep(options, document)
    if options.latency or not options.scene:
        say("latency")
        answer = workers["PENUMBRA"].call("latency", threads=options.threads, repeats=repeats)
        document["latency"] = answer
    if document["scenes"]:
        print_summary(document["scenes"])
    if document["latency"]:
        print_latency(document["latency"])
    return keep(options, document)


def keep(options: argparse.Namespace, document: dict[str, Any]) -> None:
    """Write the JSON, if it is asked for; whole or not at all."""
    if options.json:
        partial = options.json.with_name(options.json.name + ".partial")
        partial.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
        partial.replace(options.json)


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """Return the arguments, checked; ends the program with 2 if they are wrong."""
    names = [scene.name for scene in SCENES]
    parser = argparse.ArgumentParser(prog="dev.py bench", description=__doc__.split("\n")[0])
    parser.add_argument("--scene", action="append", choices=names, help="only this one; repeatable")
    parser.add_argument("--quick", action="store_true", help="smaller pictures, fewer samples")
    parser.add_argument("--repeats", type=int, help="of each render (3; 1 if quick; 7 for --costs)")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="all by default")
    parser.add_argument(
        "--variants",
        nargs="+",
        default=[],
        choices=["all", *VARIANTS],
        help="beside Cycles and Penumbra as they come",
    )
    parser.add_argument("--json", type=Path, help="write all numbers here (see README.md)")
    parser.add_argument("--latency", action="store_true", help="only what the viewport takes")
    parser.add_argument("--save", type=Path, metavar="FOLDER", help="only write .blend files there")
    parser.add_argument("--costs", action="store_true", help="only what each feature costs")
    parser.add_argument("--scaling", action="store_true", help="only what more of something costs")
    parser.add_argument("--stages", action="store_true", help="only how far stages are from ideal")
    parser.add_argument("--memory", action="store_true", help="only what takes how many bytes")
    parser.add_argument("--page", type=Path, metavar="FOLDER", help="write index.html there")
    parser.add_argument(
        "--from",
        dest="sources",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="make the page of these JSON files, render nothing",
    )
    options = parser.parse_args(argv)
    if options.threads < 1 or (options.repeats is not None and options.repeats < 1):
        parser.error("--threads and --repeats need at least 1")
    if options.memory and not STATUS.exists():
        parser.error("--memory reads /proc, which this system has not")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json {options.json}: there is no such folder")
    for name in ("save", "page"):
        folder = getattr(options, name)
        if folder and not folder.is_dir():
            parser.error(f"--{name} {folder}: there is no such folder")
    if options.sources and not options.page:
        parser.error("--from needs --page")
    try:
        options.documents = [json.loads(path.read_text("utf-8")) for path in options.sources or ()]
    except (OSError, ValueError) as error:
        parser.error(f"--from: {error}")
    return options


def main(argv: Sequence[str] | None = None) -> int:
    """Run the benchmarks; return 0, 1 if a render failed, 2 for bad arguments."""
    options = parse(argv)
    if options.documents:
        write_page(options.page, merged(options.documents))
        return 0
    workers: dict[str, Worker] = {}
    try:
        workers |= {engine: Worker() for engine in ENGINES}
        document = {"schema": 1, **workers["CYCLES"].versions, **machine(), "quick": options.quick}
        measure(options, workers, document)
    except WorkerError as error:
        say(f"benchmark failed: {error}")
        return 1
    finally:
        for worker in workers.values():
            worker.close()
    if options.page and not options.save:
        write_page(options.page, document)
    return 0


if __name__ == "__main__":
    sys.exit(main())
