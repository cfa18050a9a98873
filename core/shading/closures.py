"""points -> closures.  The lobes at a batch of hits, program by program.

Points whose materials share a program are shaded together; the closures of a program have the
same points, so that one direction to a light serves them all.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Ids, Index, Scalar, Vec, dot, frame, normalize, take
from ..bsdf import DIFFUSE, GLOSSY, REGISTRY, diffuse
from ..geometry.attributes import Asked
from ..geometry.surface import Points
from .attributes import asked_by
from .context import NOWHERE, Arrival, Context, Place
from .normals import reader
from .program import Program, merge, structure
from .spaces import READS_SPACES
from .surface import Lobe, Surface
from .telling import tells_kinds
from .tracing import looks
from .values import Array, Value, walk
from .viewed import View, Viewed, view_of

MOST_LIVE = 0.75  # where closures have weight at more of their points, none is left out


def columns(array: Any, index: Index) -> Any:
    """Return columns `index` of an array (..., N) or of one (..., 1) that stands for all."""
    return array if array.shape[-1] == 1 else array.take(index, axis=-1)


class Frame:
    """Local frames about shading normals (3, n): made when they are first used.

    x lies along the tangent (3, n) if there is one; `wo` gives the viewer's directions (3, n).
    """

    def __init__(self, normal: Vec, tangent: Vec | None, wo: Callable[[], Vec]) -> None:
        self.normal, self._tangent, self._wo = normal, tangent, wo

    @cached_property
    def axes(self) -> tuple[Vec, Vec, Vec]:
        """Two tangents and the normal (3, n)."""
        if self._tangent is None:
            return *frame(self.normal), self.normal
        x = self._tangent - self.normal * dot(self.normal, self._tangent)
        long = dot(x, x) > F32(1e-12)
        if not long.all():
            lost = np.flatnonzero(~long)
            x[:, lost] = frame(self.normal.take(lost, axis=1))[0]
        x = normalize(x)
        n = self.normal
        y = np.empty_like(x)
        y[0] = n[1] * x[2] - n[2] * x[1]
        y[1] = n[2] * x[0] - n[0] * x[2]
        y[2] = n[0] * x[1] - n[1] * x[0]
        return x, y, n

    @cached_property
    def wo(self) -> Vec:
        """The viewer's direction (3, n), local."""
        return self.local(self._wo())

    def local(self, direction: Vec) -> Vec:
        """Return world directions (3, n) in the local frame."""
        out = np.empty_like(direction)
        for row, axis in zip(out, self.axes, strict=True):
            row[:] = dot(axis, direction)
        return out

    def world(self, local: Vec) -> Vec:
        """Return local directions (3, n) in the world."""
        x, y, z = self.axes
        direction = x * local[0]
        direction += y * local[1]
        direction += z * local[2]
        return direction

    def take(self, index: Index) -> "Frame":
        """Return the frames at `index`."""
        tangent = None if self._tangent is None else columns(self._tangent, index)
        wo = self._wo
        return Frame(self.normal.take(index, axis=1), tangent, lambda: wo().take(index, axis=1))


@dataclass(frozen=True, eq=False)
class LobeAt:
    """One closure at n points: weight (3, n) or (3, 1), parameters (rows, n) or (rows, 1).

    share (n,) or (1,) is the probability with which it is chosen to go on, None is 1; odds the same
    where all go on, None where nobody asks; smooth (3, n) are the shading normals of the points if
    the closure has its own, else None, and softening what then dims light near the terminator;
    number: which of its program's closures it is; viewed: its weight from elsewhere, None where it
    is the same, or some points were taken.
    """

    module: Any
    weight: Array
    parameters: tuple[Array, ...]
    frame: Frame
    share: Scalar | None = None
    smooth: Vec | None = None
    odds: Scalar | None = None
    number: int = 0
    softening: str = "MICROFACET"
    viewed: Viewed | None = None

    def take(self, index: Index) -> "LobeAt":
        """Return the closure at the points of `index`."""
        return LobeAt(
            self.module,
            columns(self.weight, index),
            tuple(columns(parameter, index) for parameter in self.parameters),
            self.frame.take(index),
            None if self.share is None else columns(self.share, index),
            take(self.smooth, index),
            None if self.odds is None else columns(self.odds, index),
            self.number,
            self.softening,
        )

    @cached_property
    def live(self) -> Index | None:
        """The points (m,) at which the closure has any weight, None: so do most of them."""
        weight = self.weight
        if weight.shape[1] == 1 or weight[0].min(initial=1) > 0:
            return None
        index = np.flatnonzero((weight != 0).any(axis=0))
        return index if index.size < MOST_LIVE * weight.shape[1] else None

    @property
    def is_alive(self) -> bool:
        """Whether the closure has any weight at all."""
        return self.live is None or self.live.size > 0

    @property
    def there(self) -> "LobeAt":
        """The closure at its `live` points."""
        return self if self.live is None else self._alive

    @cached_property
    def _alive(self) -> "LobeAt":
        assert self.live is not None
        return self.take(self.live)

    def density(self, direction: Vec) -> Scalar:
        """Return the density (n,) [1/sr] with which the closure sends rays (3, n) of the world."""
        way: tuple[Any, Any]
        if self.module.WEIGHT_IN_WI_Z:
            way = None, (None, None, dot(self.frame.normal, direction))
        else:
            way = self.frame.wo, self.frame.local(direction)
        density: Scalar = self.module.evaluate(self.parameters, *way)[1]
        return density


