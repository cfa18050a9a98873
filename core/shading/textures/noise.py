"""points -> fractal noise.  Noise Texture: octaves of Perlin noise, summed or multiplied.

Sources: Perlin 2002 (octaves of noise, fBm); Musgrave in Ebert et al. 2003, "Texturing and
Modeling", chapter 16 (multifractals, hetero terrain, ridged), with Blender's parameters.
"""

from collections.abc import Callable

import numpy as np

from ...arrays import F32
from ..values import Array
from .batches import WHOLE, by_octaves, spread
from .hashing import hash_floats
from .perlin import perlin

_HALF, _ONE, _LEAST_WEIGHT = F32(0.5), F32(1), F32(0.001)
Numbers = tuple[Array, ...]  # roughness, lacunarity, offset, gain


def fbm(
    points: Array,
    octaves: int,
    share: Array,
    roughness: Array,
    lacunarity: Array,
    is_normalized: bool,
) -> Array:
    """Return the sum (N,) of 1 + octaves + share octaves of noise, from 0 to 1 if normalized."""
    points = spread(points, share, roughness, lacunarity)
    scale = amplitude = most = np.ones(1, F32)
    total = perlin(points)
    for octave in range(1, octaves + 1 + bool(share.any())):
        scale, amplitude = scale * lacunarity, amplitude * roughness
        ramp = perlin(points * scale) * amplitude
        if octave <= octaves:
            total += ramp
            most = most + amplitude
        elif is_normalized:
            more = (total + ramp) / (most + amplitude)
            total /= most
            total += (more - total) * share
            most = np.ones(1, F32)
        else:
            total += ramp * share
    if is_normalized:
        total *= _HALF / most
        total += _HALF
    return total


def _fbm(points: Array, octaves: int, share: Array, numbers: Numbers, is_normal: bool) -> Array:
    return fbm(points, octaves, share, numbers[0], numbers[1], is_normal)


def _multifractal(
    points: Array, octaves: int, share: Array, numbers: Numbers, is_normal: bool
) -> Array:
    roughness, lacunarity = numbers[:2]
    total = perlin(points)
    total += _ONE
    power = roughness
    for octave in range(1, octaves + 1 + bool(share.any())):
        points = points * lacunarity
        ramp = perlin(points) * (power if octave <= octaves else power * share)
        total *= ramp + _ONE
        power = power * roughness
    return total


def _hetero_terrain(
    points: Array, octaves: int, share: Array, numbers: Numbers, is_normal: bool
) -> Array:
    roughness, lacunarity, offset, _ = numbers
    total = perlin(points) + offset
    power = roughness
    for octave in range(1, octaves + 1 + bool(share.any())):
        points = points * lacunarity
        ramp = (perlin(points) + offset) * power
        ramp *= total
        total += ramp if octave <= octaves else ramp * share
        power = power * roughness
    return total


def _hybrid(points: Array, octaves: int, share: Array, numbers: Numbers, is_normal: bool) -> Array:
    roughness, lacunarity, offset, gain = numbers
    total, weight, power = np.zeros(1, F32), np.ones(1, F32), np.ones(1, F32)
    for octave in range(octaves + 1 + bool(share.any())):
        signal = (perlin(points) + offset) * power
        term = weight * signal
        total = total + (term if octave <= octaves else term * share)
        # Where the weight has died away, the remaining octaves count for nothing.
        weight = weight * (gain * signal)
        alive = weight > _LEAST_WEIGHT
        weight = np.minimum(np.maximum(weight, F32(0)), _ONE) * alive
        power = power * roughness
        points = points * lacunarity
    return total


def _ridged(points: Array, octaves: int, share: Array, numbers: Numbers, is_normal: bool) -> Array:
    roughness, lacunarity, offset, gain = numbers
    signal = offset - np.abs(perlin(points))
    signal *= signal
    total, power = signal.copy(), roughness
    for _ in range(octaves):
        points = points * lacunarity
        weight = np.minimum(np.maximum(signal * gain, F32(0)), _ONE)
        signal = offset - np.abs(perlin(points))
        signal *= signal
        signal = signal * weight
        total += signal * power
        power = power * roughness
    return total


# Type -> the fractal
TYPES: dict[str, Callable[[Array, int, Array, Numbers, bool], Array]] = {
    "FBM": _fbm,
    "MULTIFRACTAL": _multifractal,
    "HYBRID_MULTIFRACTAL": _hybrid,
    "RIDGED_MULTIFRACTAL": _ridged,
    "HETERO_TERRAIN": _hetero_terrain,
}


def _seed_offset(dimensions: int, seed: int) -> Array:
    """Return how far (D, 1) noises are apart that are to be independent: 100 to 200."""
    keys = [(seed,)] if dimensions == 1 else [(seed, axis) for axis in range(dimensions)]
    return np.stack([hash_floats(key) for key in keys]) * F32(100) + F32(100)


def noise(
    points: Array,
    detail: Array,
    roughness: Array,
    lacunarity: Array,
    offset: Array,
    gain: Array,
    distortion: Array,
    kind: str,
    is_normalized: bool,
    is_colour: bool,
) -> Array:
    """Return the noise (1, N), or three independent ones (3, N), at points (D, N).

    `kind` is of TYPES; is_normalized: FBM goes from 0 to 1; the parameters (1,) or (N,) are
    those of Blender's Noise Texture.
    """
    fractal, dimensions = TYPES[kind], len(points)
    roughness = np.maximum(roughness, F32(0))
    is_distorted = bool(distortion.any())
    seeds = (dimensions, dimensions + 1) if is_colour else ()

    def run(
        octaves: int,
        share: Array,
        points: Array,
        roughness: Array,
        lacunarity: Array,
        offset: Array,
        gain: Array,
        distortion: Array,
    ) -> Array:
        if is_distorted:
            shifts = [perlin(points + _seed_offset(dimensions, seed)) for seed in range(dimensions)]
            points = points + np.stack(shifts) * distortion
        numbers = roughness, lacunarity, offset, gain
        points = spread(points, share, *numbers)
        places = [points, *(points + _seed_offset(dimensions, seed) for seed in seeds)]
        return np.stack(
            [fractal(place, octaves, share, numbers, is_normalized) for place in places]
        )

    arrays = (points, roughness, lacunarity, offset, gain, distortion)
    return by_octaves(run, detail, arrays, 3 if is_colour else 1, WHOLE)
