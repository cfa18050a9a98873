"""directions -> radiance.  The shader of the world, as rays see it that leave the scene."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Vec
from ..geometry.attributes import Asked
from ..scene import Note, World
from .context import NEVER, NOWHERE, Arrival, Context, Place
from .graph import Library
from .program import Program, merge
from .rules import Rules
from .sky.disc import Disc
from .surfaces import compile_shader
from .telling import tells_kinds
from .values import Array, Value, walk


class WorldContext(Context):
    """What a program may read of rays (3, N) that leave the scene."""

    def __init__(self, direction: Vec, arrival: Arrival, place: Place = NOWHERE) -> None:
        self.arrival, self.index, self.direction = arrival, None, direction
        self.place = place
        self.position = self.generated = direction
        self.wo = self.normal = self.geometric = self.reflection = np.negative(direction)
        self.length = self.travelled = np.full(1, NEVER)
        self.back = np.zeros(1, bool)
        self.with_discs = True

    def attribute(self, asked: Asked) -> Vec | None:
        """Return nothing: the world is no mesh."""
        return None

    def beside(self, axis: int, width: np.float32) -> Context:
        """Return the same: nothing of the world has a slope."""
        return self

    @property
    def size(self) -> int:
        """The number of rays."""
        return self.direction.shape[1]

    @property
    def local(self) -> Vec:
        """The directions (3, N) as places about the local origin, as Cycles has them."""
        return self.direction - self.place.origin

    @property
    def seen_way(self) -> Vec:
        """The directions (3, N) in the camera's space."""
        return self.view.turn(self.direction)

    @cached_property
    def corners(self) -> tuple[Vec, Vec, Vec]:
        """Zeros (3, N): no triangle, so that no edge is near, and nothing but the first corner."""
        nowhere = np.zeros((3, self.size), F32)
        return nowhere, nowhere, nowhere

    def fact(self, row: int, is_vector: bool = False) -> Array:
        """Return zeros: there is no object."""
        return np.zeros((3, 1) if is_vector else 1, F32)

    particle = fact

    def around(self, axis: int) -> Vec:
        """Return zeros: there is no object to run around."""
        return np.zeros((3, self.size), F32)

    def into_object(self, vector: Vec, kind: str) -> Vec:
        """Return the vector: there is no object."""
        return vector

    out_of_object = into_object


@dataclass(frozen=True, eq=False)
class WorldShader:
    """The world's emission; `value` is what the program computes.

    discs: of suns, too small for a map; finest: width and height of its largest picture.
    """

    program: Program
    value: Value
    order: tuple[Value, ...]
    discs: tuple[Disc, ...] = ()
    finest: tuple[int, int] = (0, 0)
    place: Place = NOWHERE

    @property
    def is_constant(self) -> bool:
        """Whether all directions look the same to all rays."""
        return self.value.is_constant

    @property
    def tells_kinds(self) -> bool:
        """Whether rays from matte and from glossy closures see different worlds."""
        return tells_kinds(self.order)

    def radiance(
        self, direction: Vec, kinds: NDArray[np.uint8] | int, with_discs: bool = True
    ) -> Array:
        """Return the radiance (3, N) or (3, 1) [W/(sr m2)] in unit directions (3, N)."""
        context = WorldContext(direction, Arrival(kinds), self.place)
        context.with_discs = with_discs
        (light,) = self.program.run((self.value,), self.order, context, None)
        return light


def compile_world(
    world: World | None, place: Place = NOWHERE, library: Library | None = None
) -> tuple[WorldShader | None, list[Note]]:
    """Return the shader of a world, None if it is black, and what it leaves out."""
    if world is None:
        return None, []
    surface = compile_shader(f"World '{world.name}'", world.surface, Rules(), library)
    light = surface.emission
    if light is None or not light.largest() > 0:
        return None, surface.notes
    graph = surface.graph
    shader = WorldShader(
        merge([(light,)]), light, tuple(walk([light])), graph.discs, graph.finest, place
    )
    return shader, surface.notes
