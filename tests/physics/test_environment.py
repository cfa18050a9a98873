"""The importance map of a world finds directions as often as it says, and where the light is."""

from types import SimpleNamespace

import numpy as np
import pytest

from penumbra.core.arrays import F32, ONE_BELOW
from penumbra.core.compile.light import world_map
from penumbra.core.images.projection import equirectangular, equirectangular_invert
from penumbra.core.lights.environment import compile_environment
from penumbra.core.sampling.warp import cosine_hemisphere
from penumbra.core.shading.sky import Disc
from tests.support.statistics import SIGNIFICANCE, assert_same_mean, chi2_probability, sidak


def smooth(direction):
    """A sky that is brightest at the zenith and black below the horizon."""
    return np.maximum(direction[2:], F32(0)) + F32(0.5) * np.maximum(direction[:1], F32(0))


def peak(direction):
    """A dim world with one bright spot, a thousandth of the sphere, near a pole."""
    x, y, z = direction
    near = x * F32(0.1) + y * F32(0.1) + z * F32(0.98995)
    spot = np.where(near > F32(0.998), F32(500), F32(0.5))
    return np.stack([spot, spot * F32(0.5), spot * F32(0.25)])


def poles(direction):
    """Light at the two poles only, so that the sharpest rows count."""
    return (np.abs(direction[2:]) > F32(0.999)).astype(F32)


WORLDS = {"smooth": smooth, "peak": peak, "poles": poles}
WIDTH, HEIGHT = 128, 64
# Its rim lies on the edge of a row, so that the density is constant in every cell
DISC = Disc((0.0, 0.0, 1.0), 4 * np.pi / HEIGHT, (30.0, 20.0, 10.0))
CASES = [(name, discs) for name in WORLDS for discs in ((), (DISC,))]


def uniform(count, seed=1):
    return np.random.default_rng(seed).random((2, count), dtype=F32)


def sphere(count):
    """Return directions (3, count) that are spread evenly (Fibonacci)."""
    i = np.arange(count) + 0.5
    z, phi = 1 - 2 * i / count, np.pi * (1 + 5**0.5) * i
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(phi), flat * np.sin(phi), z]).astype(F32)


@pytest.mark.parametrize("compensation", [0.0, 1.0])
@pytest.mark.parametrize(("name", "discs"), CASES)
def test_directions_are_found_as_often_as_the_pdf_says(name, discs, compensation):
    environment = compile_environment(WORLDS[name], (WIDTH, HEIGHT), discs, compensation)
    direction, _ = environment.sample(*uniform(400_000))
    u, v = equirectangular(direction)
    column = np.minimum((u * WIDTH).astype(int), WIDTH - 1)
    row = np.minimum((v * HEIGHT).astype(int), HEIGHT - 1)
    counts = np.bincount(row * WIDTH + column, minlength=WIDTH * HEIGHT)
    middle = np.meshgrid((np.arange(WIDTH) + 0.5) / WIDTH, (np.arange(HEIGHT) + 0.5) / HEIGHT)
    pdf = environment.pdf(equirectangular_invert(*(each.ravel().astype(F32) for each in middle)))
    edges = np.sin(np.linspace(-np.pi / 2, np.pi / 2, HEIGHT + 1))
    expected = pdf * np.repeat(np.diff(edges) * 2 * np.pi / WIDTH, WIDTH) * u.size
    assert expected.sum() == pytest.approx(u.size, rel=1e-4)

    # Rounding puts a few over the edge of a cell, perhaps into darkness
    astray = counts[expected == 0].sum()
    assert astray < 1e-3 * u.size
    counts[expected == 0] = 0
    chance = sidak(SIGNIFICANCE, 6 * len(CASES))
    assert chi2_probability(counts, expected) > chance

    # Inside of the cells they are spread evenly, too
    places = u * WIDTH - column, (direction[2] - edges[row]) / np.diff(edges)[row]
    for place in places:
        parts = np.bincount(np.clip(place * 8, 0, 7).astype(int), minlength=8)
        assert chi2_probability(parts, np.full(8, u.size / 8)) > chance


