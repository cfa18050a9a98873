"""quadrature -> core/bsdf/tables/*.npy.  What GGX reflects in all, and the spectra of thin films.

The tables have the axes and sizes of Cycles' own (src/app/cycles_precompute.cpp says which), since
it interpolates between few points, and that is seen; their numbers are integrated here, in
float64.  Directions are averaged over the microfacets that are seen, by spherical caps
(Dupuy & Benyoub 2023): there, the integrand is smooth but for a crease where light goes under the
horizon.  The axes, from 0 to 1: roughness = sqrt(alpha), mu = cosine of the viewer, and
z = sqrt((ior - 1) / (ior + 1)).

Needs numpy, scipy and colour-science:  python3 -m tools.albedo_tables, in the checkout.
"""

import sys
from pathlib import Path

import numpy as np

TABLES = Path(__file__).resolve().parent.parent / "core" / "bsdf" / "tables"

CAP, AZIMUTHS = 400, 400  # microfacets of an integral
COSINES = 48  # viewers of an average

# As in Cycles: the ends of the axes are not quite reached.
SMALLEST, LARGEST_Z = 1e-4, 0.99

# Cycles looks at a table over the exponents of Schlick's formula, 16 points from infinity to
# zero, in its middle: that is the mean of these two.  Nothing else of it is ever read.
EXPONENTS = tuple(5 * (15 - i) / i for i in (7, 8))

# Films: the sensitivity at 512 optical path differences, up to 60000 / 2 pi [nm]
PATHS, LONGEST = 512, 60000 / (2 * np.pi)
FREQUENCIES = 1022  # of light, pi / 60 apart [1 / um]


def axis(size, largest=1.0):
    """Return the places (size,) along an axis."""
    return np.clip(np.linspace(0, 1, size), SMALLEST, largest)


def alpha_of(roughness):
    """Return the width of GGX; the smoothest entry is a perfect mirror."""
    return 0.0 if roughness <= SMALLEST else roughness**2


def ior_of(z):
    """Return the index of refraction at z."""
    return (1 + z * z) / (1 - z * z)


def visible_microfacets(alpha, mu, cap=CAP, azimuths=AZIMUTHS):
    """Return h_z, wi . h and weights (cap, azimuths) of microfacets as seen from cosine mu."""
    nodes, weights = np.polynomial.legendre.leggauss(cap)
    height = ((nodes + 1) / 2)[:, None]
    phi = (np.arange(azimuths) + 0.5) * (np.pi / azimuths)

    # Stretch the viewer, and take a point of the cap below it
    x, z = alpha * np.sqrt(1 - mu * mu), mu
    length = np.hypot(x, z)
    x, z = x / length, z / length
    level = (1 - height) * (1 + z) - z
    radius = np.sqrt(np.maximum(1 - level * level, 0))

    # Half way between both lies the normal; shrink it back
    hx = alpha * (radius * np.cos(phi) + x)
    hy = alpha * radius * np.sin(phi)
    hz = level + z + 0 * hx
    length = np.sqrt(hx * hx + hy * hy + hz * hz)
    hz /= length
    toward = np.sqrt(1 - mu * mu) * (hx / length) + mu * hz
    if alpha == 0:
        hz, toward = np.ones_like(hz), np.full_like(hz, mu)
    return hz, toward, np.broadcast_to((weights / 2)[:, None] / azimuths, hz.shape)


def fresnel(cosine, eta):
    """Return reflectance and cosine beyond the surface; eta = index beyond / index here."""
    under = 1 - (1 - cosine**2) / eta**2
    beyond = np.sqrt(np.maximum(under, 0))
    s = (cosine - eta * beyond) / (cosine + eta * beyond)
    p = (eta * cosine - beyond) / (eta * cosine + beyond)
    return np.where(under > 0, (s * s + p * p) / 2, 1.0), beyond


def unshadowed(alpha, mu, wo_z):
    """Return G2 / G1 of light that leaves at cosine wo_z, zero below the horizon."""

    def slope(z):
        return (np.sqrt(1 + alpha**2 * (1 / z**2 - 1)) - 1) / 2

    seen = 1 + slope(mu)
    return np.where(wo_z > 0, seen / (seen + slope(np.maximum(wo_z, 1e-12))), 0.0)


def reflection(alpha, mu):
    """Return the albedo of GGX that reflects all."""
    hz, toward, weight = visible_microfacets(alpha, mu)
    return (unshadowed(alpha, mu, 2 * toward * hz - mu) * weight).sum()


