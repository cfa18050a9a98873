"""lobes, emission -> Surface.  What a material does with light, as values yet to be computed.

A surface is a sum of lobes, each a closure type of `bsdf` with a colour weight and parameters,
plus emitted radiance, transparency and holdout.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ..bsdf import DIFFUSE, GLOSSY, REGISTRY, shown_as
from ..scene import Link, Node, Note
from .graph import Graph
from .inputs import NORMAL, VALID_NORMAL
from .normals import unit_normal
from .rules import Rules
from .values import (
    COLOUR,
    FLOAT,
    VECTOR,
    Number,
    Value,
    average,
    constant,
    grey,
    read,
    step,
    value,
    widened,
)

# Sorts of closures that passes tell apart
COLOURS = ("diffuse", "glossy", "transmission")
NORMALS = ("normal", "matte_normal", "bearing")


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
    light on closures with normals of their own.  facts: what passes show of it, by the names in
    `Rules.shown`: "diffuse", "glossy" and "transmission", the light that closures of this sort send
    back of a white world, "albedo", that of all and of what glows; normals; the user's own.
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
    facts: dict[str, Value] = field(default_factory=dict)

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
        if shown_as(REGISTRY[closure]) == DIFFUSE:
            self.show("diffuse", weight)

    def show(self, sort: str, albedo: Value) -> None:
        """Add what a closure sends back to the colour of its sort, if passes want that."""
        for name in {sort, "albedo"} & set(self.rules.shown):
            before = self.facts.get(name)
            albedo = widened(albedo, COLOUR)
            self.facts[name] = albedo if before is None else before + albedo

    def show_normal(self, name: str, is_matte: bool = False) -> None:
        """Tell the mean normal of all closures, or all matte ones, if passes want that."""
        total: Value | None = None
        lobes = self.lobes if name in self.rules.shown else []
        for lobe in lobes:
            if is_matte and shown_as(REGISTRY[lobe.closure]) != DIFFUSE:
                continue
            own = lobe.normal
            if own is None:
                own = NORMAL if REGISTRY[lobe.closure].RAY_KIND != GLOSSY else VALID_NORMAL
            part = own * step(np.abs, average(lobe.weight))
            total = part if total is None else total + part
        if total is not None:
            self.facts[name] = read(unit_normal, total, kind=VECTOR)

    def fact(self, name: str) -> Value:
        """Return what passes show by one of `Rules.shown`, black where there is none."""
        black = constant(
            0.0, COLOUR if name in (*COLOURS, "albedo") or name.startswith("aov_color") else FLOAT
        )
        return self.facts.setdefault(name, NORMAL if name in NORMALS else black)

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

    def swapped(self, swap: Callable[[Value], Value]) -> "Surface":
        """Return the surface with other values in the place of its `outputs`."""

        def each(part: Value | None) -> Value | None:
            return None if part is None else swap(part)

        lobes = [
            replace(
                lobe,
                weight=swap(lobe.weight),
                parameters=tuple(map(swap, lobe.parameters)),
                importance=swap(lobe.importance),
                normal=each(lobe.normal),
                tangent=each(lobe.tangent),
            )
            for lobe in self.lobes
        ]
        return replace(
            self,
            lobes=lobes,
            emission=each(self.emission),
            transparency=each(self.transparency),
            holdout=each(self.holdout),
            bent=each(self.bent),
            facts={name: swap(self.fact(name)) for name in self.rules.shown},
        )

    def outputs(self) -> tuple[Value | None, ...]:
        """Return all values that make the surface, in a fixed order."""
        lobes = tuple(
            part
            for lobe in self.lobes
            for part in (
                lobe.weight, *lobe.parameters, lobe.importance, lobe.normal, lobe.tangent
            )
        )  # fmt: skip
        facts = tuple(self.fact(name) for name in self.rules.shown)
        return (*lobes, self.emission, self.transparency, self.holdout, self.bent, *facts)
