"""numbers -> arrays.  The array conventions of the whole core, and the few operations on them.

In flight, vectors and colours are (3, N) and scalars (N,), float32 and C-contiguous; ids are
int32.  Rows of a (3, N) array are contiguous, so every operation below streams through memory.
"""

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

Vec = NDArray[np.float32]  # (3, N)
Scalar = NDArray[np.float32]  # (N,)
Ids = NDArray[np.int32]  # (N,)
Index = NDArray[np.intp]  # (M,), made by flatnonzero
Matrix = NDArray[np.float64]  # (3, 4), affine

F32 = np.float32
EPSILON = F32(2.0**-24)  # half the distance from 1 to the next float32
ONE_BELOW = F32(1.0 - 2.0**-24)  # the largest float32 below 1
INV_PI = F32(1.0 / np.pi)
TWO_PI = F32(2.0 * np.pi)

_TURNED = 1 << 12  # rows of a table that are turned into columns at once

CHECKED = os.environ.get("PENUMBRA_CHECK", "0") not in ("", "0")


def dot(a: Vec, b: Vec) -> Scalar:
    """Return the dot products (N,) of two arrays of vectors (3, N)."""
    if a.shape == b.shape:
        # On rows, unlike on columns, einsum streams: one call instead of five, the same bits.
        return np.einsum("ij,ij->j", a, b)  # noqa: TID251
    if a.ndim == b.ndim == 2 and a.shape[1] == 1:
        return np.einsum("i,ij->j", a[:, 0], b)  # noqa: TID251
    total = a[0] * b[0]
    total += a[1] * b[1]
    total += a[2] * b[2]
    return total


def add_scaled(out: Vec, a: Vec, scale: Scalar) -> Vec:
    """Add vectors (3, N) or (3, 1) times scale (N,) to `out` (3, N) in place, and return it.

    Axis by axis: the product of one is used while it is in the caches.
    """
    for row, axis in zip(out, a, strict=True):
        row += axis * scale
    return out


def cross(a: Any, b: Any) -> Any:
    """Return the cross products (3, N) of two arrays of vectors (3, N)."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


def take(array: Any, index: Index) -> Any:
    """Return columns `index` of an array (..., N) that may be absent."""
    return None if array is None else array.take(index, axis=-1)


def repeated(vector: Vec, size: int) -> Vec:
    """Return vectors (3, N) as they are, one (3, 1) as a view (3, size) that is not written to."""
    if vector.shape[1] == size:
        return vector
    # What np.broadcast_to does, which takes ten times as long to do it
    vector = np.ascontiguousarray(vector)
    return np.ndarray((3, size), vector.dtype, vector, 0, (vector.itemsize, 0))


def gather_rows(
    table: NDArray[Any], index: Index | Ids, columns: int | None = None
) -> NDArray[Any]:
    """Return rows `index` (N,) of a table (F, k), or their first `columns`, as columns (k, N).

    What is gathered together stands together in memory; it is turned over before it leaves the
    caches: all at once, large batches took more than twice as long.
    """
    out = np.empty((columns or table.shape[1], index.size), table.dtype)
    for start in range(0, index.size, _TURNED):
        part = slice(start, start + _TURNED)
        out[:, part] = table.take(index[part], axis=0).T[:columns]
    return out


def normalize(a: Vec) -> Vec:
    """Scale vectors (3, N) to unit length in place and return them; a zero vector stays zero."""
    length = dot(a, a)
    np.sqrt(length, out=length)
    np.maximum(length, F32(1e-30), out=length)
    np.divide(a, length, out=a)
    return a


def unit(vector: Vec, length: Scalar) -> Vec:
    """Return vectors (3, N) divided by their lengths (N,); a zero vector stays zero."""
    out = np.empty_like(vector)
    np.divide(vector, np.maximum(length, F32(1e-30)), out=out)
    return out


def frame(normal: Vec) -> tuple[Vec, Vec]:
    """Return two unit vectors (3, N) that make a right-handed frame with the unit `normal`.

    Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited", listing 3.
    """
    x, y, z = normal
    sign = np.copysign(F32(1), z)
    a = F32(-1) / (sign + z)
    b = x * y * a
    tangent, bitangent = np.empty_like(normal), np.empty_like(normal)
    tangent[0] = x * x * a * sign + F32(1)
    tangent[1] = sign * b
    tangent[2] = -sign * x
    bitangent[0] = b
    bitangent[1] = y * y * a + sign
    bitangent[2] = -y
    return tangent, bitangent


def check(stage: str, **arrays: Any) -> None:
    """With PENUMBRA_CHECK=1, assert that in-flight arrays are finite float32 of shape (..., N).

    Raises: FloatingPointError or TypeError that names the stage and the array.
    """
    if not CHECKED:
        return
    for name, array in arrays.items():
        if array is None:
            continue
        if array.dtype.kind == "f" and array.dtype != np.float32:
            raise TypeError(f"{stage}: {name} is {array.dtype}, expected float32")
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            bad = np.argwhere(~np.isfinite(array))[0]
            raise FloatingPointError(f"{stage}: {name}{tuple(int(i) for i in bad)} is not finite")
