"""lamp -> a row of numbers and the functions that read it.  What every kind of light can do.

A kind works on `rows` (P, N) float32: parameter p of the light that point n looks at.  With rows
(P, 1) all points look at the same light and nothing is gathered.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec
from ..scene import Lamp

Rows = NDArray[np.float32]  # (P, N) or (P, 1)
Hull = tuple[NDArray[np.float64], NDArray[np.int32]]  # vertices (V, 3), triangles (F, 3)

TINY = F32(1e-30)
AT_INFINITY = np.finfo(np.float32).max  # the distance at which a ray meets a distant light


@dataclass(frozen=True, eq=False)
class Kind:
    """One kind of light; add one with a file, and a line in the registry of `lights`.

    compile(lamp, origin) -> its P parameters, positions relative to `origin` in float64.
    sample(rows, point, u, v) -> to_light (3, N), gain (N,), pdf (N,) [1/sr].  `to_light` leads from
        the point to a point of the light, or is a unit vector if DISTANT.  colour * gain * f cos is
        the unbiased contribution: gain is radiance / pdf, for lights without extent intensity /
        distance^2 with pdf = 0.  Where no light arrives gain = pdf = 0.
    intersect(rows, origin, direction) -> t (N,), gain (N,), pdf (N,).  `direction` is of unit
        length; t is inf where the ray misses, AT_INFINITY where it meets a distant light;
        colour * gain is the radiance seen, pdf that of `sample` for this direction.
    power(lamp, radius) -> what its rank among the lights is based on [W], with the radius of the
        scene [m] for the distant ones.
    hull(lamp, origin) -> triangles that enclose it, or None if rays cannot meet it there.
    """

    name: str
    compile: Callable[[Lamp, NDArray[np.float64]], list[float]]
    sample: Callable[[Rows, Vec, Scalar, Scalar], tuple[Vec, Scalar, Scalar]]
    intersect: Callable[[Rows, Vec, Vec], tuple[Scalar, Scalar, Scalar]]
    power: Callable[[Lamp, float], float]
    hull: Callable[[Lamp, NDArray[np.float64]], Hull | None]
    DISTANT: bool = False


def position(lamp: Lamp, origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where the lamp is, relative to `origin` [m]."""
    return lamp.to_world[:, 3] - origin


def brightness(lamp: Lamp) -> float:
    """Return the mean of the lamp's three strengths."""
    return float(np.mean(lamp.strength))


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
