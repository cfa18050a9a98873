"""core.lights.triangle -> light of glowing triangles: energy, densities, precision."""

from itertools import product
from math import pi

import numpy as np
import pytest

from penumbra.core.geometry.mesh import bare_triangles
from penumbra.core.lights import Emitters, compile_lights, triangle
from penumbra.core.lights.triangle import BACK, FRONT, FRONT_BACK
from penumbra.core.sampling.warp import uniform_triangle, uniform_triangle_invert
from penumbra.core.scene import EVERY_SET
from penumbra.tests.support.statistics import SIGNIFICANCE, assert_same_mean, chi2_probability

F32 = np.float32
BELOW_ONE = F32(1 - 2.0**-24)
UP = np.array([0.0, 0.0, 1.0])


def compiled(*shapes, sides=FRONT_BACK, radiance=1.0, origin=(0, 0, 0)):
    """The lights that triangles (3, 3) are, all of them."""
    vertices = np.array(shapes, F32).reshape(-1, 3)
    corners = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    count = len(corners)
    emitters = Emitters(
        np.arange(count, dtype=np.int32),
        np.full((3, count), radiance, F32),
        np.full(count, 15, np.int32),
        np.full(count, sides, np.int32),
        *np.full((2, count), EVERY_SET, np.uint64),
    )
    return compile_lights((), np.array(origin, float), bare_triangles(vertices, corners), emitters)


def only(shape, sides=FRONT_BACK):
    return compiled(shape, sides=sides).single(0)


def columns(vector, count):
    return np.repeat(np.array(vector, F32)[:, None], count, axis=1)


def squares(side, seed=0):
    """side^2 jittered points u, v (N,) of the unit square."""
    cell = np.stack(np.meshgrid(np.arange(side), np.arange(side))).reshape(2, -1)
    uv = (cell + np.random.default_rng(seed).random(cell.shape)) / side
    return np.minimum(uv.astype(F32), BELOW_ONE)


def lambert(shape, point, normal):
    """Irradiance of a triangle of radiance 1: Lambert's formula, after clipping at the horizon."""
    corners = np.array(shape, F32).astype(float) - np.array(point, F32).astype(float)
    kept = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        high, next_high = a @ normal, b @ normal
        if high >= 0:
            kept.append(a)
        if high * next_high < 0:
            kept.append(a + (b - a) * high / (high - next_high))
    total = 0.0
    for a, b in zip(kept, kept[1:] + kept[:1], strict=True):
        across = np.cross(a, b)
        length = np.linalg.norm(across)
        if length > 0:
            total += np.arctan2(length, a @ b) * (across @ normal) / length / 2
    return abs(total)


SHAPES = {
    "right": ((0, 0, 1), (1, 0, 1), (0, 1, 1)),
    "tilted": ((0.3, 0.2, 0.4), (1, -1, 2), (-1, 0.4, 0.2)),
    "needle": ((0, 0, 1), (1, 0, 1), (0, 1e-3, 1)),
    "flat needle": ((0, 0, 1), (1, 1e-3, 1), (2, 0, 1)),
    "tiny": ((0, 0, 1), (1e-4, 0, 1), (0, 1e-4, 1)),
    "wide": ((-1, -1, 1), (2, -1, 1), (0, 2, 1)),
    "large": ((-100, -100, 1), (100, -100, 1), (0, 200, 1)),
}
POINTS = [
    (0, 0, 0),
    (0.2, 0.2, 0.5),
    (0.2, 0.2, 0.99),
    (0.5, 0, 0.99),
    (0, 0, 0.999),
    (0.1, -0.3, 0.9),
    (3, 4, 0),
    (50, 50, -20),
    (0.3, 0.4, 1.7),
]


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("name", SHAPES)
def test_irradiance_from_a_triangle_is_lamberts(name, point):
    light = only(SHAPES[name])
    u, v = squares(384)
    normal = UP if point[2] < 1 else -UP
    to_light, gain, _, distance = light.kind.sample(light.rows, columns(point, u.size), u, v)
    cosine = normal @ to_light.astype(float) / distance
    each = gain * np.maximum(cosine, 0)
    exact = lambert(SHAPES[name], point, normal)
    # stratified: below 1e-3 of the spread; near a plane, single precision ends
    assert each.mean() == pytest.approx(exact, rel=1e-3, abs=3e-3 * each.std() / np.sqrt(384))


