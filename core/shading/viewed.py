"""steps, viewer -> weight.  What a matte closure sends back, seen from elsewhere.

Most closures of a real material depend on the viewer's direction, and so do the matte ones below
coats and reflections.  Of a program that was run for one viewer, the steps that depend on the
direction are run again for another, and no others: textures are not looked up twice.
"""

from dataclasses import dataclass

from ..arrays import Ids, Vec
from . import inputs, normals, tangents
from .context import Context
from .nodes import coordinates, hit, ies, triangle
from .normals import reader
from .program import Program
from .values import Array, Value, walk

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
    """The steps that make a closure's weight and depend on the viewer, in order, with constants.

    number: which of its program's closures it is; kept: what the steps need of the others.
    """

    number: int
    weight: Value
    steps: tuple[Value, ...]
    kept: tuple[Value, ...]


def view_of(number: int, weight: Value) -> View | None:
    """Return what of a closure's weight depends on the viewer's direction.

    None if it depends on the distance, too.
    """
    order = walk([weight])
    if any(reader(item)[0] in hit.OF_DISTANCE for item in order):
        return None
    viewed: set[int] = set()
    for item in order:
        if reader(item)[0] in OF_VIEWER or any(id(arg) in viewed for arg in item.args):
            viewed.add(id(item))
    args = {id(arg): arg for item in order if id(item) in viewed for arg in item.args}
    others = [arg for key, arg in args.items() if key not in viewed]
    again = viewed | {id(arg) for arg in others if arg.is_constant}
    steps = tuple(item for item in order if id(item) in again)
    return View(number, weight, steps, tuple(arg for arg in others if not arg.is_constant))


@dataclass(frozen=True, eq=False)
class Viewed:
    """A weight at the n points of a context, that can be seen from elsewhere.

    known: arrays by the values' ids, those of `view.kept` among them; column: see `Program.run`.
    """

    view: View
    program: Program
    context: Context
    column: Ids | None
    known: dict[int, Array]

    def weight(self, wo: Vec) -> Array:
        """Return the weight (3, n) or (3, 1) for unit directions (3, n) to another viewer."""
        context = self.context.seen_from(wo)
        how = self.view.steps, context, self.column, self.known
        return self.program.run((self.view.weight,), *how)[0]
