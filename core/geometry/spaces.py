"""instances -> Spaces.  The coordinate systems of objects, for shaders that ask for them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Vec
from ..scene import Instance, Particle

# Rows of `Spaces.facts`, what shaders may ask of an object besides: first of vectors, then numbers
LOCATION, COLOUR, ORCO, UV = 0, 3, 6, 9
ALPHA, NUMBER, RANDOM, MIRRORED = 12, 13, 14, 15
FACTS = 16

# Rows of `Spaces.particles`: first of vectors, then numbers
P_LOCATION, P_VELOCITY, P_TURN, P_INDEX, P_AGE, P_LIFETIME, P_SIZE = 0, 3, 6, 9, 10, 11, 12


@dataclass(frozen=True, eq=False)
class Spaces:
    """Matrices of I instances, a row each, float32.

    to_texture (I, 12): from positions about the local origin to the object's texture space, whose
    box is -1 to 1; to_object and from_object (I, 12): between positions about the local origin
    and the object's own; normals (I, 9): from normals of the object to those of the world, any
    length; facts (FACTS, I): see LOCATION ... MIRRORED; particles (13, I): see P_LOCATION ...
    P_SIZE, None where no particle shows anything.
    """

    to_texture: NDArray[np.float32]
    to_object: NDArray[np.float32]
    from_object: NDArray[np.float32]
    normals: NDArray[np.float32]
    facts: NDArray[np.float32]
    particles: NDArray[np.float32] | None = None

    def in_texture_space(self, position: Vec, instance: Ids) -> Vec:
        """Return positions (3, N) in the texture spaces of their objects (N,)."""
        return _applied(self.to_texture.take(instance, axis=0), position, 4)

    def in_object(self, position: Vec, instance: Ids) -> Vec:
        """Return positions (3, N) in the spaces of their objects (N,)."""
        return _applied(self.to_object.take(instance, axis=0), position, 4)

    def out_of_object(self, position: Vec, instance: Ids) -> Vec:
        """Return positions (3, N) in the spaces of objects (N,) about the local origin."""
        return _applied(self.from_object.take(instance, axis=0), position, 4)

    def turn_in(self, direction: Vec, instance: Ids) -> Vec:
        """Return directions (3, N) in the spaces of their objects (N,), of any length."""
        return _applied(_linear(self.to_object).take(instance, axis=0), direction, 3)

    def turn_out(self, direction: Vec, instance: Ids) -> Vec:
        """Return directions (3, N) in the spaces of objects (N,) in the world, of any length."""
        return _applied(_linear(self.from_object).take(instance, axis=0), direction, 3)

    def carry_normals(self, normal: Vec, instance: Ids) -> Vec:
        """Return normals (3, N) of objects (N,) in the world, of any length."""
        return _applied(self.normals.take(instance, axis=0), normal, 3)

    def bring_normals(self, normal: Vec, instance: Ids) -> Vec:
        """Return normals (3, N) in the spaces of their objects (N,), of any length."""
        turned = self.from_object.reshape(-1, 3, 4)[:, :, :3].transpose(0, 2, 1)
        return _applied(turned.reshape(-1, 9).take(instance, axis=0), normal, 3)


def _linear(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    return rows.reshape(-1, 3, 4)[:, :, :3].reshape(-1, 9)


def _applied(rows: NDArray[np.float32], vector: Vec, width: int) -> Vec:
    columns = np.ascontiguousarray(rows.T)
    out = np.empty((3, columns.shape[1]), F32)
    for row in range(3):
        a = columns[row * width : (row + 1) * width]
        np.multiply(a[0], vector[0], out=out[row])
        out[row] += a[1] * vector[1]
        out[row] += a[2] * vector[2]
        if width == 4:
            out[row] += a[3]
    return out


def compile_spaces(instances: Sequence[Instance], origin: NDArray[np.float64]) -> Spaces:
    """Return the spaces of instances; positions will be about `origin` (3,) [m].

    A flattened object has no way back: its texture space is that of the next best one.
    """
    to_texture = np.zeros((len(instances), 3, 4))
    to_object, from_object = np.zeros_like(to_texture), np.zeros_like(to_texture)
    normals = np.zeros((len(instances), 3, 3))
    facts = np.zeros((FACTS, len(instances)), F32)
    for number, instance in enumerate(instances):
        linear = instance.to_world[:, :3]
        inverse = np.linalg.pinv(linear)
        middle, size = instance.mesh.texture_space
        scale = 1.0 / np.where(np.abs(size) > 0, size, 1.0)
        shift = inverse @ (origin - instance.to_world[:, 3])
        to_texture[number, :, :3] = inverse * scale[:, None]
        to_texture[number, :, 3] = (shift - middle) * scale
        to_object[number, :, :3], to_object[number, :, 3] = inverse, shift
        from_object[number, :, :3] = linear
        from_object[number, :, 3] = instance.to_world[:, 3] - origin
        normals[number] = inverse.T
        label = instance.label
        facts[:, number] = (
            *instance.to_world[:, 3],
            *label.colour,
            *label.generated,
            *label.uv,
            0.0,
            label.alpha,
            label.index,
            label.random,
            np.linalg.det(linear) < 0,
        )
    matrices = (to_texture, to_object, from_object)
    a, b, c = (matrix.reshape(-1, 12).astype(F32) for matrix in matrices)
    particles = _particles(instances)
    return Spaces(a, b, c, normals.reshape(-1, 9).astype(F32), facts, particles)


def _particles(instances: Sequence[Instance]) -> NDArray[np.float32] | None:
    found = [instance.label.particle for instance in instances]
    if not any(found):
        return None
    none = Particle()
    rows = [
        (*p.location, *p.velocity, *p.angular_velocity, p.index, p.age, p.lifetime, p.size)
        for p in (particle or none for particle in found)
    ]
    return np.ascontiguousarray(np.array(rows, F32).T)
