"""node -> Value.  Image Texture: pictures on surfaces."""

from typing import Any

import numpy as np

from ...arrays import F32, Scalar, Vec
from ...images import Image, Tiles
from ...images.lookup import find_taps, lookup, mix_grey, mix_taps
from ...images.projection import sphere, tube
from ...scene import ACTIVE_UV, Node
from ..attributes import read_attribute
from ..context import Context
from ..graph import Graph, NodeFunction, title
from ..values import COLOUR, FLOAT, SEVERAL, Array, Value, constant, read, widened
from .legacy import mapped

PROJECTIONS = {"SPHERE": sphere, "TUBE": tube}
MAGENTA = np.array([[1], [0], [1], [1]], F32)


def _image(graph: Graph, node: Node, output: str) -> Value:
    looked_up = graph.share(id(node), lambda: _texels(graph, node))
    if looked_up.kind == FLOAT:
        return constant(1.0) if output == "Alpha" else widened(looked_up, COLOUR)
    if looked_up.constant is not None:
        texel = looked_up.constant
        return constant(texel[3], FLOAT) if output == "Alpha" else constant(texel[:3], COLOUR)
    if output == "Alpha":
        return Value(FLOAT, None, _alpha, (looked_up,))
    return Value(COLOUR, None, _colour, (looked_up,))


def _texels(graph: Graph, node: Node) -> Value:
    source = node.properties.get("image")
    if source is None:
        graph.note(f"{title(node)} has no image: it is magenta")
        return Value(SEVERAL, MAGENTA)
    image = graph.library.image(source, graph.notes)
    if graph.is_linked(node, "Vector"):
        where = graph.vector(node, "Vector", (0, 0, 0))
        assert where is not None
    else:
        where = graph.share(ACTIVE_UV, lambda: read_attribute(ACTIVE_UV))
    where = mapped(graph, node, where)
    interpolation = graph.choice(node, "interpolation", "Linear")
    extension = graph.choice(node, "extension", "REPEAT")
    choices = (image, interpolation, extension, graph.is_used(node, "Alpha"))
    projection = graph.choice(node, "projection", "FLAT")
    if projection == "BOX":
        blend = float(graph.choice(node, "projection_blend", 0.0))
        return read(boxed, where, static=(blend, *choices), kind=SEVERAL)
    project = PROJECTIONS.get(projection)
    if isinstance(image, Tiles):
        return Value(SEVERAL, None, _flat, (where,), (project, *choices))

    # Images of one size at the same places share what there is to find
    static = project, image.width, image.height, interpolation, extension
    key = id(where), *static
    taps = graph.share(key, lambda: Value(SEVERAL, None, taps_at, (where,), static))
    if image.is_grey and extension != "CLIP":
        return Value(FLOAT, None, mixed_grey, (taps,), (image,))
    return Value(SEVERAL, None, mixed, (taps,), (image, choices[-1]))


def taps_at(where: Array, project: Any, *choices: Any) -> Any:
    """Return texels of images of one size and their weights at `where`, see `find_taps`."""
    u, v = _projected(where, project)
    return find_taps(u, v, *choices)


def mixed_grey(taps: Any, image: Image) -> Array:
    """Return the grey (n,) of an image at its texels."""
    return mix_grey(image, taps)


def mixed(taps: Any, image: Image, unassociate: bool) -> Array:
    """Return colours and alphas (4, n) of an image at its texels."""
    return mix_taps(image, taps, unassociate)


def _projected(where: Array, project: Any) -> tuple[Scalar, Scalar]:
    u, v = where[:2] if project is None else project(where * F32(2) - F32(1))
    return u, v


def _colour(texels: Array) -> Array:
    return texels[:3]


def _alpha(texels: Array) -> Array:
    return texels[3]


def _flat(where: Array, project: Any, image: Image | Tiles, *choices: Any) -> Array:
    return _at(image, *_projected(where, project), *choices)


def _at(image: Image | Tiles, u: Scalar, v: Scalar, *choices: Any) -> Array:
    """Return colours and alphas (4, n) of an image, or of the tile that each point lies on."""
    if isinstance(image, Image):
        return lookup(image, u, v, *choices)
    column, row = np.trunc(u), np.trunc(v)
    is_inside = (column >= 0) & (column < 10) & (row >= 0)
    number = np.where(is_inside, F32(1001) + column + F32(10) * row, F32(0))
    out = np.repeat(MAGENTA, u.size, axis=1)
    for tile, picture in image.images:
        index = np.flatnonzero(number == tile)
        if index.size:
            part = (u - column).take(index), (v - row).take(index)
            out[:, index] = lookup(picture, *part, *choices)
    return out


def boxed(context: Context, where: Array, blend: float, image: Image | Tiles, *choices: Any) -> Vec:
    """Return colours and alphas (4, n) of an image seen along the axes of the object."""
    normal = context.into_object(context.normal, "NORMAL")
    if isinstance(image, Tiles):
        image = Tiles(tuple(tile for tile in image.images if tile[0] == 1001))
    weights = _weights(np.abs(normal), F32(blend))
    x, y, z = np.broadcast_to(where, normal.shape)
    sides = (
        (np.where(normal[0] < 0, F32(1) - y, y), z),
        (np.where(normal[1] > 0, F32(1) - x, x), z),
        (np.where(normal[2] > 0, F32(1) - y, y), x),
    )
    out = np.zeros((4, normal.shape[1]), F32)
    for weight, (u, v) in zip(weights, sides, strict=True):
        index = np.flatnonzero(weight > 0)
        if index.size:
            texels = _at(image, u.take(index), v.take(index), *choices)
            out[:, index] += texels * weight.take(index)
    return out


def _weights(normal: Vec, blend: np.float32) -> Vec:
    """Return how much (3, n) each axis shows, from the sizes of a normal's components.

    One where its component is the largest by far, two or three where they are alike.
    """
    one, half = F32(1), F32(0.5)
    x, y, z = normal
    limit = half * (one + blend)
    pairs = {"xy": x + y, "xz": x + z, "yz": y + z}
    weights = np.zeros_like(normal)
    alone = (
        (x > limit * pairs["xy"]) & (x > limit * pairs["xz"]),
        (y > limit * pairs["xy"]) & (y > limit * pairs["yz"]),
        (z > limit * pairs["xz"]) & (z > limit * pairs["yz"]),
    )
    left = ~(alone[0] | alone[1] | alone[2])
    for row, is_alone in enumerate(alone):
        weights[row] = is_alone
    if blend <= 0:
        weights[0] += left
        return weights
    if not left.any():
        return weights

    # Two axes, where the third component is small
    for first, second, third in ((0, 1, 2), (1, 2, 0), (0, 2, 1)):
        both = normal[first] + normal[second]
        pair = left & (normal[third] < (one - limit) * both)
        share = normal[first] / np.where(both > 0, both, one)
        share = np.clip((share - half * (one - blend)) / blend, F32(0), one)
        weights[first] += np.where(pair, share, F32(0))
        weights[second] += np.where(pair, one - share, F32(0))
        left = left & ~pair

    # All three
    total = np.maximum(x + y + z, F32(1e-30))
    mixed = ((F32(2) - limit) * normal / total + (limit - one)) / (F32(2) * limit - one)
    weights += np.where(left, mixed, F32(0))
    return weights


IMAGES: dict[str, NodeFunction] = {"TexImage": _image}
