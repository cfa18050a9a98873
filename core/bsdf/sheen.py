"""closure, wo, u -> wi, weight, pdf.  Dust and fuzz: a volume of microfibres on the surface.

What such a volume scatters, all orders together, is close to a cosine lobe under a linear map
that leans and flattens it.  Seen from wo, x pointing to the viewer's side,

    f cos = albedo / pi  z (a / |M wi|^2)^2,     M wi = (a x + b z, a y, z)

with a, b and the albedo from a table by (cosine of the viewer, roughness): `prepare`.  The albedo
belongs to the closure's weight; the closure itself sends back all light.  The table was measured
from Cycles, which sees nodes 1/31 apart, and interpolates (tools/sheen_table.py).
Source: Zeltner, Burley and Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly
Transformed Cosines"; the maps, Heitz et al. 2016, "Real-Time Polygonal-Light Shading with LTCs".
"""

from pathlib import Path

import numpy as np

from ..arrays import F32, INV_PI, Ids, Scalar, Vec
from ..sampling import warp
from .kinds import DIFFUSE

NAME = "sheen"
PARAMETERS = {"a": 1, "b": 1}
IS_DELTA = False
RAY_KIND = DIFFUSE
TRANSMITS = False
WEIGHT_IN_WI_Z = False
DRAWS = 2

# (a, b, albedo) by roughness and cosine, both 0 to 1: (3, NODES, NODES)
TABLE = np.load(Path(__file__).parent / "tables" / "sheen.npy")
NODES = TABLE.shape[1]
LEAST_ROUGHNESS, LEAST = F32(1e-3), F32(1e-5)
TINY = F32(1e-30)


def prepare(roughness: Scalar, cos_o: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Return the parameters a, b and the albedo (N,) seen from cosines cos_o (N,).

    One roughness (1,) for all costs half as much as many (N,).  An albedo of 0 is a lobe too weak
    to matter, as in Cycles.
    """
    row, between_rows = _place(np.maximum(roughness, LEAST_ROUGHNESS))
    column, between = _place(cos_o)
    if row.size == 1:
        rows = TABLE[:, row[0]] + (TABLE[:, row[0] + 1] - TABLE[:, row[0]]) * between_rows
        lobe = _mix(rows, column, between)
    else:
        table = TABLE.reshape(3, -1)
        column = column + row * NODES
        lobe = _mix(table, column, between)
        lobe += (_mix(table, column + NODES, between) - lobe) * between_rows
    a, b, albedo = lobe
    albedo *= (a >= LEAST) & (albedo >= LEAST)
    return np.maximum(a, LEAST), b, albedo


def _place(x: Scalar) -> tuple[Ids, Scalar]:
    """Return the node (N,) before x (N,), which is cut to 0..1, and the way (N,) to the next."""
    place = np.clip(x, F32(0), F32(1)) * F32(NODES - 1)
    node = np.minimum(place.astype(np.int32), NODES - 2)
    place -= node.astype(np.float32)
    return node, place


def _mix(table: Vec, node: Ids, t: Scalar) -> Vec:
    """Return table (3, n) between the columns `node` (N,) and the next ones."""
    low = table.take(node, axis=1)
    low += (table.take(node + 1, axis=1) - low) * t
    return low


def evaluate(parameters: tuple[Scalar, ...], wo: Vec, wi: Vec) -> tuple[Scalar, Scalar]:
    """Return f cos (N,) and the same as pdf (N,) [1/sr]: light is followed where it goes."""
    cos, sin = _towards(wo)
    value = _density(parameters, wi[0] * cos + wi[1] * sin, wi[2])
    return value, value


def sample(
    parameters: tuple[Scalar, ...], wo: Vec, u: Scalar, v: Scalar, w: None = None
) -> tuple[Vec, None, Scalar]:
    """Draw wi (3, N) in proportion to f cos; the weight is exactly 1."""
    a, b = parameters

    # A cosine lobe through the inverse map
    x, y, z = warp.cosine_hemisphere(u, v)
    x -= b * z
    z *= a
    length = F32(1) / np.sqrt(x * x + y * y + z * z)
    x, y, z = x * length, y * length, z * length

    # x turns towards the viewer's side
    cos, sin = _towards(wo)
    wi = np.empty((3, z.size), F32)
    np.subtract(x * cos, y * sin, out=wi[0])
    np.add(x * sin, y * cos, out=wi[1])
    wi[2] = z
    return wi, None, _density(parameters, x, z)


def _towards(wo: Vec) -> tuple[Scalar, Scalar]:
    """Return cosine and sine (N,) of the viewer's azimuth; x where it has none."""
    length = np.sqrt(wo[0] * wo[0] + wo[1] * wo[1])
    straight = length < TINY
    length += straight
    return wo[0] / length + straight, wo[1] / length


def _density(parameters: tuple[Scalar, ...], x: Scalar, z: Scalar) -> Scalar:
    """Return f cos (N,) of unit directions with these x and z (N,)."""
    a, b = parameters
    leaning = a * x + b * z
    squared = z * z
    squared += leaning * leaning + a * a * np.maximum(F32(1) - x * x - squared, F32(0))
    value = a / squared
    value *= value
    value *= np.maximum(z, F32(0)) * INV_PI
    return value
