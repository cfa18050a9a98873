"""points -> distances, colours, positions.  Voronoi Texture, in octaves.

Source: Worley 1996, "A Cellular Texture Basis Function"; the distance to the edge is that of Inigo
Quilez, "Voronoi edges"; the smooth minimum and the octaves are Blender's.
"""

from collections.abc import Callable

import numpy as np

from ...arrays import F32
from ..values import Array
from .batches import by_octaves, in_chunks, spread
from .cells import Cells, Metric, around, cell_colour, cell_points, nearest, split
from .hashing import Integers

_ZERO, _HALF, _ONE = F32(0), F32(0.5), F32(1)
_TINY, _LARGE = F32(1e-30), F32(1e30)
_CHUNK = 2048  # points: arrays over the 27 cells around are 221 KB
EDGE, RADIUS = "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS"
# Output -> how many rows it has before it is Blender's socket
ROWS = {"Distance": 1, "Radius": 1, "Color": 3}


def voronoi(
    points: Array,
    scale: Array,
    detail: Array,
    roughness: Array,
    lacunarity: Array,
    smoothness: Array,
    exponent: Array,
    randomness: Array,
    output: str,
    feature: str,
    metric: str,
    is_normalized: bool,
    is_float: bool = False,
) -> Array:
    """Return an output of Blender's Voronoi Texture at scaled points (D, N), D = 1 to 4.

    output: "Distance" or "Radius" (1, N), "Color" (3, N), "Position" (D, N); what a feature does
    not have is 0.  The parameters (1,) or (N,) are those of Blender's node; is_float: cells are
    those of Blender before 5.0, which hashed their coordinates as floats.
    """
    dimensions = len(points)
    rows = ROWS.get(output, dimensions)
    randomness = np.minimum(np.maximum(randomness, _ZERO), _ONE)
    points = spread(points, randomness, smoothness, exponent)
    roughness = np.minimum(np.maximum(roughness, _ZERO), _ONE)
    if (feature == RADIUS) != (output == "Radius") or (
        feature == EDGE and output in ("Color", "Position")
    ):
        return np.zeros((rows, 1), F32)
    if feature == RADIUS:

        def radius(points: Array, randomness: Array) -> Array:
            return _radius(*split(points, is_float), randomness)

        return in_chunks(radius, (points, randomness), 1, _CHUNK)
    if not roughness.any():
        detail = np.zeros(1, F32)
    if feature == EDGE:

        def edge(octaves: int, share: Array, *numbers: Array) -> Array:
            return _edge_octaves(octaves, share, numbers, is_normalized, is_float)

        return by_octaves(edge, detail, (points, roughness, lacunarity, randomness), 1, _CHUNK)

    smoothness = np.minimum(np.maximum(smoothness * _HALF, _ZERO), _HALF)
    if feature == "SMOOTH_F1" and not smoothness.any():
        feature = "F1"

    def run(
        octaves: int,
        share: Array,
        points: Array,
        roughness: Array,
        lacunarity: Array,
        smoothness: Array,
        exponent: Array,
        randomness: Array,
        scale: Array,
    ) -> Array:
        def octave(points: Array) -> Array:
            cell, local = split(points, is_float)
            if feature == "SMOOTH_F1":
                return _smooth(cell, local, randomness, smoothness, lengths, output)
            return _nearest(cell, local, randomness, lengths, feature == "F2", output)

        lengths = Metric(metric if dimensions > 1 else "MANHATTAN", np.maximum(exponent, F32(1e-3)))
        total, most = _octaves(
            octave, points, octaves, share, roughness, lacunarity, output == "Position"
        )
        if output == "Position":
            safe = scale != 0
            return np.where(safe, total / np.where(safe, scale, _ONE), _ZERO)
        if not is_normalized:
            return total
        if output == "Distance":
            most = most * _farthest(lengths, randomness, dimensions)
            most = most * F32(2) if feature == "F2" else most
        return np.minimum(total / most, F32(3e38))

    arrays = (points, roughness, lacunarity, smoothness, exponent, randomness, scale)
    return by_octaves(run, detail, arrays, rows, _CHUNK if feature == "SMOOTH_F1" else 2 * _CHUNK)


def _octaves(
    octave: Callable[[Array], Array],
    points: Array,
    octaves: int,
    share: Array,
    roughness: Array,
    lacunarity: Array,
    is_place: bool,
) -> tuple[Array, Array]:
    """Return the sum of octaves, or the mixture of their places, and the sum of amplitudes."""
    total, most = octave(points), np.ones(1, F32)
    amplitude = scale = np.ones(1, F32)
    for place in range(1, octaves + 1 + bool(share.any())):
        scale, amplitude = scale * lacunarity, amplitude * roughness
        found = octave(points * scale)
        part = amplitude if place <= octaves else amplitude * share
        if is_place:
            total = total + (found / _nonzero(scale) - total) * part
        else:
            total = total + found * part
        most = most + part
    return total, most


def _nonzero(scale: Array) -> Array:
    return np.where(scale == 0, _TINY, scale)


