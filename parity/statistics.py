"""pictures of many seeds -> is it the same light?  The equivalence test of the parity suite.

A picture is judged by the means of its blocks of 16 x 16 pixels, and by its own mean, in five
channels: red, green, blue, alpha and luminance. For each of them

    deviation = (ours - reference) / max(reference, floor)

and se is the standard error of the deviation, from the spread over independent seeds of both
engines. The test asks for equivalence, not for "no significant difference" (Schuirmann 1987, two
one-sided tests, here with the burden on the difference): what fails is

    |deviation| - K * se > 1 %      of a block
    |deviation| - K * se > 0.5 %    of the picture

and the measurement counts only if se <= 0.3 % in every block. So a block that differs by 2 % is
found with a probability of at least 90 % and, at the usual se of 0.15 %, always; one that does not
differ fails by chance less than once in 100,000 blocks. The floor is 1 % of the picture's mean, so
that black blocks are no special case: where the reference is black, ours must be within 1e-4 of
the picture's mean of it. Colours are relative to no less than a tenth of the block's luminance.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

BLOCK = 16
K = 2.0
FLOOR = 0.01
DARK = 1e-7  # an absolute floor, for pictures that are black all over
ENOUGH = 0.1  # of the luminance: what a colour channel's deviation is at least relative to
BLOCK_MARGIN, PICTURE_MARGIN = 0.01, 0.005
REFERENCE_ERROR, RATIO_ERROR = 0.002, 0.003
SEEDS = 16  # the least number of seeds that a spread is taken from

CHANNELS = ("red", "green", "blue", "alpha", "luminance")
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

Array = NDArray[np.float64]


def blocks(picture: NDArray[np.float32]) -> Array:
    """Return the means (B, 5) of the blocks of a picture (H, W, 4), row by row."""
    height, width, _ = picture.shape
    rows, columns = height // BLOCK, width // BLOCK
    cut = picture[: rows * BLOCK, : columns * BLOCK].astype(np.float64)
    means = cut.reshape(rows, BLOCK, columns, BLOCK, 4).mean(axis=(1, 3)).reshape(-1, 4)
    return np.concatenate([means, means[:, :3] @ LUMINANCE[:, None]], axis=1)


@dataclass
class Estimate:
    """Independent pictures of one engine, all of `samples` samples."""

    samples: int
    chunks: list[Array] = field(default_factory=list)  # of each picture: block means (B, 5)
    total: Array | None = None  # sum of the pictures (H, W, 4)
    seconds: float = 0.0
    seeds: int = 0  # that were rendered: more than there are pictures, once some were merged

    def add(self, picture: NDArray[np.float32], seconds: float) -> None:
        """Add the picture of a further seed.  Raises ValueError if it is not finite."""
        if not np.isfinite(picture).all():
            raise ValueError("the picture has values that are not finite")
        self.chunks.append(blocks(picture))
        self.total = picture + (0.0 if self.total is None else self.total)
        self.seconds += seconds
        self.seeds += 1

    def merge(self) -> None:
        """Take pairs of pictures, of an even number, as one of twice the samples.

        They stay independent, with the same mean: so their spread still gives the mean's error
        without bias, though further seeds of so many samples may be less noisy than a pair.
        """
        assert self.total is not None
        pairs = zip(self.chunks[::2], self.chunks[1::2], strict=True)
        self.chunks = [(one + other) / 2 for one, other in pairs]
        self.total = self.total / 2
        self.samples *= 2

    @property
    def picture(self) -> NDArray[np.float32]:
        """Return the mean picture (H, W, 4)."""
        assert self.total is not None
        return (self.total / len(self.chunks)).astype(np.float32)

    def regions(self) -> tuple[Array, Array]:
        """Return means and standard errors (B + 1, 5): of the blocks, and of the picture."""
        seeds = np.stack(self.chunks)
        seeds = np.concatenate([seeds, seeds.mean(axis=1, keepdims=True)], axis=1)
        return seeds.mean(axis=0), seeds.std(axis=0, ddof=1) / len(seeds) ** 0.5

    def error(self) -> float:
        """Return the largest relative standard error of a block in any channel."""
        mean, se = self.regions()
        return float((se / _scale(mean))[:-1].max())


@dataclass(frozen=True)
class Place:
    """A block (row, column), or the picture (-1, -1), and what differs there."""

    row: int
    column: int
    channel: str
    deviation: float
    se: float

    def __str__(self) -> str:
        where = "picture" if self.row < 0 else f"block {self.row},{self.column}"
        return f"{where} {self.channel} {self.deviation:+.2%} +- {self.se:.2%}"


@dataclass(frozen=True)
class Comparison:
    """The verdict on a pair of estimates; `error` is the largest se of a block's deviation."""

    block: Place
    picture: Place
    failed_blocks: int
    number_of_blocks: int
    same: bool
    error: float

    @property
    def certain(self) -> bool:
        """Tell whether the noise was low enough for the verdict to mean something."""
        return self.error <= RATIO_ERROR


def compare(ours: Estimate, reference: Estimate, k: float = K) -> Comparison:
    """Return whether two estimates show the same light; see the top of this file."""
    mean, reference_se = reference.regions()
    our_mean, our_se = ours.regions()
    scale = _scale(mean)
    deviation = (our_mean - mean) / scale
    se = np.sqrt(our_se**2 + (reference_se * np.maximum(our_mean, scale) / scale) ** 2) / scale

    # What is beyond the margin for certain; where nothing is, the largest deviation is shown.
    margin = np.full(len(mean), BLOCK_MARGIN)
    margin[-1] = PICTURE_MARGIN
    excess = np.abs(deviation) - k * se - margin[:, None]
    beyond = (excess > 0).any(axis=1, keepdims=True)
    rank = np.where(beyond, 1e3 + excess, np.abs(deviation))
    columns = ours.total.shape[1] // BLOCK if ours.total is not None else 1

    def place(region: int) -> Place:
        channel = int(rank[region].argmax())
        row, column = divmod(region, columns) if region < len(mean) - 1 else (-1, -1)
        values = float(deviation[region, channel]), float(se[region, channel])
        return Place(row, column, CHANNELS[channel], *values)

    worst = int(rank[:-1].max(axis=1).argmax())
    return Comparison(
        place(worst),
        place(len(mean) - 1),
        int(beyond[:-1].sum()),
        len(mean) - 1,
        bool(not beyond.any()),
        float(se[:-1].max()),
    )


def samples_for(estimate: Estimate, error: float) -> int:
    """Return how many samples a seed needs, a power of two, so that SEEDS of them reach `error`.

    As if the error fell by the square root of the samples: Sobol points do better.
    """
    needed = estimate.samples * len(estimate.chunks) / SEEDS * (estimate.error() / error) ** 2
    return max(estimate.samples, 1 << int(np.ceil(np.log2(max(needed, 1.0)))))


def _scale(mean: Array) -> Array:
    """Return what deviations of regions (B + 1, 5), the picture last, are relative to."""
    # Light below zero (a colour that is a vector) counts by its size, and cancels no other.
    size = np.abs(mean)
    size[:, 4] = size[:, :3] @ LUMINANCE
    picture, luminance = size[-1], size[:, 4:]
    floor = luminance * [ENOUGH, ENOUGH, ENOUGH, 0.0, 0.0]
    floor = np.maximum(floor, FLOOR * picture[[4, 4, 4, 3, 4]])
    return np.maximum(size, np.maximum(floor, DARK))
