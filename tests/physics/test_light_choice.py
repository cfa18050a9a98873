"""core.lights.choice -> one light of many at each point: what is promised of the choice."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core.geometry.mesh import bare_triangles
from penumbra.core.lights import SAMPLED_EACH, Emitters, choice, compile_lights
from penumbra.core.lights.choice import LEAST, SLOTS
from penumbra.core.lights.tree import NODE_ROWS, STRENGTH, Sources, compile_tree
from penumbra.core.lights.triangle import FRONT_BACK
from penumbra.core.scene import EVERY_SET, Lamp
from penumbra.tests.support.statistics import SIGNIFICANCE, assert_same_mean, chi2_probability

F32 = np.float32
ORIGIN = np.zeros(3)
FLOOR = np.array([(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0)], F32)


def lamp(kind, at, strength, axes=None, **more):
    to_world = np.column_stack([np.eye(3) if axes is None else axes, at])
    return Lamp("L", kind, to_world, (strength,) * 3, **more)


def lamps(count, rng, suns=0):
    kinds = ("POINT", "SPOT", "AREA")
    for number in range(count):
        axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        at = rng.normal(0, 3, 3) + [0, 0, 4]
        yield lamp(kinds[number % 3], at, rng.lognormal(), axes, radius=0.1, spot_angle=1.5)
    for _ in range(suns):
        axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        yield lamp("SUN", rng.normal(0, 3, 3), rng.uniform(0.1, 1), axes, angle=0.1)


def scene(count, triangles=0, suns=0, seed=1):
    """Lamps, and little triangles that glow, above a floor."""
    rng = np.random.default_rng(seed)
    centre = rng.normal(0, 2, (triangles, 1, 3)) + [0, 0, 3]
    glow = (centre + rng.normal(0, 0.1, (triangles, 3, 3))).reshape(-1, 3)
    vertices = np.concatenate([FLOOR, glow]).astype(F32)
    corners = np.array([(0, 1, 2), (0, 2, 3)]).tolist()
    corners += np.arange(4, len(vertices)).reshape(-1, 3).tolist()
    emitters = Emitters(
        np.arange(2, 2 + triangles, dtype=np.int32),
        np.repeat(rng.uniform(1, 30, (1, triangles)), 3, axis=0).astype(F32),
        np.full(triangles, 15, np.int32),
        np.full(triangles, FRONT_BACK, np.int32),
        *np.full((2, triangles), EVERY_SET, np.uint64),
    )
    mesh = bare_triangles(vertices, np.array(corners, np.int32))
    return compile_lights(tuple(lamps(count, rng, suns)), ORIGIN, mesh, emitters)


SCENES = {
    "lamps": scene(40),
    "lamps and suns": scene(40, suns=7),
    "suns": scene(0, suns=12),
    "triangles": scene(0, 3000),
    "a quad": scene(3, 2),
    "all": scene(30, 500, 3),
    "one triangle": scene(0, 1),
}


def somewhere(count, seed=2):
    rng = np.random.default_rng(seed)
    position = rng.uniform(-14, 14, (3, count)).astype(F32)  # the scene ends at 10
    position[2] = np.where(rng.random(count) < 0.5, 0, position[2])
    normal = rng.normal(size=(3, count))
    normal[:, ::3] = [[0], [0], [1]]
    return position, (normal / np.linalg.norm(normal, axis=0)).astype(F32)


def each_light(lights, place):
    """The probabilities (lights, N) of all that can be chosen."""
    numbers = np.arange(lights.each, lights.count, dtype=np.int32)
    return np.stack([lights.pmf(place, np.full(place.size, n, np.int32)) for n in numbers])


@pytest.mark.parametrize("name", SCENES)
def test_probabilities_add_up_to_1_and_none_is_0(name):
    lights = SCENES[name]
    position, normal = somewhere(100)
    for normals in (normal, None):
        pmf = each_light(lights, lights.place(position, normals, 0)).astype(float)
        np.testing.assert_allclose(pmf.sum(axis=0), 1, atol=1e-5)
        assert pmf.min() > 0.1 * LEAST * 1e-2 / max(1, lights.count)


@pytest.mark.parametrize("name", SCENES)
def test_lights_are_chosen_as_often_as_their_probability_says(name):
    """Chi2 at 6 points of 100 000 choices each."""
    lights = SCENES[name]
    position, normal = somewhere(6, seed=3)
    rng = np.random.default_rng(4)
    place = lights.place(position, normal, 0)
    expected = each_light(lights, place).astype(float)
    for one, chances in zip(place, expected.T, strict=True):
        u, v = rng.random((2, 100_000)).astype(F32)
        there = np.full(u.size, one, np.int32)
        light, pmf = lights.choose(there, u, v, 0)
        np.testing.assert_allclose(pmf, chances[light - lights.each], rtol=1e-4)
        counts = np.bincount(light - lights.each, minlength=chances.size)
        assert chi2_probability(counts, chances * u.size) > SIGNIFICANCE / 6


@pytest.mark.parametrize("name", SCENES)
def test_the_ends_of_the_random_numbers_choose_lights_that_exist(name):
    lights = SCENES[name]
    rows = np.arange(0, lights.first.lower.size // (SLOTS + 1), 3, dtype=np.int32)
    place = np.invert(rows)  # of all of them, as first hits know them
    for u in (0.0, 2.0**-24, 0.5, 1 - 2.0**-24):
        for v in (0.0, 2.0**-24, 1 - 2.0**-24):
            light, pmf = lights.choose(place, *np.full((2, place.size), [[u], [v]], F32), 0)
            assert light.dtype == np.int32 and pmf.dtype == F32
            assert (light >= lights.each).all() and (light < lights.count).all()
            np.testing.assert_array_equal(pmf, lights.pmf(place, light))
            assert (pmf > 0).all() and (pmf <= 1).all()


def test_a_few_lamps_are_sampled_each_and_triangles_never():
    for count in (0, 1, SAMPLED_EACH):
        lights = scene(count, 2)
        assert lights.each == count == lights.first_triangle and lights.count == count + 2
        assert lights.of_triangle.tolist() == [-1, -1, count, count + 1]
    assert scene(SAMPLED_EACH).first is None
    assert scene(0) is None
    many = scene(SAMPLED_EACH + 1, 2)
    assert many.each == 0 and many.first is many.deep is not None
    assert many.deep.light.size == many.count


@pytest.mark.parametrize("name", ["lamps and suns", "triangles", "all"])
def test_the_light_of_one_chosen_is_on_average_that_of_all(name):
    """The z-test of 60 estimates of the irradiance at each of 5 points, one of them outside."""
    lights = SCENES[name]
    rng = np.random.default_rng(6)
    points = np.array([(0, 0, 0), (3, -2, 0), (-9, 9, 0), (0, 0, 2.5), (12, 3, 1)], F32)
    normal = np.array([(0, 0, 1), (0, 0, 1), (0.6, 0, 0.8), (0, -1, 0), (-0.48, 0.6, 0.64)], F32)
    for point, up in zip(points, normal, strict=True):

        def irradiance(light, point=point, up=up):
            """Of one sample of each light of the array."""
            out = np.zeros(light.size)
            for some, group in lights.split(light):
                where = np.arange(light.size) if some is None else some
                start = np.repeat(point[:, None], where.size, axis=1)
                u, v = rng.random((2, where.size)).astype(F32)
                to_light, gain, _, distance = group.kind.sample(group.rows, start, u, v)
                out[where] = group.colour[0] * gain * np.maximum(up @ to_light / distance, 0)
            return out

        every = np.tile(np.arange(lights.count, dtype=np.int32), max(1, 20_000 // lights.count))
        truth = [irradiance(every).mean() * lights.count for _ in range(40)]
        estimates = []
        for _ in range(60):
            start, ups = (np.repeat(x[:, None], 2048, axis=1) for x in (point, up))
            place = lights.place(start, ups, 0)
            chosen, pmf = lights.choose(place, *rng.random((2, 2048)).astype(F32), 0)
            estimates.append((irradiance(chosen) / pmf).mean())
        assert_same_mean(np.array(truth), np.array(estimates), tests=15)


def test_near_and_strong_lights_are_chosen_before_others():
    """On a street of lamps, the choice comes near to what they give; by power it is far off."""
    rng = np.random.default_rng(7)
    street = [
        lamp("POINT", (20 * i, 8 * j, 6), rng.uniform(0.5, 2)) for i in range(200) for j in (-1, 1)
    ]
    ground = np.array([(-50, -40, 0), (4050, -40, 0), (4050, 40, 0), (-50, 40, 0)], F32)
    mesh = bare_triangles(ground, np.array([(0, 1, 2), (0, 2, 3)], np.int32))
    lights = compile_lights(tuple(street), ORIGIN, mesh)
    point = np.stack([rng.uniform(0, 4000, 300), rng.uniform(-15, 15, 300), np.zeros(300)])
    up = np.repeat(np.array([[0.0], [0.0], [1.0]], F32), 300, axis=1)
    at = np.stack([light.to_world[:, 3] for _, light in lights.lamps])
    strength = np.array([light.strength[0] for _, light in lights.lamps])
    way = at[:, :, None] - point
    given = strength[:, None] * way[:, 2] / (way**2).sum(axis=1) ** 1.5
    pmf = each_light(lights, lights.place(point.astype(F32), up, 0)).astype(float)
    variance = (given**2 / pmf).sum(axis=0) / given.sum(axis=0) ** 2 - 1
    even = (given**2).sum(axis=0) * len(street) / given.sum(axis=0) ** 2 - 1
    assert np.median(variance) < 0.5 and variance.mean() < 1.5 < 0.05 * even.mean()


def test_lights_behind_a_surface_are_rarely_chosen():
    rng = np.random.default_rng(8)
    made = [lamp("POINT", (*rng.uniform(-9, 9, 2), z), 1.0) for z in (-3, 3) for _ in range(20)]
    mesh = bare_triangles(FLOOR, np.array([(0, 1, 2), (0, 2, 3)], np.int32))
    lights = compile_lights(tuple(made), ORIGIN, mesh)
    above = np.array([light.to_world[2, 3] > 0 for _, light in lights.lamps])
    point = np.stack([*rng.uniform(-9, 9, (2, 200)), np.zeros(200)]).astype(F32)
    for sign in (1, -1):
        normal = np.repeat(np.array([[0], [0], [sign]], F32), 200, axis=1)
        share = each_light(lights, lights.place(point, normal, 0))[above == (sign > 0)].sum(axis=0)
        assert share.mean() > 0.9 and share.min() > 0.7
    both = each_light(lights, lights.place(point, None, 0))[above].sum(axis=0)
    assert 0.3 < both.mean() < 0.7


def test_strong_suns_get_their_share():
    made = [lamp("POINT", (i, 0, 3), 1.0) for i in range(20)]
    weak, strong = (
        compile_lights((*made, lamp("SUN", (0, 0, 0), irradiance)), ORIGIN)
        for irradiance in (1e-3, 100.0)
    )
    point = np.array([[5], [0], [0]], F32)
    up = np.array([[0], [0], [1]], F32)
    for lights, low, high in ((weak, 0, 0.05), (strong, 0.9, 1)):
        (sun,) = lights.distant
        assert low < lights.pmf(lights.place(point, up, 0), np.array([sun], np.int32))[0] < high
        below = lights.pmf(lights.place(point, -up, 0), np.array([sun], np.int32))[0]
        assert below < 0.5


@pytest.mark.parametrize("count", [1, 2, 3, 17, 500])
@pytest.mark.parametrize("same", [False, True])
def test_the_tree_has_every_light_once_and_adds_them_up(count, same):
    rng = np.random.default_rng(count)
    centre = np.zeros((3, count)) if same else rng.normal(size=(3, count))
    strength = rng.uniform(1, 2, count)
    sources = Sources(
        centre, np.zeros(count), strength, np.zeros((3, count)), np.zeros(count, np.int32)
    )
    tree = compile_tree(sources)
    assert tree.node.shape == (NODE_ROWS, 2 * count)
    found, stack = [], [(tree.root, 0, count)]
    while stack:
        node, low, high = stack.pop()
        assert tree.first[node] == low
        mass = strength[tree.order[low:high]].sum()
        assert tree.node[STRENGTH, node] == pytest.approx(mass, rel=1e-5)
        if node >= count:
            assert high == low + 1 == node - count + 1
            found.append(tree.order[low])
        else:
            stack += [(tree.left[node], low, node), (tree.right[node], node, high)]
    assert sorted(found) == list(range(count))


def test_lights_that_are_all_in_one_place_can_be_told_apart_or_not():
    made = tuple(lamp("POINT", (0, 0, 3), 1.0 + i) for i in range(3 * SLOTS))
    lights = compile_lights(made, ORIGIN)
    place = lights.place(*somewhere(20), 0)
    pmf = each_light(lights, place)
    expected = np.array([light.strength[0] for _, light in lights.lamps])
    expected /= expected.sum()
    np.testing.assert_allclose(pmf, np.repeat(expected[:, None], 20, axis=1), rtol=0.05)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("skew", (1.0, 1e9))
def test_the_guide_leads_to_the_leaf_that_bisection_finds(name, skew):
    """Where strengths are alike, and where a few lights have nearly all of it."""
    grid = SCENES[name].deep or SCENES[name].first
    if grid is None:
        pytest.skip("nothing to choose")
    count = grid.light.size
    strength = np.diff(grid.total) * np.where(np.arange(count) % 7 == 3, skew, 1.0)
    total = np.concatenate([[0.0], np.cumsum(strength)])
    grid = replace(grid, total=total, guide=choice.guide(total))
    rng = np.random.default_rng(5)
    at = np.concatenate([rng.random(5000) * total[-1], total[:-1], np.nextafter(total[1:], 0)])
    np.testing.assert_array_equal(grid.leaf_at(at), np.searchsorted(total, at, side="right") - 1)
