"""rays with times, Embree -> hits.  Queries through Embree's own C interface, 16 rays a call.

embreex asks for time 0 only.  A call from Python costs as much as tracing some rays, and they
run one after the other under the interpreter's lock: 140 to 200 ns a ray, 70 in embreex.  So only
rays that come near something that moves are sent here (see `moving`).
"""

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Scalar, Vec
from .part import FAR

WIDTH = 16

# Rows of RTCRay16 (embree4/rtcore_ray.h), each of 16 numbers, and of RTCHit16 behind it.
ORIGIN, NEAR, DIRECTION, TIME, REACH, MASK = 0, 3, 4, 7, 8, 9
RAY_ROWS = 12
U, V, PRIMITIVE, GEOMETRY, INSTANCE = 15, 16, 17, 18, 19
HIT_ROWS = 24  # instance levels and arrays, if Embree was built with any, take some more

_POINTER = ctypes.c_void_p


class Queries:
    """The two queries of an Embree library, called without letting go of the interpreter.

    To let go and come back for each 16 rays was slower with two threads as with one.
    """

    def __init__(self, library: ctypes.CDLL) -> None:
        held = ctypes.PyDLL(library._name, handle=library._handle)
        self._intersect, self._occluded = held.rtcIntersect16, held.rtcOccluded16
        for query in (self._intersect, self._occluded):
            query.argtypes, query.restype = (_POINTER,) * 4, None

    def closest(
        self, scene: int, origin: Vec, direction: Vec, far: Scalar | None, time: Scalar
    ) -> tuple[Scalar, Scalar, Scalar, Ids, Ids]:
        """Return t, u, v, primitive and instance (N,), both -1 for a miss, of rays (3, N)."""
        size = direction.shape[1]
        rows = _packed(origin, direction, far, time, HIT_ROWS)
        ids = rows.view(np.int32)
        ids[:, PRIMITIVE : INSTANCE + 1] = -1
        _run(self._intersect, scene, rows)
        t, u, v = (_unpacked(rows[:, row], size) for row in (REACH, U, V))
        primitive, instance = (_unpacked(ids[:, row], size) for row in (PRIMITIVE, INSTANCE))
        return t, u, v, primitive, instance

    def free(
        self, scene: int, origin: Vec, direction: Vec, far: Scalar, time: Scalar
    ) -> NDArray[np.int32]:
        """Return -1 for each of N rays that meets nothing before `far`, else 0."""
        rows = _packed(origin, direction, far, time, RAY_ROWS)
        _run(self._occluded, scene, rows)
        met = _unpacked(rows[:, REACH], direction.shape[1]) < 0  # -inf: occluded
        return np.subtract(met, 1, dtype=np.int32)


def _packed(
    origin: Vec, direction: Vec, far: Scalar | None, time: Scalar, height: int
) -> NDArray[np.float32]:
    """Return packets (P, height, 16), where Embree wants them; rays that fill up reach nowhere."""
    size = direction.shape[1]
    packets = -(-size // WIDTH)
    rows = _aligned(packets * height * WIDTH).reshape(packets, height, WIDTH)
    full = packets * WIDTH
    lanes = np.zeros((RAY_ROWS, full), F32)
    lanes[ORIGIN : ORIGIN + 3, :size] = origin
    lanes[DIRECTION : DIRECTION + 3, :size] = direction
    lanes[TIME, :size] = time
    lanes[REACH] = -1
    lanes[REACH, :size] = FAR if far is None else far
    lanes.view(np.int32)[MASK] = -1
    rows[:, :RAY_ROWS] = lanes.reshape(RAY_ROWS, packets, WIDTH).transpose(1, 0, 2)
    return rows


def _aligned(size: int) -> NDArray[np.float32]:
    """Return numbers where Embree reads 16 of them at once: at multiples of 64 bytes."""
    store = np.zeros(size + WIDTH, F32)
    first = (-store.ctypes.data % 64) // 4
    return store[first : first + size]


def _run(query: Any, scene: int, rows: NDArray[np.float32]) -> None:
    valid = _aligned(WIDTH).view(np.int32)
    valid[:] = -1
    lanes, start = valid.ctypes.data, rows.ctypes.data
    stride = rows.shape[1] * WIDTH * 4
    for packet in range(start, start + len(rows) * stride, stride):
        query(lanes, scene, packet, None)


def _unpacked(column: NDArray[Any], size: int) -> NDArray[Any]:
    return np.ascontiguousarray(column).reshape(-1)[:size]