@pytest.mark.parametrize(("name", "discs"), CASES)
def test_the_pdf_integrates_to_one_over_the_sphere(name, discs):
    environment = compile_environment(WORLDS[name], (WIDTH, HEIGHT), discs)
    integral = environment.pdf(sphere(2_000_000)).mean(dtype=np.float64) * 4 * np.pi
    assert integral == pytest.approx(1, abs=2e-3)


@pytest.mark.parametrize(("name", "discs"), CASES)
def test_samples_carry_the_pdf_of_their_direction_and_are_unit(name, discs):
    environment = compile_environment(WORLDS[name], (WIDTH, HEIGHT), discs)
    direction, pdf = environment.sample(*uniform(100_000))
    assert np.abs(np.linalg.norm(direction, axis=0) - 1).max() < 1e-5
    differ = np.abs(environment.pdf(direction) - pdf) > 1e-3 * pdf
    assert differ.mean() < 1e-3  # those that rounding has put over the edge of a cell
    assert direction.dtype == pdf.dtype == environment.pdf(direction).dtype == np.float32


def test_every_u_and_v_gives_a_finite_direction_with_a_pdf():
    ends = np.array([0, 1e-30, 2.0**-24, 0.5, ONE_BELOW], F32)
    u, v = (each.ravel() for each in np.meshgrid(ends, ends))
    for name, discs in CASES:
        direction, pdf = compile_environment(WORLDS[name], (WIDTH, HEIGHT), discs).sample(u, v)
        assert np.isfinite(direction).all()
        assert (np.isfinite(pdf) & (pdf > 0)).all()
    axes = np.concatenate([np.eye(3), -np.eye(3)]).T.astype(F32)
    assert np.isfinite(compile_environment(peak, (64, 32)).pdf(axes)).all()


def test_without_compensation_the_pdf_follows_the_radiance():
    environment = compile_environment(smooth, (256, 128), compensation=0.0)
    direction, pdf = environment.sample(*uniform(50_000))
    lit = smooth(direction)[0] > 0.05
    weight = smooth(direction)[0][lit] / pdf[lit]
    assert weight.std() < 0.2 * weight.mean()  # probabilities are whole steps, four to a cell


def test_a_bright_spot_is_found_and_darkness_is_not():
    environment = compile_environment(peak, (512, 256), compensation=0.0)
    direction, _ = environment.sample(*uniform(50_000))
    found = (peak(direction)[0] > 1).mean()
    share = 500 * 0.001 / (500 * 0.001 + 0.5 * 0.999)
    assert found == pytest.approx(share, abs=0.15)
    below = compile_environment(smooth, (WIDTH, HEIGHT))
    direction, _ = below.sample(*uniform(50_000))
    lit = smooth(direction)[0] > 0
    assert lit.mean() > 0.99


def test_the_irradiance_of_a_hemisphere_is_pi():
    def half(direction):
        return np.broadcast_to((direction[2:] > 0).astype(F32), direction.shape)

    environment = compile_environment(half, (64, 32))
    blocks = []
    for seed in range(32):
        direction, pdf = environment.sample(*uniform(4096, seed))
        blocks.append((half(direction)[0] * np.maximum(direction[2], 0) / pdf).mean())
    assert_same_mean(blocks, [np.pi])


@pytest.mark.parametrize("compensation", [0.0, 1.0])
def test_both_ways_together_give_the_irradiance_whatever_the_map_leaves_out(compensation):
    """Each weighed by the power heuristic, samples of the map and of a matte surface add up."""

    def world(direction):
        return F32(1) + F32(4) * (direction[:1] > F32(0.6)) + F32(0.5) * direction[2:]

    environment = compile_environment(world, (WIDTH, HEIGHT), (DISC,), compensation)
    grid = sphere(4_000_000)
    light = world(grid)[0].astype(float) * np.maximum(grid[2], 0)
    expected = light.mean() * 4 * np.pi
    expected += 20 * np.pi * np.sin(DISC.half_angle) ** 2  # the mean of its channels

    def lit(direction):
        inside = DISC.chord(direction) < DISC.largest_chord
        return world(direction)[0] + F32(20) * inside

    blocks = []
    for seed in range(32):
        wi, pdf = environment.sample(*uniform(8192, seed))
        cosine = np.maximum(wi[2], 0)
        light = lit(wi) * cosine / pdf / (1 + (cosine / np.pi / pdf) ** 2)
        wi = cosine_hemisphere(*uniform(8192, seed + 100))
        matte = lit(wi) * np.pi / (1 + (environment.pdf(wi) / (wi[2] / np.pi)) ** 2)
        blocks.append(light.mean(dtype=float) + matte.mean(dtype=float))
    assert_same_mean(blocks, [expected], bias=1e-4)


