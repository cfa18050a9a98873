"""cosine, film -> reflectance.  Iridescence of thin films on dielectrics and metals.

Light that goes through the film m times more is delayed by m optical path differences.  Instead
of summing over wavelengths, the Fourier transform of the eye's sensitivity is looked up at each
delay, for m up to 3 (Belcour & Barla 2017, "A Practical Extension to Microfacet Theory for the
Modeling of Varying Iridescence", eq. 10).  The choices are Cycles': both polarisations apart,
films below 1 nm fade out, and none below 0.1 nm.

Every function gives the reflectance (3, N) in linear Rec. 709 under light of equal energy; what
is refracted is the rest, in the direction that it has without the film.  All arguments broadcast.
If only the cosine varies, the reflectance is tabulated once and interpolated.
Seen from behind, a film's index is film_ior * eta, as its outside is then the dielectric; that
waves are shorter there is left out, as in Cycles.
"""

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec
from .albedo import table
from .fresnel import conductor, f0_from_ior, f82, f82_b, remapped

THINNEST = F32(0.1)  # [nm], below is no film
ORDERS = 3
NODES = 1024  # of a tabulated reflectance
PATH_SCALE = F32(2 * np.pi / 60000)  # optical path difference [nm] -> 0 to 1
EDGE = np.full(1, 1 / 7, F32)  # cosine at which the colour of a metal's edge is given
NO_EDGE = np.zeros((1, 1), F32)
# CIE XYZ -> linear Rec. 709 (IEC 61966-2-1)
RGB = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)
Curve = Callable[..., Vec]


@cache
def sensitivity() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the real, then imaginary parts of r, g, b (6, n), 1 for no delay, and their steps."""
    eye = table("film").astype(float).reshape(2, 3, -1)
    found = RGB @ eye
    found /= found[:1, :, :1]
    values = found.reshape(6, -1).astype(F32)
    return values, np.diff(values, axis=1, append=values[:, -1:])


def _seen(path: Scalar, rows: slice) -> Vec:
    """Return rows of the sensitivity (rows, N) at optical path differences (N,) [nm]."""
    values, steps = sensitivity()
    last = values.shape[1] - 1
    place = np.minimum(path * PATH_SCALE, F32(1)) * F32(last)
    whole = np.floor(place)
    index = whole.astype(np.intp)
    found = steps[rows].take(index, axis=1)
    found *= place - whole
    found += values[rows].take(index, axis=1)
    return found


def _dielectric(cosine: Scalar, eta: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Return the amplitudes (N,) of s and p waves, and eta x cosine beyond.

    Where all is reflected, they are 1, 1 and 0; the series below are then 1 by themselves.
    """
    cosine = np.maximum(cosine, F32(1e-10))
    g = np.sqrt(np.maximum((eta - F32(1)) * (eta + F32(1)) + cosine * cosine, F32(0)))
    inside = eta * eta * cosine
    return (cosine - g) / (cosine + g), (inside - g) / (inside + g), g


def _fading(thickness: Scalar, film_ior: Scalar) -> Scalar:
    """Return the film's index (N,), towards 1 where it is too thin for waves."""
    t = np.clip(thickness, F32(0), F32(1))
    return F32(1) + (film_ior - F32(1)) * (t * t * (F32(3) - F32(2) * t))


def _airy(top: Any, bottom: Any) -> tuple[Any, Any, Any]:
    """Return C_0, C_1 and the ratio of the next C_m from reflectances above and below (eq. 10)."""
    both = top * bottom
    through = F32(1) - top
    once = through * through * bottom / np.maximum(F32(1) - both, F32(1e-12))
    ratio = np.sqrt(both)
    return once + top, (once - through) * ratio, ratio


