"""roughness, cosine, Fresnel -> what a surface sends back.  Tables, lost energy, layers.

GGX with single scattering loses light between its facets.  As Cycles does, closures are divided
by their albedo E without Fresnel; what scatters more than once also meets Fresnel more than once,
which darkens and saturates colours (Kulla & Conty 2017, "Revisiting Physically Based Shading at
Imageworks", pages 14-17 and appendix).  Layers below let through what those above do not reflect.

`roughness` is sqrt(sqrt(alpha_x alpha_y)), `mu` the cosine of the viewer, `fss` (3, N) the average
reflectance of a facet (the averages in `fresnel`).  All arguments broadcast: an array of size 1 is
the same for all points, and if only mu varies, tables are folded to curves, which are kept.  The
tables lie in `tables/`, are read when first used, and are made by tools/albedo_tables.py.
"""

from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec

TABLES = Path(__file__).parent / "tables"
SAFE = F32(1e-3)  # keeps colours far above 1 from dividing by zero


# --- Lookups ------------------------------------------------------------------------------------


@cache
def table(name: str) -> NDArray[np.float32]:
    """Read a table; its axes run from 0 to 1.  Raises OSError if the file is missing."""
    return np.load(TABLES / f"{name}.npy")


@lru_cache(maxsize=512)
def _folded(name: str, places: tuple[float | None, ...]) -> tuple[Any, Any]:
    """Return a table at its constant coordinates, and its steps along the last axis left."""
    values = table(name)
    for axis, place in reversed(list(enumerate(places, values.ndim - len(places)))):
        if place is not None:
            last = values.shape[axis] - 1
            x = min(max(place, 0.0), 1.0) * last
            i = min(int(x), last - 1)
            here, beyond = values.take(i, axis), values.take(i + 1, axis)
            values = here + F32(x - i) * (beyond - here)
    return values, np.diff(values, axis=-1, append=values[..., -1:]) if values.ndim else values


def _cell(x: Scalar, size: int, last: int) -> tuple[NDArray[np.intp], Scalar]:
    """Return the index and the fraction of coordinates (N,) in [0, 1] on an axis."""
    fraction = x * F32(size - 1)
    np.clip(fraction, F32(0), F32(size - 1), out=fraction)
    whole = np.minimum(np.floor(fraction), F32(last))
    fraction -= whole
    return whole.astype(np.intp), fraction


def lookup(name: str, *coordinates: Scalar, side: NDArray[np.intp] | None = None) -> Scalar:
    """Interpolate a table linearly at coordinates (N,) or (1,), one for each axis.

    A table with one more axis, the first, has two sides: side (N,) or (1,) is 0 or 1.
    """
    values, steps = _folded(name, tuple(float(c[0]) if c.size == 1 else None for c in coordinates))
    varying = [c for c in coordinates if c.size > 1]
    if not varying:
        return values.reshape(1) if side is None else values.take(side)

    # Steps past the end of the last axis are 0; along the others, the last cell is closed
    sizes = values.shape[-len(varying) :]
    index, fraction = _cell(varying[-1], sizes[-1], sizes[-1] - 1)
    others, stride = [], sizes[-1]
    for c, size in zip(varying[-2::-1], sizes[-2::-1], strict=True):
        cell, along = _cell(c, size, size - 2)
        index += cell * stride
        others.append((stride, along))
        stride *= size
    if side is not None:
        index += side * stride

    return _between((values, steps, fraction), index, others)


def _between(
    row: tuple[Scalar, Scalar, Scalar], at: NDArray[np.intp], axes: list[tuple[int, Scalar]]
) -> Scalar:
    """Interpolate from cells `at` along axes (stride, fraction).

    row: the table, its steps along its last axis, and how far along those.
    """
    if not axes:
        values, steps, fraction = row
        value = steps.take(at)
        value *= fraction
        value += values.take(at)
        return value
    (stride, along), rest = axes[-1], axes[:-1]
    low, high = _between(row, at, rest), _between(row, at + stride, rest)
    high -= low
    high *= along
    high += low
    return high


