"""pixel sums of shadow catchers -> alpha.  The shadows that are seen where they are not.

A shadow catcher is seen only by how much darker it is than it would be alone.  So a pixel sums up
its light with everything around it (caught) and without (alone), and the opacity of all that is in
the pixel; catchers themselves are holes in its alpha.  The formula is Cycles'
(film_calculate_shadow_catcher_matte_with_shadow).
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def shadow_of(caught: Array, alone: Array, opacity: Array) -> NDArray[np.float64]:
    """Return by what (3, n) the background of pixels is multiplied, 1 without catchers.

    caught and alone (3, n) are sums of radiance; opacity (n,) is of the pixel.
    """
    is_lit = alone != 0
    share = np.where(is_lit, caught / np.where(is_lit, alone, 1.0), 1.0)
    return np.asarray(1.0 + opacity * (share - 1.0))


def add_shadows(shadow: Array, alpha: Array) -> Array:
    """Return the alpha (n,) of pixels with their shadows, which are black.

    alpha (n,) is that without catchers.  Light that is added is not seen: only the mean of the
    channels of `shadow` (3, n) counts.
    """
    return alpha + (1.0 - alpha) * (1.0 - np.clip(shadow.mean(axis=0), 0.0, 1.0))
