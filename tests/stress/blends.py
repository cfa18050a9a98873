"""seeds -> what happens to fuzzed .blend content, in Blenders that may end on the way."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

CHUNK = 50  # seeds in one process
LONGEST = 120  # seconds that one of them may take


def outcomes(first: int, count: int, chunk: int = CHUNK) -> Iterator[tuple[int, str]]:
    """Yield each seed with its outcome; see fuzz_blend.py."""
    seed, end = first, first + count
    while seed < end:
        some = min(chunk, end - seed)
        done, how = _run("PENUMBRA", seed, some)
        for text in done:
            yield seed, text
            seed += 1

        # One that ended its Blender
        if len(done) < some:
            _, without_us = _run("NOTHING", seed, 1)
            yield seed, f"refused: Blender itself ends ({how})" if without_us else f"wrong: {how}"
            seed += 1


def _run(engine: str, first: int, count: int) -> tuple[list[str], str]:
    """Return the outcomes that a process came to, and how it ended if that was too soon."""
    # Checks of what is computed on the way are for scenes whose numbers fit float32.
    environ = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "PENUMBRA_CHECK": ""}
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "outcomes"
        command = [sys.executable, "-m", "penumbra.tests.stress.fuzz_blend"]
        command += [str(target), engine, str(first), str(count)]
        try:
            ended = subprocess.run(
                command,
                check=False,
                capture_output=True,
                text=True,
                timeout=LONGEST * count,
                env=environ,
            )
        except subprocess.TimeoutExpired:
            how = "it never ends"
        else:
            said = (ended.stdout + ended.stderr).strip().splitlines()
            how = f"exit {ended.returncode}: {said[-1] if said else ''}" if ended.returncode else ""
        lines = target.read_text("utf-8").splitlines() if target.exists() else []
        return [json.loads(line) for line in lines], how
