"""numbers -> points, Context.  Hit points as shading sees them, without a scene."""

import numpy as np

from penumbra.core.geometry.surface import Points
from penumbra.core.shading import Arrival
from penumbra.core.shading.context import Context

F32 = np.float32


def vectors(*columns):
    """Unit vectors (3, N) float32, one for each argument."""
    array = np.array(columns, float).T
    return (array / np.linalg.norm(array, axis=0)).astype(F32)


def points(wo, normal=None, material=0, back=False, position=None, distance=1.0):
    """Points of the plane z = 0, seen from wo (3, N), with shading normals of their own or not."""
    count = wo.shape[1]
    geometric = np.repeat(F32([[0], [0], [1]]), count, axis=1)
    return Points(
        np.zeros((3, count), F32) if position is None else np.asarray(position, F32),
        np.negative(wo),
        geometric,
        geometric if normal is None else normal,
        np.broadcast_to(np.asarray(back, bool), count).copy(),
        np.zeros(count, F32),
        np.zeros(count, np.int32),
        np.broadcast_to(np.asarray(material, np.int32), count).copy(),
        np.broadcast_to(np.asarray(distance, F32), count).copy(),
    )


def seen_from(*cosines, **more):
    """Points seen from directions with these cosines."""
    cosine = np.array(cosines, float)
    zero = np.zeros_like(cosine)
    return points(np.stack([np.sqrt(1 - cosine**2), zero, cosine]).astype(F32), **more)


def context(at, index=None, **arrival):
    """The context of all points, or of those of `index`."""
    return Context(at, Arrival(**arrival), index)