def test_a_tiny_sun_is_sampled_as_a_cone_of_its_own():
    sun = Disc((0.0, 0.6, 0.8), 0.0047, (1e5, 1e5, 1e5))
    environment = compile_environment(smooth, (256, 128), (sun,))
    direction, pdf = environment.sample(*uniform(20_000))
    inside = sun.chord(direction) < sun.largest_chord
    share = environment.disc_share[0]
    assert inside.mean() == pytest.approx(share, abs=0.02)
    assert 0.5 < share < 0.95
    cone = share / (2 * np.pi * sun.one_minus_cos)
    assert pdf[inside] == pytest.approx(np.full(inside.sum(), cone), rel=1e-3)
    assert pdf[~inside].max() < 1e-2 * cone


def test_the_mean_radiance_is_that_of_map_and_discs():
    environment = compile_environment(peak, (256, 128), (DISC,))
    map_mean = peak(sphere(1_000_000)).mean(axis=1, dtype=float)
    solid_angle = 2 * np.pi * (1 - np.cos(0.2))
    disc_mean = np.array(DISC.radiance) * solid_angle / (4 * np.pi)
    assert environment.mean == pytest.approx(map_mean + disc_mean, rel=0.02)


def test_a_world_that_is_alike_everywhere_needs_no_map():
    assert compile_environment(lambda direction: np.full((3, 1), 2.0, F32)) is None
    assert compile_environment(lambda direction: np.zeros((3, 1), F32)) is None
    constant = compile_environment(lambda direction: np.ones((3, 1), F32), (64, 32), (DISC,))
    assert constant.pdf(sphere(200_000)).mean() * 4 * np.pi == pytest.approx(1, abs=1e-2)


def test_a_texel_that_shines_into_its_neighbours_is_sampled_there():
    """At the corner of a neighbour is a quarter of a bright texel's light, in all of it 1/64.

    So the largest weight is 16 times the mean, or twice that where steps were rounded.
    """
    width, height = 64, 32

    def world(direction):
        u, v = equirectangular(direction)
        x, y = u * width - F32(20.5), v * height - F32(16.5)
        tent = np.maximum(1 - np.abs(x), 0) * np.maximum(1 - np.abs(y), 0)
        return (F32(1e-3) + F32(1000) * tent)[None]

    environment = compile_environment(world, (width, height), compensation=0.0)
    direction, pdf = environment.sample(*uniform(200_000))
    weight = world(direction)[0] / pdf
    assert weight.max() < 32 * weight.mean()


def test_pictures_finer_than_the_map_are_averaged_and_not_skipped():
    width = 8192

    def world(direction):
        u, _ = equirectangular(direction)
        column = (u * F32(width)).astype(np.int32)
        return (F32(1) + F32(9) * ((column % 4 == 1) & (u > 0.5)))[None].astype(F32)

    environment = compile_environment(world, (width, 64), compensation=0.0)
    right = equirectangular_invert(np.full(1, 0.75, F32), np.full(1, 0.5, F32))
    left = equirectangular_invert(np.full(1, 0.25, F32), np.full(1, 0.5, F32))
    ratio = float(environment.pdf(right)[0] / environment.pdf(left)[0])
    assert ratio == pytest.approx(3.25, rel=0.3)  # 13 / 4; steps are quarters


def test_a_world_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="not a finite number"):
        compile_environment(lambda direction: np.full((3, 1), np.nan, F32))


def test_a_picture_of_one_column_is_sampled():
    def radiance(direction, depth, with_discs=True):
        return np.repeat(np.maximum(direction[:1] + direction[1:2], 0), 3, axis=0)

    world = SimpleNamespace(is_constant=False, finest=(1, 8), discs=(), radiance=radiance)
    environment = world_map(SimpleNamespace(world=SimpleNamespace(sampled=True)), world)
    u = np.random.default_rng(0).random((2, 100), np.float32)
    direction, pdf = environment.sample(*u)
    assert np.isfinite(direction).all() and (pdf > 0).all()
