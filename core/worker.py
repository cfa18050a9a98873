"""batches -> sums.  What a worker process does, forked or fresh, until it is ended."""

import threading
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from .batches import Work
from .plan import Plan
from .sampling.draws import Numbers

KEPT = 4  # chunks whose tables of random numbers a process keeps
STATUS = Path("/proc/self/status")


def serve(receive: Callable[[], Any], send: Callable[[Any], None], base: Plan, work: Work) -> None:
    """Work on what is received until nothing more is, which raises."""
    before, never = _memory(), threading.Event()
    plan, last = base, dict[str, Any]()
    kept: dict[Any, Numbers] = {}
    while True:
        changes, batch = receive()
        if changes != last:
            plan, last = changed(base, changes), changes

        # Chunks share their tables, which are not sent.
        numbers = batch.numbers
        key = numbers.pattern, numbers.seed, numbers.first, numbers.count, numbers.total
        if key not in kept and len(kept) == KEPT:
            kept.pop(next(iter(kept)))
        batch = replace(batch, numbers=kept.setdefault(key, numbers))
        send((work(plan, batch, never), _memory() - before))


def _memory() -> int:
    """Return the memory of this process that is no file's [bytes] (proc(5)); 0 if unknown."""
    if not STATUS.exists():
        return 0
    for line in STATUS.read_text().splitlines():
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
