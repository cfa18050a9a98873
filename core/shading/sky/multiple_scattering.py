"""sun and air -> radiance of the sky.  Light that was scattered any number of times.

The model of Garcia Linan ("Spectral sky", 2022): four wavelengths stand for the spectrum, and what
was scattered more than once is a fit for the air of the earth, added to light scattered once and to
that from the ground.  Coefficients are as published there: molecules by Bucholtz 1995, ozone by
Gorshelev et al. 2014, urban aerosols by Guimera et al. 2018.  Heights in kilometres.
"""

import numpy as np

from ...arrays import F32
from .spectrum import Array

EARTH, THICKNESS = 6371.0, 100.0  # radius of the earth, and the air around it [km]
TOP = EARTH + THICKNESS
_STEPS = 64
_G = 0.8  # anisotropy of aerosols
_ALBEDO = 0.3  # of the ground

# At 630, 560, 490 and 430 nm
_SUN = np.array([1.679, 1.828, 1.986, 1.307])  # [W/(m2 nm)]
_MOLECULES = np.array([6.605e-3, 1.067e-2, 1.842e-2, 3.156e-2])  # [1/km] at sea level
_OZONE = np.array([3.472e-25, 3.914e-25, 1.349e-25, 1.103e-26]) * 334.5  # times Dobson units
_AEROSOLS_ABSORB = np.array([2.8722e-24, 4.6168e-24, 7.9706e-24, 1.3578e-23])  # [km2]
_AEROSOLS_SCATTER = np.array([1.5908e-22, 1.7711e-22, 2.0942e-22, 2.4033e-22])
_AEROSOLS, _BACKGROUND = 1.3681e20, 2e6  # [1/km3]
_AEROSOLS_HEIGHT = 0.73  # scale height
_SEVERAL_TIMES = 0.02 * np.array([0.217, 0.347, 0.594, 1.0])  # radiance per irradiance

# XYZ of the four, fitted to the whole spectrum
_XYZ = np.array(
    [
        (53.3869177, 22.9813375, 0.0),
        (43.9048445, 71.3477957, 0.1025069),
        (1.6137278, 18.4229606, 31.7429212),
        (20.7626687, 2.3614214, 110.4800964),
    ]
)


