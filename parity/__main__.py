"""arguments -> verdicts.  Render the scenes of the suite with both engines and compare them.

Cycles' pictures are rendered once and kept (`parity/cache/`, or --cache); Penumbra's are always
new. An engine that fails or crashes on a scene fails that scene only.
Exit codes: 0 every scene is the same or a known difference; 1 some are not; 2 bad arguments.
"""

import argparse
import fnmatch
import json
import os
import platform
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from .estimate import CACHE, References, estimate, fixed
from .page import write_page
from .process import Absent, Worker, WorkerError
from .results import Result, print_result, print_summary
from .scenes import ALL, known
from .scenes.scene import Scene
from .statistics import RATIO_ERROR, REFERENCE_ERROR, Estimate, compare

# A quick run has no references: both engines render little, and only what is plain counts.
QUICK_SEEDS, QUICK_SAMPLES, QUICK_K = 12, 8, 6.0


class Suite:
    """The two workers and what they are to do."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.options = options
        self.cycles, self.penumbra = Worker(), Worker()
        self.versions = self.penumbra.call("version")
        self.references = References(options.cache, self.versions["blender"])

    def close(self) -> None:
        """End the workers."""
        self.cycles.close()
        self.penumbra.close()

    def run(self, scene: Scene) -> Result:
        """Return what became of a scene; nothing is raised."""
        result = Result(scene.name, scene.shows)
        try:
            reference, ours = self.quick(scene, result) if self.options.quick else (
                self.full(scene, result)
            )  # fmt: skip
        except Absent as absent:
            return replace(result, verdict="absent", reason=str(absent))
        except (WorkerError, ValueError) as error:
            engine = "Penumbra" if result.reference else "Cycles"
            return replace(result, verdict="failed", reason=f"{engine}: {error}")
        result.reference = reference
        if ours is None:
            done = reference.error() <= REFERENCE_ERROR
            reason = f"reference: error {reference.error():.2%}, {reference.seeds} seeds"
            return replace(result, verdict="reference" if done else "noisy", reason=reason)
        result.judge(ours, compare(ours, reference, QUICK_K if self.options.quick else 2.0))
        if self.options.quick and result.verdict == "noisy":
            result.verdict = "same"
        cause = known(scene.name, self.versions["blender"])
        if result.verdict == "differs" and cause is not None:
            result.verdict, result.reason = "known", cause
        return result

    def full(self, scene: Scene, result: Result) -> tuple[Estimate, Estimate | None]:
        """Return the reference, and Penumbra's picture unless only references are wanted."""
        options = self.options
        opener = self.cycles if options.references else self.penumbra
        fingerprint = opener.open(scene.name)
        reference = self.references.make(
            scene.name, fingerprint, self.cycles, options.reference_seconds, options.threads
        )
        result.reference = reference
        if options.references:
            return reference, None

        # What the reference lacks in certainty is not asked of ours, nor is ours sharper than it.
        left = RATIO_ERROR**2 - min(reference.error(), REFERENCE_ERROR) ** 2
        ours, result.notes = estimate(
            self.penumbra, "PENUMBRA", left**0.5, options.seconds, options.threads
        )
        return reference, ours

    def quick(self, scene: Scene, result: Result) -> tuple[Estimate, Estimate]:
        """Return few samples of both engines, without a reference on disk."""
        pictures = []
        for worker, engine in ((self.cycles, "CYCLES"), (self.penumbra, "PENUMBRA")):
            worker.open(scene.name)
            taken = QUICK_SAMPLES, QUICK_SEEDS, self.options.threads
            pictures.append(fixed(worker, engine, *taken))
            result.reference = pictures[0]
        return pictures[0], pictures[1]


def chosen(options: argparse.Namespace, parser: argparse.ArgumentParser) -> list[Scene]:
    """Return the scenes that were asked for; exits with 2 if there is one that does not exist."""
    for pattern in options.scene or ():
        if not any(fnmatch.fnmatch(scene.name, pattern) for scene in ALL):
            parser.error(f"no scene {pattern!r}; --list shows their names")
    return [
        scene
        for scene in ALL
        if (not options.scene or any(fnmatch.fnmatch(scene.name, each) for each in options.scene))
        and (not options.quick or options.scene or "quick" in scene.tags)
    ]


def write(options: argparse.Namespace, versions: dict[str, str], results: list[Result]) -> None:
    """Write what is known so far: whoever stops a run of an hour keeps what it found."""
    machine = {"system": sys.platform, "processor": platform.processor() or platform.machine()}
    document = {"schema": 1, **versions, **machine, "threads": options.threads}
    document |= {"quick": options.quick, "scenes": [result.document() for result in results]}
    if options.json:
        options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    if options.html:
        write_page(options.html, document, results)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the suite; return the exit code."""
    parser = argparse.ArgumentParser(prog="dev.py parity", description=__doc__.split("\n")[0])
    add = parser.add_argument
    add("--scene", action="append", help="only this one, or a pattern such as 'lamp_*'; repeatable")
    add("--html", type=Path, metavar="FILE", help="write a page with all pictures")
    add("--json", type=Path, metavar="FILE", help="write all numbers (see README.md)")
    add("--quick", action="store_true", help="few samples of a few scenes, nothing is kept")
    add("--references", action="store_true", help="only make Cycles' pictures, or improve them")
    add("--reference-seconds", type=float, default=120.0, help="for one picture of Cycles (120)")
    add("--seconds", type=float, default=60.0, help="for one picture of Penumbra (60)")
    add("--threads", type=int, default=min(2, os.cpu_count() or 1), help="of each engine (2)")
    add("--cache", type=Path, default=CACHE, help="the folder of Cycles' pictures")
    add("--list", action="store_true", help="list the scenes and what they show")
    options = parser.parse_args(argv)
    for path in (options.html, options.json):
        if path and not path.resolve().parent.is_dir():
            parser.error(f"{path}: there is no such folder")
    if options.threads < 1:
        parser.error("--threads needs at least 1")
    scenes = chosen(options, parser)
    if options.list:
        for scene in scenes:
            print(f"{scene.name:30s} {scene.shows}")
        return 0

    results: list[Result] = []
    suite = Suite(options)
    try:
        for scene in scenes:
            results.append(suite.run(scene))
            print_result(results[-1])
            if options.html:
                results[-1].paint()
            results[-1].forget()
            write(options, suite.versions, results)
    except KeyboardInterrupt:
        print("Stopped: the results so far follow.", file=sys.stderr)
    finally:
        suite.close()
    print_summary(results)
    return 1 if any(result.fails for result in results) or len(results) < len(scenes) else 0


if __name__ == "__main__":
    sys.exit(main())