def glass(alpha, mu, etas, lost=False):
    """Return the albedos (len(etas),) of GGX glass that reflects and refracts.

    What is refracted at a tilted facet, but still above the horizon, is lost.  Renders by Cycles
    show that its table counts it as passed, with the shadows of the mirrored direction: so
    `lost` light goes into our table, too.
    """
    hz, toward, weight = visible_microfacets(alpha, mu)
    reflected = unshadowed(alpha, mu, 2 * toward * hz - mu)
    found = []
    for eta in etas:
        share, beyond = fresnel(toward, eta)
        down = mu / eta - (toward / eta - beyond) * hz
        passed = unshadowed(alpha, mu, np.abs(down) if lost else down)
        if abs(eta - 1) < 1e-4:
            passed = 1.0  # Cycles lets light go straight on, without shadows
        found.append(((share * reflected + (1 - share) * passed) * weight).sum())
    return np.array(found)


def remapped(alpha, mu, etas):
    """Return how far towards white Fresnel's curves bring the reflectance, 0 at normal light."""
    hz, toward, weight = visible_microfacets(alpha, mu)
    weight = np.where(2 * toward * hz > mu, weight, 0.0)
    found = []
    for eta in etas:
        normal = ((eta - 1) / (eta + 1)) ** 2
        curve = (fresnel(toward, eta)[0] - normal) / (1 - normal)
        found.append((np.clip(curve, 0, 1) * weight).sum())
    return np.array(found)


def schlick(alpha, mu):
    """Return the same for Schlick's fifth power, as Cycles blends it from two others."""
    hz, toward, weight = visible_microfacets(alpha, mu)
    weight = np.where(2 * toward * hz > mu, weight, 0.0)
    grazing = np.clip(1 - toward, 0, 1)
    return np.mean([(grazing**power * weight).sum() for power in EXPONENTS])


def average(albedo, alpha):
    """Return the integral of 2 mu albedo(alpha, mu) over mu."""
    nodes, weights = np.polynomial.legendre.leggauss(COSINES)
    # With mu = t^2, many viewers are where rough surfaces change quickly
    t = (nodes + 1) / 2
    return sum(w * 2 * s**3 * albedo(alpha, s * s) for s, w in zip(t, weights, strict=True))


def over(alphas, cosines, integral):
    """Return an integral of (alpha, mu) as an array (..., mu, roughness)."""
    return np.stack(
        [np.stack([integral(a, mu) for a in alphas], axis=-1) for mu in cosines], axis=-2
    )


def sensitivity():
    """Return Re and Im (6, PATHS) of the Fourier transforms of the eye's x, y, z by frequency.

    A film whose paths differ by D reflects cos(2 pi D / wavelength) of some amplitude; what the
    eye makes of it is the transform of its sensitivity (Belcour & Barla 2017, eq. 10 and 11).
    """
    from colour.colorimetry import MSDS_CMFS_STANDARD_OBSERVER
    from scipy.interpolate import CubicSpline

    eye = MSDS_CMFS_STANDARD_OBSERVER["CIE 1931 2 Degree Standard Observer"]
    frequency = np.arange(1, FREQUENCIES) * (np.pi / 60)
    wavelength = 1000 / frequency
    curves = CubicSpline(eye.wavelengths, eye.values, extrapolate=False)(wavelength)
    density = np.nan_to_num(curves) / (frequency * frequency)[:, None]
    path = np.linspace(0, LONGEST, PATHS) / 1000
    phase = np.exp(-2j * np.pi * path[:, None] * frequency[None, :])
    transform = (phase @ density).T / density.sum(axis=0)[1]
    return np.concatenate([transform.real, transform.imag])


def both_sides(albedos):
    """Return an array (32, ...) as (2, 16, ...): light comes from outside, or from inside."""
    return albedos.reshape(2, 16, *albedos.shape[1:])


def main(asked):
    """Write the tables asked for, or all."""
    rough32 = [alpha_of(r) for r in axis(32)]
    rough16 = [alpha_of(r) for r in axis(16)]
    iors = ior_of(axis(16, LARGEST_Z))
    sides = np.concatenate([iors, 1 / iors])

    def clear(alpha, mu):
        return glass(alpha, mu, sides, lost=True)

    integrals = {
        "reflection": lambda: over(rough32, axis(32), reflection),
        "reflection_average": lambda: np.array([average(reflection, a) for a in rough32]),
        "glass": lambda: both_sides(over(rough16, axis(16), clear)),
        "glass_average": lambda: both_sides(
            np.stack([average(clear, a) for a in rough16], axis=-1)
        ),
        "remapped": lambda: over(rough16, axis(16), lambda a, mu: remapped(a, mu, iors)),
        "schlick": lambda: over(rough16, axis(16), schlick),
        "film": sensitivity,
    }
    for name in asked or integrals:
        values = integrals[name]()
        assert np.isfinite(values).all(), name
        np.save(TABLES / f"{name}.npy", values.astype(np.float32))
        print(f"{name}: {values.shape}, {values.min():.4f} to {values.max():.4f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
