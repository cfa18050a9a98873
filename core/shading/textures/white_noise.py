"""points (D, N) -> random numbers.  White Noise Texture: hashes of the coordinates' bits."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..values import Array
from .hashing import hash_floats

# By dimension, the keys of green and blue: coordinates by number, or "+1" for the float 1
_KEYS: dict[int, tuple[tuple[int | str, ...], tuple[int | str, ...]]] = {
    1: ((0, "1"), (0, "2")),
    2: ((0, 1, "1"), (0, 1, "2")),
    3: ((0, 1, 2, "1"), (0, 1, 2, "2")),
    4: ((2, 0, 3, 1), (3, 2, 1, 0)),
}


def white_noise(points: Array | Sequence[NDArray[Any]], is_colour: bool) -> Array:
    """Return a random number (1, N), or colour (3, N), from 0 to 1 for points (D, N)."""
    rows = list(points)
    keys: list[tuple[int | str, ...]] = [tuple(range(len(rows)))]
    if is_colour:
        keys.extend(_KEYS[len(rows)])
    return np.stack(
        [
            hash_floats([rows[key] if isinstance(key, int) else float(key) for key in some])
            for some in keys
        ]
    )
