"""plan -> workers.  Who renders batches: threads of this process, or processes.

Between two calls of numpy a thread needs the interpreter, which serves one thread at a time.  A
forked process has an interpreter of its own, and shares the memory of the scene, Embree's trees
and all, with its parent: that takes milliseconds, however large the scene is.  A thread of the
parent hands batches to each of them and waits, so that the order of work, the sums and their bits
are the same.  Where a process fails, its thread does that batch and all that follow itself: what
was wrong with the batch is then raised where it can be seen.  Systems that cannot fork have fresh
processes (`fresh`), which take a second to start; meanwhile the threads work themselves.
"""

import contextlib
import ctypes
import gc
import os
import queue
import signal
import sys
import threading
import warnings
from collections.abc import Sequence
from multiprocessing.connection import Pipe
from pathlib import Path
from typing import Any, Protocol

from . import fresh
from .batches import Batch, Sums, Work
from .fresh import LOOK, Lost
from .plan import Plan
from .scene import Note
from .worker import changed, differences, serve

# macOS has fork, but its libraries do not survive it; what a process does is read from /proc
CAN_FORK = sys.platform == "linux" and Path("/proc/self/stat").exists()
LEAST = 1 << 18  # samples that are worth processes: about a tenth of a second of the cheapest
LEAST_FRESH = 1 << 22  # that are worth fresh ones
PATIENCE = 100  # looks, in all of which a process sleeps and does nothing: it waits for ever
PR_SET_PDEATHSIG = 1  # of prctl(2)
CRASHES = (signal.SIGSEGV, signal.SIGABRT, signal.SIGFPE, signal.SIGILL)


class Threads:
    """Threads of this process do the work themselves."""

    processes = memory = 0

    def __init__(self, work: Work, notes: tuple[Note, ...] = ()) -> None:
        self.sample = work
        self._notes = notes

    def notes(self) -> tuple[Note, ...]:
        """Return what is not as it was asked for."""
        return self._notes

    def close(self) -> None:
        """Leave nothing behind."""


class Process(Protocol):
    """A process that works for a thread; memory: what it has had besides what is shared [bytes]."""

    memory: int
    is_ready: bool
    is_lost: bool
    why: str  # it was lost, as far as is known

    def look(self) -> None:
        """See whether it is ready by now, or will never be."""

    def ask(self, changes: dict[str, Any], batch: Batch, stop: threading.Event) -> Sums | None:
        """Return the sums of a batch, None if it is stopped.  Raises: Lost."""

    def close(self) -> None:
        """End it, at once."""


class Processes:
    """Processes do the work for as many threads, which call `sample`."""

    def __init__(self, plan: Plan, work: Work, threads: int, some: Sequence[Process]) -> None:
        self._plan, self._work = plan, work
        self._all = some
        self._lost = 0

        # One for each thread; None: the thread does the work itself.
        self._idle: queue.SimpleQueue[Process | None] = queue.SimpleQueue()
        for number in range(threads):
            self._idle.put(some[number] if number < len(some) else None)

    @property
    def processes(self) -> int:
        """Return how many have been ready to work."""
        return sum(process.is_ready for process in self._all)

    @property
    def memory(self) -> int:
        """What they have had besides what they share [bytes]."""
        return sum(process.memory for process in self._all)

    def sample(self, plan: Plan, batch: Batch, stop: threading.Event) -> Sums:
        """Return the sums of a batch: of no samples if it is stopped."""
        process = self._idle.get()
        try:
            if process is not None:
                process.look()
                if process.is_lost:
                    raise Lost
            if process is not None and process.is_ready and not stop.is_set():
                sums = process.ask(differences(self._plan, plan), batch, stop)
                if sums is not None:
                    return sums
        except Lost:
            process = None
            self._lost += not stop.is_set()  # then it was ended
        finally:
            self._idle.put(process)
        return self._work(plan, batch, stop)

    def notes(self) -> tuple[Note, ...]:
        """Return what did not go as it should."""
        if not self._lost:
            return ()
        said = f"Workers: {self._lost} of {len(self._all)} processes failed; threads did their work"
        said += next((process.why for process in self._all if process.why), "")
        return (Note("Render settings", said),)

    def close(self) -> None:
        """End them at once, whatever they do; whoever waits for one does its work itself."""
        for process in self._all:
            process.close()


