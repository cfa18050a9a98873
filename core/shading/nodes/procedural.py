"""node -> Value.  The procedural textures: noise, cells, waves, bricks and what else has a formula.

Where nothing feeds Vector, they lie in the box of the object (Generated), as in Cycles.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import F32
from ...scene import Node
from ..graph import Graph
from ..textures.brick import brick
from ..textures.checker import checker
from ..textures.gabor import gabor
from ..textures.gradient import gradient
from ..textures.magic import magic
from ..textures.noise import noise
from ..textures.voronoi import voronoi
from ..textures.wave import wave
from ..textures.white_noise import white_noise
from ..values import COLOUR, FLOAT, VECTOR, Array, Value, constant, mix, step, widened
from .coordinates import COORDINATES
from .legacy import mapped

NodeFunction = Callable[[Graph, Node, str], Value | None]


def coordinates(graph: Graph, node: Node) -> Value:
    """Return where a texture is looked up: what feeds Vector, else Generated; then its mapping."""
    linked = graph.vector(node, "Vector") if graph.is_linked(node, "Vector") else None
    where = COORDINATES["Generated"] if linked is None else linked
    return mapped(graph, node, where)


def _scaled(graph: Graph, node: Node, default: float) -> Value:
    return coordinates(graph, node) * graph.number(node, "Scale", default)


def _dimensions(graph: Graph, node: Node) -> int:
    return int(
        graph.choice(node, "noise_dimensions", graph.choice(node, "voronoi_dimensions", "3D"))[0]
    )


def _points(vector: Array, w: Array, dimensions: int) -> Array:
    """Return the coordinates (D, N) of textures in D dimensions; W alone in one, last in four."""
    if dimensions == 1:
        return w[None]
    if dimensions < 4:
        return vector[:dimensions]
    return np.stack(np.broadcast_arrays(*vector, w))


def _in_space(graph: Graph, node: Node, scale: Value | None, default: Value) -> tuple[Value, Value]:
    """Return the vector and W of a texture, as far as its dimensions need them, scaled."""
    dimensions = _dimensions(graph, node)
    zero = constant(0.0, VECTOR)
    vector = default if dimensions > 1 else zero
    w = graph.number(node, "W") if dimensions in (1, 4) else constant(0.0)
    return (vector, w) if scale is None else (vector * scale, w * scale)


def _white_noise(graph: Graph, node: Node, output: str) -> Value:
    vector = graph.vector(node, "Vector", (0, 0, 0))
    assert vector is not None
    vector, w = _in_space(graph, node, None, vector)
    is_colour = output == "Color"
    static = _dimensions(graph, node), is_colour
    return step(_white_step, vector, w, kind=COLOUR if is_colour else FLOAT, static=static)


def _white_step(vector: Array, w: Array, dimensions: int, is_colour: bool) -> Array:
    found = white_noise(_points(vector, w, dimensions), is_colour)
    return found if is_colour else found[0]


def _noise(graph: Graph, node: Node, output: str) -> Value:
    scale = graph.number(node, "Scale", 5.0)
    vector, w = _in_space(graph, node, scale, coordinates(graph, node))
    numbers = [
        graph.number(node, socket, default)
        for socket, default in (
            ("Detail", 2.0),
            ("Roughness", 0.5),
            ("Lacunarity", 2.0),
            ("Offset", 0.0),
            ("Gain", 1.0),
            ("Distortion", 0.0),
        )
    ]
    is_colour = output == "Color"
    kind, is_normalized = (
        graph.choice(node, "noise_type", "FBM"),
        graph.choice(node, "normalize", True),
    )
    static = _dimensions(graph, node), kind, bool(is_normalized), is_colour
    return step(
        _noise_step, vector, w, *numbers, kind=COLOUR if is_colour else FLOAT, static=static
    )


def _noise_step(
    vector: Array,
    w: Array,
    detail: Array,
    roughness: Array,
    lacunarity: Array,
    offset: Array,
    gain: Array,
    distortion: Array,
    dimensions: int,
    *choices: Any,
) -> Array:
    points = _points(vector, w, dimensions)
    found = noise(points, detail, roughness, lacunarity, offset, gain, distortion, *choices)
    return found if len(found) == 3 else found[0]


def _voronoi(graph: Graph, node: Node, output: str) -> Value:
    scale = graph.number(node, "Scale", 5.0)
    vector, w = _in_space(graph, node, scale, coordinates(graph, node))
    numbers = [
        graph.number(node, socket, default)
        for socket, default in (
            ("Detail", 0.0),
            ("Roughness", 0.5),
            ("Lacunarity", 2.0),
            ("Smoothness", 1.0),
            ("Exponent", 0.5),
            ("Randomness", 1.0),
        )
    ]
    static = (
        _dimensions(graph, node),
        output,
        graph.choice(node, "feature", "F1"),
        graph.choice(node, "distance", "EUCLIDEAN"),
        bool(graph.choice(node, "normalize", False)),
        bool(graph.choice(node, "is_float", False)),
    )
    kind = {"Color": COLOUR, "Position": VECTOR}.get(output, FLOAT)
    return step(_voronoi_step, vector, w, scale, *numbers, kind=kind, static=static)


def _voronoi_step(
    vector: Array,
    w: Array,
    scale: Array,
    detail: Array,
    roughness: Array,
    lacunarity: Array,
    smoothness: Array,
    exponent: Array,
    randomness: Array,
    dimensions: int,
    output: str,
    *choices: Any,
) -> Array:
    if output == "W" and dimensions not in (1, 4):
        return np.zeros(1, F32)
    if output == "Position" and dimensions == 1:
        return np.zeros((3, 1), F32)
    numbers = detail, roughness, lacunarity, smoothness, exponent, randomness
    wanted = "Position" if output == "W" else output
    found = voronoi(_points(vector, w, dimensions), scale, *numbers, wanted, *choices)
    found = np.nan_to_num(found)  # scales and exponents of any size may be beyond float32
    if output == "Position":
        return found[:3] if len(found) > 2 else np.stack((*found, np.zeros_like(found[0])))
    return found if output == "Color" else found[-1]


def _shown(found: Value, output: str) -> Value:
    """Return a texture's number as its Fac or its Color."""
    return widened(found, COLOUR) if output == "Color" else found


