"""sun and air -> radiance of the sky.  Light that was scattered once on its way (Nishita).

Air is three layers around a round earth: molecules and aerosols thin out exponentially, ozone lies
between 10 and 40 km.  Light from the sun reaches each of 32 points along a view ray through what is
between, and is scattered towards the viewer (Nishita et al. 1993, "Display of the Earth Taking into
Account Atmospheric Scattering", eqs. 3 to 8); depths towards the sun are integrated by
Gauss-Laguerre quadrature, which suits what decays exponentially.
"""

import numpy as np

from ...arrays import F32
from .spectrum import OBSERVER, STEP, WAVELENGTHS, Array, planck

EARTH, TOP = 6360e3, 6420e3  # radii [m]
HIGHEST = 59999.0  # of the viewer [m]
_DEEPEST = -60e3  # of paths through the earth, where nothing passes anyway [m]
_STEPS = 32

# The sun: a black body, as seen from the earth
_SUN = planck(WAVELENGTHS, 5778.0) * np.pi * (6.955e8 / 1.496e11) ** 2  # [W/(m2 nm)]

# Molecules: scattering at sea level goes with the inverse 4th power of the wavelength [1/m]
_MOLECULES = 1.1311e-6 * (WAVELENGTHS * 1e-3) ** -4
_MOLECULES_HEIGHT = 8e3  # scale height [m]

# Aerosols: alike for all wavelengths; they absorb a little, too
_AEROSOLS, _ABSORBED = 2e-5, 1.11  # [1/m], extinction / scattering
_AEROSOLS_HEIGHT = 1.2e3
_G = 0.76  # anisotropy

# Ozone: absorption cross sections [1e-26 m2], and 300 Dobson units over a triangle 15 km to both
# sides of 25 km.  Measured ones (at 233 K, Gorshelev et al. 2014) differ by their averaging over
# wavelengths, up to 2 % of the sky's radiance; from those, these were fitted by least squares to 16
# skies that Cycles 5.2 had rendered, with sun and ozone low and high: to 0.008 % rms.
_CROSS_SECTIONS = np.array(
    [
        (0.02498, 0.11054, 0.42462, 1.2646, 3.9172, 7.2288, 12.071),
        (17.923, 28.702, 39.176, 45.501, 51.159, 39.782, 29.925),
        (20.605, 13.861, 8.7843, 5.8175, 3.7172, 2.6205, 2.0774),
    ]
).ravel()
_OZONE = _CROSS_SECTIONS * 1e-26 * 300 * 2.687e20 / 15e3  # [1/m] at 25 km

# Eight nodes, the last of which is still within the path
_NODES, _WEIGHTS = np.polynomial.laguerre.laggauss(8)
_WEIGHTS = _WEIGHTS * np.exp(_NODES) / 25
_NODES = _NODES / 25


