"""rays, lamps -> Context.  What a lamp's shader may read of where rays meet it."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, INV_PI, Ids, Index, Scalar, Vec, dot, normalize
from ..geometry.attributes import VECTOR, Asked
from ..geometry.spaces import FACTS, facts_of
from ..scene import ACTIVE_UV, Lamp
from .context import NEVER, NOWHERE, Arrival, Context

# How lamps face the rays that meet them: as what always faces the ray, a ball, or a plane
DISK, BALL, PLANE = 0, 1, 2

# Rows of a lamp's numbers: the affine to the lamp's own space, its linear part back, its normal,
# and how far its texture spans
TO_LOCAL, TO_WORLD, CENTRE, NORMAL, SPAN = 0, 12, 21, 24, 27

# Row of a lamp's facts, behind those that it has in common with what has a mesh
IS_OBJECT = FACTS


def compile_row(lamp: Lamp, origin: NDArray[np.float64]) -> tuple[list[float], int]:
    """Return the numbers of a lamp, places relative to `origin` (3,), and how it faces rays."""
    linear, centre = lamp.to_world[:, :3], lamp.to_world[:, 3] - origin
    inverse = np.linalg.pinv(linear)
    normal = -linear[:, 2] / max(float(np.linalg.norm(linear[:, 2])), 1e-30)
    facing, span = DISK, (1.0, 1.0)
    if lamp.kind == "AREA":
        facing, span = PLANE, (1.0 / max(lamp.size[0], 1e-30), 1.0 / max(lamp.size[1], 1e-30))
    elif lamp.kind == "SPOT":
        half = 0.5 / np.tan(0.5 * lamp.spot_angle)
        span = (half, half)
    elif lamp.kind == "SUN":
        half = 0.5 / max(float(np.sin(0.25 * lamp.angle)), 1e-30) if lamp.angle > 0 else 0.0
        span = (half, half)
    if lamp.kind in ("POINT", "SPOT") and lamp.radius > 0.0 and not lamp.soft_falloff:
        facing = BALL
    row = [*inverse.ravel(), *(inverse @ -centre), *linear.ravel(), *centre, *normal, *span]
    return [float(value) for value in row], facing


def facts_of_lamp(lamp: Lamp) -> list[float]:
    """Return the facts of a lamp, one more than FACTS."""
    to_world = lamp.to_world if lamp.is_object else np.eye(3, 4)
    return [*facts_of(lamp.label, to_world), float(lamp.is_object)]


class LampContext(Context):
    """What a program may read of n rays of unit directions that meet lamps.

    rows (29, n) or (29, 1), facing (n,) or (1,): of `compile_row`; facts (FACTS + 1, L) of all
    lamps, of which these are `which` (n,) or (1,); where (3, n): places on the lamps about the
    local origin, direction (3, n) and length (n,) of the rays; of all N rays that `arrival` is
    about these are `index`, None for all.
    """

    def __init__(
        self,
        rows: NDArray[np.float32],
        facing: NDArray[np.int32],
        facts: NDArray[np.float32],
        which: Ids,
        kind: str,
        where: Vec,
        direction: Vec,
        length: Scalar,
        arrival: Arrival,
        index: Index | None,
        origin: Vec,
    ) -> None:
        self.arrival, self.index, self.place = arrival, index, NOWHERE
        self._rows, self._facing, self._kind = rows, facing, kind
        self._facts, self._which = facts, which
        self._where, self.direction, self._origin = where, direction, origin
        self.wo = np.negative(direction)
        self.length = self.travelled = np.full(1, NEVER) if kind == "SUN" else length

    @property
    def size(self) -> int:
        """The number of rays."""
        return self.direction.shape[1]

    @cached_property
    def position(self) -> Vec:
        """Places (3, n) in the world [m]; of suns where their light goes."""
        return self.wo if self._kind == "SUN" else self._where + self._origin

    @cached_property
    def outward(self) -> Vec:
        """Normals (3, n) of the lamps, on the side that shines."""
        rows, facing = self._rows, self._facing
        if (facing == DISK).all():
            return self.wo
        if (facing == PLANE).all():
            plane: Vec = np.broadcast_to(rows[NORMAL : NORMAL + 3], self.wo.shape)
            return plane
        ball = normalize(self._where - rows[CENTRE : CENTRE + 3])
        return np.where(facing == BALL, ball, self.wo)

    @cached_property
    def back(self) -> NDArray[np.bool_]:
        """Which rays meet lamps from inside (n,)."""
        return dot(self.outward, self.wo) < 0

    @cached_property
    def normal(self) -> Vec:
        """Normals (3, n) on the viewer's side."""
        return np.where(self.back, np.negative(self.outward), self.outward)

    @cached_property
    def geometric(self) -> Vec:
        """The same: lamps have no other normals."""
        return self.normal

    @cached_property
    def valid_normal(self) -> Vec:
        """The same: nothing is mirrored."""
        return self.normal

    def attribute(self, asked: Asked) -> Vec | None:
        """Return what lamps have for a UV map (3, n); they carry nothing else."""
        return self.parametric if asked == (ACTIVE_UV, VECTOR) else None

    def beside(self, axis: int, width: np.float32) -> Context:
        """Return the same: nothing of a lamp has a slope."""
        return self

    @cached_property
    def in_object(self) -> Vec:
        """Places (3, n) in the lamp's own space, if it has one, else in the world."""
        if self.is_object is None:
            return self._in_own_space
        return np.where(self.is_object, self._in_own_space, self.position)

    @cached_property
    def _in_own_space(self) -> Vec:
        where = self.position if self._kind == "SUN" else self._where
        return self._to_local(where) + self._rows[TO_LOCAL + 9 : TO_LOCAL + 12]

    @property
    def generated(self) -> Vec:
        """The same: lamps have no box (Cycles)."""
        return self.in_object

    @property
    def is_object(self) -> NDArray[np.bool_] | None:
        """Which lamps (n,) or (1,) have a space of their own, None if all have."""
        facts = self._facts[IS_OBJECT]
        return None if facts.all() else facts.take(self._which) > 0

    def fact(self, row: int, is_vector: bool = False) -> NDArray[np.float32]:
        """Return what is known of the lamps, (n,) or (3, n), see `geometry.spaces`."""
        facts = self._facts
        return (facts[row : row + 3] if is_vector else facts[row]).take(self._which, axis=-1)

    @cached_property
    def reflection(self) -> Vec:
        """Directions (3, n) of the mirrored viewer's rays; what is no object mirrors nothing."""
        mirrored = super().reflection
        return mirrored if self.is_object is None else np.where(self.is_object, mirrored, self.wo)

    @cached_property
    def normal_in_object(self) -> Vec:
        """Normals (3, n) in the lamp's own space."""
        return self.into_object(self.normal, "NORMAL")

    @cached_property
    def parametric(self) -> Vec:
        """Coordinates (3, n) on the lamp's surface or in its cone, 0 to 1; the third is 0."""
        u_span, v_span = self._rows[SPAN], self._rows[SPAN + 1]
        if self._kind == "POINT":
            x, y, z = self._to_local(self.outward)
            long = np.maximum(np.sqrt(x * x + y * y + z * z), F32(1e-30))
            u = F32(0.5) - np.arctan2(x, y) * F32(0.5) * INV_PI
            v = F32(1) - np.arccos(np.clip(z / long, F32(-1), F32(1))) * INV_PI
        elif self._kind == "AREA":
            x, y, _ = self._in_own_space
            u = np.clip(x * u_span, F32(-0.5), F32(0.5)) + F32(0.5)
            v = np.clip(y * v_span, F32(-0.5), F32(0.5)) + F32(0.5)
        elif self._kind == "SPOT":
            x, y, z = self._to_local(self.wo)
            below = np.where(z < 0, np.minimum(z, F32(-1e-6)), np.maximum(z, F32(1e-6)))
            u, v = F32(0.5) - x / below * u_span, F32(0.5) - y / below * v_span
        else:
            x, y, _ = self._to_local(self.direction)
            apart = self.direction - self._rows[NORMAL : NORMAL + 3]
            scale = u_span / np.maximum(np.sqrt(dot(apart, apart)), F32(1e-30))
            u, v = x * scale + F32(0.5), y * scale + F32(0.5)
        return np.stack(np.broadcast_arrays(u, v, np.zeros(1, F32)))

    def into_object(self, vector: Vec, kind: str) -> Vec:
        """Return a POINT, VECTOR or NORMAL (3, n) or (3, 1) of the world in the lamps' spaces."""
        if kind == "NORMAL":
            return normalize(_turned(self._rows[TO_WORLD : TO_WORLD + 9], vector, (1, 3)))
        if kind == "VECTOR":
            return self._to_local(vector)
        return self._to_local(vector - self._origin) + self._rows[TO_LOCAL + 9 : TO_LOCAL + 12]

    def out_of_object(self, vector: Vec, kind: str) -> Vec:
        """Return a POINT, VECTOR or NORMAL (3, n) or (3, 1) of the lamps' spaces in the world."""
        if kind == "NORMAL":
            return normalize(_turned(self._rows[TO_LOCAL : TO_LOCAL + 9], vector, (1, 3)))
        turned = _turned(self._rows[TO_WORLD : TO_WORLD + 9], vector, (3, 1))
        if kind == "VECTOR":
            return turned
        return turned + self._rows[CENTRE : CENTRE + 3] + self._origin

    def _to_local(self, vector: Vec) -> Vec:
        """Return directions (3, n) of the world in the lamp's own space."""
        return _turned(self._rows[TO_LOCAL : TO_LOCAL + 9], vector, (3, 1))


def _turned(m: NDArray[np.float32], vector: Vec, steps: tuple[int, int]) -> Vec:
    """Return vectors times matrices (9, n), whose rows and columns are so many steps apart."""
    down, along = steps
    x, y, z = vector
    starts = (row * down for row in range(3))
    return np.stack([m[k] * x + m[k + along] * y + m[k + 2 * along] * z for k in starts])
