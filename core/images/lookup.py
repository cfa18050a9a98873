"""image, coordinates -> colours.  Mixing of texels, and what lies beyond the edges.

Each axis yields the texels that take part and their weights; a colour is the sum over both.  Where
images of a set have the same size, their texels are found once.
Interpolation: CLOSEST one texel, LINEAR two, CUBIC and SMART four of the cubic B-spline, which
blurs a little (Cycles renders both alike).  Beyond the edges: REPEAT, EXTEND (the last texel),
CLIP (transparent black), MIRROR.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Scalar, Vec
from . import Image

Tap = tuple[Ids, Scalar | None]  # a texel's number along the axis, and its weight (None is 1)

TAPS = {"Closest": 1, "Linear": 2, "Cubic": 4, "Smart": 4}


def lookup(
    image: Image,
    u: Scalar,
    v: Scalar,
    interpolation: str = "Linear",
    extension: str = "REPEAT",
    unassociate: bool = False,
) -> Vec:
    """Return scene-linear colour and alpha (4, N) float32 at u, v (N,), 0 to 1 from lower left.

    Colours are associated, unless `unassociate` asks for straight ones: Blender does where the
    node's Alpha output is used.
    """
    taps = find_taps(u, v, image.width, image.height, interpolation, extension)
    return mix_taps(image, taps, unassociate)


def find_taps(
    u: Scalar,
    v: Scalar,
    width: int | Ids,
    height: int | Ids,
    interpolation: str,
    extension: str,
    first: Ids | None = None,
) -> list[Tap]:
    """Return texels of an image of this size and their weights (N,), which add up to 1 inside.

    Images of one size that are looked up at the same places share them.  Sizes and first texels
    (N,) are those of levels where there are several.
    """
    count = TAPS[interpolation]
    columns = _taps(u, width, count, extension)
    rows = _taps(v, height, count, extension)
    taps: list[Tap] = []
    for row, share in rows:
        start = row * np.int32(width)
        if first is not None:
            start += first
        for column, weight in columns:
            both = share if weight is None else weight if share is None else weight * share
            taps.append((start + column, both))
    return taps


def mix_taps(image: Image, taps: list[Tap], unassociate: bool = False) -> Vec:
    """Return colour and alpha (4, N) of weighed texels; see `lookup`."""
    if image.is_grey:
        return _from_grey(image, taps)
    total = _weighed(image, taps)

    # Separate alpha, decode
    if unassociate and image.has_alpha and image.can_unassociate:
        alpha = total[3]
        total[:3] /= np.where(alpha == 0, F32(1), alpha)
    if image.is_srgb:
        total[:3] = decode_srgb(total[:3])
    return total


def mix_grey(image: Image, taps: list[Tap]) -> Scalar:
    """Return the grey (N,) of weighed texels of a grey image."""
    total = _weighed(image, taps)
    return decode_srgb(total) if image.is_srgb else total


def _weighed(image: Image, taps: list[Tap]) -> NDArray[np.float32]:
    """Return the sum of weighed texels, (4, N) or, of a grey image, (N,), as they are encoded."""
    total: NDArray[np.float32] | None = None
    for index, weight in taps:
        # Every index is inside; clip is take's fastest mode
        found = image.texels.take(index, mode="clip")
        if not image.is_grey:
            found = found.view(image.dtype).reshape(-1, 4).T
        texel = np.array(found, F32, order="C")
        if weight is not None:
            texel *= weight
        total = texel if total is None else np.add(total, texel, out=total)
    assert total is not None  # there is at least one texel
    if image.dtype.kind == "u":
        total *= F32(1.0 / np.iinfo(image.dtype).max)
    return total


def _from_grey(image: Image, taps: list[Tap]) -> Vec:
    """Return colour and alpha (4, N); where there is no texel, alpha is less than 1."""
    grey = mix_grey(image, taps)
    out = np.empty((4, grey.size), F32)
    out[:3] = grey
    weights = [weight for _, weight in taps if weight is not None]
    out[3] = np.add.reduce(weights) if weights else F32(1)
    return out


def decode_srgb(colour: Vec) -> Vec:
    """Return linear colours (..., N) of sRGB ones (IEC 61966-2-1); those below 0 become 0."""
    low = np.maximum(colour, F32(0))
    high: Vec = low + F32(0.055)
    high *= F32(1 / 1.055)
    np.power(high, F32(2.4), out=high)
    np.multiply(low, F32(1 / 12.92), out=high, where=low < F32(0.04045))
    return high


def _taps(place: Scalar, size: int | Ids, count: int, extension: str) -> list[Tap]:
    """Return the texels along one axis that take part at `place` (N,), and their weights."""
    x = _FOLD[extension](place, F32(size))
    if count > 1:
        x -= F32(0.5)
    first = np.floor(x)
    weights = _WEIGHTS[count](x - first)
    base = first.astype(np.int32)
    taps: list[Tap] = []
    for step, weight in zip(_STEPS[count], weights, strict=True):
        index = base + np.int32(step) if step else base
        if extension == "CLIP":
            inside = ((index >= 0) & (index < size)).astype(F32)
            weight = inside if weight is None else weight * inside
        taps.append((_WRAP[extension](index, size), weight))
    return taps


# --- Weights by the number of texels: t (N,) is the place between the middle two -----------------


def _linear(t: Scalar) -> list[Scalar | None]:
    return [F32(1) - t, t]


def _cubic(t: Scalar) -> list[Scalar | None]:
    """Return the uniform cubic B-spline's weights."""
    sixth, s = F32(1 / 6), F32(1) - t
    outer, inner = s * s * s * sixth, t * t * t * sixth
    left = F32(2 / 3) - t * t * (F32(1) - F32(0.5) * t)
    return [outer, left, F32(1) - outer - left - inner, inner]


