"""render -> light: furnaces, bounce limits, clamps, alpha, sample subsets."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import SceneError
from penumbra.core.transport import scatter
from tests.support import scenes as s
from tests.support.statistics import assert_same_mean

DEEP = {
    "max_bounces": 200,
    "diffuse_bounces": 200,
    "glossy_bounces": 200,
    "transmission_bounces": 200,
}
FLAT_SPHERE = s.sphere(levels=2, smooth=False)
GROUND = s.quad((50, 0, 0), (0, 50, 0))


@pytest.fixture
def no_roulette(monkeypatch):
    """Follow even the faintest path, so that truncated sums come out exactly."""
    monkeypatch.setattr(scatter, "FAINT", np.float32(1e-9))
    monkeypatch.setattr(scatter, "FAINT_IN_VIEW", np.float32(1e-9))


# --- Furnaces -----------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", (s.box(), FLAT_SPHERE), ids=("box", "sphere"))
@pytest.mark.parametrize("bounces", (0, 1, 3))
@pytest.mark.parametrize("limit", ("max_bounces", "diffuse_bounces"))
@pytest.mark.usefixtures("no_roulette")
def test_a_closed_furnace_shows_as_many_terms_of_its_series_as_bounces_allow(shape, bounces, limit):
    inside = s.camera((0.1, 0.2, -0.1), (0.5, 0.3, 1), fov=90)
    # Rays run into the walls only: what is sampled on purpose has noise.
    walls = replace(s.glowing(0.5, (1.0, 2.0, 3.0)), emission_sampling="NONE")
    image = s.pixels(inside, s.put(shape, walls), samples=2, **{limit: bounces})
    series = sum(0.5**k for k in range(bounces + 2))
    np.testing.assert_allclose(image[..., :3] / (1, 2, 3), series, 1e-5)


@pytest.mark.parametrize("kind", ("diffuse", "mirror"))
def test_a_closed_furnace_converges_to_its_series(kind):
    albedo = 0.8
    material = {"diffuse": s.diffuse, "mirror": s.mirror}[kind](albedo)
    walls = s.Material("Walls", s.shader(material.surface, s.emission().surface))
    inside = s.camera((0.1, 0.2, -0.1), (0.5, 0.3, 1), fov=90)
    assert_same_mean(s.means(inside, s.put(s.box(), walls), **DEEP), 1 / (1 - albedo))


@pytest.mark.parametrize(
    ("shape", "material"),
    ((FLAT_SPHERE, s.diffuse()), (FLAT_SPHERE, s.mirror()), (s.sphere(levels=1), s.mirror())),
    ids=("matte", "mirror", "smooth mirror"),
)
def test_a_white_convex_object_vanishes_in_a_white_world(shape, material):
    image = s.pixels(s.camera((0, -3, 1), size=16), s.put(shape, material), s.world())
    np.testing.assert_allclose(image, 1, 1e-5)


def test_a_white_hollow_vanishes_in_a_white_world():
    bowl = (
        s.quad(),
        s.quad((0, 0, 1), (0, 1, 0), (-1, 0, 1)),
        s.quad((1, 0, 0), (0, 0, 1), (0, 1, 1)),
    )
    view = s.camera((2, -3, 2), (-0.3, 0.3, 0.5), fov=20)
    parts = [s.put(shape, s.diffuse()) for shape in bowl]
    image = s.pixels(view, *parts, s.world(), **DEEP)
    np.testing.assert_allclose(image, 1, 1e-5)


@pytest.mark.parametrize("ior", (1.0, 0.75, 1.5))
@pytest.mark.parametrize("splitting", (True, False))
def test_clear_glass_vanishes_in_a_white_world(ior, splitting):
    things = s.put(FLAT_SPHERE, s.glass(ior)), s.world()
    view = s.camera((0, -3, 1), size=12)
    assert_same_mean(s.means(view, *things, splitting=splitting, **DEEP), 1.0)


@pytest.mark.parametrize("lobes", ("glass", "mixture"))
def test_splitting_does_not_change_the_mean(lobes):
    mixture = s.Material(
        "Mix", s.shader(s.mirror((0.2, 0.5, 0.7)).surface, s.diffuse(0.6).surface, "MixShader", 0.4)
    )
    material = s.glass(1.5, (0.9, 0.7, 0.5)) if lobes == "glass" else mixture
    things = (
        s.put(s.sphere(0.9, 2, smooth=False), material, to_world=s.affine(1.0, (0, 0, 1))),
        s.put(GROUND, s.diffuse(0.5)),
        s.area((1, -1, 3), radiance=5.0),
        s.world(0.3),
    )
    view = s.camera((0, -4, 2), (0, 0, 1))
    one, other = (
        s.means(view, *things, splitting=on, samples=64, max_bounces=6) for on in (True, False)
    )
    assert_same_mean(one, other)


@pytest.mark.parametrize("splitting", (True, False))
def test_a_camera_inside_glass_sees_a_white_world(splitting):
    things = s.put(FLAT_SPHERE, s.glass(1.5)), s.world()
    view = s.camera((0, 0.3, 0), (0, 1, 0.2), fov=100)
    assert_same_mean(s.means(view, *things, splitting=splitting, **DEEP), 1.0)


# --- Bounce limits ------------------------------------------------------------------------------


def test_without_bounces_there_is_direct_light_only():
    walls = s.put(s.box(), s.diffuse(0.5))
    lamp = s.point((0.2, 0.1, 0.3), 1.0)
    view = s.camera((0, 0, 0), (0, 0, -1), fov=60, size=8)
    image = s.pixels(view, walls, lamp, max_bounces=0, samples=1, pattern="REGULAR")[..., 1]
    x, y = s.centres(8, 2 * np.tan(np.radians(30)))
    squared = (x - 0.2) ** 2 + (y - 0.1) ** 2 + 1.3**2
    expected = 0.5 / np.pi * 1.3 / squared**1.5
    np.testing.assert_allclose(image, expected, rtol=2e-4)
    more = s.pixels(view, walls, lamp, max_bounces=1, samples=4)[..., 1]
    assert (more > expected * 1.05).all()


@pytest.mark.parametrize("bounces", (0, 1, 3))
@pytest.mark.parametrize("limit", ("glossy_bounces", "max_bounces"))
@pytest.mark.usefixtures("no_roulette")
def test_mirrors_count_by_their_own_limit(limit, bounces):
    # As for matte walls, what follows the last bounce still shows what glows.
    walls = s.Material("Walls", s.shader(s.mirror(0.5).surface, s.emission().surface))
    inside = s.camera((0.1, 0.2, -0.1), (0.5, 0.3, 1), fov=90)
    options = {**DEEP, "diffuse_bounces": 0, "transmission_bounces": 0, limit: bounces}
    image = s.pixels(inside, s.put(s.box(), walls), **options)[..., 1]
    np.testing.assert_allclose(image, sum(0.5**k for k in range(bounces + 2)), 1e-5)


@pytest.mark.parametrize("bounces", (0, 1, 3))
@pytest.mark.parametrize("limit", ("transmission_bounces", "max_bounces"))
@pytest.mark.usefixtures("no_roulette")
def test_refractions_count_by_their_own_limit(limit, bounces):
    pane = s.Material("Pane", s.shader(s.refraction(1.0, 0.5).surface, s.emission().surface))
    panes = [s.put(s.quad((9, 0, 0), (0, 9, 0), (0, 0, -z)), pane) for z in range(9)]
    options = {**DEEP, "diffuse_bounces": 0, "glossy_bounces": 0, limit: bounces}
    image = s.pixels(s.orthographic((0, 0, 5), size=4), *panes, **options)[..., 1]
    np.testing.assert_allclose(image, sum(0.5**k for k in range(bounces + 2)), 1e-5)


def test_behind_the_last_mirror_lamps_light_nothing_but_glowing_things_are_seen():
    floor = s.put(s.quad((4, 0, 0), (0, 4, 0)), s.mirror())
    view = s.camera((0, 0, 0.5), (0, 0, 0), size=4, fov=10)
    lamp = s.point((0, 0, 1), 5.0)
    for roof, seen in ((s.diffuse(), False), (s.emission(), True)):
        things = floor, s.put(s.quad((4, 0, 0), (0, 4, 0), (0, 0, 2)), roof), lamp
        without = s.pixels(view, *things, glossy_bounces=0)[..., 1]
        with_one = s.pixels(view, *things, glossy_bounces=1, max_bounces=1)[..., 1]
        assert (without > 0).all() == seen
        assert (without == 0).all() != seen
        assert (with_one > 0).all()


def test_limits_of_other_kinds_do_not_stop_a_path():
    # Camera, mirror, matte wall, lamp: one reflection, no diffuse bounce.
    things = (
        s.put(s.quad((4, 0, 0), (0, 4, 0)), s.mirror()),
        s.put(s.quad((4, 0, 0), (0, 4, 0), (0, 0, 2)), s.diffuse()),
        s.point((0, 0, 1), 5.0),
    )
    view = s.camera((0, 0, 0.5), (0, 0, 0), size=4, fov=10)
    image = s.pixels(view, *things, diffuse_bounces=0, transmission_bounces=0)[..., 1]
    assert (image > 0).all()


# --- Film ---------------------------------------------------------------------------------------


def test_clamping_bounds_the_mean_of_the_channels_of_a_sample():
    # Twice the clamp, with the hue kept: the limit is three times the clamp for the sum.
    view = s.orthographic((0, 0, 5), size=2, scale=1)
    seen = s.put(GROUND, s.emission((2.0, 4.0, 6.0)))
    image = s.pixels(view, seen, sample_clamp_direct=2.0)
    np.testing.assert_allclose(image[0, 0, :3], (1, 2, 3), rtol=1e-5)
    image = s.pixels(view, seen, sample_clamp_indirect=2.0)
    np.testing.assert_allclose(image[0, 0, :3], (2, 4, 6), rtol=1e-5)

    # Light of lamps at the first hit is direct, after a bounce it is not.
    things = (
        s.put(s.quad((4, 0, 0), (0, 4, 0)), s.mirror()),
        s.put(s.quad((4, 0, 0), (0, 4, 0), (0, 0, 2)), s.diffuse()),
        s.point((0, 0, 1), 50.0),
    )
    view = s.camera((0, 0, 0.5), (0, 0, 0), size=2, fov=10)
    image = s.pixels(view, *things, sample_clamp_direct=2.0)[..., 1]
    assert (image > 10).all()
    image = s.pixels(view, *things, sample_clamp_indirect=2.0, max_bounces=1)[..., 1]
    np.testing.assert_allclose(image, 2.0, rtol=1e-5)
    view = s.orthographic((0, 0, 1.5), (0, 0, 3), size=2, scale=0.1)
    image = s.pixels(view, *things[1:], sample_clamp_direct=2.0, max_bounces=0)[..., 1]
    np.testing.assert_allclose(image, 2.0, rtol=1e-5)


def test_a_transparent_film_shows_how_much_of_a_pixel_is_covered():
    # The quad's edge passes through the middle of the second column of pixels.
    edge = s.put(s.quad((5, 0, 0), (0, 5, 0), (5.25, 0, 0)), s.diffuse())
    view = s.orthographic((0, 0, 5), size=4, scale=4)
    things = edge, s.world(0.7)
    image = s.pixels(view, *things, film_transparent=True, samples=64)
    alpha = image[0, :, 3]
    np.testing.assert_allclose(alpha, (0, 0, 0.75, 1), atol=0.02)
    np.testing.assert_allclose(image[..., 1], 0.7 * image[..., 3], rtol=1e-5)
    opaque = s.pixels(view, *things, film_transparent=False, samples=64)
    np.testing.assert_allclose(opaque[..., :3], 0.7, rtol=1e-5)
    assert (opaque[..., 3] == 1).all()


def test_glass_is_not_transparent_to_the_film():
    image = s.pixels(
        s.camera((0, -3, 0), fov=20, size=4),
        s.put(FLAT_SPHERE, s.glass()),
        s.world(),
        film_transparent=True,
    )
    assert (image[..., 3] == 1).all()


def test_exposure_is_a_factor_on_colour_but_not_on_alpha():
    things = s.orthographic((0, 0, 5), scale=2), s.put(s.quad(), s.emission((1, 2, 3)))
    image = s.pixels(*things, film_exposure=2.5)
    np.testing.assert_allclose(image[4, 4], (2.5, 5, 7.5, 1), rtol=1e-6)


@pytest.mark.parametrize("pattern", ("SOBOL", "RANDOM"))
def test_two_sample_subsets_average_to_the_whole(pattern):
    things = (
        s.camera((0, -3, 2), (0, 0, 0.3)),
        s.put(GROUND, s.diffuse(0.7)),
        s.put(FLAT_SPHERE, s.glass(), to_world=s.affine(0.5, (0, 0, 0.5))),
        s.area((0.5, 0, 2), radiance=4.0),
        s.world(0.2),
    )
    options = {"samples": 16, "pattern": pattern, "light_samples": 2}
    whole = s.pixels(*things, **options)
    first, second = (
        s.pixels(
            *things, **options, use_sample_subset=True, sample_offset=offset, sample_subset_length=8
        )
        for offset in (0, 8)
    )
    assert np.abs(first - second).max() > 1e-3
    np.testing.assert_allclose((first + second) / 2, whole, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("pattern", ("POISSON", "JITTERED", "REGULAR"))
def test_patterns_of_a_fixed_size_refuse_sample_subsets(pattern):
    with pytest.raises(SceneError, match=pattern):
        s.pixels(s.camera((0, -3, 0)), pattern=pattern, use_sample_subset=True)
