"""film -> pictures.  How the sums of a film become the numbers of a pass, (C, pixels).

Each function takes the film, the exposure and the names of what it reads.
"""

import numpy as np
from numpy.typing import NDArray

from .film import Film

Array = NDArray[np.floating]

FAR_AWAY = 1e10  # the depth of what is not there (Blender)


def mean(film: Film, exposure: float, name: str) -> Array:
    """Return the mean of the samples."""
    return film.mean(name)


def exposed(film: Film, exposure: float, name: str) -> Array:
    """Return the mean of the samples as bright as the picture."""
    return film.mean(name) * exposure


def lighting(film: Film, exposure: float, light: str, colour: str) -> Array:
    """Return light divided by the colour that it was multiplied with.

    Where one channel of the colour is black, it gets what the others have, so that grey light stays
    grey (Cycles).
    """
    total, colours = film.total(light), film.total(colour)
    is_lit = colours != 0
    out = np.where(is_lit, total / np.where(is_lit, colours, 1.0), 0.0)
    count = is_lit.sum(axis=0)
    even = out.sum(axis=0) / np.maximum(count, 1)
    return np.asarray(np.where(is_lit, out, even) * exposure)


def middle(film: Film, exposure: float, name: str) -> Array:
    """Return what the middle of each pixel shows."""
    return film.middle(name)


def speed(film: Film, exposure: float, name: str) -> Array:
    """Return the mean of the samples that show anything."""
    *total, count = film.total(name)
    return np.stack(total) / np.maximum(count, 1.0)


def depth(film: Film, exposure: float, name: str) -> Array:
    """Return the depth [m], of nothing a large one."""
    found = film.middle(name)
    return np.where(found == 0, np.float32(FAR_AWAY), found)


def mist(film: Film, exposure: float, name: str) -> Array:
    """Return the share that mist hides, of what was summed up: the share that it shows."""
    return np.clip(1.0 - film.mean(name), 0.0, 1.0) * (film.counts > 0)


def catcher(film: Film, exposure: float) -> Array:
    """Return by what shadow catchers multiply the background."""
    if "caught" not in film.passes:
        return np.ones((3, film.counts.size))
    return film.shadow()


def noisy(film: Film, exposure: float) -> Array:
    """Return the picture before it was denoised."""
    return film.noisy(exposure).reshape(-1, 4).T


def samples(film: Film, exposure: float) -> Array:
    """Return how many samples there are, as a share of the most that a pixel has (Cycles)."""
    return np.asarray(film.counts[None] / max(int(film.counts.max(initial=0)), 1))


def milliseconds(film: Film, exposure: float, name: str) -> Array:
    """Return the time [ms] that the pixels took."""
    return film.total(name) * 1e3
