"""angles -> a disc in the sky.  The sun as its own source of light, too small for any map."""

from dataclasses import dataclass

import numpy as np

from ...arrays import F32, Scalar, Vec


@dataclass(frozen=True, eq=False)
class Disc:
    """A small bright disc at infinity."""

    direction: tuple[float, float, float]  # to its middle, unit
    half_angle: float  # [radians]
    radiance: tuple[float, float, float]  # the mean over the disc [W/(sr m2)]

    @property
    def one_minus_cos(self) -> float:
        """1 - cos(half_angle), to full precision for small angles."""
        return float(2 * np.sin(0.5 * self.half_angle) ** 2)

    @property
    def flux(self) -> float:
        """|Radiance|, averaged over the channels, times solid angle [W/m2]."""
        return float(np.mean(np.abs(self.radiance)) * 2 * np.pi * self.one_minus_cos)

    def chord(self, direction: Vec) -> Scalar:
        """Return the squared distance (N,) of unit directions (3, N) from the middle.

        It is 4 sin^2(angle / 2) without the rounding that small angles suffer in a cosine.
        """
        x, y, z = (direction[axis] - F32(self.direction[axis]) for axis in range(3))
        chord: Scalar = x * x
        chord += y * y
        chord += z * z
        return chord

    @property
    def largest_chord(self) -> np.float32:
        """The squared distance of the rim from the middle."""
        return F32(2 * self.one_minus_cos)