def table(elevation: float, altitude: float, air: float, aerosol: float, ozone: float) -> Array:
    """Return XYZ radiance (256, 512, 3) [W/(sr m2)] of all directions.

    `elevation` of the sun [radians], `altitude` of the viewer [m], and densities in units of the
    clear sky's.
    """
    height, width = 256, 512
    densities = (air, aerosol, ozone)
    line = 2 * (np.arange(height) + 0.5) / height - 1
    latitude = np.copysign(line * line, line) * np.pi / 2
    longitude = 2 * np.pi * (np.arange(width // 2) + 0.5) / width  # pi is the sun's
    half = _radiance(latitude, longitude, elevation, _kilometres(altitude), densities)
    return np.concatenate([half, half[:, ::-1]], axis=1)


def sun(elevation: float, altitude: float, air: float, aerosol: float, ozone: float) -> Array:
    """Return the XYZ irradiance (3,) [W/m2] of the sun at an elevation."""
    cosine, height = np.array([np.sin(elevation)]), np.array([_kilometres(altitude)])
    through = _transmittance(cosine, height, (air, aerosol, ozone))
    irradiance: Array = (_SUN * through[0]) @ _XYZ
    return irradiance


def _kilometres(altitude: float) -> float:
    return min(max(altitude, 1.0), 99999.0) / 1000


def _coefficients(
    height: Array, densities: tuple[float, float, float]
) -> tuple[Array, Array, Array]:
    """Return what scatters of molecules and of aerosols, and extinction, (..., 4) [1/km]."""
    height = np.maximum(height, 0.0)[..., None]
    air, aerosol, ozone = densities
    molecules = _MOLECULES * np.exp(-0.07771971 * height**1.16364243) * air
    log = np.log(np.maximum(height, 1e-4))
    ozone_density = 3.78547397e20 * np.exp(-((log - 3.22261) ** 2) * 5.55555555 - log)
    aerosols = np.exp(height / -_AEROSOLS_HEIGHT) * _AEROSOLS + _BACKGROUND
    scattered = _AEROSOLS_SCATTER * aerosols * aerosol
    absorbed = _AEROSOLS_ABSORB * aerosols * aerosol + _OZONE * ozone_density * ozone
    return molecules, scattered, molecules + scattered + absorbed


def _transmittance(cosine: Array, height: Array, densities: tuple[float, float, float]) -> Array:
    """Return what passes (..., 4) from `height` to the top, `cosine` from the zenith."""
    radius = EARTH + height
    towards = radius * cosine
    length = -towards + np.sqrt(towards * towards - radius * radius + TOP * TOP)
    total = np.zeros((*np.broadcast(cosine, height).shape, 4))
    for step in range(_STEPS):
        along = (step + 0.5) / _STEPS * length
        place = np.sqrt(radius * radius + along * (2 * towards + along)) - EARTH
        total += _coefficients(place, densities)[2]
    return np.exp(-total * (length / _STEPS)[..., None])


def _radiance(
    latitude: Array,
    longitude: Array,
    elevation: float,
    altitude: float,
    densities: tuple[float, float, float],
) -> Array:
    """Return XYZ radiance (Y, X, 3) of directions; the sun is at longitude pi."""
    cosines, heights = np.linspace(-1, 1, 256), np.linspace(0, THICKNESS, 64)
    passing = _transmittance(cosines, heights[:, None], densities)  # (64, 256, 4)

    # Walk along the view rays to the ground or the top: (Y, steps)
    start = EARTH + altitude
    towards = start * np.sin(latitude)
    # In float32, as in Cycles: seen from low above the ground, its rounding moves the ground by up
    # to 0.5 %, and with it the radiance
    near = F32(start) * np.sin(latitude).astype(F32)
    hit = near * near - (F32(start) * F32(start) - F32(EARTH) * F32(EARTH))
    to_ground = -near - np.sqrt(np.maximum(hit, F32(0)))
    ground = (towards <= 0) & (hit >= 0)
    length = -towards + np.sqrt(towards * towards - start * start + TOP * TOP)
    length = np.where(ground, to_ground, length)[:, None]
    along = (np.arange(_STEPS) + 0.5) / _STEPS * length
    radius = np.sqrt(start * start + along * (2 * towards[:, None] + along))
    height = np.maximum(radius - EARTH, 0.0)

    # What a point sends to the viewer: (Y, steps, 4)
    molecules, aerosols, extinction = _coefficients(height, densities)
    depth = extinction * (length / _STEPS)[:, :, None]
    share = np.exp(depth - depth.cumsum(axis=1)) * -np.expm1(-depth) / np.maximum(extinction, 1e-7)
    molecules *= share * _SUN
    aerosols *= share * _SUN

    # What of it comes from the ground: its view, and what passes between
    view = 2 * np.pi * (1 - np.sqrt(np.maximum(1 - (EARTH / radius) ** 2, 0)))
    upwards = _interpolate(passing[:, -1], height / THICKNESS * 63)
    ground_share = view[:, :, None] / (4 * np.pi) * _ALBEDO / np.pi * passing[0, -1] / upwards

    # What the scattering angle does
    sun_x, sun_z = -np.cos(elevation), np.sin(elevation)
    flat, up = np.cos(latitude)[:, None], np.sin(latitude)[:, None]
    mu = flat * np.cos(longitude) * sun_x + up * sun_z
    molecular = 3 / (16 * np.pi) * (1 + mu * mu)
    forward = (1 - _G * _G) / (4 * np.pi) * (1 + _G * _G - 2 * _G * mu) ** -1.5

    # Add up the points, row by row, as each row stays in the caches
    xyz = np.empty((*mu.shape, 3))
    passing, ground_share = passing.astype(F32), ground_share.astype(F32)
    molecules, aerosols = molecules.astype(F32), aerosols.astype(F32)
    for row in range(latitude.size):
        x = along[row] * flat[row] * np.cos(longitude)[:, None]
        z = start + along[row] * up[row]
        cosine = ((x * sun_x + z * sun_z) / radius[row]).astype(F32)
        from_sun = _lookup(passing, cosine, height[row].astype(F32))  # (X, steps, 4)
        at_ground = _interpolate(passing[0], (cosine * 0.5 + 0.5) * 255)
        often = _SEVERAL_TIMES.astype(F32) / (1 + 5 * np.exp(-17.92 * cosine))[..., None]
        often = often + ground_share[row] * at_ground * cosine[..., None]
        once = _along(from_sun, molecules[row]) * molecular[row][:, None]
        once += _along(from_sun, aerosols[row]) * forward[row][:, None]
        xyz[row] = (once + _along(often, molecules[row] + aerosols[row])) @ _XYZ
    return xyz


def _along(values: Array, weights: Array) -> Array:
    """Return the sums (X, 4) of values (X, steps, 4) by weights (steps, 4)."""
    sums: Array = np.matmul(values.transpose(2, 0, 1), weights.T[:, :, None])[:, :, 0].T
    return sums


def _interpolate(values: Array, place: Array) -> Array:
    """Return values (M, 4) at places (...) in [0, M - 1], with straight lines between."""
    place = np.clip(place, 0, len(values) - 1)
    first = np.minimum(place.astype(np.int32), len(values) - 2)
    rest = (place - first)[..., None]
    return values.take(first, axis=0) * (1 - rest) + values.take(first + 1, axis=0) * rest


def _lookup(passing: Array, cosine: Array, height: Array) -> Array:
    """Return what passes (X, steps, 4) of the table (64, 256, 4), bilinearly."""
    rows, columns, _ = passing.shape
    place = np.clip(height / THICKNESS, 0, 1) * (rows - 1)
    first = np.minimum(place.astype(np.int32), rows - 2)
    rest = (place - first)[:, None, None]
    lines = passing.take(first, axis=0) * (1 - rest) + passing.take(first + 1, axis=0) * rest
    across = np.clip(cosine * 0.5 + 0.5, 0, 1) * (columns - 1)
    column = np.minimum(across.astype(np.int32), columns - 2)
    part = (across - column)[..., None]
    flat = lines.reshape(-1, 4)
    column = column + np.arange(len(height), dtype=np.int32) * np.int32(columns)
    return flat.take(column, axis=0) * (1 - part) + flat.take(column + 1, axis=0) * part
