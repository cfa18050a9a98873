"""keys, time -> places.  Objects that move, turn and deform while the shutter is open.

Time runs from 0, when the shutter opens, to 1.  An object's matrix is known at equal steps of it;
between them it turns along arcs: matrices are split into translation, rotation and an upper
triangle of scale and shear, rotations interpolated as quaternions (Shoemake 1985).  That is done
once, at so many steps that straight lines between them are as good, so that rays and Embree work
with straight lines only and agree to the last bits.  Vertices that move by themselves go straight
between their own steps (Cycles).

Bias: a point at the distance r from the axis of a turn is up to r LARGEST_TURN^2 / 8 inside of its
arc; more if an object turns by more than MOST_STEPS of these while the shutter is open.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Scalar, Vec, cross, normalize

LARGEST_TURN = 0.02  # [rad] between two steps: a chord leaves its arc by 5e-5 of the radius
MOST_STEPS = 128  # that Embree takes

Affines = NDArray[np.float64]  # (K, 3, 4)


@dataclass(frozen=True, eq=False)
class Tracks:
    """Numbers that change with time, W of each of M things, straight between equal steps.

    rows (R, W) float32; first (M,) is the row of a thing at time 0, steps (M,) int32 how many
    others follow it; 0 if it does not change.
    """

    rows: NDArray[np.float32]
    first: Ids
    steps: Ids

    def at(self, which: Ids, time: Scalar) -> NDArray[np.float32]:
        """Return the numbers (W, N) of things (N,) at times (N,) in [0, 1]."""
        row, rest = between(self.steps.take(which), time)
        row += self.first.take(which)
        before = self.rows.take(row, axis=0)
        after = self.rows.take(row + (self.steps.take(which) > 0), axis=0)
        after -= before
        after *= rest[:, None]
        before += after
        return np.ascontiguousarray(before.T)


def between(steps: Ids, time: Scalar) -> tuple[Ids, Scalar]:
    """Return the step (N,) that times (N,) are in, of `steps` (N,), and how much of it is over."""
    place = time * steps.astype(F32)
    step = np.minimum(place.astype(np.int32), np.maximum(steps - np.int32(1), np.int32(0)))
    place -= step.astype(F32)
    return step, place


def compile_tracks(tables: Sequence[NDArray[np.floating]]) -> Tracks:
    """Return tracks of M tables (steps + 1, W), one for each thing; an empty one is no thing."""
    counts = np.array([len(table) for table in tables], np.int32)
    first = (np.cumsum(counts) - counts).astype(np.int32)
    rows = np.concatenate([np.asarray(table, F32) for table in tables])
    return Tracks(np.ascontiguousarray(rows), first, np.maximum(counts - 1, 0))


@dataclass(frozen=True, eq=False)
class Shapes:
    """Vertices, or other vectors, of I instances in their own spaces, by steps of time.

    rows (R, 3) float32; of an instance, first (I,) is the row of its first vector at time 0, count
    (I,) the number of its vectors, after which those of the next step follow, steps (I,) the
    number of steps; base (I,) the number by which its first vector is known elsewhere.
    """

    rows: NDArray[np.float32]
    first: Ids
    count: Ids
    steps: Ids
    base: Ids

    def at(self, numbers: Sequence[Ids], instance: Ids, time: Scalar) -> list[Vec]:
        """Return vectors (3, N) known as each of `numbers` (N,), of instances at times (N,)."""
        first = self.first.take(instance)
        first -= self.base.take(instance)
        steps, changing = self.steps.take(instance), np.zeros(0, np.intp)
        if steps.any():
            count = self.count.take(instance)
            step, rest = between(steps, time)
            first += step * count
            changing = np.flatnonzero(steps)
            count, rest = count.take(changing), rest.take(changing)
        found = []
        for number in numbers:
            row = number + first
            out = np.ascontiguousarray(self.rows.take(row, axis=0).T)
            if changing.size:
                change = self.rows.take(row.take(changing) + count, axis=0).T - out[:, changing]
                out[:, changing] += change * rest
            found.append(out)
        return found


@dataclass(frozen=True, eq=False)
class Movement:
    """How I instances move: which do (I,), and where they are at any time.

    affines: of 12 numbers, from the spaces of objects to places about the local origin; vertices
    by their numbers in the triangle table; normals: vertex_normals by vertices, None where there
    are none, corner_normals by rows of the table's normals.
    """

    moves: NDArray[np.bool_]
    affines: Tracks
    vertices: Shapes
    vertex_normals: Shapes | None
    corner_normals: Shapes | None

    def places(self, vertices: Sequence[Ids], instance: Ids, time: Scalar) -> list[Vec]:
        """Return where several vertices (N,) of instances are (3, N) about the local origin [m]."""
        affine = self.affines.at(instance, time)
        return [applied(affine, each) for each in self.vertices.at(vertices, instance, time)]

    def normals(
        self, shapes: Shapes, numbers: Sequence[Ids], instance: Ids, time: Scalar
    ) -> NDArray[np.float32]:
        """Return the unit normals (3 n, N) known as n `numbers` (N,) in `shapes`."""
        turn = cofactors(self.affines.at(instance, time))
        found = shapes.at(numbers, instance, time)
        return np.concatenate([normalize(applied(turn, each, 3)) for each in found])


def applied(affine: NDArray[np.float32], point: Vec, width: int = 4) -> Vec:
    """Return points (3, N) after affines (12, N); with width = 3 directions after (9, N)."""
    out = np.empty(np.broadcast_shapes(affine[:3].shape, point.shape), F32)
    for row in range(3):
        a = affine[row * width : (row + 1) * width]
        np.multiply(a[0], point[0], out=out[row])
        out[row] += a[1] * point[1]
        out[row] += a[2] * point[2]
        if width == 4:
            out[row] += a[3]
    return out


def cofactors(affine: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what turns normals (9, N) as affines (12, N) carry surfaces, up to their length.

    A mirrored object keeps its outside.
    """
    m = affine.reshape(3, 4, -1)[:, :3]
    a, b, c = m[0], m[1], m[2]
    rows = [cross(b, c), cross(c, a), cross(a, b)]
    sign = np.copysign(F32(1), (rows[0] * a).sum(axis=0))
    out: NDArray[np.float32] = (np.stack(rows) * sign).reshape(9, -1)
    return out


