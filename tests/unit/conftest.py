"""pytest -> the one statistic of the unit tests."""

import numpy as np
import pytest


@pytest.fixture
def chi2():
    """Return a function (counts, expected) -> chi2 as a standard normal z.

    Source: Wilson and Hilferty 1931.  z > 4 happens by chance once in 30 000 tests.
    """

    def z(counts, expected):
        counts, expected = np.ravel(counts).astype(float), np.ravel(expected).astype(float)
        assert expected.min() >= 5, "too few expected in a bin for chi2"
        assert abs(counts.sum() / expected.sum() - 1) < 1e-3, "samples outside all bins"
        freedom = counts.size - 1
        spread = 2 / (9 * freedom)
        ratio = ((counts - expected) ** 2 / expected).sum() / freedom
        return (ratio ** (1 / 3) - (1 - spread)) / spread**0.5

    return z
