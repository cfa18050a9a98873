"""pixel sums of shadow catchers -> alpha.  The shadows that are seen where they are not.

A shadow catcher is seen only by how much darker it is than it would be alone.  So a pixel sums up
its light with everything around it (caught) and without (alone), and the opacity of all that is in
the pixel; catchers themselves are holes in its alpha.  The formula is Cycles'
(film_calculate_shadow_catcher_matte_with_shadow).
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def add_shadows(caught: Array, alone: Array, opacity: Array, alpha: Array) -> Array:
    """Return the alpha (n,) of pixels with their shadows, which are black.

    caught and alone (3, n) are sums of radiance; opacity (n,) is of the pixel, alpha (n,) of it
    without catchers.  Light that is added is not seen: only the mean of the channels counts.
    """
    is_lit = alone != 0
    share = np.where(is_lit, caught / np.where(is_lit, alone, 1.0), 1.0)
    share = 1.0 + opacity * (share - 1.0)
    shadow = 1.0 - np.clip(share.mean(axis=0), 0.0, 1.0)
    return alpha + (1.0 - alpha) * shadow