@pytest.mark.parametrize("point", [(0.5, -2e-4, 0.9998), (0.5, -1e-3, 0.999), (0.3, -5e-4, 0.9995)])
def test_irradiance_close_beside_an_edge_is_lamberts(point):
    """Where the ends of the edge are opposite each other."""
    light = only(SHAPES["right"])
    u, v = squares(256)
    to_light, gain, _, distance = light.kind.sample(light.rows, columns(point, u.size), u, v)
    arriving = (gain * np.maximum(to_light[2].astype(float) / distance, 0)).mean()
    assert arriving == pytest.approx(lambert(SHAPES["right"], point, UP), rel=3e-4)


def solid_angle(shape, point):
    """Of a triangle [sr], in float64: Van Oosterom & Strackee 1983."""
    corners = np.array(shape, F32).astype(float) - np.array(point, F32).astype(float)
    a, b, c = corners / np.linalg.norm(corners, axis=1)[:, None]
    return 2 * np.arctan2(abs(a @ np.cross(b, c)), 1 + a @ b + a @ c + b @ c)


@pytest.mark.parametrize("point", [*POINTS, (0.2, 0.2, 0.995)])
@pytest.mark.parametrize("name", SHAPES)
def test_the_mean_gain_is_the_solid_angle(name, point):
    light = only(SHAPES[name])
    u, v = squares(256)
    _, gain, *_ = light.kind.sample(light.rows, columns(point, u.size), u, v)
    exact = solid_angle(SHAPES[name], point)
    assert gain.mean(dtype=float) == pytest.approx(
        exact, rel=1e-3, abs=3e-3 * float(gain.std()) / 16
    )


@pytest.mark.parametrize("height", [0.03, 1e-3, 1e-4, 1e-5, 1e-6])
def test_all_light_arrives_just_above_a_large_triangle(height):
    """Pi from the half space, at any height; the triangle is some 1 / height times as large."""
    light = only(((-1, -1, 0), (1, -1, 0), (0, 2, 0)))
    u, v = squares(256)
    to_light, gain, _, distance = light.kind.sample(
        light.rows, columns((0.1, 0.2, -height), u.size), u, v
    )
    cosine = np.maximum(to_light[2].astype(float) / distance, 0)
    assert (gain * cosine).mean() == pytest.approx(pi, rel=max(0.003, height**2))


@pytest.mark.parametrize("sides", [FRONT, BACK, FRONT_BACK])
def test_power_is_pi_area_radiance_on_each_side_sampled(sides):
    """On a sphere around it; 400 000 points with one sample each."""
    shape = SHAPES["tilted"]
    light, radius = only(shape, sides), 30.0
    a, b = squares(640, 1).astype(float)
    z, phi = 1 - 2 * a, 2 * pi * b
    normal = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z])
    u, v = np.random.default_rng(2).random((2, a.size)).astype(F32)
    to_light, gain, *_ = light.kind.sample(light.rows, (radius * normal).astype(F32), u, v)
    cosine = -(normal * to_light).sum(axis=0) / np.linalg.norm(to_light, axis=0)
    arriving = gain * np.maximum(cosine, 0) * 4 * pi * radius**2
    corners = np.array(shape)
    across = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    power = pi * np.linalg.norm(across) / 2
    assert arriving.mean() == pytest.approx(power * (2 if sides == FRONT_BACK else 1), rel=0.005)
    in_front = across @ (radius * normal - corners[0][:, None]) > 0
    for side, there in ((FRONT, in_front), (BACK, ~in_front)):
        light_there = arriving[np.flatnonzero(there)].mean()
        assert (light_there > 0) == bool(sides & side)


@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("name", SHAPES)
def test_the_density_of_what_is_hit_is_that_of_the_sample(name, point):
    light = only(SHAPES[name])
    u, v = squares(64)
    start = columns(point, u.size)
    to_light, gain, density, distance = light.kind.sample(light.rows, start, u, v, True)
    np.testing.assert_allclose(distance, np.linalg.norm(to_light, axis=0), rtol=1e-5)
    direction = to_light / distance
    found = triangle.pdf(light.rows, start, distance)
    np.testing.assert_allclose(found, density, rtol=1e-4)
    sent = np.flatnonzero(gain > 0)
    assert sent.size > 0.35 * u.size
    np.testing.assert_allclose(gain[sent] * density[sent], 1, rtol=1e-5)

    # `intersect` meets it there
    t, radiance, met = light.kind.intersect(light.rows, start, direction)
    inside = np.flatnonzero(np.isfinite(t) & (gain > 0))
    assert inside.size > 0.9 * sent.size
    np.testing.assert_allclose(t[inside], distance[inside], rtol=2e-3)
    np.testing.assert_allclose(met[inside], density[inside], rtol=1e-2)
    assert (radiance[inside] == 1).all()


