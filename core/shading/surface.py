"""lobes, emission -> Surface.  What a material does with light, as values yet to be computed.

A surface is a sum of lobes, each a closure type of `bsdf` with a colour weight and parameters,
plus emitted radiance, transparency and holdout.
"""

from dataclasses import dataclass, field

from ..bsdf import REGISTRY
from ..scene import Link, Node, Note
from .graph import Graph
from .inputs import NORMAL
from .normals import unit_normal
from .rules import Rules
from .values import COLOUR, VECTOR, Number, Value, average, grey, read, value, widened


@dataclass(frozen=True, eq=False)
class Lobe:
    """One closure: its type's name, its colour weight, its parameters in the type's order.

    importance is the share of light it scatters, up to a factor, by which one of several lobes is
    chosen; normal and tangent (None: any) make its local frame.
    """

    closure: str
    weight: Value
    parameters: tuple[Value, ...]
    importance: Value
    normal: Value | None = None
    tangent: Value | None = None


@dataclass(eq=False)
class Surface:
    """The lobes of a material, its emitted radiance [W/(sr m2)], what passes, what is held out.

    Constants that are black are left out (None).  weights: of shader nodes, by id, as they flow
    down from the output.  bent: the shading normal where the material displaces it; softening: of
    light on closures with normals of their own.
    """

    graph: Graph
    rules: Rules
    lobes: list[Lobe] = field(default_factory=list)
    emission: Value | None = None
    transparency: Value | None = None
    holdout: Value | None = None
    weights: dict[int, Value] = field(default_factory=dict)
    bent: Value | None = None
    softening: str = "MICROFACET"

    @property
    def notes(self) -> list[Note]:
        """What the picture does not honour."""
        return self.graph.notes

    def add(
        self,
        closure: str,
        weight: Value,
        *parameters: Number,
        normal: Value | None = None,
        tangent: Value | None = None,
        importance: Value | None = None,
    ) -> None:
        """Add a lobe, unless it is black; colours among the parameters are made so.

        `importance` is the albedo of the closure itself: its weight is multiplied to it.
        """
        if not weight.largest() > 0:
            return
        rows = REGISTRY[closure].PARAMETERS.values()
        made = tuple(
            widened(value(given), COLOUR) if count == 3 else grey(value(given))
            for given, count in zip(parameters, rows, strict=True)
        )
        share = average(weight) if importance is None else average(weight * importance)
        self.lobes.append(Lobe(closure, widened(weight, COLOUR), made, share, normal, tangent))

    def normal_of(self, node: Node, socket: str = "Normal") -> Value | None:
        """Return a node's own unit normal, None if it is the shading normal."""
        if not self.graph.is_linked(node, socket):
            return None
        found = self.graph.vector(node, socket)
        if found is None or found is NORMAL:
            return None
        return read(unit_normal, found, kind=VECTOR)

    def emit(self, radiance: Value) -> None:
        """Add emitted radiance."""
        if radiance.is_exactly(0):
            return
        radiance = widened(radiance, COLOUR)
        self.emission = radiance if self.emission is None else self.emission + radiance

    def let_through(self, weight: Value) -> None:
        """Let this share of light pass straight."""
        if not weight.largest() > 0:
            return
        weight = widened(weight, COLOUR)
        self.transparency = weight if self.transparency is None else self.transparency + weight

    def hold_out(self, weight: Value) -> None:
        """Cut a hole into the picture, this deep."""
        if not weight.largest() > 0:
            return
        weight = average(weight)
        self.holdout = weight if self.holdout is None else self.holdout + weight

    def pass_on(self, node: Node, socket: str, weight: Value) -> None:
        """Give a weight to the shader that feeds an input."""
        link = node.inputs.get(socket)
        if not isinstance(link, Link) or weight.is_exactly(0):
            return
        key = id(link.node)
        self.weights[key] = self.weights[key] + weight if key in self.weights else weight

    def outputs(self) -> tuple[Value | None, ...]:
        """Return all values that make the surface, in a fixed order."""
        lobes = tuple(
            part
            for lobe in self.lobes
            for part in (
                lobe.weight, *lobe.parameters, lobe.importance, lobe.normal, lobe.tangent
            )
        )  # fmt: skip
        return (*lobes, self.emission, self.transparency, self.holdout, self.bent)