def _wave(graph: Graph, node: Node, output: str) -> Value:
    kind = graph.choice(node, "wave_type", "BANDS")
    direction = graph.choice(node, f"{kind.lower()}_direction", "X")
    numbers = [
        graph.number(node, socket, default)
        for socket, default in (
            ("Distortion", 0.0),
            ("Detail", 2.0),
            ("Detail Scale", 1.0),
            ("Detail Roughness", 0.5),
            ("Phase Offset", 0.0),
        )
    ]
    static = kind, direction, graph.choice(node, "wave_profile", "SIN")
    found = step(wave, _scaled(graph, node, 5.0), *numbers, kind=FLOAT, static=static)
    return _shown(found, output)


def _magic(graph: Graph, node: Node, output: str) -> Value:
    numbers = _scaled(graph, node, 5.0), graph.number(node, "Distortion", 1.0)
    depth = int(graph.choice(node, "turbulence_depth", 2))
    found = step(magic, *numbers, kind=VECTOR, static=(depth,))
    # Its Fac is the mean of the colour, not the luminance.
    return widened(found, COLOUR if output == "Color" else FLOAT)


def _brick(graph: Graph, node: Node, output: str) -> Value:
    numbers = [
        graph.number(node, socket, default)
        for socket, default in (
            ("Mortar Size", 0.02),
            ("Mortar Smooth", 0.1),
            ("Bias", 0.0),
            ("Brick Width", 0.5),
            ("Row Height", 0.25),
        )
    ]
    pattern = (
        float(graph.choice(node, "offset", 0.5)),
        int(graph.choice(node, "offset_frequency", 2)),
        float(graph.choice(node, "squash", 1.0)),
        int(graph.choice(node, "squash_frequency", 2)),
    )
    where = _scaled(graph, node, 5.0)
    shade, mortar = (
        step(_brick_row, where, *numbers, kind=FLOAT, static=(pattern, row)) for row in (0, 1)
    )
    if output != "Color":
        return mortar
    one, two = graph.colour(node, "Color1"), graph.colour(node, "Color2")
    return mix(mix(one, two, shade), graph.colour(node, "Mortar"), mortar)


def _brick_row(*numbers: Any) -> Array:
    return brick(*numbers[:-1])[numbers[-1]]


def _checker(graph: Graph, node: Node, output: str) -> Value:
    found = step(checker, _scaled(graph, node, 5.0), kind=FLOAT)
    if output != "Color":
        return found
    return mix(graph.colour(node, "Color2"), graph.colour(node, "Color1"), found)


def _gradient(graph: Graph, node: Node, output: str) -> Value:
    kind = graph.choice(node, "gradient_type", "LINEAR")
    found = step(gradient, coordinates(graph, node), kind=FLOAT, static=(kind,))
    return _shown(found, output)


def _gabor(graph: Graph, node: Node, output: str) -> Value | None:
    dimensions = int(graph.choice(node, "gabor_type", "2D")[0])
    if dimensions == 2:
        orientation: Value | None = graph.number(node, "Orientation 2D", np.pi / 4)
    else:
        orientation = graph.vector(node, "Orientation 3D", (np.sqrt(0.5), np.sqrt(0.5), 0))
    assert orientation is not None
    frequency = graph.number(node, "Frequency", 2.0)
    anisotropy = graph.number(node, "Anisotropy", 1.0)
    where = _scaled(graph, node, 5.0)
    static = dimensions, output
    return step(_gabor_step, where, frequency, anisotropy, orientation, kind=FLOAT, static=static)


def _gabor_step(
    vector: Array,
    frequency: Array,
    anisotropy: Array,
    orientation: Array,
    dimensions: int,
    output: str,
) -> Array:
    return gabor(vector[:dimensions], frequency, anisotropy, orientation, output)


PROCEDURAL: dict[str, NodeFunction] = {
    "TexWhiteNoise": _white_noise,
    "TexNoise": _noise,
    "TexVoronoi": _voronoi,
    "TexWave": _wave,
    "TexMagic": _magic,
    "TexBrick": _brick,
    "TexChecker": _checker,
    "TexGradient": _gradient,
    "TexGabor": _gabor,
}
