"""a process -> how often its interpreter is taken; shares -> how many workers it can feed.

One interpreter serves one thread at a time.  Whether it is taken is a number in the memory of the
process (CPython's lock), which is looked at from outside some thousand times a second: nothing in
the process is slowed or made to wait.
"""

import ctypes
import os
import struct
import sys
import threading
from collections.abc import Sequence
from time import monotonic, sleep

# Where CPython tells debuggers its layout (_Py_DebugOffsets, Include/internal/pycore_runtime.h):
# bytes from the beginning of _PyRuntime to the offsets of the first interpreter and of its lock
COOKIE = b"xdebugpy"
OFFSETS = {(3, 13): (40, 136)}
PERIOD = 2e-4  # seconds between two looks


def lock_address() -> int | None:
    """Return where this process keeps whether its interpreter is taken; None if not known."""
    offsets = OFFSETS.get(sys.version_info[:2])
    if offsets is None or not sys.platform.startswith("linux"):
        return None
    runtime = ctypes.addressof(ctypes.c_char.in_dll(ctypes.pythonapi, "_PyRuntime"))
    if ctypes.string_at(runtime, len(COOKIE)) != COOKIE:
        return None
    first, locked = (ctypes.c_uint64.from_address(runtime + at).value for at in offsets)
    return int(ctypes.c_uint64.from_address(runtime + first).value + locked)


class Watch:
    """Looks at the lock of another process, in a thread, until it is closed."""

    def __init__(self, pid: int, address: int) -> None:
        self.seen: list[tuple[float, bool]] = []
        self._file = os.open(f"/proc/{pid}/mem", os.O_RDONLY)
        self._address, self._over = address, threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)
        self._thread.start()

    def _look(self) -> None:
        while not self._over.is_set():
            (locked,) = struct.unpack("i", os.pread(self._file, 4, self._address))
            self.seen.append((monotonic(), locked == 1))
            sleep(PERIOD)

    @property
    def is_alive(self) -> bool:
        """Whether it still looks: the other process may have ended."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Look no more."""
        self._over.set()
        self._thread.join()
        os.close(self._file)

    def share(self, begin: float, end: float) -> float | None:
        """Return for which share of a time, by `monotonic`, it was taken; None if not seen."""
        found = [taken for when, taken in self.seen if begin <= when <= end]
        return sum(found) / len(found) if found else None


def speedup(taken: float, workers: int) -> float:
    """Return how many times as fast as one are workers that each need one server for a share.

    Exact for random times of service: mean value analysis of a closed queue (Reiser and Lavenberg
    1980, "Mean-Value Analysis of Closed Multichain Queuing Networks").  It tends to 1 / taken.
    """
    waiting = rate = 0.0
    for count in range(1, workers + 1):
        served = taken * (1 + waiting)
        rate = count / (1 - taken + served)
        waiting = rate * served
    return rate


def predictions(taken: float | None, workers: Sequence[int]) -> dict[str, float]:
    """Return the speedup by number of workers; {} if it is not known how much is taken."""
    return {} if taken is None else {str(count): speedup(taken, count) for count in workers}
