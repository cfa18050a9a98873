"""wavelengths -> XYZ.  Light of the sun, and how the standard observer sees a spectrum.

Twenty-one wavelengths, 380 to 780 nm in steps of 20.
"""

import numpy as np
from numpy.typing import NDArray

from ..observer import OBSERVER as EVERY_5_NM

Array = NDArray[np.float64]

WAVELENGTHS: Array = np.arange(380.0, 781.0, 20.0)  # [nm]
STEP = 20.0  # [nm]

# The CIE 1931 standard observer: x, y, z at each wavelength
OBSERVER: Array = EVERY_5_NM[::4]


def planck(wavelength: Array, temperature: float) -> Array:
    """Return the radiance of a black body [W/(m2 sr nm)] at wavelengths [nm] (Planck 1901)."""
    h, c, k = 6.62607015e-34, 299792458.0, 1.380649e-23
    metres = wavelength * 1e-9
    return 2e-9 * h * c**2 / metres**5 / np.expm1(h * c / (metres * k * temperature))


def rec709_of_xyz() -> Array:
    """Return the matrix (3, 3) from XYZ (white D65) to linear Rec.709 (ITU-R BT.709)."""
    xy = np.array([(0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290)])
    xyz = np.stack([xy[:, 0], xy[:, 1], 1 - xy.sum(axis=1)]) / xy[:, 1]
    scale = np.linalg.solve(xyz[:, :3], xyz[:, 3])
    return np.linalg.inv(xyz[:, :3] * scale)
