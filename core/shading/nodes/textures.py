"""node -> Value.  Pictures of the surroundings: Environment Texture and Sky Texture."""

from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import Vec, dot, unit
from ...images import MAGENTA, Image, Tiles
from ...images.lookup import lookup
from ...images.projection import PROJECTIONS
from ...scene import Node
from ..context import Context
from ..graph import Graph, title
from ..inputs import POSITION
from ..sky import Sky, compile_sky
from ..values import COLOUR, FLOAT, Array, Value, read, step


def _environment(graph: Graph, node: Node, output: str) -> Value | None:
    source = node.properties.get("image")
    if source is None:
        graph.note(f"{title(node)} has no image: it is magenta")
    image: Image | Tiles = MAGENTA
    if source is not None:
        image = graph.library.image(source, graph.notes)
    if isinstance(image, Tiles):
        image = image.images[0][1]
    graph.finest = max(graph.finest, (image.width, image.height))
    projection = PROJECTIONS[graph.choice(node, "projection", "EQUIRECTANGULAR")]
    static = image, projection, graph.choice(node, "interpolation", "Linear")
    where = _towards(graph, node)
    if output == "Alpha":
        return step(_alpha, where, static=static, kind=FLOAT)
    return step(_colour, where, static=static, kind=COLOUR)


def _looked_up(
    direction: Vec,
    image: Image,
    projection: Callable[[Vec], tuple[Array, Array]],
    interpolation: str,
) -> Array:
    length = np.sqrt(dot(direction, direction))
    u, v = projection(unit(direction, length))
    return lookup(image, u, v, interpolation)


def _colour(direction: Vec, *picture: Any) -> Array:
    return _looked_up(direction, *picture)[:3]


def _alpha(direction: Vec, *picture: Any) -> Array:
    return _looked_up(direction, *picture)[3]


def _sky(graph: Graph, node: Node, output: str) -> Value | None:
    sky = graph.library.get(node, lambda: compile_sky(node.properties))
    if sky is None:
        kind = node.properties.get("sky_type", "?")
        graph.note(f"{title(node)}: a sky of the type {kind} is rendered as Preetham's")
        sky = compile_sky({**node.properties, "sky_type": "PREETHAM"})
        assert sky is not None
    if not graph.is_linked(node, "Vector"):
        graph.discs += sky.discs
    return read(_sky_radiance, _towards(graph, node), static=(sky,), kind=COLOUR)


def _sky_radiance(context: Context, direction: Vec, sky: Sky) -> Array:
    length = np.sqrt(dot(direction, direction))
    return sky.radiance(unit(direction, length), context.with_discs)


def _towards(graph: Graph, node: Node) -> Value:
    """Return where a node looks: what feeds Vector, else the position, of worlds the ray."""
    linked = graph.vector(node, "Vector") if graph.is_linked(node, "Vector") else None
    return POSITION if linked is None else linked


TEXTURES: dict[str, Callable[[Graph, Node, str], Value | None]] = {
    "TexEnvironment": _environment,
    "TexSky": _sky,
}