@dataclass(frozen=True, eq=False)
class Shaded:
    """The closures of one program at its points `index` (n,), None for all of the batch."""

    index: Index | None
    size: int
    lobes: tuple[LobeAt, ...]
    matte_number: int | None = None  # of the closure that sends the same to all directions

    @property
    def matte(self) -> LobeAt | None:
        """That closure, if there is just one."""
        return None if self.matte_number is None else self.lobes[self.matte_number]

    @property
    def scatters(self) -> bool:
        """Whether a lamp can light any of the closures."""
        return any(not lobe.module.IS_DELTA for lobe in self.lobes)


@dataclass(frozen=True, eq=False)
class Recipe:
    """A program, and which of its values are what; orders are what `Program.run` needs."""

    program: Program
    lobes: tuple[Lobe, ...]
    scattering: tuple[Value, ...]
    scattering_order: tuple[Value, ...]
    emission: Value | None
    emission_order: tuple[Value, ...]
    transparency: Value | None
    transparency_order: tuple[Value, ...]
    holdout: Value | None
    holdout_order: tuple[Value, ...]
    bent: Value | None
    bent_order: tuple[Value, ...]
    softening: str
    facts: tuple[Value, ...] = ()
    facts_order: tuple[Value, ...] = ()
    view: View | None = None  # of the weight of the one matte closure, if there is just one

    def shade(
        self,
        context: Context,
        column: Ids | None,
        throughput: Vec | None,
        is_chosen: bool,
        has_odds: bool,
    ) -> Shaded:
        """Return the closures at the points of a context, their weights times the throughput.

        With shares if one of the closures will be chosen, with odds if none but they are asked.
        """
        known = dict(
            zip(
                map(id, self.scattering),
                self.program.run(self.scattering, self.scattering_order, context, column),
                strict=True,
            )
        )
        frames: dict[tuple[int, int], Frame] = {}
        lobes: list[LobeAt] = []
        view = self.view
        for lobe in self.lobes:
            module = REGISTRY[lobe.closure]
            normal, tangent = _normal(lobe, module, known, context), None
            if lobe.tangent is not None:
                tangent = known[id(lobe.tangent)]
            key = id(normal), id(tangent)
            if key not in frames:
                frames[key] = Frame(normal, tangent, lambda: context.wo)
            weight = known[id(lobe.weight)]
            if throughput is not None:
                weight = weight * context.of(throughput)
            parameters = tuple(known[id(parameter)] for parameter in lobe.parameters)
            is_weighed = len(self.lobes) > 1 and (is_chosen or (has_odds and self.mixes_kinds))
            share = known[id(lobe.importance)] if is_weighed else None
            smooth = None if lobe.normal is None else context.normal
            viewed = None
            if view is not None and view.steps and len(lobes) == view.number:
                viewed = Viewed(view, self.program, context, column, known)
            made = module, weight, parameters, frames[key], share, smooth
            lobes.append(LobeAt(*made, None, len(lobes), self.softening, viewed))
        own, number = tuple(_normalized(lobes, is_chosen)), None if view is None else view.number
        return Shaded(context.index, context.size, own, number)

    @cached_property
    def mixes_kinds(self) -> bool:
        """Whether rays of two kinds may go the same way: from matte and from glossy closures."""
        modules = [REGISTRY[lobe.closure] for lobe in self.lobes]
        kinds = {module.RAY_KIND for module in modules if not module.IS_DELTA}
        return {DIFFUSE, GLOSSY} <= kinds


