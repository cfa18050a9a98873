"""sun and turbidity -> radiance of the sky.  A fit of five coefficients for each of Y, x and y.

Source: Preetham, Shirley & Smits 1999, "A Practical Analytic Model for Daylight", appendix A.2;
luminance is scaled down by Blender, to 0.06 of kcd/m2.
"""

import numpy as np

from ...arrays import F32, Scalar, Vec
from .spectrum import Array

_SCALE = 0.06

# Coefficients A to E of Perez' formula for Y, x, y: what turbidity adds, and what is there without
_BY_TURBIDITY = np.array(
    [
        (0.1787, -0.3554, -0.0227, 0.1206, -0.0670),
        (-0.0193, -0.0665, -0.0004, -0.0641, -0.0033),
        (-0.0167, -0.0950, -0.0079, -0.0441, -0.0109),
    ]
)
_WITHOUT = np.array(
    [
        (-1.4630, 0.4275, 5.3251, -2.5771, 0.3703),
        (-0.2592, 0.0008, 0.2125, -0.8989, 0.0452),
        (-0.2608, 0.0092, 0.2102, -1.6537, 0.0529),
    ]
)

# Chromaticity at the zenith: rows by turbidity^2, ^1, ^0, columns by the sun's angle^3 ... ^0
_ZENITH_X = np.array(
    [
        (0.00166, -0.00375, 0.00209, 0.0),
        (-0.02903, 0.06377, -0.03202, 0.00394),
        (0.11693, -0.21196, 0.06052, 0.25886),
    ]
)
_ZENITH_Y = np.array(
    [
        (0.00275, -0.00610, 0.00317, 0.0),
        (-0.04214, 0.08970, -0.04153, 0.00516),
        (0.15346, -0.26756, 0.06670, 0.26688),
    ]
)
_LOWEST = F32(np.pi / 2 - 0.001)  # below it the sky is that of the horizon


class Preetham:
    """The sky for a direction of the sun (3,) and a turbidity."""

    def __init__(self, sun: Array, turbidity: float) -> None:
        self.sun = (sun / np.linalg.norm(sun)).astype(F32)
        angle = float(np.arccos(np.clip(self.sun[2], -1, 1)))
        self.perez = (_BY_TURBIDITY * turbidity + _WITHOUT).astype(F32)
        chi = (4 / 9 - turbidity / 120) * (np.pi - 2 * angle)
        bright = (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192
        powers = np.array([turbidity**2, turbidity, 1.0]), np.array([angle**3, angle**2, angle, 1])
        zenith = (
            bright * _SCALE,
            powers[0] @ _ZENITH_X @ powers[1],
            powers[0] @ _ZENITH_Y @ powers[1],
        )
        zero, there = np.zeros(1, F32), np.array([angle], F32)
        self.scale = [
            F32(value / _perez(lam, zero, there)[0])
            for value, lam in zip(zenith, self.perez, strict=True)
        ]

    def xyz(self, direction: Vec) -> Vec:
        """Return XYZ radiance (3, N) of unit directions (3, N)."""
        cosine = direction[0] * self.sun[0]
        cosine += direction[1] * self.sun[1]
        cosine += direction[2] * self.sun[2]
        gamma = np.arccos(np.clip(cosine, F32(-1), F32(1)))
        theta = np.arccos(np.clip(direction[2], F32(-1), F32(1)))
        np.minimum(theta, _LOWEST, out=theta)
        bright, x, y = (
            scale * _perez(lam, theta, gamma)
            for scale, lam in zip(self.scale, self.perez, strict=True)
        )
        xyz = np.empty_like(direction)
        over = bright / np.where(y == 0, F32(1), y) * (y != 0)
        np.multiply(x, over, out=xyz[0])
        xyz[1] = bright
        np.multiply(F32(1) - x - y, over, out=xyz[2])
        return xyz


def _perez(lam: Vec, theta: Scalar, gamma: Scalar) -> Scalar:
    """Return Perez' luminance distribution (N,) (eq. 3) by the angles from zenith and sun."""
    cosine = np.cos(gamma)
    near: Scalar = lam[2] * np.exp(lam[3] * gamma)
    near += lam[4] * cosine * cosine
    near += F32(1)
    far = lam[0] * np.exp(lam[1] / np.cos(theta))
    far += F32(1)
    return far * near
