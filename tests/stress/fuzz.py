"""a seed -> a scene that nobody meant.  Random values at random places of a description.

What is asked of a render: a `SceneError` with a message that names something, or a picture
without a NaN or an infinity (lamps may take light away).  Anything else is a defect.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace

import numpy as np

from penumbra.core import Node, Scene, SceneError, compile_plan, render

from ..support import scenes as s
from .scenes import SCENES, build

NUMBERS = (
    *(0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 1e-45, 1e-38, 1e-12, 1e-6, 1e3, 1e6, 1e12, 1e30, 3.4e38),
    *(1e39, 1e300, -1e-30, -1e12, np.pi, np.inf, -np.inf, np.nan),
)
COUNTS = (0, 1, 2, -1, 64, 1 << 20, 1 << 31, -(1 << 40), 1 << 63, 1 << 70)
WORDS = ("", "NONE", "Nonsense", "BOX", "RANDOM", "POINT", "SUN", "ORTHO")

# What says how much work there is: drawn from what can be done in a moment
SMALL = {
    "samples": (0, 1, 4, -1),
    "light_samples": (0, 1, 5),
    "width": (0, 1, 7, -3),
    "height": (0, 1, 5, -3),
    "max_bounces": (0, 1, 3, 40, -1),
}


class Mutator:
    """Returns copies of descriptions in which about `rate` of the values are others."""

    def __init__(self, seed: int, rate: float) -> None:
        self.random = np.random.default_rng(seed)
        self.rate = rate
        self.done: dict[int, object] = {}  # what is shared stays shared

    def _one_of(self, values):
        return values[int(self.random.integers(len(values)))]

    def _array(self, values):
        values = values.copy()
        if values.size == 0 or self.random.random() > 3 * self.rate:
            return values
        some = self.random.integers(values.size, size=1 + int(self.random.integers(3)))
        pool = NUMBERS if values.dtype.kind == "f" else (0, -1, 1, len(values), 1 << 30)
        with np.errstate(over="ignore"):
            values.reshape(-1)[some] = np.asarray([self._one_of(pool) for _ in some], values.dtype)
        return values

    def value(self, name, value):
        """Return the value of a field, or another of its type."""
        if isinstance(value, np.ndarray):
            return self._array(value)
        if is_dataclass(value):
            return self.thing(value)
        if isinstance(value, Mapping):
            return {key: self.value(key, inner) for key, inner in value.items()}
        if isinstance(value, tuple):
            if value and self.random.random() < self.rate / 4:
                return ()
            return tuple(self.value(name, inner) for inner in value)
        if self.random.random() > self.rate:
            return value
        if isinstance(value, bool):
            return not value
        if name in SMALL:
            return self._one_of(SMALL[name])
        if isinstance(value, int):
            return self._one_of(COUNTS)
        if isinstance(value, float):
            return float(self._one_of(NUMBERS))
        return self._one_of(WORDS) if isinstance(value, str) and name != "name" else value

    def thing(self, thing):
        """Return a description with other values; raises what its checks raise."""
        if id(thing) not in self.done:
            changes = {f.name: self.value(f.name, getattr(thing, f.name)) for f in fields(thing)}
            if isinstance(thing, Node) and self.random.random() < self.rate:
                changes["inputs"] = dict(list(changes["inputs"].items())[1:])
            self.done[id(thing)] = replace(thing, **changes)
        return self.done[id(thing)]


def scene_of(seed: int) -> tuple[Scene, object]:
    """Return a scene and settings with a few, or many, values that nobody meant."""
    names = tuple(SCENES)
    scene, own = build(names[seed % len(names)])
    mutate = Mutator(seed, (0.005, 0.02, 0.1)[seed % 3])
    settings = replace(s.DEFAULTS, samples=1, max_bounces=3, seed=0, **own)
    scene = replace(scene, camera=replace(scene.camera, width=8, height=8))
    return mutate.thing(scene), mutate.thing(settings)


def outcome(seed: int) -> str:
    """Render a fuzzed scene and return 'drawn', 'refused: message' or 'wrong: what'."""
    try:
        scene, settings = scene_of(seed)
        picture = render(compile_plan(scene, settings), threads=1)
    except SceneError as error:
        return f"refused: {error}" if len(str(error)) > 10 else f"wrong: message {error!r}"
    except Exception as error:  # what a user would see as a crash
        place = error.__traceback__
        while place.tb_next is not None:
            place = place.tb_next
        where = f"{place.tb_frame.f_code.co_filename}:{place.tb_lineno}"
        return f"wrong: {type(error).__name__}: {error} ({where})"
    values = picture.combined()
    for found, name in ((np.isnan, "NaN"), (np.isinf, "infinite")):
        if found(values).any():
            return f"wrong: {name} pixels"
    return "drawn"
