"""lamps, rays -> colour.  The shaders of lamps that are no constant, where rays meet them.

Cycles asks them without telling what kind of ray it is, for light samples and for rays that run
into a lamp alike, and counts one bounce more.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec
from ..scene import Lamp, Note
from .context import Arrival
from .graph import Library
from .lamp_context import LampContext, compile_row, facts_of_lamp
from .nodes import LAMP_NODES
from .program import Program, merge, structure
from .rules import Rules
from .surfaces import compile_shader
from .values import Array, Value, walk

# How far from a lamp its shader is looked at, to guess how bright it is [m]
TYPICAL_DISTANCE = 3.0


@dataclass(frozen=True, eq=False)
class Glow:
    """A program of lamps' shaders, and the value that is their colour."""

    program: Program
    value: Value
    order: tuple[Value, ...]


@dataclass(frozen=True, eq=False)
class LampShaders:
    """The shaders of L lamps, by their numbers.

    program (L,) int32 of `glows`, -1 where the colour is constant, and column (L,) of its table;
    rows (29, L), facing (L,) and facts (FACTS + 1, L), see `lamp_context`; origin (3, 1) of local
    places [m].
    """

    glows: tuple[Glow, ...]
    program: Ids
    column: Ids
    rows: NDArray[np.float32]
    facing: NDArray[np.int32]
    facts: NDArray[np.float32]
    kinds: tuple[str, ...]
    origin: Vec

    def colour(
        self, number: int | Ids, where: Vec, direction: Vec, length: Scalar, arrival: Arrival
    ) -> Array | None:
        """Return what multiplies the colour of lamps (3, N) or (3, 1), None if that is nothing.

        number: of one lamp, or (N,) of lamps of one kind; rays of unit direction (3, N) have come
        the way length (N,) to `where` (3, N), about the local origin.
        """
        if isinstance(number, int):
            place = int(self.program[number])
            if place < 0:
                return None
            which = np.full(1, number, np.int32)
            return self._run(place, which, where, direction, length, arrival, None)
        program = self.program.take(number)
        if (program < 0).all():
            return None
        colour = np.ones((3, number.size), F32)
        for place in range(len(self.glows)):
            index = np.flatnonzero(program == place)
            if index.size:
                some = where.take(index, axis=1), direction.take(index, axis=1), length.take(index)
                colour[:, index] = self._run(place, number.take(index), *some, arrival, index)
        return colour

    def _run(
        self,
        place: int,
        which: Ids,
        where: Vec,
        direction: Vec,
        length: Scalar,
        arrival: Arrival,
        index: Index | None,
    ) -> Array:
        glow = self.glows[place]
        context = LampContext(
            self.rows.take(which, axis=1),
            self.facing.take(which),
            self.facts,
            which,
            self.kinds[int(which[0])],
            where,
            direction,
            length,
            arrival,
            index,
            self.origin,
        )
        column = self.column.take(which) if glow.program.columns else None
        with np.errstate(all="ignore"):
            (light,) = glow.program.run((glow.value,), glow.order, context, column)
        finite = np.isfinite(light)
        return light if finite.all() else np.where(finite, light, F32(0))

    def typical(self, number: int) -> float:
        """Return a guess of how bright a lamp is, as a multiple of its colour; never 0."""
        if self.program[number] < 0:
            return 1.0
        direction = _all_around()
        where = self.rows[21:24, number : number + 1] + direction * F32(0)
        length = np.full(direction.shape[1], TYPICAL_DISTANCE, F32)
        colour = self.colour(number, where, direction, length, Arrival(0, 0, total=1))
        assert colour is not None
        return max(float(np.abs(colour).mean()), 1e-3)


def _all_around() -> Vec:
    """Return 32 directions (3, 32) that are spread evenly (a Fibonacci spiral)."""
    step = np.arange(32) + 0.5
    z, turn = 1 - step / 16, step * np.pi * (1 + np.sqrt(5.0))
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z]).astype(F32)


def fold_lamps(
    lamps: Sequence[Lamp], library: Library | None = None
) -> tuple[tuple[Lamp, ...], dict[int, Value], list[Note]]:
    """Return lamps without constant shaders, what the others emit by id(surface), and notes.

    Lamps whose shader is black are left out.
    """
    values: dict[int, Value | None] = {}
    notes: list[Note] = []
    kept: list[Lamp] = []
    for lamp in lamps:
        if lamp.surface is None:
            kept.append(lamp)
            continue
        key = id(lamp.surface)
        if key not in values:
            owner = f"Light '{lamp.name}'"
            surface = compile_shader(owner, lamp.surface, Rules(), library, LAMP_NODES)
            values[key] = surface.emission
            notes += surface.notes
        value = values[key]
        if value is None:
            continue
        if value.constant is None:
            kept.append(lamp)
            continue
        factors = value.constant[:, 0]
        red, green, blue = (float(a * b) for a, b in zip(lamp.strength, factors, strict=True))
        kept.append(replace(lamp, strength=(red, green, blue), surface=None))
    varying = {key: value for key, value in values.items() if value and value.constant is None}
    return tuple(kept), varying, notes


def compile_lamp_shaders(
    lamps: Sequence[Lamp], values: Mapping[int, Value], origin: NDArray[np.float64]
) -> LampShaders | None:
    """Return the shaders of lamps in the order of their numbers, None if all are constant.

    values: what `fold_lamps` found; origin (3,): of local places [m].
    """
    groups: dict[object, list[Value]] = {}
    program = np.full(len(lamps), -1, np.int32)
    column = np.zeros(len(lamps), np.int32)
    for number, lamp in enumerate(lamps):
        value = None if lamp.surface is None else values[id(lamp.surface)]
        if value is not None:
            key = structure((value,))
            members = groups.setdefault(key, [])
            if not any(member is value for member in members):
                members.append(value)
            program[number] = list(groups).index(key)
            column[number] = next(k for k, member in enumerate(members) if member is value)
    if not groups:
        return None
    glows = []
    for members in groups.values():
        merged = merge([(value,) for value in members])
        glows.append(Glow(merged, members[0], tuple(walk([members[0]]))))
    compiled = [compile_row(lamp, origin) for lamp in lamps]
    return LampShaders(
        tuple(glows),
        program,
        column,
        np.ascontiguousarray(np.array([row for row, _ in compiled]).T, F32),
        np.array([facing for _, facing in compiled], np.int32),
        np.array([facts_of_lamp(lamp) for lamp in lamps], F32).T,
        tuple(lamp.kind for lamp in lamps),
        origin.astype(F32)[:, None],
    )
