"""dielectric sheet -> reflectance, transmittance.  Glass as thin as a soap bubble.

A sheet without thickness reflects at both faces, again and again; the series is summed.  What it
reflects is one glossy lobe, what it lets through another, mirrored at the sheet and rougher, since
both faces blurred it.  These are the weights that Cycles gives to its closures for thin walls.
Source: OpenPBR 1.1, "Thin-walled case"; Kulla & Conty 2017, "Revisiting Physically Based Shading
at Imageworks", page 40, with 3.4 for the misprinted 3.7.
"""

import numpy as np

from ..arrays import F32, Scalar, Vec
from .thin_film import THINNEST, film_remapped

TINY = F32(1e-20)


def thin_glass(
    cosine: Scalar,
    ior: Scalar,
    f0: Vec,
    tint: Vec,
    thickness: Scalar,
    film_ior: Scalar,
    reflective: bool = True,
    refractive: bool = True,
) -> tuple[Vec, Vec]:
    """Return reflectance and transmittance (3, N) of a sheet seen at `cosine` (N,).

    ior (N,) is that of the sheet from either side; f0 (3, N) what one face reflects at normal
    light, tint (3, N) what passes then through the sheet; a film of `thickness` (N,) [nm] and
    film_ior (N,) is on both faces.  Without `reflective` or `refractive`, the switches for
    caustics, a face gives no such light.
    """
    # One face from outside, and from inside: without a film that is the same
    g2 = (ior - F32(1)) * (ior + F32(1)) + cosine * cosine
    beyond = np.sqrt(np.maximum(g2, F32(0))) / ior
    outer = film_remapped(cosine, ior, f0, thickness, film_ior)
    inner = outer
    if (thickness > THINNEST).any():
        inner = film_remapped(beyond, F32(1) / ior, f0, thickness, film_ior / ior)
        inner = np.where(thickness > THINNEST, inner, outer)
    passed = (F32(1) - outer) * (F32(1) - inner)
    if not refractive:
        passed = np.zeros_like(passed)
    if not reflective:
        outer = inner = np.zeros_like(outer)

    # Beer's law on the longer way of slanting light, then all the reflections in between
    absorbed = np.power(tint, F32(1) / np.maximum(beyond, TINY))
    bounced = inner * absorbed
    through = absorbed * passed / np.maximum(F32(1) - bounced * bounced, TINY)
    return outer + through * bounced, through


def transmission_alpha(alpha: Scalar, ior: Scalar) -> Scalar:
    """Return the roughness alpha (N,) of what passes a sheet whose faces have `alpha` (N,)."""
    half = ior - F32(0.5)
    ratio = F32(3.4) * (ior - F32(1)) * half * half / (ior * ior * ior)
    return np.minimum(alpha * np.sqrt(np.maximum(ratio, F32(0))), F32(1))
