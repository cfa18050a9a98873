"""temperature -> XYZ.  The colour of what glows because it is hot.

Planck's law, seen by the standard observer, tabulated by 1 / temperature.
"""

import functools

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar
from .observer import FIRST, OBSERVER, STEP
from .sky.spectrum import planck

# Cycles' range [K]; beyond it the colour stays
COLDEST, HOTTEST = 800.0, 12000.0
_ENTRIES = 1024


def seen_black_body(temperature: Scalar) -> NDArray[np.float32]:
    """Return the XYZ (3, N) of black bodies of temperatures (N,) [K], of luminance 1.

    Cycles has a fit of the same; they agree to 0.1 % of the brightest channel.
    """
    inverse, table = _black_bodies()
    place = 1.0 / np.clip(temperature, COLDEST, HOTTEST)
    return np.stack([np.interp(place, inverse, row) for row in table]).astype(F32)


@functools.cache
def _black_bodies() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return 1 / temperature [1/K], rising, and the XYZ (3, entries) there."""
    inverse = np.linspace(1.0 / HOTTEST, 1.0 / COLDEST, _ENTRIES)
    wavelengths: NDArray[np.float64] = FIRST + STEP * np.arange(len(OBSERVER), dtype=np.float64)
    rows = np.round(OBSERVER, 4).T  # as many digits as Blender's table has
    xyz = np.stack([rows @ planck(wavelengths, 1.0 / float(each)) for each in inverse], axis=1)
    return inverse, xyz / xyz[1]
