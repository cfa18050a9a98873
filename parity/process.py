"""calls -> answers of a worker process, or the reason why there is none.  It may crash or hang.

The near side of `worker.py`. A worker that dies, or does not answer in time, is buried and
started again by the next call: whatever one scene does to Blender, the others do not see it.
"""

import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

COMMAND = (sys.executable, "-m", f"{__package__}.worker")
PATIENCE = 900.0


class WorkerError(RuntimeError):
    """The worker could not do what it was asked, or is gone."""


class Absent(WorkerError):
    """Blender lacks what the scene is about, in this version."""


class Worker:
    """A process with Blender in it, started when it is first needed.

    It hangs if it does not answer for `patience` [s]; `command` is for tests.
    """

    def __init__(self, command: Sequence[str] = COMMAND, patience: float = PATIENCE) -> None:
        self.command, self.patience = command, patience
        self.folder = tempfile.TemporaryDirectory(prefix="penumbra-parity-")
        self.process: subprocess.Popen[str] | None = None
        self.lines: queue.Queue[str] = queue.Queue()

    def call(self, request: str, **arguments: Any) -> dict[str, Any]:
        """Send a request and wait for its answer; raises WorkerError, or Absent."""
        process = self._running()
        assert process.stdin
        try:
            process.stdin.write(json.dumps({"call": request, **arguments}) + "\n")
            process.stdin.flush()
            line = self.lines.get(timeout=self.patience)
        except queue.Empty:
            self.close()
            raise WorkerError(f"no answer within {self.patience:.0f} s") from None
        except OSError:
            line = ""
        if not line:
            code = process.wait()
            self.close()
            raise WorkerError(f"Blender crashed (exit code {code})")
        answer: dict[str, Any] = json.loads(line)
        if "absent" in answer:
            raise Absent(answer["absent"])
        if "error" in answer:
            raise WorkerError(answer["error"])
        return answer

    def open(self, name: str) -> str:
        """Build a scene; return its fingerprint."""
        fingerprint: str = self.call("open", name=name)["fingerprint"]
        return fingerprint

    def render(
        self, engine: str, samples: int, seed: int, threads: int
    ) -> tuple[dict[str, Any], NDArray[np.float32]]:
        """Render the open scene; return what was measured and the picture (H, W, 4)."""
        path = Path(self.folder.name) / "pixels.npy"
        request = {"engine": engine, "samples": samples, "seed": seed, "threads": threads}
        answer = self.call("render", **request, pixels=str(path))
        return answer, np.load(path)

    def close(self) -> None:
        """End the process, if there is one."""
        process, self.process = self.process, None
        if process and process.stdin:
            try:
                process.stdin.close()
                process.wait(timeout=10)
            except (OSError, subprocess.TimeoutExpired):
                process.kill()
                process.wait()

    def _running(self) -> subprocess.Popen[str]:
        if self.process is None or self.process.poll() is not None:
            environment = {**os.environ, "TMPDIR": self.folder.name}
            self.process = subprocess.Popen(
                self.command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                text=True,
                env=environment,
            )
            # Each process has a queue of its own: a late line of a dead one reaches nobody.
            self.lines = queue.Queue()
            reader = threading.Thread(target=_read, args=(self.process, self.lines), daemon=True)
            reader.start()
        return self.process


def _read(process: subprocess.Popen[str], lines: queue.Queue[str]) -> None:
    """Put what the process says into a queue, and '' when it has ended."""
    assert process.stdout
    for line in process.stdout:
        lines.put(line)
    lines.put("")
