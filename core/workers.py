"""plan -> workers.  Who renders batches: threads of this process, or processes forked from it.

Between two calls of numpy a thread needs the interpreter, which serves one thread at a time.  A
forked process has an interpreter of its own, and shares the memory of the scene, Embree's trees
and all, with its parent: that takes milliseconds, however large the scene is.  A thread of the
parent hands batches to each of them and waits, so that the order of work, the sums and their bits
are the same.  Where a process fails, its thread does that batch and all that follow itself: what
was wrong with the batch is then raised where it can be seen.
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
from dataclasses import fields, replace
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import Any

from .batches import Batch, Sums, Work
from .plan import Plan
from .sampling.draws import Numbers
from .scene import Note

# macOS has fork, but its libraries do not survive it; what a process does is read from /proc
CAN_FORK = sys.platform == "linux" and Path("/proc/self/stat").exists()
LEAST = 1 << 18  # samples that are worth processes: about a tenth of a second of the cheapest
LOOK = 0.05  # seconds between two looks at whether to stop
PATIENCE = 100  # looks, in all of which a process sleeps and does nothing: it waits for ever
KEPT = 4  # chunks whose tables of random numbers a process keeps
PR_SET_PDEATHSIG = 1  # of prctl(2)
CRASHES = (signal.SIGSEGV, signal.SIGABRT, signal.SIGFPE, signal.SIGILL)


class Lost(Exception):
    """A worker process has ended or waits for ever."""


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


class Processes:
    """Forked processes do the work for as many threads, which call `sample`.

    processes: how many there were at first.
    """

    def __init__(self, plan: Plan, work: Work, threads: int) -> None:
        self._plan, self._work = plan, work
        self._all: list[_Process] = []
        self._lost = 0
        with contextlib.suppress(OSError):  # no memory to promise, or no more processes allowed
            for _ in range(threads):
                self._all.append(_Process(plan, work))
        self.processes = len(self._all)

        # One for each thread; None: the thread does the work itself.
        self._idle: queue.SimpleQueue[_Process | None] = queue.SimpleQueue()
        for number in range(threads):
            self._idle.put(self._all[number] if number < self.processes else None)

    @property
    def memory(self) -> int:
        """What they have had besides what they share [bytes]."""
        return sum(process.memory for process in self._all)

    def sample(self, plan: Plan, batch: Batch, stop: threading.Event) -> Sums:
        """Return the sums of a batch: of no samples if it is stopped."""
        process = self._idle.get()
        try:
            if process is not None and not stop.is_set():
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
        said = f"Workers: {self._lost} of {self.processes} processes failed; threads did their work"
        return (Note("Render settings", said),)

    def close(self) -> None:
        """End them at once, whatever they do; whoever waits for one does its work itself."""
        for process in self._all:
            process.close()


def hire(plan: Plan, work: Work, threads: int, pixels: int) -> Threads | Processes:
    """Return who works for `threads` threads on a picture of so many pixels."""
    samples = pixels * (plan.samples[1] - plan.samples[0])
    if plan.workers == "PROCESSES" and not CAN_FORK:
        return Threads(work, (Note("Render settings", "Workers: processes are for Linux only"),))
    pays = plan.workers == "PROCESSES" or (plan.workers == "AUTO" and samples >= LEAST)
    return Processes(plan, work, threads) if CAN_FORK and pays and threads > 1 else Threads(work)


class _Process:
    """A forked process, seen by the thread that it works for."""

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
                    _serve(far, plan, work)
                finally:
                    os._exit(0)
        except OSError:
            self.pipe.close()
            raise
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            far.close()

    def ask(self, changes: dict[str, Any], batch: Batch, stop: threading.Event) -> Sums | None:
        """Return the sums of a batch, None if it is stopped."""
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


def _serve(pipe: Connection, base: Plan, work: Work) -> None:
    """Work until the parent closes the pipe, or something goes wrong."""
    before, never = _memory(), threading.Event()
    plan, last = base, dict[str, Any]()
    kept: dict[Any, Numbers] = {}
    while True:
        changes, batch = pipe.recv()
        if changes != last:
            plan, last = changed(base, changes), changes

        # Chunks share their tables, which are not sent.
        numbers = batch.numbers
        key = numbers.pattern, numbers.seed, numbers.first, numbers.count, numbers.total
        if key not in kept and len(kept) == KEPT:
            kept.pop(next(iter(kept)))
        batch = replace(batch, numbers=kept.setdefault(key, numbers))
        pipe.send((work(plan, batch, never), _memory() - before))


def _memory() -> int:
    """Return the memory of this process that is no file's [bytes] (proc(5))."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("RssAnon"):
            return int(line.split()[1]) << 10
    return 0  # before Linux 4.5


# Plans of one render differ in little, and most of them cannot be sent


def differences(base: Plan, plan: Plan) -> dict[str, Any]:
    """Return the fields of a plan that are not those of `base`, by name."""
    found = {}
    for name in (item.name for item in fields(Plan)):
        old, new = getattr(base, name), getattr(plan, name)
        if new is not old:
            is_plan = isinstance(old, Plan) and isinstance(new, Plan)
            found[name] = differences(old, new) if is_plan else new
    return found


def changed(base: Plan, found: dict[str, Any]) -> Plan:
    """Return `base` with such differences."""
    alone = found.get("alone")
    if isinstance(alone, dict) and base.alone is not None:
        found = {**found, "alone": changed(base.alone, alone)}
    return replace(base, **found)
