"""samples -> verdicts.  The tests of chance that the physics tests share, without scipy.

`significance` is the probability that one whole test function fails by chance; Sidak's correction
shares it out over the comparisons inside it.
"""

import math

import numpy as np

SIGNIFICANCE = 1e-4


def sidak(significance, tests):
    """Return the significance of each of `tests` that together have `significance`."""
    return -math.expm1(math.log1p(-significance) / tests)


def chi2_probability(counts, expected):
    """Return the probability of a worse fit, with rare bins pooled (Wilson and Hilferty 1931)."""
    counts, expected = np.ravel(counts).astype(float), np.ravel(expected).astype(float)

    # Where nothing may fall, nothing must have fallen.
    assert counts[expected == 0].sum() == 0, "samples where the pdf is 0"

    # Pool bins from the rarest on until each holds at least 5.
    order = np.argsort(expected)
    counts, expected = counts[order], expected[order]
    pool = int(np.searchsorted(expected, 5.0))
    while pool < len(expected) and 0 < expected[:pool].sum() < 5:
        pool += 1
    counts = np.append(counts[pool:], counts[:pool].sum())
    expected = np.append(expected[pool:], expected[:pool].sum())
    counts, expected = counts[expected > 0], expected[expected > 0]

    freedom = max(len(counts) - 1, 1)
    chi2 = ((counts - expected) ** 2 / expected).sum()
    spread = 2 / (9 * freedom)
    z = ((chi2 / freedom) ** (1 / 3) - (1 - spread)) / math.sqrt(spread)
    return 0.5 * math.erfc(z / math.sqrt(2))


def chi2_of_directions(wi, pdf, rows=16, columns=32, refine=8):
    """Return the chi2 probability that directions wi (3, n) were drawn from pdf(wi) [1/sr].

    The sphere is cut into cells of equal solid angle in z and phi; `pdf` is integrated over each by
    the midpoint rule.  Weights do not count: failed samples must be left out before, and are then
    the part of the pdf that integrates to less than 1.
    """
    z = np.clip(wi[2].astype(float), -1, 1)
    phi = np.arctan2(wi[1].astype(float), wi[0]) % (2 * np.pi)
    row = np.minimum(((z + 1) / 2 * rows).astype(int), rows - 1)
    column = np.minimum((phi / (2 * np.pi) * columns).astype(int), columns - 1)
    counts = np.bincount(row * columns + column, minlength=rows * columns)

    middle_z = (np.arange(rows * refine) + 0.5) / (rows * refine) * 2 - 1
    middle_phi = (np.arange(columns * refine) + 0.5) / (columns * refine) * 2 * np.pi
    zz, pp = np.meshgrid(middle_z, middle_phi, indexing="ij")
    radius = np.sqrt(1 - zz * zz)
    there = np.stack([radius * np.cos(pp), radius * np.sin(pp), zz]).reshape(3, -1)
    density = np.asarray(pdf(there.astype(np.float32)), float)
    cells = density.reshape(rows, refine, columns, refine).mean(axis=(1, 3))
    return chi2_probability(counts, cells * 4 * np.pi / (rows * columns) * z.size)


def t_probability(t, freedom):
    """Return the two-sided probability of Student's t, by integrating cos^(freedom - 1)."""
    theta = np.linspace(0, np.pi / 2, 20001)
    density = np.cos(theta) ** (freedom - 1)
    beyond = theta >= math.atan(abs(t) / math.sqrt(freedom))
    return float(density[beyond].sum() / density.sum())


def assert_same_mean(a, b, significance=SIGNIFICANCE, tests=1, bias=1e-6):
    """Assert that independent estimates a (n,) and b (n,) or a number have the same mean.

    A z-test with Student's t, as there are few estimates; `bias` is what rounding may do, relative.
    """
    a, b = np.asarray(a, float), np.asarray(b, float)
    difference = a.mean() - b.mean()
    variance = a.var(ddof=1) / a.size + (b.var(ddof=1) / b.size if b.size > 1 else 0.0)
    freedom = a.size - 1
    gap = max(abs(difference) - bias * max(abs(a.mean()), abs(b.mean())), 0.0)
    if gap == 0:
        return
    t = gap / math.sqrt(variance) if variance > 0 else math.inf
    probability = t_probability(t, freedom)
    assert probability > sidak(significance, tests), (
        f"{a.mean():.6g} against {b.mean():.6g}: a difference of {t:.1f} standard errors, "
        f"by chance once in {1 / max(probability, 1e-300):.3g}"
    )
