"""render -> the process's memory.  Keeps the pages of arrays between steps, on Linux.

Arrays of a batch live for microseconds.  glibc at first gives each of them fresh pages, which the
system has to clear: a fifth of a short render.  It learns not to, but slowly and for each thread;
here it is told once, with the limit that it would reach by itself, and memory goes back to the
system when a render ends.  Blender itself may run on the allocator of Intel's TBB, which keeps what
is freed without being told; it is asked to give it back, too.  Elsewhere nothing is done.
"""

import ctypes
import sys
from functools import cache
from typing import Any

# mallopt's parameters (malloc.h), and where glibc's own adaptation of the first one ends
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
LARGEST_MAPPED, KEPT = 32 << 20, 1 << 30  # [bytes]
TBBMALLOC_CLEAN_ALL_BUFFERS = 0  # scalable_allocation_command's (tbb/scalable_allocator.h)


@cache
def _glibc() -> Any:
    """Return the C library if it is glibc, told to keep pages, else None."""
    if not sys.platform.startswith("linux"):
        return None
    library = ctypes.CDLL(None)
    if not (hasattr(library, "gnu_get_libc_version") and hasattr(library, "malloc_trim")):
        return None
    library.mallopt(M_MMAP_THRESHOLD, LARGEST_MAPPED)
    library.mallopt(M_TRIM_THRESHOLD, KEPT)
    return library


@cache
def _tbb() -> Any:
    """Return the program if TBB's allocator is a part of it, else None."""
    if not sys.platform.startswith("linux"):
        return None
    library = ctypes.CDLL(None)
    return library if hasattr(library, "scalable_allocation_command") else None


def keep_pages() -> None:
    """Let freed memory stay with the process for now."""
    _glibc()


def release_pages() -> None:
    """Give memory that nobody uses back to the system."""
    library = _glibc()
    if library is not None:
        library.malloc_trim(0)
    library = _tbb()
    if library is not None:
        library.scalable_allocation_command(TBBMALLOC_CLEAN_ALL_BUFFERS, None)