def inverses(affine: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the affines (12, N) that lead back; 0 where there is no way back."""
    m = affine.reshape(3, 4, -1).astype(np.float64)
    a, b, c = m[0, :3], m[1, :3], m[2, :3]
    columns = np.stack([cross(b, c), cross(c, a), cross(a, b)], axis=1)
    determinant = (columns[:, 0] * a).sum(axis=0)
    columns *= np.where(determinant != 0, 1 / np.where(determinant != 0, determinant, 1), 0)
    shift = -(columns * m[:, 3]).sum(axis=1)
    return np.concatenate([columns, shift[:, None]], axis=1).reshape(12, -1).astype(F32)


# --- From keys to straight lines ----------------------------------------------------------------


def along_arcs(keys: Affines, least: int = 0) -> Affines:
    """Return affines (S + 1, 3, 4) at equal steps, between which straight lines will do.

    `keys` (K, 3, 4) are at equal steps; no turn between two of them is longer than half a circle.
    least: so many steps there are if anything but the place changes.
    """
    if len(keys) == 1:
        return keys
    turn, stretch = decompose(keys)
    cosine = np.abs((turn[1:] * turn[:-1]).sum(axis=1)).clip(0, 1)
    largest = 2 * np.arccos(cosine).max()
    each = max(1, min(int(np.ceil(largest / LARGEST_TURN)), MOST_STEPS // (len(keys) - 1)))
    if largest < 1e-5:
        each = 1
    is_fine = least > 0 and bool(np.ptp(keys[:, :, :3], axis=0).any())
    if is_fine:
        each = max(each, -(-least // (len(keys) - 1)))
    place = np.linspace(0, len(keys) - 1, each * (len(keys) - 1) + 1)
    key = np.minimum(place.astype(int), len(keys) - 2)
    rest = place - key
    rotation = _matrices(_slerp(turn[key], turn[key + 1], rest))
    part = rest[:, None, None]
    stretch = stretch[key] * (1 - part) + stretch[key + 1] * part
    shift = keys[key, :, 3:] * (1 - part) + keys[key + 1, :, 3:] * part
    fine = np.concatenate([rotation @ stretch, shift], axis=2)
    fine[::each] = keys

    if is_fine:
        return fine

    # What goes straight from end to end needs no steps between.
    part = np.linspace(0, 1, len(fine))[:, None, None]
    straight = fine[0] * (1 - part) + fine[-1] * part
    size = np.maximum(np.abs(fine).max(axis=(0, 2), keepdims=True), 1e-30)
    return fine[[0, -1]] if (np.abs(fine - straight) <= 1e-7 * size).all() else fine


def decompose(keys: Affines) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rotations of affines (K, 3, 4) as quaternions (K, 4), and what they turn.

    That is an upper triangle (K, 3, 3) of scale and shear, negative if the object is mirrored.
    Quaternions of neighbours are on one side.
    """
    turn, stretch = np.linalg.qr(keys[:, :, :3])
    sign = np.where(np.diagonal(stretch, axis1=1, axis2=2) < 0, -1.0, 1.0)
    turn, stretch = turn * sign[:, None, :], stretch * sign[:, :, None]
    mirror = np.where(np.linalg.det(turn) < 0, -1.0, 1.0)[:, None, None]
    turn, stretch = turn * mirror, stretch * mirror
    quaternion = np.stack([_quaternion(matrix) for matrix in turn])
    for number in range(1, len(quaternion)):
        if quaternion[number] @ quaternion[number - 1] < 0:
            quaternion[number] *= -1
    return quaternion, stretch


def _quaternion(m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the quaternion (w, x, y, z) of a rotation (3, 3): the eigenvector of Bar-Itzhack."""
    k = np.array(
        [
            [m.trace(), m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [0, m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [0, 0, m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1]],
            [0, 0, 0, m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    vector: NDArray[np.float64] = np.linalg.eigh(np.triu(k) + np.triu(k, 1).T)[1][:, -1]
    return vector


def _slerp(
    a: NDArray[np.float64], b: NDArray[np.float64], part: NDArray[np.float64]
) -> NDArray[np.float64]:
    angle = np.arccos((a * b).sum(axis=1).clip(-1, 1))[:, None]
    part = part[:, None]
    small = angle < 1e-6
    sine = np.where(small, 1.0, np.sin(angle))
    left = np.where(small, 1 - part, np.sin((1 - part) * angle) / sine)
    right = np.where(small, part, np.sin(part * angle) / sine)
    q = a * left + b * right
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return q


def _matrices(q: NDArray[np.float64]) -> NDArray[np.float64]:
    w, x, y, z = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)
