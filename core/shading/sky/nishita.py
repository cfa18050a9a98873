"""sun and air -> radiance of the sky.  Single scattering as Blender 4 has it.

Its table is that of `single_scattering` but for the last row, which lies half a row's height beyond
the zenith.  Towards the ground the horizon fades with the direction itself, and the disc of the sun
ends at the horizon.
"""

import numpy as np

from . import single_scattering
from .single_scattering import sun
from .spectrum import Array

__all__ = ["sun", "table"]

_TOP = np.pi / 2 * (1 + 0.5 / 128)


def table(elevation: float, altitude: float, air: float, aerosol: float, ozone: float) -> Array:
    """Return XYZ radiance (256, 512, 3) [W/(sr m2)]; only its upper half counts."""
    return single_scattering.table(elevation, altitude, air, aerosol, ozone, _TOP)