def _normal(lobe: Lobe, module: Any, known: dict[int, Array], context: Context) -> Vec:
    if lobe.normal is not None:
        return known[id(lobe.normal)]
    return context.normal if module.RAY_KIND == DIFFUSE else context.valid_normal


def _normalized(lobes: list[LobeAt], is_chosen: bool) -> Iterator[LobeAt]:
    """Yield the lobes with shares that add up to 1, if they have shares; else with such odds."""
    shares = [lobe.share for lobe in lobes if lobe.share is not None]
    if not shares:
        yield from lobes
        return
    total = shares[0] + shares[1]
    for share in shares[2:]:
        total = total + share
    scale = np.reciprocal(np.maximum(total, F32(1e-30)))
    for lobe, share in zip(lobes, shares, strict=True):
        share = share * scale
        yield replace(lobe, share=share if is_chosen else None, odds=share)


@dataclass(frozen=True, eq=False)
class SurfaceTable:
    """The surfaces of M materials, as recipes; program and column (M,) int32 of each of them.

    glows, is_transparent (M,) bool; plain_transparency and plain_emission (3, M) are these, None
    if any depends on the point; tells_kinds: matte rays from glossy ones; reads_spaces: of objects,
    which `place` must then have, as it must the `attributes` of meshes.  `blurred` are the same
    surfaces as paths see them that filter glossy blurs, None where it changes nothing.  shown:
    names of the facts that surfaces tell.
    """

    recipes: tuple[Recipe, ...]
    program: Ids
    column: Ids
    glows: NDArray[np.bool_]
    is_transparent: NDArray[np.bool_]
    plain_transparency: NDArray[np.float32] | None
    plain_emission: NDArray[np.float32] | None
    has_holdout: bool
    modules: tuple[Any, ...]
    reads_spaces: bool
    tells_kinds: bool = False
    attributes: frozenset[Asked] = frozenset()
    place: Place = NOWHERE
    blurred: "SurfaceTable | None" = None
    reach: NDArray[np.uint8] | None = None  # how far each material looks (M,), see `tracing`
    shown: tuple[str, ...] = ()

    def asking(self, asked: Asked) -> "SurfaceTable":
        """Return the table with one more attribute that is asked of meshes."""
        return replace(self, attributes=self.attributes | {asked})

    @property
    def has_specular(self) -> bool:
        """Whether any closure is glossy: rays from it may have to meet lamps."""
        return any(module.RAY_KIND == GLOSSY for module in self.modules)

    @property
    def mixes_kinds(self) -> bool:
        """Whether rays of two kinds may go the same way from a surface."""
        return any(recipe.mixes_kinds for recipe in self.recipes)

    @property
    def bends_normals(self) -> bool:
        """Whether any closure has a normal that is not that of the mesh."""
        return any(
            recipe.bent is not None or any(lobe.normal is not None for lobe in recipe.lobes)
            for recipe in self.recipes
        )

    @property
    def lights_both_sides(self) -> bool:
        """Whether light from behind any surface may reach the viewer."""
        return any(module.TRANSMITS and not module.IS_DELTA for module in self.modules)

    def bend(self, points: Points, arrival: Arrival) -> Points:
        """Return the points with the shading normals that displaced materials have."""
        if all(recipe.bent is None for recipe in self.recipes):
            return points
        normal = points.normal.copy()
        for recipe, index, column in self._split(points.material, None):
            if recipe.bent is not None:
                context = Context(points, arrival, index, self.place)
                (bent,) = recipe.program.run((recipe.bent,), recipe.bent_order, context, column)
                normal[:, slice(None) if index is None else index] = bent
        return replace(points, normal=normal)

    def shade(
        self,
        points: Points,
        arrival: Arrival,
        throughput: Vec | None,
        is_chosen: bool,
        has_odds: bool = False,
    ) -> tuple[Shaded, ...]:
        """Return the closures at `points`, program by program; `is_chosen`: one will go on.

        `has_odds`: tell of closures of several kinds how probably each would be chosen.
        """
        how = is_chosen, has_odds
        some = None
        shaded: list[Shaded] = []
        if self.blurred is not None and arrival.blur is not None:
            is_blurred = arrival.blur > 0
            some, other = np.flatnonzero(is_blurred), np.flatnonzero(~is_blurred)
            if some.size:
                index = some if other.size else None
                shaded += self.blurred._shade(points, arrival, throughput, index, *how)
            if not other.size:
                return tuple(shaded)
            some = other if some.size else None
        shaded += self._shade(points, arrival, throughput, some, *how)
        return tuple(shaded)

    def _shade(
        self,
        points: Points,
        arrival: Arrival,
        throughput: Vec | None,
        some: Index | None,
        is_chosen: bool,
        has_odds: bool,
    ) -> Iterator[Shaded]:
        for recipe, index, column in self._split(points.material, some):
            if recipe.lobes:
                context = Context(points, arrival, index, self.place)
                yield recipe.shade(context, column, throughput, is_chosen, has_odds)

    def emission(self, points: Points, arrival: Arrival) -> Iterator[tuple[Index | None, Array]]:
        """Yield points and the radiance (3, n) or (3, 1) that they emit to the viewer."""
        for recipe, index, column in self._split(points.material, None):
            if recipe.emission is not None:
                context = Context(points, arrival, index, self.place)
                (light,) = recipe.program.run(
                    (recipe.emission,), recipe.emission_order, context, column
                )
                yield index, light

    def typical_emission(self) -> NDArray[np.float32]:
        """Return what each material emits (3, M) to one who looks at it from the front."""
        if self.plain_emission is not None:
            return self.plain_emission
        count = self.program.size
        up = np.repeat(np.array([[0], [0], [1]], F32), count, axis=1)
        zero, none = np.zeros(count, F32), np.zeros(count, np.int32)
        material = np.arange(count, dtype=np.int32)
        points = Points(
            up * 0, -up, up, up, none > 0, zero, none, material, zero, None, zero, zero, none
        )
        light = np.zeros((3, count), F32)
        for index, some in self.emission(points, Arrival(0)):
            light[:, slice(None) if index is None else index] = some
        return light

    def transparency(self, points: Points, arrival: Arrival) -> Vec:
        """Return the share of light (3, N) that passes the points straight."""
        out = np.zeros((3, points.size), F32)
        for recipe, index, column in self._split(points.material, None):
            if recipe.transparency is not None:
                context = Context(points, arrival, index, self.place)
                (passed,) = recipe.program.run(
                    (recipe.transparency,), recipe.transparency_order, context, column
                )
                out[:, slice(None) if index is None else index] = passed
        return out

    def facts(
        self, points: Points, arrival: Arrival
    ) -> Iterator[tuple[Index | None, dict[str, Array]]]:
        """Yield points and what passes show of them, (n,) or (3, n) or of one column."""
        for recipe, index, column in self._split(points.material, None):
            context = Context(points, arrival, index, self.place)
            found = recipe.program.run(recipe.facts, recipe.facts_order, context, column)
            yield index, dict(zip(self.shown, found, strict=True))

    def holdout(self, points: Points, arrival: Arrival) -> Iterator[tuple[Index | None, Array]]:
        """Yield points and how deep (n,) or (1,) they cut a hole into the picture."""
        for recipe, index, column in self._split(points.material, None):
            if recipe.holdout is not None:
                context = Context(points, arrival, index, self.place)
                (depth,) = recipe.program.run(
                    (recipe.holdout,), recipe.holdout_order, context, column
                )
                yield index, depth

    @cached_property
    def _is_in_order(self) -> bool:
        """Whether each material has the column of its own number: all share one program."""
        return bool((self.column == np.arange(self.column.size)).all())

    def _split(
        self, material: Ids, some: Index | None
    ) -> Iterator[tuple[Recipe, Index | None, Ids | None]]:
        """Yield each recipe that occurs, with its points (None: all) and their columns."""
        if some is not None:
            material = material.take(some)
        number = self.program.take(material) if len(self.recipes) > 1 else None
        for place, recipe in enumerate(self.recipes):
            index = None
            if number is not None:
                index = np.flatnonzero(number == place)
                if not index.size:
                    continue
                if index.size == number.size:
                    index = None
            column = None
            if recipe.program.columns:
                column = material if index is None else material.take(index)
                if not self._is_in_order:
                    column = self.column.take(column)
            if some is not None:
                index = some if index is None else some.take(index)
            yield recipe, index, column