@pytest.mark.parametrize("point", [(0.2, 0.2, 0.5), (0.1, -0.3, 0.9), (0.2, 0.2, 0.97), (1, 3, 0)])
@pytest.mark.parametrize("name", ["right", "tilted", "wide"])
def test_directions_to_a_triangle_are_distributed_as_their_density_says(name, point):
    light = only(SHAPES[name])
    u, v = np.random.default_rng(3).random((2, 200_000)).astype(F32)
    start = columns(point, u.size)
    to_light, gain, _, distance = light.kind.sample(light.rows, start, u, v)
    sent = np.flatnonzero(gain > 0)

    # Bins of the square that the triangle is a map of; mass by the density at fine points in them
    corner, one, other = np.array(SHAPES[name], float)
    edges = np.stack([one - corner, other - corner], axis=1)
    there = start.take(sent, axis=1).astype(float) + to_light.take(sent, axis=1) - corner[:, None]
    places = uniform_triangle_invert(np.linalg.lstsq(edges, there, rcond=None)[0])
    bins = np.clip(np.floor(np.array(places) * 16), 0, 15).astype(int)
    counts = np.bincount(bins[0] * 16 + bins[1], minlength=256)
    fine = (np.stack(np.meshgrid(np.arange(256), np.arange(256), indexing="ij")) + 0.5) / 256
    inside = corner[:, None] + edges @ uniform_triangle(*fine.reshape(2, -1))
    way = inside - np.array(point, F32).astype(float)[:, None]
    length = np.linalg.norm(way, axis=0)
    density = triangle.pdf(light.rows, columns(point, length.size), length.astype(F32))
    across = np.cross(edges[:, 0], edges[:, 1])
    mass = density * np.abs(across @ way) / 2 / length**3
    mass = mass.reshape(16, 16, 16, 16).mean(axis=(1, 3)).ravel() / 256
    assert mass.sum() == pytest.approx(sent.size / u.size, abs=5e-3)
    assert chi2_probability(counts, mass / mass.sum() * sent.size) > SIGNIFICANCE / 12


def test_samples_carry_the_barycentrics_of_their_points():
    shape = np.array(SHAPES["tilted"])
    light = only(shape)
    u, v = squares(32)
    for point in POINTS:
        sampled, (x, y) = triangle.sample_place(light.rows, columns(point, u.size), u, v)
        there = shape[0][:, None] * (1 - x - y) + shape[1][:, None] * x + shape[2][:, None] * y
        hit = columns(point, u.size) + sampled.to_light
        np.testing.assert_allclose(hit, there, atol=2e-5 * max(1, np.abs(point).max()))
        assert (x >= 0).all() and (y >= 0).all() and (x + y <= 1 + 1e-6).all()


def test_the_side_that_is_not_sampled_has_no_density():
    shape = SHAPES["right"]
    below, above = (0.2, 0.2, 0.0), (0.2, 0.2, 2.0)  # its normal points up
    u, v = squares(8)
    for sides, point, dark in product((FRONT, BACK), (below, above), (True,)):
        light = only(shape, sides)
        dark = (sides == FRONT) == (point is below)
        start = columns(point, u.size)
        _, gain, density, distance = light.kind.sample(light.rows, start, u, v, True)
        assert dark != bool((gain > 0).all()) and dark != bool((density > 0).all())
        way = columns((0, 0, 1 - point[2]), u.size)
        t, radiance, density = light.kind.intersect(light.rows, start, way)
        assert (t == 1).all() and (radiance == 1).all(), "it glows there all the same"
        assert dark != bool((density > 0).all())