def hire(plan: Plan, work: Work, threads: int, pixels: int) -> Threads | Processes:
    """Return who works for `threads` threads on a picture of so many pixels."""
    samples = pixels * (plan.samples[1] - plan.samples[0])
    forks = CAN_FORK and plan.workers != "FRESH"
    pays = plan.workers in ("PROCESSES", "FRESH")
    if plan.workers == "AUTO":
        pays = samples >= (LEAST if forks else LEAST_FRESH)
    if not pays or threads < 2:
        return Threads(work)
    if forks:
        return Processes(plan, work, threads, _forked(plan, work, threads))
    some = fresh.start(plan, work, threads)
    if some:
        return Processes(plan, work, threads, some)
    said = Note("Render settings", "Workers: there is no Python to start them")
    return Threads(work, () if plan.workers == "AUTO" else (said,))


def _forked(plan: Plan, work: Work, count: int) -> list["_Process"]:
    processes: list[_Process] = []
    with contextlib.suppress(OSError):  # no memory to promise, or no more processes allowed
        for _ in range(count):
            processes.append(_Process(plan, work))
    return processes


class _Process:
    """A forked process, seen by the thread that it works for."""

    is_ready, is_lost, why = True, False, ""

    def __init__(self, plan: Plan, work: Work) -> None:
        self.memory = 0
        parent, library = os.getpid(), ctypes.CDLL(None)
        self.pipe, far = Pipe()
        held = {signal.SIGINT, signal.SIGTERM}
        before = signal.pthread_sigmask(signal.SIG_BLOCK, held)  # they shall find it prepared
        try:
            with warnings.catch_warnings():
                # Python warns since other threads may hold locks for ever. Python's own and the
                # C library's are taken care of; for all others there is PATIENCE.
                warnings.simplefilter("ignore", DeprecationWarning)
                self.pid = os.fork()
            if self.pid == 0:
                try:
                    _prepare(parent, library, far.fileno())
                    serve(far.recv, far.send, plan, work)
                finally:
                    os._exit(0)
        except OSError:
            self.pipe.close()
            raise
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            far.close()

    def look(self) -> None:
        """It is ready from the start."""

    def ask(self, changes: dict[str, Any], batch: Batch, stop: threading.Event) -> Sums | None:
        """Return the sums of a batch, None if it is stopped.  Raises: Lost."""
        idle, spent = 0, None
        try:
            self.pipe.send((changes, batch))
            while not self.pipe.poll(LOOK):
                if stop.is_set():
                    return None
                before, spent = spent, self._spent_asleep()
                idle = idle + 1 if spent is not None and spent == before else 0
                if idle == PATIENCE:
                    raise Lost
            sums: Sums
            sums, self.memory = self.pipe.recv()
        except (EOFError, OSError):
            raise Lost from None
        return sums

    def _spent_asleep(self) -> int | None:
        """Return the ticks of processor time so far, None if it is not asleep (proc(5))."""
        words = Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
        return int(words[11]) + int(words[12]) if words[0] == "S" else None

    def close(self) -> None:
        """End it, at once; the pipe is closed when nobody looks at it any more."""
        with contextlib.suppress(ProcessLookupError, ChildProcessError):
            os.kill(self.pid, signal.SIGKILL)
            os.waitpid(self.pid, 0)


# The forked process


def _prepare(parent: int, library: Any, pipe: int) -> None:
    """Let go of all that is the parent's, and end when it ends."""
    # What Blender and Python do at signals is not for this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for each in (signal.SIGTERM, *CRASHES):
        signal.signal(each, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, signal.SIGTERM})
    library.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(0)

    # Whoever reads what the parent prints must not have to wait for this process, too.
    nowhere = os.open(os.devnull, os.O_RDWR)
    for standard in range(3):
        os.dup2(nowhere, standard)
    for file in [int(entry.name) for entry in Path("/proc/self/fd").iterdir()]:
        if file > 2 and file != pipe:
            with contextlib.suppress(OSError):  # the listing's own
                os.close(file)

    # If there is no memory left, the system shall not choose Blender.
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")
    gc.freeze()  # else the collector would write to all shared pages


__all__ = ["Lost", "Processes", "Threads", "changed", "differences", "hire"]
