"""Cycles' Sheen BSDF -> core/bsdf/tables/sheen.npy.  The sheen's lobes, measured and fitted.

Run inside an environment with bpy, from the checkout: python -m tools.sheen_table
Squares are lit from many directions for each (cosine of the viewer, roughness).  The lobe that
`core/bsdf/sheen.py` describes is, for z / f, the square of a form that is linear in three unknowns,
so that least squares in float64 finds them: residuals are 2e-4 at most, most of them 1e-6.
Cycles interpolates between 32 x 32 nodes.  Those it does not show, at cosine and roughness 0 and
where it drops a lobe that is too weak, follow from what it shows halfway to the next node.
"""

import os
import sys

import numpy as np

from tests.support import planes

from .environment import ROOT

NODES = 32
SUNS = 96
BETWEEN = (0.0, 0.04, 0.25, 0.5, 0.75, 0.9)  # places between two nodes where lobes are measured
WEAK = 1e-7  # of f cos, where float32 tells too little


def spiral(count):
    """Return directions (3, count) that cover the upper hemisphere evenly."""
    index = np.arange(count) + 0.5
    return planes.polar(1 - index / count, index * np.pi * (3 - np.sqrt(5)))


def fit(wi, value):
    """Return (a, b, albedo) of the lobe with f cos = value (S,) at wi (3, S), and the residual."""
    x, _, z = wi
    good = np.flatnonzero((z > 0.02) & (value > WEAK))
    if good.size < 8:
        return np.full(3, np.nan), 0.0
    x, z, value = x[good], z[good], value[good]

    # sqrt(z / (pi f)) = (a^2 (1 - z^2) + 2 a b x z + (b^2 + 1) z^2) / (a sqrt(albedo))
    root = np.sqrt(z / (np.pi * value))
    terms = np.stack([1 - z * z, x * z, z * z], axis=1) / root[:, None]
    p, q, r = np.linalg.lstsq(terms, np.ones(good.size))[0]
    albedo = 1 / (p * r - q * q / 4)
    residual = np.abs(1 / (terms @ (p, q, r)) ** 2 - 1).max()
    return np.array([p * np.sqrt(albedo), q * np.sqrt(albedo) / 2, albedo]), residual


def measure():
    """Return lobes (3, roughness, cosine) at all nodes and places between, NaN where dropped."""
    cosine = np.arange(NODES) / (NODES - 1)
    cosine[0] = 0.5 / (NODES - 1)
    rows = np.add.outer(np.arange(NODES - 1), BETWEEN).ravel() / (NODES - 1)
    rows = np.append(rows, 1.0)
    rows[0] = 1e-3  # the least that Cycles takes
    views, suns = planes.polar(cosine, 0.0), spiral(SUNS)
    kind = "ShaderNodeBsdfSheen"
    sheens = [(kind, {"Roughness": x, "Color": (1.0, 1.0, 1.0, 1.0)}) for x in rows.tolist()]
    (value,) = planes.radiance(sheens, views, suns)[:1]
    wi = planes.local(views, suns)

    # Seen along the normal, the lobe has no side: Cycles leans it towards (1, -1, 0).
    wi[0, :, -1] = (wi[0, :, -1] - wi[1, :, -1]) / np.sqrt(2)
    lobes, worst = np.empty((3, rows.size, NODES)), 0.0
    for row in range(rows.size):
        for column in range(NODES):
            lobes[:, row, column], residual = fit(wi[:, :, column], value[:, row, column])
            worst = max(worst, residual)
    print(f"worst relative residual {worst:.1e}")
    return lobes


def nodes(lobes):
    """Return the nodes (3, NODES, NODES) of which the measured lobes are interpolations."""
    table = np.zeros((3, NODES, NODES))
    table[:, -1] = lobes[:, -1]
    for row in range(NODES - 2, -1, -1):
        here = np.full((3, NODES), np.nan)
        for place, between in enumerate(BETWEEN):
            t = 1e-3 * (NODES - 1) if row == 0 and place == 0 else between
            guess = (lobes[:, row * len(BETWEEN) + place] - t * table[:, row + 1]) / (1 - t)
            here = np.where(np.isnan(here), guess, here)
        table[:, row] = np.nan_to_num(here)
    table[:, :, 0] = 2 * table[:, :, 0] - table[:, :, 1]
    return table


if __name__ == "__main__":
    path = ROOT / "core" / "bsdf" / "tables" / "sheen.npy"
    np.save(path, nodes(measure()).astype(np.float32))
    sys.stdout.flush()
    os._exit(0)  # bpy may crash when it is unloaded