def _on_dielectric(cosine: Scalar, eta: Scalar, thickness: Scalar, film_ior: Scalar) -> Vec:
    ior = _fading(thickness, film_ior)
    s12, p12, g = _dielectric(cosine, ior)
    s23, p23, _ = _dielectric(g / ior, eta / ior)

    # Waves come back in phase or against it, and so do the odd ones among m
    s_turn = np.where((s12 >= 0) == (s23 >= 0), F32(-1), F32(1))
    p_turn = np.where((p12 >= 0) == (p23 >= 0), F32(-1), F32(1))
    s0, s, s_ratio = _airy(s12 * s12, s23 * s23)
    p0, p, p_ratio = _airy(p12 * p12, p23 * p23)
    path = F32(2) * thickness * g
    total = np.broadcast_to(F32(0.5) * (s0 + p0), np.broadcast_shapes(s0.shape, path.shape))
    total = np.repeat(total[None], 3, axis=0)
    for m in range(1, ORDERS + 1):
        amplitude = s * s_turn + p * p_turn if m % 2 else s + p
        total += amplitude * _seen(F32(m) * path, slice(0, 3))
        s, p = s * s_ratio, p * p_ratio
    return np.clip(total, F32(0), F32(1), out=total)


def _on_conductor(
    cosine: Scalar, n: Vec, k: Vec, edge: Vec | None, thickness: Scalar, film_ior: Scalar
) -> Vec:
    ior = _fading(thickness, film_ior)
    s12, p12, g = _dielectric(cosine, ior)
    inner = g / ior

    # Fresnel's amplitudes below the film (Born & Wolf, 14.4.1), with complex indices
    metal = (n + np.complex64(1j) * k) / ior
    epsilon = metal * metal
    beyond = np.sqrt(epsilon - (F32(1) - inner * inner))
    s23 = (inner - beyond) / (inner + beyond + F32(1e-20))
    p23 = (epsilon * inner - beyond) / (epsilon * inner + beyond + F32(1e-20))
    s_size, p_size = np.abs(s23), np.abs(p23)
    s_turn = s23 * np.where(s12 >= 0, F32(-1), F32(1)) / np.maximum(s_size, F32(1e-20))
    p_turn = p23 * np.where(p12 >= 0, F32(-1), F32(1)) / np.maximum(p_size, F32(1e-20))
    s_low, p_low = s_size * s_size, p_size * p_size
    if edge is not None:
        # How much is reflected follows the artist's curve, from its new start under the film
        normal = np.abs((metal - F32(1)) / (metal + F32(1)))
        normal *= normal
        tint = edge / f82(EDGE, normal, NO_EDGE)
        s_low = p_low = f82(inner, normal, f82_b(normal, tint))

    s0, s, s_ratio = _airy(s12 * s12, s_low)
    p0, p, p_ratio = _airy(p12 * p12, p_low)
    path = F32(2) * thickness * g
    total = F32(0.5) * (s0 + p0)
    s_phase, p_phase = s_turn, p_turn
    for m in range(1, ORDERS + 1):
        found = _seen(F32(m) * path, slice(0, 6))
        wave = s * s_phase + p * p_phase
        total = total + wave.real * found[:3] + wave.imag * found[3:]
        s, p = s * s_ratio, p * p_ratio
        s_phase, p_phase = s_phase * s_turn, p_phase * p_turn
    return np.clip(total, F32(0), F32(1))


# --- Fresnel models -----------------------------------------------------------------------------


def _film_remapped(
    cosine: Scalar, thickness: Scalar, film_ior: Scalar, eta: Scalar, f0: Vec
) -> Vec:
    """Scale the film's reflectance to f0, the less of it the more is reflected."""
    real = f0_from_ior(eta)
    found = _on_dielectric(cosine, eta, thickness, film_ior)
    share = np.clip((F32(1) - found) / np.maximum(F32(1) - real, F32(1e-6)), F32(0), F32(1))
    change = np.where(real > F32(1e-5), f0 / np.maximum(real, F32(1e-5)) - F32(1), F32(0))
    return np.minimum(found * (F32(1) + change * share), F32(1))


