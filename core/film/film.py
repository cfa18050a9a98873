"""radiance per slot -> pixel sums.  Where samples end.

Sums are float64, so that ten thousand samples add up without drift; every pixel knows how many
samples it holds, since a stopped render leaves some pixels behind others.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32
from .shadows import add_shadows

# What pixels may sum up, and how many rows that takes; see `shadows` for the last four.
PASSES = {
    "combined": 3,
    "alpha": 1,
    "caught": 3,
    "opacity": 1,
    "alone": 3,
    "background": 3,
}

LARGEST = 1e36  # of a sample; a batch has fewer than 300 samples of a pixel


@dataclass(eq=False)
class Film:
    """Sums of a width x height rectangle, row 0 at the bottom.

    sums (C, pixels) float64 of the `passes`, one after the other; counts (pixels,) int64.
    """

    width: int
    height: int
    passes: tuple[str, ...]
    sums: NDArray[np.float64]
    counts: NDArray[np.int64]

    def add(self, first: int, sums: NDArray[np.float32], samples: int) -> None:
        """Add what `samples` samples gave for the pixels from `first` on; sums is (C, n)."""
        pixels = slice(first, first + sums.shape[1])
        self.sums[:, pixels] += sums
        self.counts[pixels] += samples

    def combined(self, exposure: float) -> NDArray[np.float32]:
        """Return (H, W, 4) float32: mean radiance x exposure, premultiplied alpha.

        Pixels without a sample are transparent black.
        """
        scale = 1.0 / np.maximum(self.counts, 1)
        alpha = np.minimum(self.counts, 1.0)
        if "alpha" in self.passes:
            alpha = np.clip(self._sum("alpha")[0] * scale, 0.0, 1.0)
        colour = self._sum("combined")
        if "caught" in self.passes:
            opacity = np.clip(self._sum("opacity")[0] * scale, 0.0, 1.0)
            alpha = add_shadows(self._sum("caught"), self._sum("alone"), opacity, alpha)
        if "background" in self.passes:
            colour = colour + self._sum("background") * (1.0 - alpha)
            alpha = np.minimum(self.counts, 1.0)
        out = np.zeros((self.counts.size, 4), F32)
        np.multiply(colour, scale * exposure, out=out[:, :3].T, casting="same_kind")
        out[:, 3] = alpha
        return out.reshape(self.height, self.width, 4)

    def _sum(self, name: str) -> NDArray[np.float64]:
        first = rows(self.passes[: self.passes.index(name)])
        return self.sums[first : first + PASSES[name]]


def rows(passes: tuple[str, ...]) -> int:
    """Return the number of rows of passes."""
    return sum(PASSES[name] for name in passes)


def new_film(width: int, height: int, passes: tuple[str, ...] = ("combined",)) -> Film:
    """Return an empty film."""
    pixels = width * height
    sums, counts = np.zeros((rows(passes), pixels)), np.zeros(pixels, np.int64)
    return Film(width, height, passes, sums, counts)


def drop_not_finite(values: NDArray[np.float32]) -> int:
    """Make samples black, in place, that have a number that is not finite; return how many.

    values (C, N) or (N,).  One such sample would blind its pixel: numbers of 1e30 in a scene are
    mistakes, and their products overflow.  Nor can numbers above `LARGEST` be added up in float32.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        if abs(float(values.sum(dtype=F32))) < LARGEST:
            return 0
        bad = ~(np.abs(values) < LARGEST)
    lost = bad.any(axis=0) if bad.ndim > 1 else bad
    values[..., lost] = 0.0
    return int(np.count_nonzero(lost))
