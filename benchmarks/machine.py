"""a machine -> its description.  What timings depend on, for the JSON and the page."""

import datetime
import os
import platform
import sys
from pathlib import Path
from typing import Any


def machine() -> dict[str, Any]:
    """Return processor, system, cores, memory [GiB], Python, the day, and the load before."""
    return {
        "processor": _processor(),
        "system": sys.platform,
        "cores": os.cpu_count(),
        "memory": _memory(),
        "python": platform.python_version(),
        "day": datetime.date.today().isoformat(),
        "load": load(),
    }


def load() -> float | None:
    """Return how many processes wanted to run, in the last minute; None if the system won't say."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text("utf-8", "replace").splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()


def _memory() -> float | None:
    names = getattr(os, "sysconf_names", {})
    if "SC_PHYS_PAGES" not in names:
        return None
    return round(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30, 1)
