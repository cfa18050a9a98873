"""stages -> nanoseconds of a path vertex beside the least that they could take.

Where are gains left?  Each stage stands beside a bound, of `bounds.py`: what moving the bytes takes
that it has to read and write, and taking a triangle's row at random for what hits look up.  All
other time is spent between, in passes over the batch.  Least of the rounds: what else the machine
does only adds.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .process import Worker

# What is looked at: a name, and an axis of `axes.py` with a value
SCENES = {
    "Cornell box, direct light": ("bounces", 0),
    "Cornell box, four bounces": ("bounces", 4),
    "16 Principled materials": ("materials", 16),
    "two million triangles": ("triangles", 2_000_000),
}
LOOKS_UP = "surface"  # the stage that takes a row of each hit's triangle


def measure_stages(
    worker: "Worker", rounds: int, say: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Return the stages of each scene: what they take, exchange, and could take at best."""
    found = []
    for name, (axis, value) in SCENES.items():
        say(f"stages: {name}")
        runs = [worker.call("stages", axis=axis, value=value) for _ in range(rounds)]
        found.append({"name": name} | compared(runs))
    return found


def compared(runs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the stages of a scene that was rendered in some runs [ns and bytes of a vertex]."""
    vertices = runs[0]["path_vertices"]
    roof = {key: min(run["roof"][key] for run in runs) for key in runs[0]["roof"]}
    stages = {}
    for stage, size in runs[0]["bytes"].items():
        taken = 1e9 * min(run["stage_seconds"][stage] for run in runs) / vertices
        bound = roof["byte"] * size / vertices + roof["row"] * (stage == LOOKS_UP)
        stages[stage] = {
            "ns": taken,
            "bytes": size / vertices,
            "bound": bound,
            "passes": taken / roof["addition"],
        }
    embree = 1e9 * min(run["embree_seconds"] for run in runs) / vertices
    return {"vertices": vertices, "roof": roof, "embree": embree, "stages": stages}


def print_stages(found: Sequence[dict[str, Any]]) -> None:
    """Print the tables, as README shows them."""
    for scene in found:
        roof = scene["roof"]
        print(
            f"\n{scene['name']}: {scene['embree']:.0f} ns of a vertex in Embree; a byte "
            f"{roof['byte']:.3f} ns, an addition {roof['addition']:.2f}, a row {roof['row']:.1f}"
        )
        print("| stage | ns | bytes | at best, ns | additions |\n|---|---|---|---|---|")
        for name, of in scene["stages"].items():
            cells = f"{of['ns']:.1f} | {of['bytes']:.0f} | {of['bound']:.1f} | {of['passes']:.0f}"
            print(f"| {name} | {cells} |")
