"""sun + u, v -> a direction to it, its gain and pdf.  Light from infinitely far.

A sun is a cone of uniform radiance E / (pi sin^2(angle / 2)): a surface that faces it has the
irradiance E, whatever the angle.  With angle 0 it is one direction.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, INV_PI, Scalar, Vec, dot, frame
from ..sampling.warp import uniform_cone
from ..scene import Lamp
from .kind import (
    AT_INFINITY,
    ONE_SIDE,
    Hull,
    LampKind,
    Rows,
    Sampled,
    Source,
    brightness,
    everywhere,
    missed,
)

# Parameters: axis to the sun 0:3, tangent 3:6, bitangent 6:9, and the numbers below
MINUS_COS, GAIN, RADIANCE = 9, 10, 11


def classify(lamp: Lamp) -> LampKind | None:
    """Return the kind of a sun, None if it has no direction."""
    if not lamp.to_world[:, 2].any():
        return None
    return SUN if lamp.angle > 0.0 else PARALLEL


def _compile(lamp: Lamp, origin: NDArray[np.float64]) -> list[float]:
    axis = lamp.to_world[:, 2] / np.abs(lamp.to_world[:, 2]).max()
    axis = axis / np.linalg.norm(axis)
    tangent, bitangent = frame(axis[:, None])
    half = 0.5 * min(lamp.angle, np.pi)
    minus = 2.0 * np.sin(0.5 * half) ** 2
    row = [*axis, *tangent[:, 0], *bitangent[:, 0], minus]
    if lamp.angle > 0.0:
        row += [2.0 * minus / np.sin(half) ** 2, 1.0 / (np.pi * np.sin(half) ** 2)]
    return [float(value) for value in row]


def _source(lamp: Lamp, origin: NDArray[np.float64]) -> Source:
    axis = -np.array(_compile(lamp, origin)[0:3])
    return Source(np.zeros(3), 0.0, brightness(lamp), axis, ONE_SIDE)


def _hull(lamp: Lamp, origin: NDArray[np.float64]) -> Hull | None:
    return None


def _sample(rows: Rows, point: Vec, u: Scalar, v: Scalar, with_pdf: bool = False) -> Sampled:
    """Sample the cone by solid angle; unbiased."""
    x, y, z = uniform_cone(u, v, rows[MINUS_COS])
    to_light = rows[0:3] * z
    to_light += rows[3:6] * x
    to_light += rows[6:9] * y
    gain = np.empty_like(z)
    gain[:] = rows[GAIN]
    pdf = None
    if with_pdf:
        pdf = np.empty_like(z)
        pdf[:] = F32(0.5) * INV_PI / rows[MINUS_COS]
    return Sampled(to_light, gain, pdf, np.ones_like(z))


def _intersect(rows: Rows, origin: Vec, direction: Vec) -> tuple[Scalar, Scalar, Scalar]:
    """Meet the cone at infinity."""
    # The chord is accurate where the cosine of a small angle is not
    chord = direction - rows[0:3]
    hit = dot(chord, chord) <= F32(2) * rows[MINUS_COS]
    gain = np.where(hit, rows[RADIANCE], F32(0))
    pdf = np.where(hit, F32(0.5) * INV_PI / rows[MINUS_COS], F32(0))
    return np.where(hit, AT_INFINITY, F32(np.inf)), gain, pdf


def _sample_parallel(
    rows: Rows, point: Vec, u: Scalar, v: Scalar, with_pdf: bool = False
) -> Sampled:
    """Go towards the sun: nothing to choose."""
    to_light = np.empty((3, u.size), F32)
    to_light[:] = rows[0:3]
    pdf = np.zeros(u.size, F32) if with_pdf else None
    return Sampled(to_light, np.ones(u.size, F32), pdf, np.ones(u.size, F32))


def _intersect_parallel(rows: Rows, origin: Vec, direction: Vec) -> tuple[Scalar, Scalar, Scalar]:
    return missed(origin, direction)


SUN = LampKind("sun", _sample, _intersect, _compile, _source, _hull, everywhere, DISTANT=True)
PARALLEL = replace(SUN, name="parallel", sample=_sample_parallel, intersect=_intersect_parallel)
