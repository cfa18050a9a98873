"""lamp -> a row of numbers and the functions that read it.  What every kind of light can do.

A kind works on `rows` (P, N) float32: parameter p of the light that point n looks at.  With rows
(P, 1) all points look at the same light and nothing is gathered.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec
from ..scene import Lamp

Rows = NDArray[np.float32]  # (P, N) or (P, 1)
Hull = tuple[NDArray[np.float64], NDArray[np.int32]]  # vertices (V, 3), triangles (F, 3)

TINY = F32(1e-30)
AT_INFINITY = np.finfo(np.float32).max  # the distance at which a ray meets a distant light

# How the light of a source is spread over directions, see `Source`
ALL_SIDES, ONE_SIDE, BOTH_SIDES = 0, 1, 2


class Sampled(NamedTuple):
    """What a kind's `sample` returns.

    to_light (3, N) leads from the point to a point of the light, or is a unit vector if the kind
    is DISTANT.  colour * gain (N,) * f cos is the unbiased contribution: gain is radiance / pdf,
    for lights without extent intensity / distance^2 with pdf = 0.  pdf (N,) [1/sr] is None if it
    was not asked for.  distance (N,) is the length of `to_light`.  Where no light arrives
    gain = pdf = 0.
    """

    to_light: Vec
    gain: Scalar
    pdf: Scalar | None
    distance: Scalar


class Sampler(Protocol):
    """The signature of a kind's `sample`."""

    def __call__(
        self, rows: Rows, point: Vec, u: Scalar, v: Scalar, with_pdf: bool = False
    ) -> Sampled:
        """Sample the light for points (3, N) by u, v (N,)."""


class Region(NamedTuple):
    """Half spaces that hold all that a lamp lights, as `normals` (K, 3) . p >= `least` (K,) [m]."""

    normals: NDArray[np.float64]
    least: NDArray[np.float64]


class Source(NamedTuple):
    """What matters of a light for choosing it: a sketch that need not be exact.

    centre (3,) about the local origin [m]; spread: the mean square distance of its points from
    there [m2]; strength: the largest intensity [W/sr], of distant lights the irradiance [W/m2];
    axis (3,): where it shines to, unit length; sides: ALL_SIDES, or by the cosine to the axis
    ONE_SIDE or BOTH_SIDES.
    """

    centre: NDArray[np.float64]
    spread: float
    strength: float
    axis: NDArray[np.float64]
    sides: int


@dataclass(frozen=True, eq=False)
class Kind:
    """One kind of light.

    sample(rows, point, u, v, with_pdf) -> see `Sampled`.
    intersect(rows, origin, direction) -> t (N,), gain (N,), pdf (N,).  `direction` is of unit
        length; t is inf where the ray misses, AT_INFINITY where it meets a distant light;
        colour * gain is the radiance seen, pdf that of `sample` for this direction.
    """

    name: str
    sample: Sampler
    intersect: Callable[[Rows, Vec, Vec], tuple[Scalar, Scalar, Scalar]]
    DISTANT: bool = field(default=False, kw_only=True)


@dataclass(frozen=True, eq=False)
class LampKind(Kind):
    """One kind of lamp; add one with a file, and a line in the registry of `lights`.

    compile(lamp, origin) -> its P parameters, positions relative to `origin` in float64.
    source(lamp, origin) -> what choosing it is based on.
    hull(lamp, origin) -> triangles that enclose it, or None if rays cannot meet it there.
    region(lamp, origin) -> where it shines at most, or None if it shines everywhere.
    """

    compile: Callable[[Lamp, NDArray[np.float64]], list[float]]
    source: Callable[[Lamp, NDArray[np.float64]], Source]
    hull: Callable[[Lamp, NDArray[np.float64]], Hull | None]
    region: Callable[[Lamp, NDArray[np.float64]], Region | None]


def position(lamp: Lamp, origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where the lamp is, relative to `origin` [m]."""
    return lamp.to_world[:, 3] - origin


def brightness(lamp: Lamp) -> float:
    """Return the mean of the lamp's three strengths."""
    return sum(map(abs, lamp.strength)) / 3


def everywhere(lamp: Lamp, origin: NDArray[np.float64]) -> Region | None:
    """Return the region of a lamp that shines to all sides."""
    return None


def around() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the cosines and sines (16, 1) of the planes that bound a cone."""
    angle = 2.0 * np.pi * np.arange(16)[:, None] / 16
    return np.cos(angle), np.sin(angle)


def missed(origin: Vec, direction: Vec) -> tuple[Scalar, Scalar, Scalar]:
    """Return what `intersect` returns for rays that meet nothing."""
    count = max(origin.shape[1], direction.shape[1])
    none = np.zeros(count, F32)
    return np.full(count, np.inf, F32), none, none.copy()


def reciprocal(weight: Scalar) -> Scalar:
    """Return 1 / weight, and 0 where the weight is 0."""
    out: Scalar = np.reciprocal(np.maximum(weight, TINY))
    out *= weight > 0
    return out