def table(
    elevation: float,
    altitude: float,
    air: float,
    aerosol: float,
    ozone: float,
    top: float = np.pi / 2,
) -> Array:
    """Return XYZ radiance (256, 512, 3) [W/(sr m2)] of all directions.

    `elevation` of the sun [radians], `altitude` of the viewer [m], and densities in units of the
    clear sky's; `top` is the elevation of the row that would follow the last [radians].  Below the
    horizon the sky fades out.
    """
    height, width = 256, 512
    half = height // 2
    latitude = top * (np.arange(half) / half) ** 2
    longitude = 2 * np.pi * np.arange(width // 2) / width - np.pi
    upper = _radiance(latitude, longitude, elevation, altitude, (air, aerosol, ozone))
    upper = np.concatenate([upper, upper[:, ::-1]], axis=1)

    # Fade the horizon out downwards
    down = np.sin(np.pi / 2 * (np.arange(half) / half - 1) ** 2)
    fade = np.where(down < 0.4, 1 - 2.5 * down, 0.0) ** 3
    return np.concatenate([upper[:1] * fade[:, None, None], upper])


def _radiance(
    latitude: Array,
    longitude: Array,
    elevation: float,
    altitude: float,
    densities: tuple[float, float, float],
) -> Array:
    """Return XYZ radiance (Y, X, 3) of directions; longitudes are measured from the sun."""
    # Walk along the view rays: (Y, steps); heights from squares, free of large numbers
    altitude = min(max(altitude, 1.0), HIGHEST)
    start = EARTH + altitude
    up = np.sin(latitude)[:, None]
    length = _to_top(start, start * up)
    step = length / _STEPS
    along = (np.arange(_STEPS) + 0.5) * step
    z = start + along * up
    flat = along * np.cos(latitude)[:, None]
    height = _height(altitude, start * up, along)
    density = _density(height) * np.array(densities)[:, None, None]
    before = density.cumsum(axis=2) * step

    # From each point towards the sun: (Y, X, steps)
    sun_x, sun_z = np.cos(elevation), np.sin(elevation)
    towards = flat[:, None] * np.cos(longitude)[:, None] * sun_x + z[:, None] * sun_z
    depth = _depth_to_top(height[:, None].astype(F32), towards.astype(F32))
    above_earth = height * (2 * EARTH + height)  # r^2 - R^2
    lit = (sun_z >= 0) | (towards * towards < above_earth[:, None])

    # What the scattering angle does
    mu = np.cos(latitude)[:, None] * np.cos(longitude) * sun_x + up * sun_z
    molecular = 3 / (16 * np.pi) * (1 + mu * mu)
    g2 = _G * _G
    aerosols = 3 * (1 - g2) * (1 + mu * mu) / (8 * np.pi * (2 + g2))
    aerosols /= (1 + g2 - 2 * _G * mu) ** 1.5

    # Add up the points, wavelength by wavelength
    molecules_depth, aerosols_depth, ozone_depth = (
        density_of_all * depth[kind] + before[kind][:, None].astype(F32)
        for kind, density_of_all in enumerate(densities)
    )
    weights = np.stack([density[0] * step, density[1] * step]).astype(F32)
    xyz = np.zeros((*mu.shape, 3))
    for wavelength, sunlight in enumerate(_SUN):
        extinction = molecules_depth * F32(-_MOLECULES[wavelength])
        extinction -= aerosols_depth * F32(_AEROSOLS * _ABSORBED)
        extinction -= ozone_depth * F32(_OZONE[wavelength])
        np.exp(extinction, out=extinction)
        extinction *= lit
        scattered = np.matmul(extinction, weights.transpose(1, 2, 0))  # (Y, X, 2)
        radiance = scattered[:, :, 0] * molecular * _MOLECULES[wavelength]
        radiance += scattered[:, :, 1] * aerosols * _AEROSOLS
        xyz += (sunlight * STEP * radiance)[:, :, None] * OBSERVER[wavelength]
    return xyz


def sun(elevation: float, altitude: float, air: float, aerosol: float, ozone: float) -> Array:
    """Return the XYZ irradiance (3,) [W/m2] of the sun at an elevation, not below the horizon.

    Cycles leaves ozone out of the sun's own light, and so does this.
    """
    altitude = min(max(altitude, 1.0), HIGHEST)
    towards = (EARTH + altitude) * np.sin(max(elevation, 0.0))
    molecules, aerosols, _ = _depth_to_top(np.array([altitude]), np.array([towards]))
    depth = _MOLECULES * molecules[0] * air + _ABSORBED * _AEROSOLS * aerosols[0] * aerosol
    irradiance: Array = (_SUN * np.exp(-depth)) @ OBSERVER * STEP
    return irradiance


def _to_top(radius: float | Array, towards: Array) -> Array:
    """Return how far (...) the top of the air is, `towards` = position . direction [m2 / m]."""
    inside = (TOP - radius) * (TOP + radius)
    return np.sqrt(towards * towards + inside) - towards


def _height(altitude: float | Array, towards: Array, along: Array) -> Array:
    """Return the height [m] at the distance `along` of a ray that starts at `altitude`."""
    square = altitude * (2 * EARTH + altitude) + along * (2 * towards + along)
    return square / (np.sqrt(EARTH * EARTH + square) + EARTH)


def _density(height: Array) -> Array:
    """Return the densities (3, ...) of molecules, aerosols and ozone, 1 where they are densest."""
    height = np.maximum(height, _DEEPEST)
    return np.stack(
        [
            np.exp(height / -_MOLECULES_HEIGHT),
            np.exp(height / -_AEROSOLS_HEIGHT),
            np.maximum(1 - np.abs(height - 25e3) / 15e3, 0),
        ]
    )


def _depth_to_top(height: Array, towards: Array) -> Array:
    """Return density times length (3, ...) [m] from a height to the top of the air."""
    length = _to_top(EARTH + height, towards)
    depth = np.zeros((3, *towards.shape), towards.dtype)
    for node, weight in zip(_NODES.tolist(), _WEIGHTS.tolist(), strict=True):
        depth += weight * _density(_height(height, towards, node * length))
    depth *= length
    return depth
