"""samples -> verdicts.  Chi2 of directions in cells that follow narrow lobes.

A hemisphere is cut by elevation and azimuth, at quantiles of the samples, so that the cells are as
narrow as the lobe; asymptotically this is as good as fixed cells (Watson 1957, "The chi-squared
goodness-of-fit test for normal distributions").  What lies beyond the outermost quantiles, at most
0.2 % of the samples, is not compared.
"""

import numpy as np

from tests.support.statistics import chi2_probability

QUANTILES = (5e-4, 5e-3, 0.03, *(np.arange(1, 10) / 10), 0.97, 1 - 5e-3, 1 - 5e-4)


def chi2_of_lobe(wi, pdf, tries, above, points=16):
    """Return the chi2 probability that `tries` draws from pdf left those of wi (3, n) on one side.

    wi are the directions that did not fail; only those above, or below, the surface count.  pdf
    gives [1/sr] for directions (3, m); it may integrate to less than 1.
    """
    side = 1.0 if above else -1.0
    x, y, z = wi[:, (wi[2] > 0) == above].astype(float)
    if x.size < 1000:
        return 1.0

    # Log of tan^2 of half the polar angle, linear near the axis; the azimuth from the far side
    tangent2 = (x * x + y * y) / (1 + side * z) ** 2
    scale = np.median(tangent2)
    height = np.log(tangent2 + scale)
    start = np.arctan2(y.sum(), x.sum()) - np.pi
    phi = (np.arctan2(y, x) - start) % (2 * np.pi)
    rows, columns = np.quantile(height, QUANTILES), np.quantile(phi, QUANTILES)
    counts, _, _ = np.histogram2d(height, phi, (rows, columns))

    # Integrate the pdf over the cells by Gauss's rule.
    (height, tall), (phi, wide) = _nodes(rows, points), _nodes(columns, points)
    height, phi = (each.ravel() for each in np.meshgrid(height, phi + start, indexing="ij"))
    tangent2 = np.exp(height) - scale
    sine = 2 * np.sqrt(tangent2) / (1 + tangent2)
    z = side * (1 - tangent2) / (1 + tangent2)
    there = np.stack([sine * np.cos(phi), sine * np.sin(phi), z]).astype(np.float32)
    density = np.asarray(pdf(there), float) * 2 / (1 + tangent2) ** 2 * (tangent2 + scale)
    mass = (density.reshape(tall.size, wide.size) * tall[:, None]) * wide
    mass = mass.reshape(len(rows) - 1, points, -1, points)
    inside = (mass > 0).all(axis=(1, 3))
    mass = mass.sum(axis=(1, 3))

    # Where the pdf has an edge, the cells are one, so that the errors of its steps cancel.
    counts = np.append(counts[inside], counts[~inside].sum())
    mass = np.append(mass[inside], mass[~inside].sum())
    return chi2_probability(counts, mass * tries)


def _nodes(borders, points):
    """Return nodes and weights (cells * points,) of Gauss's rule for each cell."""
    node, weight = np.polynomial.legendre.leggauss(points)
    half = np.diff(borders)[:, None] / 2
    return (borders[:-1, None] + half * (node + 1)).ravel(), (half * weight).ravel()
