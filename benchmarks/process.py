"""calls -> answers of a worker process.  The near side of `worker.py`."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .scenes import Scene


class WorkerError(RuntimeError):
    """The worker could not do what it was asked, or is gone."""


class Worker:
    """A process with Blender in it."""

    def __init__(self) -> None:
        command = [sys.executable, "-m", f"{__package__}.worker"]
        self.folder = tempfile.TemporaryDirectory(prefix="penumbra-bench-")
        start = perf_counter()
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.versions = self.call("version")
        self.start_seconds = perf_counter() - start  # until Blender and the add-on are there

    def call(self, name: str, **arguments: Any) -> dict[str, Any]:
        """Send a request and wait for its answer; raises WorkerError."""
        assert self.process.stdin and self.process.stdout
        try:
            self.process.stdin.write(json.dumps({"call": name, **arguments}) + "\n")
            self.process.stdin.flush()
            line = self.process.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise WorkerError(f"the process ended with exit code {self.process.wait()}")
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            raise WorkerError(answer["error"])
        return answer

    def open(self, scene: Scene) -> tuple[tuple[int, int], float]:
        """Open a scene; return the picture's width and height, and how long it took."""
        start = perf_counter()
        blend = scene.blend()
        path = None if blend is None else str(blend)
        answer = self.call("open", scene=scene.name, blend=path, percentage=scene.percentage)
        width, height = answer["size"]
        return (width, height), perf_counter() - start

    def render(
        self,
        engine: str,
        scene: Scene,
        samples: int,
        seed: int,
        threads: int,
        settings: dict[str, Any] | None = None,
    ) -> tuple[dict[str, Any], NDArray[np.float32]]:
        """Render the open scene; return what was measured and the picture (H, W, 3)."""
        path = Path(self.folder.name) / "pixels.npy"
        answer = self.call(
            "render",
            engine=engine,
            settings=scene.settings | (settings or {}),
            samples=samples,
            seed=seed,
            threads=threads,
            pixels=str(path),
        )
        return answer, np.load(path)

    def close(self) -> None:
        """End the process and remove its folder."""
        assert self.process.stdin
        self.process.stdin.close()
        self.process.wait()
        self.folder.cleanup()
