"""star field -> directions and light.  Stars of the world, by chance.

Each star has its own random numbers: more of them leave the others where they are.
"""

import numpy as np
from numpy.typing import NDArray

from ..sampling.hashing import keys_of, uniform, words_of
from ..scene import StarField
from ..shading.black_body import seen_black_body

PURPOSE = 0x5C1E5  # of random numbers, apart from those of pixels


def make_field(field: StarField) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return unit directions (S, 3), even all around, and irradiances (S, 3) [W/m2], scene-linear.

    A magnitude more is 10^-0.4 of the light (Pogson 1856); their numbers grow like 10^(slope x
    magnitude), 0.6 in an even universe.
    """
    words = words_of(keys_of((PURPOSE, field.seed), field.count), 4)
    around, height, rank, warmth = uniform(words).astype(np.float64)

    # Place them on the unit sphere, by the area of its zones
    z = 2 * height - 1
    level = np.sqrt(np.maximum(1 - z * z, 0))
    direction = np.stack(
        [level * np.cos(2 * np.pi * around), level * np.sin(2 * np.pi * around), z]
    )

    # Invert the distribution of their magnitudes
    low, high = sorted((field.brightest, field.faintest))
    growth = field.slope * np.log(10.0)
    if growth * (high - low) < 1e-6:
        magnitude = low + rank * (high - low)
    else:
        most = np.expm1(growth * (high - low))
        magnitude = low + np.log1p(rank * most) / growth
    irradiance = field.irradiance * 10 ** (-0.4 * magnitude)

    # Colour them as black bodies, evenly by 1 / temperature
    inverse = (1 + np.clip(field.spread, 0, 1) * (2 * warmth - 1)) / field.temperature
    temperature = 1 / np.maximum(inverse, 1e-9)
    rgb = np.array(field.rgb_of_xyz) @ seen_black_body(temperature.astype(np.float32))
    return direction.T, (np.maximum(rgb, 0) * irradiance).T