def _film_f82(cosine: Scalar, thickness: Scalar, film_ior: Scalar, f0: Vec, b: Vec) -> Vec:
    """Guess the metal's n and k from the colours at 0 and 82 degrees (Gulbrandsen 2014)."""
    edge = f82(EDGE, f0, b)
    r = np.minimum(f0, F32(0.999))
    root = np.sqrt(r)
    n: Vec = np.divide(F32(1) + root, F32(1) - root)
    least: Vec = np.divide(F32(1) - r, F32(1) + r)
    n = n + edge * (least - n)
    k2 = (r * np.square(n + F32(1)) - np.square(n - F32(1))) / (F32(1) - r)
    k: Vec = np.sqrt(np.maximum(k2, F32(0)))
    return _on_conductor(cosine, n, k, edge, thickness, film_ior)


def _film_conductor(cosine: Scalar, thickness: Scalar, film_ior: Scalar, n: Vec, k: Vec) -> Vec:
    return _on_conductor(cosine, n, k, None, thickness, film_ior)


@lru_cache(maxsize=64)
def _tabulated(film: Curve, key: tuple[tuple[bytes, tuple[int, ...]], ...]) -> tuple[Vec, Vec]:
    """Return a film's reflectance (3, NODES + 1) over the cosine, and its steps."""
    constants = [np.frombuffer(each, F32).reshape(shape) for each, shape in key]
    values = film(np.linspace(0, 1, NODES + 1, dtype=F32), *constants)
    return values, np.diff(values, axis=1, append=values[:, -1:])


def _either(plain: Curve, film: Curve, cosine: Scalar, layer: tuple[Any, Any], *base: Any) -> Vec:
    """Return film(cosine, *layer, *base), or plain(cosine, *base) where there is no film."""
    thin = layer[0] <= THINNEST
    if thin.all():
        return plain(cosine, *base)
    parameters = (*layer, *base)
    if any(each.shape[-1] > 1 for each in parameters):
        found = film(cosine, *parameters)
        return np.where(thin, plain(cosine, *base), found) if thin.any() else found

    # All points have the same film
    values, steps = _tabulated(film, tuple((each.tobytes(), each.shape) for each in parameters))
    place = np.clip(cosine, F32(0), F32(1)) * F32(NODES)
    whole = np.floor(place)
    index = whole.astype(np.intp)
    found = steps.take(index, axis=1)
    found *= place - whole
    found += values.take(index, axis=1)
    return found


def film_remapped(cosine: Scalar, eta: Scalar, f0: Vec, thickness: Scalar, film_ior: Scalar) -> Vec:
    """Return the reflectance (3, N) of a film on a dielectric whose curve is stretched to f0.

    cosine (N,) is that of the viewer and the facet; eta (N,) the index beyond over that on this
    side, f0 (3, N) f0_from_ior(eta) for a plain dielectric; thickness (N,) [nm]; film_ior
    (N,) over the index on this side.  1 where nothing can be refracted.
    """
    found = _either(remapped, _film_remapped, cosine, (thickness, film_ior), eta, f0)
    if (eta < 1).any():
        # A tabulated curve would smear the critical angle
        found = np.where((eta - F32(1)) * (eta + F32(1)) + cosine * cosine <= 0, F32(1), found)
    return found


def film_f82(cosine: Scalar, f0: Vec, b: Vec, thickness: Scalar, film_ior: Scalar) -> Vec:
    """Return the reflectance (3, N) of a film on metal by its colours; f0 and b as for `f82`."""
    return _either(f82, _film_f82, cosine, (thickness, film_ior), f0, b)


def film_conductor(cosine: Scalar, n: Vec, k: Vec, thickness: Scalar, film_ior: Scalar) -> Vec:
    """Return the reflectance (3, N) of a film on metal of the complex indices n + i k (3, N)."""
    return _either(conductor, _film_conductor, cosine, (thickness, film_ior), n, k)
