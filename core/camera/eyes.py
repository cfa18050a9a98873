"""eye, directions -> where the eye is, and where it looks.  Spherical stereo.

Both eyes turn about their middle to every direction of a picture, so that there is depth all
around.  Source: Ishiguro, Yamamoto and Tsuji 1992, "Omni-Directional Stereo".
"""

import numpy as np

from ..arrays import F32, Scalar, Vec, normalize
from ..optics import Eye


def look(eye: Eye, direction: Vec) -> tuple[Vec, Vec]:
    """Return how far (3, N) [m] an eye is from the middle, and unit directions (3, N) of its rays.

    direction (3, N): that of the middle, z up.
    """
    # Find the right of the viewer, on the horizon
    right = np.zeros_like(direction)
    right[0], right[1] = direction[1], -direction[0]
    aside = normalize(right)
    aside *= F32(eye.offset) if eye.poles is None else _faded(eye, direction[2])

    # Turn to the point where both eyes meet
    return aside, normalize(direction - aside * F32(1 / eye.convergence))


def _faded(eye: Eye, up: Scalar) -> Scalar:
    """Return the offset (N,) [m], which goes to nothing towards the poles."""
    assert eye.poles is not None
    start, end = eye.poles
    if end <= 0:
        return np.full(up.size, eye.offset, F32)
    height = np.abs(np.arcsin(np.clip(up, F32(-1), F32(1))))
    share = (height - F32(start)) * F32(1 / (end - start) if end != start else 1e30)
    faded = F32(eye.offset) * np.cos(np.clip(share, F32(0), F32(1)) * F32(np.pi / 2))
    faded = np.where(height > F32(start), faded, F32(eye.offset))
    return np.where(height > F32(end), F32(0), faded)