def _farthest(metric: Metric, randomness: Array, dimensions: int) -> Array:
    """Return the distance by which Blender normalizes: that of a cell's middle and far corner."""
    half = _HALF + _HALF * randomness
    return metric.distance(metric.size([half] * dimensions))


def _nearest(
    cell: Cells, local: Array, randomness: Array, metric: Metric, is_second: bool, output: str
) -> Array:
    near = nearest(cell, local, randomness, metric, is_second)
    if output == "Distance":
        return metric.distance(near.size)[None]
    return _of_cell(cell, near.offset, randomness, output)


def _of_cell(cell: Cells, offset: Integers, randomness: Array, output: str) -> Array:
    """Return the colours or the places of the points of cells."""
    chosen = cell + offset
    if output == "Color":
        return cell_colour(list(chosen))
    return np.stack(cell_points(list(chosen))) * randomness + chosen.astype(F32)


def _smooth(
    cell: Cells, local: Array, randomness: Array, smoothness: Array, metric: Metric, output: str
) -> Array:
    """Return the smooth minimum over the 5^D cells around, one after the other."""
    smoothness = np.maximum(smoothness, F32(1e-6))
    softer = smoothness / (F32(3) * smoothness + _ONE)
    parts = around(cell, local, randomness, 2)
    lengths = metric.distance(metric.size(parts))
    smooth = lengths[0].copy()
    result: Array | None = None
    for place, length in enumerate(lengths):
        if place:
            share = (smooth - length) * (_HALF / smoothness) + _HALF
            share = np.minimum(np.maximum(share, _ZERO), _ONE)
            share = share * share * (F32(3) - F32(2) * share)
            bend = share * (_ONE - share)
            smooth += (length - smooth) * share
            smooth -= bend * smoothness
        if output == "Distance":
            continue
        if output == "Color":
            digits = np.unravel_index(place, (5,) * len(cell))[::-1]
            there = cell + np.array(digits, np.int32)[:, None] - np.int32(2)
            value = cell_colour(list(there))
        else:
            value = np.stack([part[place] for part in parts]) + local
        if result is None:
            result = value
        else:
            result += (value - result) * share
            result -= bend * softer
    if output == "Distance":
        return smooth[None]
    assert result is not None
    return result if output == "Color" else result + cell.astype(F32)


def _edge_octaves(
    octaves: int,
    share: Array,
    numbers: tuple[Array, ...],
    is_normalized: bool,
    is_float: bool,
) -> Array:
    """Return the distances (1, N) to the nearest edge of any octave."""
    points, roughness, lacunarity, randomness = numbers
    reach = _HALF + _HALF * randomness
    total, most = _edge(*split(points, is_float), randomness), reach
    amplitude = scale = np.ones(1, F32)
    for place in range(1, octaves + 1 + bool(share.any())):
        scale, amplitude = scale * lacunarity, amplitude * roughness
        part = amplitude if place <= octaves else amplitude * share
        unit = _nonzero(scale)
        found = np.minimum(total, _edge(*split(points * scale, is_float), randomness) / unit)
        if place <= octaves:
            total = total + (found - total) * amplitude
        else:
            mixed = total + (found - total) * amplitude
            total = total + (np.minimum(total, mixed) - total) * share
        most = most + (reach / unit - most) * part
    return (total / most if is_normalized else total)[None]


def _edge(cell: Cells, local: Array, randomness: Array) -> Array:
    """Return the distances (N,) to the edges of the cells."""
    parts = around(cell, local, randomness, 1)
    if len(cell) == 1:
        low, middle, high = parts[0]
        return np.minimum(np.abs(middle + low), np.abs(middle + high)) * _HALF

    # Find the nearest point, then the nearest of the planes halfway to the others.
    size = parts[0] * parts[0]
    for part in parts[1:]:
        size += part * part
    code, best = np.zeros(size.shape[1], np.int8), size[0].copy()
    for place, row in enumerate(size):
        code += (row < best).view(np.int8) * (np.int8(place) - code)
        np.minimum(best, row, out=best)
    index = code.astype(np.intp) * size.shape[1] + np.arange(size.shape[1])
    across, along = np.zeros_like(size), np.zeros_like(size)
    for part in parts:
        closest = part.ravel().take(index)
        way = part - closest
        across += way * way
        way *= part + closest
        along += way
    is_same = across <= F32(1e-4)
    across += is_same
    along *= _HALF
    along /= np.sqrt(across)
    along += is_same * _LARGE
    return along.min(axis=0)


def _radius(cell: Cells, local: Array, randomness: Array) -> Array:
    """Return the radii (1, N) of the balls about cells' points that reach halfway to the next."""
    metric = Metric("EUCLIDEAN", np.ones(1, F32))
    chosen = cell + nearest(cell, local, randomness, metric).offset
    inside = np.stack(cell_points(list(chosen))) * randomness
    parts = around(chosen, np.broadcast_to(inside, chosen.shape), randomness, 1)
    size = parts[0] * parts[0]
    for part in parts[1:]:
        size += part * part
    size[len(size) // 2] = _LARGE
    return (np.sqrt(size.min(axis=0)) * _HALF)[None]