def _z(eta: Scalar) -> Scalar:
    """Return the coordinate (N,) of an index of refraction, the same for its inverse."""
    return np.sqrt(np.abs((eta - F32(1)) / (eta + F32(1))))


def roughness_of(alpha_x: Scalar, alpha_y: Scalar) -> Scalar:
    """Return the roughness (N,) that all of this module takes."""
    return np.sqrt(np.sqrt(alpha_x * alpha_y))


# --- Lost energy --------------------------------------------------------------------------------


def kept_energy(e: Scalar, average: Scalar, fss: Vec | None = None) -> tuple[Any, Any]:
    """Return factor and darkening from the albedo at this angle and over all of them.

    See `ggx_energy`.
    """
    if fss is None:
        return F32(1) / e, F32(1)
    # Light that missed meets the facets' Fresnel again and again; one time is in the closure
    more = fss * average
    more /= np.maximum(F32(1) - fss + more, SAFE)
    darkening = (F32(1) - more) * e
    darkening += more
    return darkening / e, darkening


def ggx_energy(roughness: Scalar, mu: Scalar, fss: Vec | None = None) -> tuple[Any, Any]:
    """Return by what GGX reflection is multiplied to keep the energy, and the darkening in it.

    The factor is (3, N), or (N,) where fss is None: then nothing is absorbed, and the darkening
    is 1.  A layer's estimated albedo contains the darkening only: see `layering`.
    """
    return kept_energy(ggx_albedo(roughness, mu), ggx_average_albedo(roughness), fss)


def ggx_albedo(roughness: Scalar, mu: Scalar) -> Scalar:
    """Return the share (N,) of light that GGX reflection without Fresnel sends back once."""
    return lookup("reflection", mu, roughness)


def ggx_average_albedo(roughness: Scalar) -> Scalar:
    """Return the same (N,) of light from everywhere."""
    return lookup("reflection_average", roughness)


def ggx_glass_energy(
    roughness: Scalar, mu: Scalar, ior: Scalar, back: NDArray[np.bool_], fss: Vec | None = None
) -> tuple[Any, Any]:
    """Return the same for GGX glass of index `ior` (N,), seen from behind where back (N,)."""
    z, side = _z(ior), ((ior < 1) != back).astype(np.intp)
    e = lookup("glass", z, mu, roughness, side=side)
    return kept_energy(e, lookup("glass_average", z, roughness, side=side), fss)


# --- Layers -------------------------------------------------------------------------------------


def estimated_albedo_remapped(roughness: Scalar, mu: Scalar, eta: Scalar, f0: Vec) -> Vec:
    """Return the share (3, N) that GGX with Fresnel's curve, stretched to start at f0, reflects.

    Of a plain dielectric, f0 = f0_from_ior(eta).  Missing energy counts as restored.
    """
    return f0 + (F32(1) - f0) * lookup("remapped", _z(eta), mu, roughness)


def estimated_albedo_f82(roughness: Scalar, mu: Scalar, f0: Vec) -> Vec:
    """Return the share (3, N) that GGX metal reflects; its edge tint is left out, as in Cycles."""
    return f0 + (F32(1) - f0) * lookup("schlick", mu, roughness)


def layering(albedo: Vec, weight: Vec) -> Vec:
    """Return the weight (3, N) of what lies below a layer.

    albedo (3, N) is what the layer reflects, its own weight included: weight x darkening x
    estimated albedo.  weight (3, N) is that of the layer and all below.  All colours are let
    through alike, as little as the most reflected one, as Cycles has it.
    """
    reflected = albedo / np.maximum(weight, F32(1e-30))
    passed: Scalar = np.clip(F32(1) - reflected.max(axis=0), F32(0), F32(1))
    return weight * passed