def choose(shaded: Shaded, u: Scalar) -> Iterator[tuple[Index | None, LobeAt]]:
    """Yield lobes with the points of `shaded` that u (n,) lets go on with them.

    The points are counted within `shaded`; None is all of them.
    """
    below: Scalar | float = 0.0
    last = len(shaded.lobes) - 1
    for place, lobe in enumerate(shaded.lobes):
        if lobe.share is None:
            yield None, lobe
            return
        above = below + lobe.share
        chosen = np.flatnonzero((u >= below) & (u < above) if place < last else u >= below)
        if chosen.size:
            yield chosen, lobe.take(chosen)
        below = above


def compile_table(surfaces: Sequence[Surface], shown: tuple[str, ...] = ()) -> SurfaceTable:
    """Sort the surfaces of all materials into programs; `shown` are the facts they all tell."""
    groups: dict[Any, list[int]] = {}
    for number, surface in enumerate(surfaces):
        closures = tuple(lobe.closure for lobe in surface.lobes)
        key = closures, structure(surface.outputs()), surface.softening
        groups.setdefault(key, []).append(number)
    program = np.zeros(len(surfaces), np.int32)
    column = np.zeros(len(surfaces), np.int32)
    recipes = []
    for place, members in enumerate(groups.values()):
        program[members] = place
        column[members] = np.arange(len(members))
        recipes.append(_recipe([surfaces[member] for member in members]))
    names = dict.fromkeys(lobe.closure for surface in surfaces for lobe in surface.lobes)
    return SurfaceTable(
        tuple(recipes),
        program,
        column,
        np.array([surface.emission is not None for surface in surfaces], bool),
        np.array([surface.transparency is not None for surface in surfaces], bool),
        _plain([surface.transparency for surface in surfaces]),
        _plain([surface.emission for surface in surfaces]),
        any(surface.holdout is not None for surface in surfaces),
        tuple(REGISTRY[name] for name in names),
        any(reader(item)[0] in READS_SPACES for recipe in recipes for item in recipe.program.order),
        any(tells_kinds(recipe.program.order) for recipe in recipes),
        frozenset(asked for recipe in recipes for asked in asked_by(recipe.program.order)),
        reach=_reach(recipes, program),
        shown=shown,
    )


