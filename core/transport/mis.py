"""pdf, pdf -> weight.  How two ways of finding the same light share it.

Source: Veach and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering",
section 3.4 (power heuristic with the exponent 2).
"""

import numpy as np

from ..arrays import F32, Scalar


def power_weight(own: Scalar, other: Scalar) -> Scalar:
    """Return the weight (N,) of a sample with density `own`, which `other` could have found too.

    1 where `own` is 0 (this way has no rival: a light without extent) or infinite; the weights of
    both ways add up to 1.  No square overflows.
    """
    ratio = other / np.maximum(own, F32(1e-30))
    np.minimum(ratio, F32(1e18), out=ratio)
    ratio *= ratio
    ratio += F32(1)
    weight = np.reciprocal(ratio, out=ratio)
    return np.where(own > 0, weight, F32(1))
