"""radiance per slot -> pixel sums.  Where samples end.

Sums are float64, so that ten thousand samples add up without drift; every pixel knows how many
samples it holds, since a stopped render leaves some pixels behind others.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32


@dataclass(eq=False)
class Film:
    """Sums of a width x height rectangle, row 0 at the bottom.

    sums (C, pixels) float64 of radiance and, with C = 4, of alpha; counts (pixels,) int64.
    """

    width: int
    height: int
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
        out = np.zeros((self.counts.size, 4), F32)
        np.multiply(self.sums[:3], scale * exposure, out=out[:, :3].T, casting="same_kind")
        out[:, 3] = self.sums[3] * scale if len(self.sums) == 4 else self.counts > 0
        return out.reshape(self.height, self.width, 4)


def new_film(width: int, height: int, with_alpha: bool) -> Film:
    """Return an empty film."""
    pixels = width * height
    return Film(width, height, np.zeros((3 + with_alpha, pixels)), np.zeros(pixels, np.int64))