def _reach(recipes: Sequence[Recipe], program: Ids) -> NDArray[np.uint8] | None:
    """Return how far the shaders of materials look (M,), None if none looks around."""
    reach = [max((looks(*reader(i)) for i in r.program.order), default=0) for r in recipes]
    return np.array(reach, np.uint8).take(program) if any(reach) else None


def _plain(values: list[Value | None]) -> NDArray[np.float32] | None:
    """Return constants as columns (3, M), None is black; None if they are not all constants."""
    table = np.zeros((3, len(values)), F32)
    for column, item in enumerate(values):
        if item is not None and item.constant is None:
            return None
        if item is not None and item.constant is not None:
            table[:, column] = item.constant.reshape(-1)
    return table


def _recipe(members: list[Surface]) -> Recipe:
    first = members[0]
    program = merge([surface.outputs() for surface in members])
    scattering = []
    for lobe in first.lobes:
        scattering += [lobe.weight, *lobe.parameters]
        scattering += [lobe.importance] if len(first.lobes) > 1 else []
        scattering += [part for part in (lobe.normal, lobe.tangent) if part is not None]
    matte = [number for number, lobe in enumerate(first.lobes) if lobe.closure == diffuse.NAME]
    view = view_of(matte[0], first.lobes[matte[0]].weight) if len(matte) == 1 else None
    scattering += view.kept if view is not None else ()

    def order(output: Value | None) -> tuple[Value, ...]:
        return () if output is None else tuple(walk([output]))

    facts = tuple(first.fact(name) for name in first.rules.shown)

    return Recipe(
        program,
        tuple(first.lobes),
        tuple(scattering),
        tuple(walk(scattering)),
        first.emission,
        order(first.emission),
        first.transparency,
        order(first.transparency),
        first.holdout,
        order(first.holdout),
        first.bent,
        order(first.bent),
        first.softening,
        facts,
        tuple(walk(facts)),
        view,
    )
