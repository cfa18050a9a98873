"""scenes x transformations, sweeps -> rows of what was found.

A picture may not hold a NaN, an infinity or a negative number; a transformed scene may not look
different, block by block of 4 x 4 pixels (paired Student's t over the seeds); the mean of a sweep
has to be where theory puts it.
"""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np

from penumbra.core import compile_plan, render

from ..support import scenes as s
from ..support.statistics import sidak, t_probability
from .scenes import SCENES, build
from .sweeps import SWEEPS
from .transforms import TRANSFORMS, TURNED_OVER

SIGNIFICANCE = 1e-4  # of a row to be called different by chance
ROUNDING = 2e-3  # what rounding may do to a block, of the mean of the picture
SETTINGS = replace(s.DEFAULTS, samples=16, max_bounces=4)
BLOCK = 4


@dataclass(frozen=True)
class Row:
    """What one picture, or pair of pictures, shows."""

    what: str
    nan: int
    infinite: int
    negative: int
    self_hits: int
    wrong: int  # blocks that differ, or 1 for a mean that is not where it should be
    deviation: float  # of the mean, relative
    error: float  # its standard error

    @property
    def is_good(self) -> bool:
        """Whether nothing was found."""
        return not (self.nan or self.infinite or self.negative or self.wrong)


def _render(scene, settings, seeds: int):
    """Return the pictures (seeds, H, W, 3), and the self-hits."""
    found, hits = [], 0
    for seed in range(seeds):
        picture = render(compile_plan(scene, replace(settings, seed=seed)), threads=2)
        found.append(picture.combined()[..., :3].astype(float))
        hits += picture.statistics["self_hits"]
    return np.stack(found), hits


def _blocks(pictures):
    n, height, width, _ = pictures.shape
    mean = pictures.mean(axis=-1).reshape(n, height // BLOCK, BLOCK, width // BLOCK, BLOCK)
    return mean.mean(axis=(2, 4)).reshape(n, -1)


def _bad(pictures) -> tuple[int, int, int]:
    return (
        int(np.isnan(pictures).sum()),
        int(np.isinf(pictures).sum()),
        int((pictures < 0).sum()),
    )


def compare(name: str, transform: str, seeds: int) -> Row:
    """Render a scene as it is and transformed."""
    scene, own = build(name)
    settings = replace(SETTINGS, **own)
    before, _ = _render(scene, settings, seeds)
    after, hits = _render(TRANSFORMS[transform](scene), settings, seeds)
    if transform in TURNED_OVER:
        after = after[:, :, ::-1]
    a, b = _blocks(before), _blocks(after)
    scale = max(a.mean(), 1e-30)
    difference = (b - a) / scale
    gap = np.abs(difference.mean(axis=0)) - ROUNDING
    error = difference.std(axis=0, ddof=1) / math.sqrt(seeds)
    level = sidak(SIGNIFICANCE, gap.size)
    wrong = sum(
        g > 0 and t_probability(g / max(e, 1e-12), seeds - 1) < level
        for g, e in zip(gap, error, strict=True)
    )
    drift = difference.mean(axis=1)
    deviation, spread = float(drift.mean()), float(drift.std(ddof=1) / math.sqrt(seeds))
    return Row(f"{name}: {transform}", *_bad(after), hits, int(wrong), deviation, spread)


def extreme(name: str, value: float, seeds: int) -> Row:
    """Render a sweep's scene for one value of its parameter."""
    sweep = SWEEPS[name]
    settings = replace(SETTINGS, **sweep.settings(value))
    pictures, hits = _render(sweep.build(value), settings, seeds)
    means = pictures.mean(axis=(1, 2, 3))
    low, high = sweep.within(value)
    mean, error = float(means.mean()), float(means.std(ddof=1) / math.sqrt(seeds))
    margin = sweep.tolerance * max(abs(high) if math.isfinite(high) else 0.0, 1e-9) + 6 * error
    wrong = not (low - margin <= mean <= high + margin)
    beyond = mean - high if mean > high else min(mean - low, 0.0)
    return Row(f"{name} {value:g}", *_bad(pictures), hits, int(wrong), beyond, error)


def run(seeds: int) -> Iterator[Row]:
    """Yield the rows of everything."""
    for name in SCENES:
        for transform in TRANSFORMS:
            yield compare(name, transform, seeds)
    for name, sweep in SWEEPS.items():
        for value in sweep.values:
            yield extreme(name, value, seeds)


def described(row: Row) -> str:
    """Return a line of text."""
    found = {key: value for key, value in asdict(row).items() if isinstance(value, int) and value}
    text = ", ".join(f"{value} {key}" for key, value in found.items()) or "good"
    return f"{row.what:45} {row.deviation:+.2e} +- {row.error:.1e}  {text}"
