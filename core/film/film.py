"""radiance per slot -> pixel sums.  Where samples end.

Sums are float64, so that ten thousand samples add up without drift; every pixel knows how many
samples it holds, since adaptive sampling and stopped renders leave some pixels behind others.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index
from .cryptomatte import Parts
from .shadows import add_shadows, shadow_of

# What pixels may sum up, and how many rows that takes; see `shadows` for the four after alpha, and
# `ledger` for all from emission on.  Those that there may be several of are named "aov_color:X".
SUMS = {
    "combined": 3,
    "alpha": 1,
    "caught": 3,
    "opacity": 1,
    "alone": 3,
    "background": 3,
    "emission": 3,
    "environment": 3,
    "diffuse_direct": 3,
    "diffuse_indirect": 3,
    "glossy_direct": 3,
    "glossy_indirect": 3,
    "transmission_direct": 3,
    "transmission_indirect": 3,
    "diffuse": 3,  # colours
    "glossy": 3,
    "transmission": 3,
    "normal": 3,
    "uv": 3,
    "speed": 5,  # and how many samples have one
    "mist": 1,
    "occlusion": 3,
    "seconds": 1,
    "albedo": 3,  # guides of the denoiser
    "bearing": 3,
    "reach": 1,
    "aov_color": 4,
    "aov_value": 1,
    "group": 3,
}
# Those that the picture is made of; they come first.
PICTURE = ("combined", "alpha", "caught", "opacity", "alone", "background")

# What the middle of a pixel shows, which no filter blurs
MIDDLES = {"depth": 1, "position": 3, "object_index": 1, "material_index": 1}
LARGEST = 1e36  # of a sample; a batch has fewer than 300 samples of a pixel


@dataclass(eq=False)
class Film:
    """Sums of a width x height rectangle, row 0 at the bottom.

    sums (C, pixels) float64 of the `passes`, one after the other; counts (pixels,) int64.  middles
    (C, pixels) float32, in the order of `MIDDLES`, and `parts`, what a pixel shows parts of, are
    None where nobody asks.  keeps_shadows: those of shadow catchers are not in the picture;
    denoised (H, W, 3), before exposure, None where it is not.  stars: radiance (3, pixels) float64
    by the name of the sum that it belongs to; it has no samples, and None is none.
    """

    width: int
    height: int
    passes: tuple[str, ...]
    sums: NDArray[np.float64]
    counts: NDArray[np.int64]
    middles: NDArray[np.float32] | None = None
    parts: Parts | None = field(default=None, repr=False)
    keeps_shadows: bool = False
    denoised: NDArray[np.float32] | None = None
    stars: dict[str, NDArray[np.float64]] | None = None

    def add(self, pixels: slice | Index, sums: NDArray[np.float32], samples: int) -> None:
        """Add what `samples` samples gave for some pixels; sums is (C, n)."""
        self.sums[:, pixels] += sums
        self.counts[pixels] += samples

    def combined(self, exposure: float) -> NDArray[np.float32]:
        """Return (H, W, 4) float32: mean radiance x exposure, premultiplied alpha.

        Pixels without a sample are transparent black.  Denoised, if the film is.
        """
        if self.denoised is None:
            return self.noisy(exposure)
        picture = self.sampled(exposure)
        np.multiply(self.denoised, exposure, out=picture[..., :3], casting="same_kind")
        return self._with_stars(picture, exposure)

    def noisy(self, exposure: float) -> NDArray[np.float32]:
        """Return the picture (H, W, 4) before it was denoised."""
        return self._with_stars(self.sampled(exposure), exposure)

    def _with_stars(self, picture: NDArray[np.float32], exposure: float) -> NDArray[np.float32]:
        """Add the stars, which leave alpha as it is, to the pixels that have samples."""
        if self.stars is not None:
            light = self.stars["combined"] * ((self.counts > 0) * exposure)
            picture[..., :3] += self.shaped(light)
        return picture

    def sampled(self, exposure: float) -> NDArray[np.float32]:
        """Return the picture (H, W, 4) as its samples are, without stars."""
        scale = 1.0 / np.maximum(self.counts, 1)
        alpha = np.minimum(self.counts, 1.0)
        if "alpha" in self.passes:
            alpha = np.clip(self.total("alpha")[0] * scale, 0.0, 1.0)
        colour = self.total("combined")
        if "caught" in self.passes and not self.keeps_shadows:
            alpha = add_shadows(self.shadow(), alpha)
            if "background" in self.passes:
                colour = colour + self.total("background") * (1.0 - alpha)
                alpha = np.minimum(self.counts, 1.0)
        out = np.zeros((self.counts.size, 4), F32)
        np.multiply(colour, scale * exposure, out=out[:, :3].T, casting="same_kind")
        out[:, 3] = alpha
        return out.reshape(self.height, self.width, 4)

    def shadow(self) -> NDArray[np.float64]:
        """Return by what (3, pixels) shadow catchers are darker than they would be alone."""
        opacity = np.clip(self.mean("opacity")[0], 0.0, 1.0)
        return shadow_of(self.total("caught"), self.total("alone"), opacity)

    def mean(self, name: str) -> NDArray[np.float64]:
        """Return the mean (C, pixels) of the samples of one of `SUMS`, with the stars in it."""
        mean = self.total(name) / np.maximum(self.counts, 1)
        if self.stars is not None and name in self.stars:
            mean += self.stars[name] * (self.counts > 0)
        return mean

    def total(self, name: str) -> NDArray[np.float64]:
        """Return one of `SUMS` (C, pixels)."""
        first = rows(self.passes[: self.passes.index(name)])
        return self.sums[first : first + rows((name,))]

    def middle(self, name: str) -> NDArray[np.float32]:
        """Return one of `MIDDLES` (C, pixels)."""
        assert self.middles is not None
        names = list(MIDDLES)
        first = sum(MIDDLES[each] for each in names[: names.index(name)])
        return self.middles[first : first + MIDDLES[name]]

    def shaped(self, array: NDArray[np.floating]) -> NDArray[np.float32]:
        """Return (H, W, C) float32 of an array (C, pixels)."""
        return np.ascontiguousarray(array.T, F32).reshape(self.height, self.width, -1)


def rows(passes: tuple[str, ...]) -> int:
    """Return the number of rows of passes."""
    return sum(SUMS[name.partition(":")[0]] for name in passes)


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
