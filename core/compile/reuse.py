"""plan, settings -> plan.  Whether tiles of pixels may share what their scattered rays find."""

from collections.abc import Callable
from dataclasses import replace

from ..bsdf import diffuse
from ..plan import Plan
from ..scene import Note
from ..settings import Settings
from ..tiles import SIZE

# What rules it out, as the report says it.  The first two leave it nothing to do.
OBSTACLES: dict[str, Callable[[Plan], bool]] = {
    "no matte surface": lambda plan: plan.accel is None or diffuse not in plan.surfaces.modules,
    "no diffuse bounces": lambda plan: plan.max_bounces < 1 or (plan.kind_limits or (1,))[0] < 1,
    "motion blur": lambda plan: plan.shutter is not None,
    "passes of light by kind": lambda plan: plan.ledger is not None and plan.ledger.sorts_light,
    "a pass of the render time": lambda plan: (
        plan.ledger is not None and plan.ledger.row("seconds") is not None
    ),
    "shadow catchers": lambda plan: plan.alone is not None,
    "rays that count as diffuse or glossy at random": lambda plan: plan.mixes_kinds,
    "a shading offset of the terminator": lambda plan: plan.shifts_terminators,
}
NOTHING_TO_DO = 2


def with_reuse(plan: Plan, settings: Settings) -> Plan:
    """Return the plan with re-use of paths, or so that it is measured whether it pays.

    Denoisers take noise that is alike in neighbouring pixels for the picture: with one, it has to
    be asked for.
    """
    why_not = [name for name, is_there in OBSTACLES.items() if is_there(plan)]
    if settings.path_reuse == "AUTO" and not why_not and plan.denoising is None:
        return replace(plan, measures=(*plan.measures, "path_reuse"))
    if settings.path_reuse != "ON":
        return plan
    if not why_not:
        return replace(plan, path_reuse=SIZE)
    if why_not[0] in list(OBSTACLES)[:NOTHING_TO_DO]:
        return plan
    note = Note("Render settings", f"Path Reuse: there is none with {why_not[0]}")
    return replace(plan, notes=(*plan.notes, note))
