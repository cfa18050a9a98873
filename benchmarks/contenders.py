"""names -> contenders.  Who renders a scene: an engine, and what is changed in its settings.

Cycles and Penumbra as they come are always there; the others are asked for by `--variants`.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from .scenes import Scene

# Where sampling is adaptive: times as many samples as a scene's largest count at most, and the
# thresholds, so that the errors are those of the other curves
MORE, THRESHOLDS = 2, (0.5, 0.2, 0.1, 0.05, 0.03, 0.02)
# What Penumbra's contenders change, as it comes
DEFAULTS = {
    "pattern": "SOBOL",
    "light_samples": 0,
    "scatter_samples": 0,
    "path_reuse": "AUTO",
    "splitting": True,
}
ONE_RAY = {"light_samples": 1, "scatter_samples": 1, "path_reuse": "OFF"}
# Other renderers: as what each of them runs, its module and the mode of it
OTHERS = {"MITSUBA": "scalar_rgb", "MITSUBA_LLVM": "llvm_ad_rgb"}


@dataclass(frozen=True)
class Contender:
    """An engine with settings of its own; `name` is its key in the JSON."""

    name: str
    engine: str
    settings: dict[str, Any] = field(default_factory=dict)
    is_adaptive: bool = False
    needs_count: bool = False  # its pattern is made for one number of samples

    def competes(self, scene: Scene) -> bool:
        """Tell whether it makes sense in a scene."""
        if self.is_adaptive:
            return bool(scene.reference) and not scene.thresholds
        others = self.needs_count or self.engine in OTHERS
        return not (others and scene.thresholds)

    def points(self, scene: Scene) -> list[tuple[int, dict[str, Any]]]:
        """Return the points of its curve: samples, and the settings of this point."""
        if self.is_adaptive:
            most = MORE * scene.samples[-1]
            scene = replace(scene, samples=(most,), thresholds=THRESHOLDS)
        return [(samples, self.settings | settings) for samples, settings in scene.points()]


def _pattern(name: str) -> Contender:
    return Contender(
        f"PENUMBRA {name}", "PENUMBRA", {"pattern": name.upper()}, False, name != "random"
    )


ALWAYS = (Contender("CYCLES", "CYCLES"), Contender("PENUMBRA", "PENUMBRA"))
# What the option --variants may name, and who takes part then
VARIANTS = {
    "patterns": tuple(map(_pattern, ("poisson", "jittered", "regular", "random"))),
    "adaptive": tuple(Contender(f"{e} adaptive", e, {}, True) for e in ("CYCLES", "PENUMBRA")),
    "splitting": (
        Contender("PENUMBRA one ray", "PENUMBRA", ONE_RAY),
        Contender("PENUMBRA own paths", "PENUMBRA", {"path_reuse": "OFF"}),
        Contender("PENUMBRA no splitting", "PENUMBRA", {"splitting": False}),
    ),
    "mitsuba": (Contender("MITSUBA", "MITSUBA"),),
    "mitsuba-llvm": (Contender("MITSUBA LLVM", "MITSUBA_LLVM"),),
}
ALL = ("patterns", "adaptive", "splitting", "mitsuba")  # what works wherever the wheels do


def chosen(variants: Iterable[str]) -> tuple[Contender, ...]:
    """Return who takes part; Cycles, to which all are compared, comes first."""
    asked = [name for each in variants for name in (ALL if each == "all" else (each,))]
    more = (contender for name in dict.fromkeys(asked) for contender in VARIANTS[name])
    return (*ALWAYS, *more)
