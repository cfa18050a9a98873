"""core.shading.textures -> Blender's numbers, on whichever way a batch is computed."""

import numpy as np
import pytest

from penumbra.core.shading.textures import cells
from penumbra.core.shading.textures.batches import by_octaves
from penumbra.core.shading.textures.gabor import gabor
from penumbra.core.shading.textures.hashing import hash_words
from penumbra.core.shading.textures.noise import TYPES, noise
from penumbra.core.shading.textures.perlin import perlin
from penumbra.core.shading.textures.voronoi import voronoi
from penumbra.core.shading.textures.white_noise import white_noise

F32 = np.float32
GENERATOR = np.random.default_rng(3)


def number(value):
    return np.full(1, value, F32)


def fractal(points, detail=2.5, kind="FBM", colour=False):
    rest = (number(0.5), number(2), number(0.7), number(1.3), number(0))
    return noise(points, np.atleast_1d(F32(detail)), *rest, kind, True, colour)


def cellular(points, output="Distance", feature="F1", metric="EUCLIDEAN", randomness=1.0):
    rest = (number(0), number(0.5), number(2), number(1), number(1.7), number(randomness))
    return voronoi(points, number(1.5), *rest, output, feature, metric, False)


# Two points (x, y, z, w), and what Blender 5.2's Cycles makes of their first D coordinates, of W
# alone where D = 1; rendered to 6 digits
POINTS = np.array([(0.75, 0.25, 0.4375, 1.3125), (-0.75, 1.75, 0.8125, 2.4375)], F32).T
WHITE = {
    1: (0.296329, 0.734701),
    2: (0.813179, 0.883169),
    3: (0.90267, 0.597449),
    4: (0.822991, 0.216933),
}
NOISE = {
    1: (0.526935, 0.381618),
    2: (0.481525, 0.358446),
    3: (0.384452, 0.46984),
    4: (0.516936, 0.469309),
}
VORONOI = {
    1: (0.82039, 0.137483),
    2: (0.201964, 0.275535),
    3: (0.789466, 0.481091),
    4: (0.741796, 0.68469),
}


def points_in(dimensions):
    return POINTS[3:] if dimensions == 1 else POINTS[:dimensions]


@pytest.mark.parametrize("dimensions", WHITE)
def test_white_noise_is_that_of_cycles(dimensions):
    found = white_noise(points_in(dimensions), False)[0]
    np.testing.assert_allclose(found, WHITE[dimensions], atol=2e-6)


@pytest.mark.parametrize("dimensions", NOISE)
def test_noise_is_that_of_cycles(dimensions):
    """Perlin noise of each dimension, blended by its type (1.5 is the scale of the rows)."""
    points = points_in(dimensions) * F32(1.5)
    rest = (number(0.5), number(2), number(0.7), number(1.3), number(0))
    found = noise(points, number(2.5), *rest, "FBM", True, False)[0]
    np.testing.assert_allclose(found, NOISE[dimensions], atol=2e-6)


@pytest.mark.parametrize("dimensions", VORONOI)
def test_cells_are_those_of_cycles(dimensions):
    found = cellular(points_in(dimensions) * F32(1.5))[0]
    np.testing.assert_allclose(found, VORONOI[dimensions], atol=2e-6)


def test_hashes_of_corners_are_those_of_their_coordinates_alone():
    """What is shared between corners must not change the hash."""
    x, y, z, w = GENERATOR.integers(0, 2**32, (4, 3), dtype=np.uint32)
    together = hash_words([x, y[:, None], z[:, None, None], w[:, None, None, None]])
    for (i, j, k, m), found in np.ndenumerate(together):
        alone = hash_words([x[m : m + 1], y[k : k + 1], z[j : j + 1], w[i : i + 1]])
        assert alone[0] == found


@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
def test_noise_of_a_large_batch_has_the_same_bits_as_that_of_few_points(dimensions):
    """Where a batch is large, its gradients come from a table."""
    points = GENERATOR.uniform(-3, 4, (dimensions, 20_000)).astype(F32)
    few = np.concatenate([perlin(part) for part in np.array_split(points, 40, axis=1)])
    np.testing.assert_array_equal(perlin(points), few)


@pytest.mark.parametrize("dimensions", [1, 2, 3, 4])
def test_noise_is_0_on_the_grid_and_repeats_after_100000(dimensions):
    grid = GENERATOR.integers(-50, 50, (dimensions, 100)).astype(F32)
    np.testing.assert_array_equal(perlin(grid), 0)
    between = np.abs(grid) + F32(0.25)
    np.testing.assert_allclose(perlin(between + F32(100_000)), perlin(between), atol=1e-6)


@pytest.mark.parametrize("kind", TYPES)
def test_points_of_different_detail_are_as_if_alone(kind):
    points = GENERATOR.uniform(-5, 5, (3, 200)).astype(F32)
    detail = GENERATOR.uniform(-1, 5, 200).astype(F32)
    detail[::7] = np.floor(detail[::7])
    alone = [fractal(points[:, i : i + 1], detail[i], kind)[0, 0] for i in range(200)]
    np.testing.assert_allclose(fractal(points, detail, kind)[0], alone, rtol=1e-5, atol=1e-6)


def test_batches_are_cut_into_pieces_that_do_not_show():
    rows = GENERATOR.random((3, 1000), dtype=F32), number(2), GENERATOR.random(1000, dtype=F32)

    def product(octaves, share, points, factor, shift):
        return points * factor + shift + octaves + share

    whole = by_octaves(product, rows[2] * 3, rows, 3, 10_000)
    np.testing.assert_array_equal(by_octaves(product, rows[2] * 3, rows, 3, 64), whole)
    np.testing.assert_allclose(whole, rows[0] * 2 + rows[2] * 4, rtol=1e-6)


@pytest.mark.parametrize("metric", cells.METRICS)
@pytest.mark.parametrize("dimensions", [2, 3, 4])
@pytest.mark.parametrize("is_second", [False, True])
def test_looking_at_near_cells_first_finds_what_looking_at_all_finds(metric, dimensions, is_second):
    count = 3000
    points = GENERATOR.uniform(-9, 9, (dimensions, count)).astype(F32)
    cell, local = cells.split(points)
    randomness = GENERATOR.random(count, dtype=F32)
    how = cells.Metric(metric, GENERATOR.uniform(0.4, 6, count).astype(F32))
    sizes = np.sort(how.size(cells.around(cell, local, randomness, 1)), axis=0)[int(is_second)]
    near = cells.nearest(cell, local, randomness, how, is_second)
    np.testing.assert_allclose(near.size, sizes, rtol=2e-5)

    # The cell it names has that point.
    there = cell + near.offset
    inside = np.stack(cells.cell_points(list(there))) * randomness
    ways = list(inside + near.offset.astype(F32) - local)
    np.testing.assert_allclose(how.size(ways), sizes, rtol=2e-4, atol=1e-6)


@pytest.mark.parametrize("size", [1e6, 1e12, 1e30])
def test_points_far_away_have_finite_values(size):
    points = (GENERATOR.uniform(-1, 1, (3, 300)) * size).astype(F32)
    found = [fractal(points, kind=kind, colour=True) for kind in TYPES]
    found.append(white_noise(points, True))
    found.extend(
        cellular(points, output, feature)
        for output in ("Distance", "Color", "Position", "Radius")
        for feature in ("F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS")
    )
    direction = np.array([[0], [0], [1]], F32)
    found.append(gabor(points, number(2), number(0.5), direction, "Phase"))
    assert all(np.isfinite(values).all() for values in found)