def test_nothing_is_ever_not_finite():
    """Points on corners, edges, the plane and the triangle; and the ends of the random numbers."""
    near = [0.0, 0.5, 1.0, 1e-4, 1e-7, -1e-7, -1.0, 3e3]
    where = np.array(list(product(near, near, near)), F32).T
    degenerate = {"point": ((0, 0, 1),) * 3, "line": ((0, 0, 1), (1, 0, 1), (2, 0, 1))}
    for shape, size in product({**SHAPES, **degenerate}.values(), (1e-6, 1.0, 1e4)):
        light = only(np.array(shape) * size)
        point = (where + UP[:, None].astype(F32)) * F32(size)
        with np.errstate(invalid="raise", divide="raise", over="raise"):
            for u, v in product([0.0, 1e-7, 0.3, BELOW_ONE], repeat=2):
                uv = np.full((2, point.shape[1]), [[u], [v]], F32)
                sampled, place = triangle.sample_place(light.rows, point, *uv, True)
                for array in (*sampled, place):
                    assert np.isfinite(array).all() and array.dtype == F32
                _, gain, density, distance = sampled
                assert (gain >= 0).all() and (density >= 0).all() and (distance >= 0).all()
            for way in [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, 0, 0.8), (0.6, 0.8, 1e-9)]:
                direction = columns(way, point.shape[1])
                t, gain, density = light.kind.intersect(light.rows, point, direction)
                assert not np.isnan(t).any() and (t >= 0).all()
                assert np.isfinite(gain).all() and np.isfinite(density).all()
                density = triangle.pdf(light.rows, point, np.zeros(t.size, F32))
                assert np.isfinite(density).all()


def test_a_point_on_the_plane_of_a_triangle_gets_no_light():
    light = only(SHAPES["right"])
    u, v = squares(16)
    for point in [(0.2, 0.2, 1), (0, 0, 1), (0.5, 0.5, 1), (-3, 2, 1), (1, 0, 1)]:
        _, gain, density, _ = light.kind.sample(light.rows, columns(point, u.size), u, v, True)
        assert not gain.any() and not density.any()


def test_many_triangles_at_once_are_what_each_is_alone():
    lights = compiled(*SHAPES.values())
    alone = [lights.single(number) for number in range(len(SHAPES))]
    rng = np.random.default_rng(4)
    number = rng.integers(0, len(SHAPES), 600).astype(np.int32)
    point = rng.normal(size=(3, 600)).astype(F32)
    uv = rng.random((2, 600)).astype(F32)
    ((where, group),) = lights.split(number)
    assert where is None  # all of them
    together = group.kind.sample(group.rows, point, *uv, True)
    for column, own in enumerate(number):
        one = slice(column, column + 1)
        light = alone[own]
        single = light.kind.sample(light.rows, point[:, one], *uv[:, one], True)
        for a, b in zip(single, together, strict=True):
            np.testing.assert_allclose(a, b[..., one], rtol=1e-4, atol=1e-6)


def test_the_scenes_triangles_know_their_lights():
    vertices = np.random.default_rng(5).normal(size=(12, 3)).astype(F32)
    corners = np.arange(12, dtype=np.int32).reshape(4, 3)
    emitters = Emitters(
        np.array([3, 1], np.int32),
        np.array([[1, 2], [3, 4], [5, 6]], F32),
        np.array([15, 4], np.int32),
        np.array([FRONT, FRONT_BACK], np.int32),
        *np.full((2, 2), EVERY_SET, np.uint64),
    )
    lights = compile_lights((), np.zeros(3), bare_triangles(vertices, corners), emitters)
    assert lights.of_triangle.tolist() == [-1, 1, -1, 0]
    assert lights.first_triangle == 0 and lights.count == 2 and lights.each == 0
    for number, (shape, seen) in enumerate(((3, 15), (1, 4))):
        light = lights.single(number)
        np.testing.assert_array_equal(light.rows[:3, 0], vertices[3 * shape])
        np.testing.assert_array_equal(light.colour[:, 0], emitters.radiance[:, number])
        assert light.seen_by[0] == seen


def test_the_light_of_a_quad_is_sampled_without_bias():
    """One of its two triangles at a time; z-test of 64 estimates against Lambert's formula."""
    quad = ((-1, -1, 1), (1, -1, 1), (1, 1, 1)), ((-1, -1, 1), (1, 1, 1), (-1, 1, 1))
    lights = compiled(*quad, radiance=2.0)
    point, rng = (0.4, -0.3, 0.2), np.random.default_rng(6)
    exact = 2 * sum(lambert(half, point, UP) for half in quad)
    estimates = []
    for _ in range(64):
        a, b, u, v = rng.random((4, 1024)).astype(F32)
        start = columns(point, u.size)
        chosen, pmf = lights.choose(lights.place(start, columns(UP, u.size), 0), a, b, 0)
        ((_, group),) = lights.split(chosen)
        to_light, gain, _, distance = group.kind.sample(group.rows, start, u, v)
        light = group.colour[0] * gain * np.maximum(to_light[2] / distance, 0) / pmf
        estimates.append(light.astype(float).mean())
    assert_same_mean(np.array(estimates), exact)
