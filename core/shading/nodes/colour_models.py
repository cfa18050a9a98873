"""RGB -> HSV, HSL, and back.  Colours as hue, saturation and value or lightness, each 0 to 1.

Written for what Blender makes of colours outside of 0 to 1, too: a hue beyond its range lies in
the last sixth of the circle.  Source: Smith 1978, "Color Gamut Transform Pairs".
"""

import numpy as np

from ...arrays import F32
from ..values import Array
from .arithmetic import ONE, TWO, ZERO, divide, nonzero

SIXTH = F32(1 / 6)


def hsv_of_rgb(rgb: Array) -> tuple[Array, Array, Array]:
    """Return hue, saturation and value (N,) of colours (3, N)."""
    high, low = rgb.max(axis=0), rgb.min(axis=0)
    saturation = divide(high - low, high)
    return np.where(saturation != 0, _hue(rgb, high, low), ZERO), saturation, high


def _hue(rgb: Array, high: Array, low: Array) -> Array:
    red, green, blue = (high - rgb) / nonzero(high - low)
    sixths = np.where(rgb[1] == high, TWO + red - blue, F32(4) + green - red)
    sixths = np.where(rgb[0] == high, blue - green, sixths)
    hue = sixths * SIXTH
    return np.where(hue < 0, hue + ONE, hue)


def rgb_of_hsv(hue: Array, saturation: Array, value: Array) -> Array:
    """Return colours (3, N) of hue, saturation and value (N,)."""
    sixths = np.where(hue == 1, ZERO, hue) * F32(6)
    floor = np.floor(sixths)
    part = sixths - floor
    p = value * (ONE - saturation)
    q = value * (ONE - saturation * part)
    t = value * (ONE - saturation * (ONE - part))
    v = np.broadcast_to(value, p.shape)
    inside = (floor >= 0) & (floor <= 5)
    sector = np.where(inside, floor, F32(5)).astype(np.int32)
    return np.stack(
        [
            np.choose(sector, (v, q, p, p, t, v)),
            np.choose(sector, (t, v, v, q, p, p)),
            np.choose(sector, (p, p, t, v, v, q)),
        ]
    )


def hsl_of_rgb(rgb: Array) -> tuple[Array, Array, Array]:
    """Return hue, saturation and lightness (N,) of colours (3, N)."""
    high, low = rgb.max(axis=0), rgb.min(axis=0)
    total, span = high + low, high - low
    lightness = np.minimum(total * F32(0.5), ONE)
    saturation = divide(span, np.where(lightness > F32(0.5), TWO - total, total))
    hue = np.where(span != 0, _hue(rgb, high, low), ZERO)
    return hue, saturation, lightness


def rgb_of_hsl(hue: Array, saturation: Array, lightness: Array) -> Array:
    """Return colours (3, N) of hue, saturation and lightness (N,)."""
    sixths = hue * F32(6)
    shares = (
        np.abs(sixths - F32(3)) - ONE,
        TWO - np.abs(sixths - TWO),
        TWO - np.abs(sixths - F32(4)),
    )
    chroma = (ONE - np.abs(TWO * lightness - ONE)) * saturation
    rows = ((np.clip(share, ZERO, ONE) - F32(0.5)) * chroma + lightness for share in shares)
    return np.stack(np.broadcast_arrays(*rows))
