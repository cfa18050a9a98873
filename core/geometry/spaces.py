"""instances -> Spaces.  The coordinate systems of objects, for shaders that ask for them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Scalar, Vec
from ..scene import Instance, Label, Particle
from .motion import Movement, applied, cofactors, inverses

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

    def at(self, movement: Movement, time: Scalar) -> "Spaces":
        """Return the spaces at times (N,), to be asked for N instances, some of which move."""
        own = {item.name: getattr(self, item.name) for item in fields(Spaces)}
        return _SpacesAt(**own, movement=movement, time=time)

    def in_texture_space(self, position: Vec, instance: Ids) -> Vec:
        """Return positions (3, N) in the texture spaces of their objects (N,).

        Of what moves, positions where it is in the frame itself.
        """
        return applied(_columns(self.to_texture, instance), position)

    def in_object(self, position: Vec, instance: Ids) -> Vec:
        """Return positions (3, N) in the spaces of their objects (N,)."""
        return applied(self._to_object(instance), position)

    def out_of_object(self, position: Vec, instance: Ids) -> Vec:
        """Return positions (3, N) in the spaces of objects (N,) about the local origin."""
        return applied(self._from_object(instance), position)

    def turn_in(self, direction: Vec, instance: Ids) -> Vec:
        """Return directions (3, N) in the spaces of their objects (N,), of any length."""
        return applied(_linear(self._to_object(instance)), direction, 3)

    def turn_out(self, direction: Vec, instance: Ids) -> Vec:
        """Return directions (3, N) in the spaces of objects (N,) in the world, of any length."""
        return applied(_linear(self._from_object(instance)), direction, 3)

    def carry_normals(self, normal: Vec, instance: Ids) -> Vec:
        """Return normals (3, N) of objects (N,) in the world, of any length."""
        return applied(self._normals(instance), normal, 3)

    def bring_normals(self, normal: Vec, instance: Ids) -> Vec:
        """Return normals (3, N) in the spaces of their objects (N,), of any length."""
        linear = _linear(self._from_object(instance)).reshape(3, 3, -1)
        return applied(linear.transpose(1, 0, 2).reshape(9, -1), normal, 3)

    def location(self, instance: Ids) -> Vec:
        """Return where the objects (N,) have their own origins (3, N) about the local one [m]."""
        return self._from_object(instance)[3::4]

    def _to_object(self, instance: Ids) -> NDArray[np.float32]:
        return _columns(self.to_object, instance)

    def _from_object(self, instance: Ids) -> NDArray[np.float32]:
        return _columns(self.from_object, instance)

    def _normals(self, instance: Ids) -> NDArray[np.float32]:
        return _columns(self.normals, instance)


@dataclass(frozen=True, eq=False, kw_only=True)
class _SpacesAt(Spaces):
    """The same for N instances that are asked for at times (N,)."""

    movement: Movement
    time: Scalar

    def _to_object(self, instance: Ids) -> NDArray[np.float32]:
        return self._moved(super()._to_object(instance), instance, inverses)

    def _from_object(self, instance: Ids) -> NDArray[np.float32]:
        return self._moved(super()._from_object(instance), instance, lambda affine: affine)

    def _normals(self, instance: Ids) -> NDArray[np.float32]:
        return self._moved(super()._normals(instance), instance, cofactors)

    def _moved(
        self,
        resting: NDArray[np.float32],
        instance: Ids,
        change: Callable[[NDArray[np.float32]], NDArray[np.float32]],
    ) -> NDArray[np.float32]:
        some = np.flatnonzero(self.movement.moves.take(instance))
        if some.size:
            affine = self.movement.affines.at(instance.take(some), self.time.take(some))
            resting[:, some] = change(affine)
        return resting


def _columns(rows: NDArray[np.float32], instance: Ids) -> NDArray[np.float32]:
    return np.ascontiguousarray(rows.take(instance, axis=0).T)


def _linear(affine: NDArray[np.float32]) -> NDArray[np.float32]:
    return affine.reshape(3, 4, -1)[:, :3].reshape(9, -1)


def facts_of(label: Label, to_world: NDArray[np.float64]) -> tuple[float, ...]:
    """Return the FACTS of an object whose affine is to_world (3, 4)."""
    return (
        *to_world[:, 3],
        *label.colour,
        *label.generated,
        *label.uv,
        0.0,
        label.alpha,
        label.index,
        label.random,
        float(np.linalg.det(to_world[:, :3]) < 0),
    )


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
        facts[:, number] = facts_of(instance.label, instance.to_world)
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
