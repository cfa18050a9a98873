"""cosine, optical constants -> reflectance.  What smooth surfaces, or microfacets, reflect.

Cosines (N,) lie in [0, 1].  A relative index eta is the index beyond the surface divided by that on
the viewer's side.  Scalars are (N,) or (1,), colours (3, N) or (3, 1); they broadcast.  The
averages are the share of a uniform sky that is reflected, the integral of 2 cos F(cos) dcos, which
the compensation of lost energy needs; where Cycles takes a fit, so do they.
Source: Pharr et al. 2023, "Physically Based Rendering", 4th ed., sections 9.3.5 and 9.3.6.
"""

import numpy as np

from ..arrays import F32, Scalar, Vec

_GRAZING = F32(1e-10)  # the least cosine: nothing is divided by zero

# The cosine (about 82 degrees) at which the F82 model is fitted, where cos (1 - cos)^6 peaks, and
# Schlick's weight of white there.
_COS82 = F32(1 / 7)
_WHITE82 = F32((6 / 7) ** 5)
_SCALE82 = F32(7 / (6 / 7) ** 6)


def dielectric(cos: Scalar, eta: Scalar) -> tuple[Scalar, Scalar]:
    """Return the exact reflectance (N,) for unpolarised light and the cosine (N,) beyond.

    Total internal reflection gives exactly (1, 0).
    """
    cos = np.maximum(cos, _GRAZING)

    # g^2 = eta^2 - sin^2, in a form that is exact at grazing angles and for eta near 1; where
    # g = 0 both terms below become 1 by themselves.
    g = cos * cos
    g += (eta - F32(1)) * (eta + F32(1))
    np.maximum(g, F32(0), out=g)
    np.sqrt(g, out=g)
    perpendicular = cos - g
    perpendicular /= cos + g
    inside = cos * (eta * eta)
    parallel = inside - g
    inside += g
    parallel /= inside
    perpendicular *= perpendicular
    parallel *= parallel
    parallel += perpendicular
    parallel *= F32(0.5)
    g *= F32(1) / eta
    return parallel, g


def dielectric_average(eta: Scalar) -> Scalar:
    """Return the average of `dielectric` for a relative index (N,).

    Source: fit of Kulla and Conty 2017, "Revisiting Physically Based Shading at Imageworks"; its
    error is below 0.0066 for eta in [0.4, 3].
    """
    dense: Scalar = np.divide(eta - F32(1), F32(4.08567) + F32(1.00071) * eta)
    cubic: Scalar = F32(0.1014) - eta * (F32(0.965241) + eta * F32(0.130607))
    cubic *= eta
    cubic += F32(0.997118)
    return np.where(eta < F32(1), cubic, dense)


def f0_from_ior(eta: Scalar) -> Scalar:
    """Return the reflectance (N,) at perpendicular incidence, the same for eta and 1 / eta."""
    ratio: Scalar = np.divide(eta - F32(1), eta + F32(1))
    return ratio * ratio


def ior_from_f0(f0: Scalar) -> Scalar:
    """Return the index (N,) >= 1 whose perpendicular reflectance is f0 (N,), at most 0.99."""
    root = np.sqrt(np.clip(f0, F32(0), F32(0.99)))
    return np.divide(F32(1) + root, F32(1) - root)


def _remap(reflectance: Scalar, eta: Scalar) -> Scalar:
    """Return how far (N,) in [0, 1] a reflectance is from the perpendicular one to 1."""
    # (F - F0) / (1 - F0), with 1 - F0 = 4 eta / (eta + 1)^2
    share = (reflectance - f0_from_ior(eta)) * ((eta + F32(1)) ** 2 / (F32(4) * eta))
    return np.clip(share, F32(0), F32(1), out=share)


def _towards_white(color: Vec, share: Scalar | np.float32) -> Vec:
    out: Vec = (F32(1) - color) * share
    out += color
    return out


def remapped(cos: Scalar, eta: Scalar, f0: Vec) -> Vec:
    """Return the dielectric's curve (3, N), stretched so that it goes from f0 to 1.

    Cycles' generalised Schlick model with a negative exponent.
    """
    return _towards_white(f0, _remap(dielectric(cos, eta)[0], eta))


def remapped_average(eta: Scalar, f0: Vec) -> Vec:
    """Return the average of `remapped` (3, N), which is linear in that of `dielectric`."""
    return _towards_white(f0, _remap(dielectric_average(eta), eta))


def f82(cos: Scalar, f0: Vec, b: Vec) -> Vec:
    """Return the reflectance (3, N) of metal by colours: Schlick's, less b cos (1 - cos)^6.

    Source: Kutz et al. 2021, "Novel aspects of the Adobe Standard Material", section 2.
    """
    grazing = np.maximum(F32(1) - cos, F32(0))
    fifth = grazing * grazing
    fifth *= fifth
    fifth *= grazing
    out = _towards_white(f0, fifth)
    if b.any():
        fifth *= grazing
        fifth *= cos
        out -= b * fifth
        np.maximum(out, F32(0), out=out)
    return np.minimum(out, F32(1), out=out)


def f82_b(f0: Vec, tint: Vec) -> Vec:
    """Return the b of `f82` that multiplies the reflectance near 82 degrees by `tint`."""
    return _towards_white(f0, _WHITE82) * _SCALE82 * (F32(1) - tint)


def f82_average(f0: Vec, b: Vec) -> Vec:
    """Return the average of `f82` (3, N) before it is clipped to [0, 1]: exact integrals."""
    return _towards_white(f0, F32(1 / 21)) - b * F32(1 / 126)


def conductor(cos: Scalar, n: Vec, k: Vec) -> Vec:
    """Return the exact reflectance (3, N) of a metal of index n + ik for unpolarised light.

    Source: Born and Wolf 1999, "Principles of Optics", 7th ed., section 14.4.1.
    """
    cos2 = cos * cos
    n2, k2 = n * n, k * k
    product2 = F32(4) * n2 * k2

    # u + iv = sqrt((n + ik)^2 - sin^2): |.|^2 and its real part u
    real = (n2 - k2 - F32(1)) + cos2
    size = np.sqrt(real * real + product2)
    real += size
    real *= F32(0.5)
    np.maximum(real, F32(0), out=real)
    cross = np.sqrt(real)
    cross *= F32(2) * cos
    total = size + cos2
    perpendicular = (total - cross) / np.maximum(total + cross, F32(1e-20))

    # With |u + iv|^2 = size, the parallel one is the perpendicular one times the same at sin^2.
    sin2 = np.maximum(F32(1) - cos2, F32(0))
    total = size * cos2
    total += sin2 * sin2
    cross *= sin2
    parallel = (total - cross) / np.maximum(total + cross, F32(1e-20))
    parallel *= perpendicular
    parallel += perpendicular
    parallel *= F32(0.5)
    return np.clip(parallel, F32(0), F32(1), out=parallel)


def conductor_average(n: Vec, k: Vec) -> Vec:
    """Return about the average of `conductor` (3, N): that of the `f82` model fitted to it.

    The model meets the exact curve at perpendicular incidence and near 82 degrees; its average is
    within 0.03 of the true one for metals.
    """
    f0 = conductor(np.ones(1, F32), n, k)
    b = (_towards_white(f0, _WHITE82) - conductor(np.full(1, _COS82), n, k)) * _SCALE82
    return np.clip(f82_average(f0, b), F32(0), F32(1))
