"""film -> pixels that go on.  Adaptive sampling: stops where the noise is low enough.

The samples of a pixel in two halves are two pictures, and half of what they differ by is about the
error of both together.  The halves are those of a block of 2^k samples, which a Sobol sequence
spreads well each; even and odd samples are not, and would show 4 to 8 times the error.  The
difference is held against the brightness as in Cycles: its root, as the eye does, up to 1; the
brightness itself above.  Source: Dammertz, Hanika, Keller and Lensch 2010, "A Hierarchical
Automatic Stopping Condition for Monte Carlo Global Illumination", there for blocks of pixels.

Who stops when samples agree stops too early where bright paths are rare, and the picture gets too
dark.  So a pixel is held back by the error it had with half of the samples, scaled; by its own
error and those next to it, as in Cycles; and by the mean error around it, in which its own samples
count little: what others decide is no bias.  Pixels that had stopped catch up, sample by sample,
when their neighbours find what they missed.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index
from ..sampling.patterns import PATTERNS
from ..settings import Settings
from .film import PICTURE, Film, rows

Array = NDArray[np.floating]

LEAST_FIRST = 16  # samples: then quarters of four are compared
PIECE = 1 << 17  # pixels whose errors are measured at once: some 30 ms
AUTOMATIC_FIRST = 64  # at the least; with 32, pictures of rare light lose a quarter more

# Thresholds that the error of a pixel, or of one next to it, may have: Cycles, too, takes its
# users' threshold five times.
ALONE = 5.0
# And those for the mean of 5 x 5 pixels, the largest that holds one or its neighbours: as low as
# keeps the bias of a caustic below half a percent at thresholds up to 0.03, see tests/physics.
TOGETHER = 3.0


@dataclass(frozen=True)
class Adaptive:
    """The noise at which sampling stops, and after how many samples, 2^k, it is looked at first."""

    threshold: float
    first: int


def compile_adaptive(settings: Settings) -> tuple[Adaptive | None, str]:
    """Return how pixels are judged, None if all get all samples; and why, if that was not asked.

    Automatic values are Cycles': a threshold of 1 / samples, at least 0.001; a minimum of
    16 / threshold^0.3 samples, here at least 64 and in any case a power of two.
    """
    if not settings.use_adaptive_sampling:
        return None, ""
    threshold = settings.adaptive_threshold or max(0.001, 1.0 / settings.samples)
    automatic = max(AUTOMATIC_FIRST, ceil(16.0 / threshold**0.3))
    minimum = settings.adaptive_min_samples or automatic
    first = 1 << (max(minimum, LEAST_FIRST) - 1).bit_length()
    if first >= settings.samples:
        return None, ""
    if not PATTERNS[settings.pattern].progressive:
        return None, f"pattern {settings.pattern} is a set of a fixed size"
    if settings.use_sample_subset:
        return None, "a sample subset has its samples everywhere"
    return Adaptive(threshold, first), ""


class Judge:
    """Decides which pixels of a film go on; it is asked when all have 2^k samples, or stopped.

    Unbiased it cannot be: pixels of one brightness stop at different counts.  Measured, see
    benchmarks/README.md.
    Shadows of catchers that have a pass of their own are judged with the picture, too: that is
    where they go.  Other passes are not, as in Cycles.
    """

    def __init__(self, film: Film, adaptive: Adaptive, exposure: float) -> None:
        self.film, self.adaptive, self.exposure = film, adaptive, exposure
        self.passes = tuple(name for name in film.passes if name in PICTURE)
        assert film.passes[: len(self.passes)] == self.passes
        count = rows(self.passes)
        self.half = np.zeros((count, film.counts.size), F32)  # sums at the last 2^k, and
        self.quarter = np.zeros_like(self.half)  # at the one before
        self.error = np.zeros(film.counts.size, F32)  # squared, in thresholds

    def keep(self, pixels: slice | Index) -> None:
        """Remember the sums of pixels, which have 2^k samples."""
        self.quarter[:, pixels] = self.half[:, pixels]
        self.half[:, pixels] = self.film.sums[: len(self.half), pixels]

    def measure(self, count: int) -> Iterator[None]:
        """Measure the errors of the pixels that have come to `count` samples, piece by piece.

        Those that had stopped keep the error that they stopped with.
        """
        some = np.flatnonzero(self.film.counts == count)
        for low in range(0, some.size, PIECE):
            piece = some[low : low + PIECE]
            self.error[piece] = self._squared(piece, count)
            yield

    def judge(self, count: int) -> tuple[Index, float]:
        """Return the pixels that go on from `count` samples, and how many these will need in all.

        Pixels with fewer samples had stopped; some may be among those that go on.
        """
        # Who is noisy takes those around along
        error = self.error.reshape(self.film.height, self.film.width)
        alone = _around(error, np.maximum, 1) / ALONE**2
        together = _around(_around(error, np.add, 2) / 25, np.maximum, 2) / TOGETHER**2
        need = np.maximum(alone, together).reshape(-1)
        going = np.flatnonzero(need > 1)
        return going, float(np.maximum(count * need.take(going), 2 * count).sum())

    def _squared(self, some: Index, count: int) -> Array:
        """Return the squared errors (n,) of some pixels, by all their samples and by half of them.

        Half of the samples have twice the squared error.
        """
        sums = self.film.sums[: len(self.half)].take(some, axis=1)
        half, quarter = self.half.take(some, axis=1), self.quarter.take(some, axis=1)
        now = self._error(half, sums - half, count // 2)
        before = self._error(quarter, half - quarter, count // 4)
        return np.maximum(now, 0.5 * before)

    def _error(self, first: NDArray[np.float32], second: NDArray[np.floating], count: int) -> Array:
        """Return the squared errors (n,), in thresholds, of sums (C, n) of `count` samples each."""
        a, b = self._picture(first, count), self._picture(second, count)
        brightness = np.maximum(0.5 * (a[:, :3] + b[:, :3]).sum(axis=1), 0)
        scale = np.where(brightness < 1, np.sqrt(brightness), brightness) + 1e-4
        difference = 0.5 * np.abs(a - b)
        error = difference[:, :3].sum(axis=1) / scale
        # Alpha is judged by the white that would shine through.
        error = np.maximum(error, difference[:, 3])
        return (error / self.adaptive.threshold) ** 2

    def _picture(self, sums: NDArray[np.floating], count: int) -> NDArray[np.float32]:
        pixels = sums.shape[1]
        film = Film(pixels, 1, self.passes, np.asarray(sums, float), np.full(pixels, count))
        return film.combined(self.exposure)[0]


def _around(values: Array, join: np.ufunc, reach: int) -> Array:
    """Return a picture in which each value (H, W) is joined with all up to `reach` pixels away."""
    size = 2 * reach + 1
    padded = np.pad(values, reach, mode="edge")
    lines = reduce(join, (padded[k : k + len(values)] for k in range(size)))
    return np.asarray(reduce(join, (lines[:, k : k + values.shape[1]] for k in range(size))))
