"""suite -> a report.  The long form of the stress tests.

python3 dev.py stress [--seeds N] [--fuzzed N] [--blends N] [--report FILE.md]
Exit codes: 0 nothing was found, 1 something was.
"""

import argparse
import platform
import sys
from collections import Counter
from pathlib import Path

from . import blends, fuzz
from .suite import described, run

HEAD = """# Stress

What `python3 dev.py stress --seeds {seeds}` found last ({machine}).  A row is a scene and what was
done to it, or a parameter and its value: the change of the picture's mean (of a sweep: what it is
outside of its bounds), its standard error, and what was counted; `self_hits` are rays that met the
triangle they had left and were traced again.

```
{rows}
```
"""


def main(argv: list[str]) -> int:
    """Run everything, and print what was found; return the exit code."""
    parser = argparse.ArgumentParser(description="Render scenes under stress.")
    parser.add_argument("--seeds", type=int, default=8, help="pictures for each row")
    parser.add_argument("--report", type=Path, help="write the report there")
    parser.add_argument("--fuzzed", type=int, default=1000, help="scenes of random values")
    parser.add_argument("--blends", type=int, default=1000, help="the same through Blender")
    options = parser.parse_args(argv)
    lines, bad = [], 0
    for row in run(options.seeds):
        bad += not row.is_good
        lines.append(("   " if row.is_good else "!! ") + described(row))
        print(lines[-1], flush=True)
    descriptions = ((seed, fuzz.outcome(seed)) for seed in range(options.fuzzed))
    for what, found in (
        ("fuzzed scenes", descriptions),
        ("fuzzed files", blends.outcomes(0, options.blends)),
    ):
        counts: Counter[str] = Counter()
        for seed, text in found:
            counts[text.split(":")[0]] += 1
            if text.startswith("wrong"):
                lines.append(f"!! {what}, seed {seed}: {text}")
                print(lines[-1], flush=True)
        lines.append(f"{sum(counts.values())} {what}: {dict(counts)}")
        print(lines[-1], flush=True)
        bad += counts["wrong"]
    lines.append(f"{bad} with something wrong")
    print(lines[-1])
    if options.report is not None:
        machine = f"{platform.machine()}, Python {platform.python_version()}"
        text = HEAD.format(seeds=options.seeds, machine=machine, rows="\n".join(lines))
        options.report.write_text(text, encoding="utf-8")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