_STEPS = {1: (0,), 2: (0, 1), 4: (-1, 0, 1, 2)}
_WEIGHTS: dict[int, Callable[[Scalar], list[Scalar | None]]] = {
    1: lambda t: [None],
    2: _linear,
    4: _cubic,
}

# --- Beyond the edges: coordinates to [0, size] or a little more, then texel numbers inside ------


def _repeat(place: Scalar, size: np.float32) -> Scalar:
    x: Scalar = place - np.floor(place)
    x *= size
    return x


def _mirror(place: Scalar, size: np.float32) -> Scalar:
    half = place * F32(0.5)
    half -= np.floor(half)
    half *= F32(2)
    np.minimum(half, F32(2) - half, out=half)
    half *= size
    return half


def _near(place: Scalar, size: np.float32) -> Scalar:
    # Four texels beyond the edge nothing changes any more
    x: Scalar = place * size
    np.clip(x, F32(-4), size + F32(4), out=x)
    return x


def _wrap_repeat(index: Ids, size: int | Ids) -> Ids:
    if isinstance(size, int) and size < 4:
        wrapped: Ids = np.remainder(index, np.int32(size))
        return wrapped
    index = index + np.int32(size) * (index < 0)
    index -= np.int32(size) * (index >= size)
    return index


def _wrap_mirror(index: Ids, size: int | Ids) -> Ids:
    index = np.where(index < 0, np.int32(-1) - index, index)
    index = np.where(index >= size, np.int32(2 * size - 1) - index, index)
    return _wrap_clamp(index, size)


def _wrap_clamp(index: Ids, size: int | Ids) -> Ids:
    clamped: Ids = np.clip(index, np.int32(0), np.int32(size - 1))
    return clamped


_FOLD: dict[str, Callable[[Scalar, np.float32], Scalar]] = {
    "REPEAT": _repeat,
    "MIRROR": _mirror,
    "EXTEND": _near,
    "CLIP": _near,
}
_WRAP: dict[str, Callable[[Ids, int | Ids], Ids]] = {
    "REPEAT": _wrap_repeat,
    "MIRROR": _wrap_mirror,
    "EXTEND": _wrap_clamp,
    "CLIP": _wrap_clamp,
}

EXTENSIONS = tuple(_FOLD)
