"""plan -> a fresh process.  Worker processes where processes cannot be forked.

A fresh interpreter without Blender is started, gets the frame through shared memory (`handover`),
builds Embree's trees for itself, and says when it is ready; until then threads do its work.  It
ends when the pipe to its parent closes, whatever it does.  It reports how long it has worked, so
that hard work is told from waiting for ever, on all systems.
"""

import contextlib
import os
import pickle
import queue
import re
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, BinaryIO

from . import worker
from .batches import Batch, Sums, Work
from .handover import Block, pack, unpack
from .plan import Plan

LOOK = 0.05  # seconds between two looks at whether to stop
BEAT = 0.5  # seconds between two reports of how long a process has worked
PATIENCE = 200  # looks, in all of which one has done nothing: it waits for ever
NOTHING = 0.01  # seconds of processor time: to report takes some
READY = "ready"

# What a fresh interpreter runs.  Packages above the core are not imported: they may need Blender.
START = """
import importlib, os, pickle, signal, sys, types
signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's is for the parent alone
source, sink = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
os.dup2(os.open(os.devnull, os.O_RDWR), 1)
path, package, folder = pickle.load(source)
sys.path[:] = path
name = ""
for part in package.split("."):
    name = f"{name}.{part}" if name else part
    sys.modules[name] = types.ModuleType(name)
    sys.modules[name].__path__ = []
sys.modules[name].__path__ = [folder]
importlib.import_module(package + ".core.fresh").serve(source, sink)
"""


class Lost(Exception):
    """A worker process has ended or waits for ever."""


class FreshProcess:
    """A fresh process, seen by the thread that it works for."""

    def __init__(self, python: str, block: Block) -> None:
        self.memory = 0
        self.is_ready = self.is_lost = False
        self.why = ""
        hidden = {"creationflags": 0x08000000} if sys.platform == "win32" else {}  # no window
        more: dict[str, Any] = hidden or {"pass_fds": block.inherited}
        self._process = subprocess.Popen(
            [python, "-I", "-c", START],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            **more,
        )
        self._worked = 0.0
        self._has_frame = threading.Event()  # or never will
        self._answers: queue.SimpleQueue[Any] = queue.SimpleQueue()
        threading.Thread(target=self._read, name="penumbra-answers", daemon=True).start()

    def _read(self) -> None:
        """Collect answers, among which are reports; None is the last."""
        assert self._process.stdout is not None
        with self._process.stdout as answers, contextlib.suppress(Exception):
            while True:  # whatever is wrong with an answer, it is the last
                answer = pickle.load(answers)
                if isinstance(answer, float):
                    self._worked = answer
                else:
                    self._has_frame.set()
                    self._answers.put(answer)
        self._has_frame.set()
        self._answers.put(None)

    def wait(self) -> None:
        """Wait until it has the frame, or has ended."""
        self._has_frame.wait()

    def send(self, *things: Any) -> None:
        """Send things, one after the other.  Raises: Lost."""
        assert self._process.stdin is not None
        try:
            for thing in things:
                pickle.dump(thing, self._process.stdin, 5)
            self._process.stdin.flush()
        except (OSError, ValueError):
            raise Lost from None

    def look(self) -> None:
        """See whether it is ready by now, or will never be."""
        if not (self.is_ready or self.is_lost):
            with contextlib.suppress(queue.Empty):
                self.is_ready = self._answers.get_nowait() == READY
                self.is_lost = not self.is_ready

    def ask(self, changes: dict[str, Any], batch: Batch, stop: threading.Event) -> Sums | None:
        """Return the sums of a batch, None if it is stopped.  Raises: Lost."""
        self.send((changes, batch))
        idle, worked = 0, self._worked
        while not stop.is_set():
            idle += 1
            if self._worked > worked + NOTHING:
                idle, worked = 0, self._worked
            if idle == PATIENCE:
                self.close()
                raise Lost
            with contextlib.suppress(queue.Empty):
                answer = self._answers.get(timeout=LOOK)
                if answer is None:
                    raise Lost
                sums: Sums
                sums, self.memory = answer
                return sums
        return None

    def close(self) -> None:
        """End it, at once."""
        self._process.kill()
        self._process.wait()
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()


def start(plan: Plan, work: Work, count: int) -> list[FreshProcess]:
    """Return processes that get the plan in the background; none if there is no interpreter."""
    python = interpreter()
    if python is None:
        return []
    block = Block()
    processes: list[FreshProcess] = []
    with contextlib.suppress(OSError):  # no memory to promise, or no more processes allowed
        for _ in range(count):
            processes.append(FreshProcess(python, block))
    giver = threading.Thread(
        target=_give, args=(plan, work, block, processes), name="penumbra-handover", daemon=True
    )
    giver.start()
    return processes


def _give(plan: Plan, work: Work, block: Block, processes: Sequence[FreshProcess]) -> None:
    folder = str(Path(__file__).parent.parent)
    package = __name__.rpartition(".core.")[0]
    try:
        for process in processes:
            with contextlib.suppress(Lost):
                process.send((list(sys.path), package, folder))
        frame = pack((plan, work), block)
        for process in processes:
            with contextlib.suppress(Lost):
                process.send(frame)
        for process in processes:
            process.wait()  # the block is theirs only when they have opened it
    except Exception as error:
        # What cannot be sent is not worth the picture: threads do the work, and it is said why
        for process in processes:
            process.why = f": {type(error).__name__}: {error}"
            process.close()
    finally:
        block.close()


def interpreter() -> str | None:
    """Return the program that runs Python alone, None if there is none: Blender runs more."""
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    places = [Path(sys.executable or "")]
    for prefix in (sys.prefix, sys.base_prefix):
        names = ("python.exe", "bin/python.exe", f"bin/python{version}", "bin/python3")
        places += [Path(prefix) / name for name in names]
    for place in places:
        if re.fullmatch(r"python[\d.]*(\.exe)?", place.name.lower()) and place.is_file():
            return str(place)
    return None


# The fresh process


def serve(source: BinaryIO, sink: BinaryIO) -> None:
    """Work until the parent closes the pipe, or something goes wrong."""
    # The end of the pipe is the end of this process, in the middle of whatever it does
    requests: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def read() -> None:
        try:
            while True:
                requests.put(pickle.load(source))
        finally:
            os._exit(0)

    speaking = threading.Lock()

    def answer(thing: Any) -> None:
        with speaking:
            pickle.dump(thing, sink, 5)
            sink.flush()

    def report() -> None:
        while True:
            time.sleep(BEAT)
            answer(time.process_time())

    for task in (read, report):
        threading.Thread(target=task, daemon=True).start()
    try:
        plan, work = unpack(*requests.get())
        answer(READY)
        worker.serve(requests.get, answer, plan, work)
    finally:
        os._exit(1)
