"""splits -> how many rays pay: the arithmetic of the choice, and plain scenes."""

import pytest

from penumbra.core import compile_plan, render
from penumbra.core.splits import CHOSEN, choose, splits_of
from penumbra.core.tiles import SIZE
from tests.support import scenes as s

NAMES = ("light_samples", "scatter_samples", "path_reuse")
MOST = CHOSEN[NAMES[0]][-1]

# (error that nothing changes, of light, of scattered rays), (cost likewise), the best numbers
CASES = {
    "nothing is theirs": ((1, 0, 0), (1, 1, 1), (1, 1)),
    "all is the light's, rays are cheap": ((0, 1, 0), (9, 1, 1), (4, 1)),
    "all is the light's, error and cost": ((0, 1, 0), (0, 1, 0), (1, 1)),
    "all is of scattered rays": ((0, 0, 1), (8, 1, 1), (1, 4)),
    "a sample shall not take too long": ((0, 0, 1), (1, 0, 1), (1, 2)),
    "half each": ((0, 1, 1), (8, 1, 1), (4, 4)),
    "half is the pixel's": ((1, 1, 0), (4, 1, 0), (2, 1)),
    "too little to be sure of": ((1, 0.05, 0.05), (8, 1, 1), (1, 1)),
    "too little to be sure of, yet a gain": ((1, 0.3, 0), (8, 1, 1), (1, 1)),
    "better than one over the number": ((-0.1, 0.05, 1), (0.5, 0.2, 1.3), (1, 2)),
    "together better than everything": ((-0.6, 0.8, 0.8), (0, 0.5, 0.5), (1, 1)),
    "noise made it worse": ((1, -0.5, -0.1), (8, 1, 1), (1, 1)),
}


@pytest.mark.parametrize("name", CASES)
def test_the_least_product_of_error_and_cost_wins(name):
    error, cost, best = CASES[name]
    errors, costs = [sum(error)], [sum(cost)]
    for share, step in zip(error[1:], cost[1:], strict=True):
        errors.append(sum(error) - share + share / MOST)
        costs.append(sum(cost) + step * (MOST - 1))
    assert choose(NAMES[:2], errors, costs) == dict(zip(NAMES, best, strict=False))


# (error that nothing changes, of scattered rays, what re-use takes of that), (cost likewise, what
# re-use adds), the best numbers
REUSES = {
    "it takes all, for little": ((0.1, 1, 1), (4, 1, 1), (1, SIZE)),
    "it takes half, rays are cheap": ((0, 1, 0.5), (8, 0.5, 0.5), (4, SIZE)),
    "it takes little and costs much": ((1, 0.5, 0.1), (4, 1, 4), (1, 1)),
    "it takes nothing": ((1, 0, 0), (4, 1, 1), (1, 1)),
    "it made it worse": ((1, 0.2, -0.3), (4, 1, 1), (1, 1)),
    "it would take too long": ((0, 1, 1), (1, 1, 3), (2, 1)),
}


@pytest.mark.parametrize("name", REUSES)
def test_paths_are_shared_where_that_pays(name):
    error, cost, best = REUSES[name]
    fixed, rays, shared = error
    errors = [fixed + rays, fixed + rays / MOST, fixed + rays - shared]
    costs = [cost[0] + cost[1], cost[0] + cost[1] * MOST, sum(cost)]
    names = "scatter_samples", "path_reuse"
    assert choose(names, errors, costs) == dict(zip(names, best, strict=True))


# --- Scenes -------------------------------------------------------------------------------------

VIEW = s.camera((0, -4, 3), (0, 0, 0), size=96)
GROUND = s.put(s.quad((9, 0, 0), (0, 9, 0)), s.diffuse(0.7))
BLINDS = tuple(
    s.put(s.quad((2, 0, 0), (0, 0.1, 0)), s.diffuse(0.0), to_world=s.affine(1.0, (0, y / 4, 0.5)))
    for y in range(-5, 6)
)


def chosen(*things, samples=256, **settings):
    settings = {"samples": samples, "use_sample_subset": True, "sample_subset_length": 1} | settings
    plan = compile_plan(s.scene(VIEW, *things), s.replace(s.DEFAULTS, **settings))
    picture = render(plan)
    numbers = splits_of(picture.plan)
    assert {name: picture.statistics[f"used_{name}"] for name in NAMES} == numbers
    assert f"{numbers['light_samples']} shadow rays" in picture.plan.describe()
    assert picture.plan.measures == ()  # rendered again, it is as it is
    return tuple(numbers[name] for name in NAMES)


def lamp(size):
    return s.area((0, 0.5, 2), (0, 0, 0), radiance=4.0, size=(size, size))


def test_penumbrae_take_more_light_samples_and_sharp_shadows_do_not():
    soft, *_ = chosen(GROUND, *BLINDS, lamp(1.5), max_bounces=0)
    sharp, *_ = chosen(GROUND, *BLINDS, lamp(1e-3), max_bounces=0)
    assert (soft, sharp) == (MOST, 1)


def test_light_that_comes_by_chance_takes_more_scattered_rays():
    wall = s.put(s.quad((3, 0, 0), (0, 0, 3)), s.diffuse(0.8), to_world=s.affine(1.0, (0, 2, 0)))
    lit = s.put(s.quad((1, 0, 0), (0, 1, 0)), s.diffuse(0.9), to_world=s.affine(1.0, (0, 0, 4)))
    things = GROUND, wall, lit, s.spot((0, 0, 1), (0, 0, 4))
    _, scattered, _ = chosen(*things, max_bounces=2, path_reuse="OFF")
    assert scattered > 1
    *_, shared = chosen(*things, max_bounces=2)
    assert shared == SIZE


def test_small_pictures_and_numbers_that_are_set_are_not_measured():
    things = GROUND, *BLINDS, lamp(1.5)
    assert chosen(*things, samples=4, max_bounces=0) == (1, 1, 1)
    own = {"light_samples": 3, "scatter_samples": 2, "path_reuse": "ON"}
    assert chosen(*things, **own) == (3, 2, SIZE)


def test_nothing_is_measured_that_cannot_matter():
    mirrors = s.put(s.sphere(1.0), s.mirror(0.9))
    plan = compile_plan(s.scene(VIEW, mirrors, s.world(1.0)), s.DEFAULTS)
    assert plan.measures == ()
