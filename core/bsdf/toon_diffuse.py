"""closure, wo, u -> wi, weight, pdf.  Cartoon shading: a disk of even light around the normal.

f cos is 1 / (solid angle of the cone) up to the angle `size`, and fades linearly over the angle
`smooth` beyond; both are given as shares of a quarter turn.  There is no cosine: not a BSDF that
nature has, but Cycles'.
"""

import numpy as np

from ..arrays import F32, Scalar, Vec
from ..sampling import warp
from .kinds import DIFFUSE

NAME = "toon diffuse"
PARAMETERS = {"size": 1, "smooth": 1}
IS_DELTA = False
RAY_KIND = DIFFUSE
TRANSMITS = False
WEIGHT_IN_WI_Z = False
DRAWS = 2

QUARTER = F32(np.pi / 2)
LEAST_SIZE, TINY = F32(1e-5), F32(1e-20)


def evaluate(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec) -> tuple[Scalar, Scalar]:
    """Return f cos (N,) and the pdf (N,) [1/sr] with which `sample` finds wi (3, N)."""
    weight, pdf = ring(parameters, wi[0], wi[1], wi[2] - F32(1))
    pdf *= wi[2] > 0
    return weight * pdf, pdf


def sample(
    parameters: tuple[Scalar, ...], wo: Vec, u: Scalar, v: Scalar, w: None = None
) -> tuple[Vec, Scalar, Scalar]:
    """Draw wi (3, N) uniformly from the cone."""
    wi = warp.uniform_cone(u, v, opening(parameters))
    weight, pdf = ring(parameters, wi[0], wi[1], wi[2] - F32(1))
    return wi, weight, pdf


def opening(parameters: tuple[Scalar, ...]) -> Scalar:
    """Return 1 - cos of the half angle of the cone, up to a quarter turn."""
    size, smooth = angles(parameters)
    return F32(2) * np.square(np.sin(F32(0.5) * np.minimum(size + smooth, QUARTER)))


def angles(parameters: tuple[Scalar, ...]) -> tuple[Scalar, Scalar]:
    """Return `size` and `smooth` [radians]."""
    size, smooth = parameters
    return (
        np.clip(size, LEAST_SIZE, F32(1)) * QUARTER,
        np.clip(smooth, F32(0), F32(1)) * QUARTER,
    )


def ring(parameters: tuple[Scalar, ...], x: Scalar, y: Scalar, z: Scalar) -> tuple[Scalar, Scalar]:
    """Return brightness and pdf (N,) at directions that differ by (x, y, z) from the middle.

    The chord tells small angles apart that have the same cosine in float32.
    """
    size, smooth = angles(parameters)
    chord = np.sqrt(x * x + y * y + z * z)
    angle = F32(2) * np.arcsin(np.minimum(F32(0.5) * chord, F32(1)))
    brightness = (size + smooth - angle) / np.maximum(smooth, TINY)
    np.clip(brightness, F32(0), F32(1), out=brightness)
    inside = angle < np.minimum(size + smooth, QUARTER)
    return brightness * inside, inside * warp.uniform_cone_pdf(opening(parameters))
