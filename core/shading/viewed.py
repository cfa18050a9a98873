"""steps, viewer -> weight.  What a matte closure sends back, seen from elsewhere.

Most closures of a real material depend on the viewer's direction, and so do the matte ones below
coats and reflections.  Of a program that was run for one viewer, the steps that depend on the
direction are run again for another, and no others: textures are not looked up twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..arrays import Ids, Vec
from . import inputs, normals, tangents
from .context import Context
from .nodes import coordinates, hit, ies, triangle
from .normals import reader
from .values import Array, Value, walk

if TYPE_CHECKING:
    from .program import Program

OF_VIEWER = frozenset(
    (
        *inputs.OF_VIEWER,
        *normals.OF_VIEWER,
        *tangents.OF_VIEWER,
        *coordinates.OF_VIEWER,
        *hit.OF_VIEWER,
        *ies.OF_VIEWER,
        *triangle.OF_VIEWER,
    )
)


@dataclass(frozen=True, eq=False)
class View:
    """The steps that make a weight and depend on the viewer, in order, with their constants.

    kept: what they need of the others; is_near: the weight depends on the viewer's distance, too.
    """

    weight: Value
    steps: tuple[Value, ...]
    kept: tuple[Value, ...]
    is_near: bool

    @property
    def matters(self) -> bool:
        """Whether the weight depends on the viewer's direction at all."""
        return bool(self.steps)


def view_of(weight: Value) -> View:
    """Return what of a weight depends on the viewer."""
    order = walk([weight])
    viewed: set[int] = set()
    for item in order:
        if reader(item)[0] in OF_VIEWER or any(id(arg) in viewed for arg in item.args):
            viewed.add(id(item))
    args = [arg for item in order if id(item) in viewed for arg in item.args]
    others = {id(arg): arg for arg in args if id(arg) not in viewed}
    constants = {key for key, arg in others.items() if arg.constant is not None}
    return View(
        weight,
        tuple(item for item in order if id(item) in viewed or id(item) in constants)
        if viewed
        else (),
        tuple(arg for key, arg in others.items() if key not in constants),
        any(reader(item)[0] in hit.OF_DISTANCE for item in order),
    )


@dataclass(frozen=True, eq=False)
class Viewed:
    """A weight at the n points of a context, that can be seen from elsewhere.

    known: the arrays of `view.kept`, by id; column: see `Program.run`.
    """

    view: View
    program: "Program"
    context: Context
    column: Ids | None
    known: dict[int, Array]

    def weight(self, wo: Vec) -> Array:
        """Return the weight (3, n) or (3, 1) for unit directions (3, n) to another viewer."""
        context = self.context.seen_from(wo)
        wanted: Sequence[Any] = (self.view.weight,)
        return self.program.run(wanted, self.view.steps, context, self.column, self.known)[0]
