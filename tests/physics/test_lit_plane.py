"""lamps over a plane -> analytic values, shadows, and the same mean from every pattern."""

import numpy as np
import pytest

from tests.support import scenes as s
from tests.support.statistics import assert_same_mean

DIRECT = {"max_bounces": 0, "samples": 1, "pattern": "REGULAR"}  # rays through pixel centres
GROUND = s.quad((50, 0, 0), (0, 50, 0))


def test_a_point_lamp_lights_a_plane_by_the_inverse_square():
    height, intensity, albedo = 2.0, 7.0, 0.6
    things = s.put(GROUND, s.diffuse(albedo)), s.point((0.3, -0.2, height), intensity)
    image = s.pixels(s.orthographic((0, 0, 5), size=8, scale=6), *things, **DIRECT)
    x, y = s.centres(8, 6)
    squared = (x - 0.3) ** 2 + (y + 0.2) ** 2 + height**2
    np.testing.assert_allclose(
        image[..., 1], albedo / np.pi * intensity * height / squared**1.5, rtol=2e-4
    )


def test_the_sun_lights_a_plane_by_the_cosine():
    towards = np.array([1.0, 0.5, 2.0])
    things = s.put(GROUND, s.diffuse(0.6)), s.sun(towards, (3.0, 2.0, 1.0))
    image = s.pixels(s.orthographic((0, 0, 5), scale=6), *things, **DIRECT)
    cosine = 2 / np.linalg.norm(towards)
    expected = np.array([3, 2, 1]) * 0.6 / np.pi * cosine
    np.testing.assert_allclose(image[..., :3], np.broadcast_to(expected, (8, 8, 3)), 2e-5)


def test_a_spot_lights_its_cone_with_a_smooth_rim_and_nothing_else():
    height, cone, blend = 2.0, np.radians(60), 0.5
    things = (
        s.put(GROUND, s.diffuse()),
        s.spot((0, 0, height), intensity=5.0, spot_angle=cone, spot_blend=blend),
    )
    image = s.pixels(s.orthographic((0, 0, 5), size=16, scale=4), *things, **DIRECT)[..., 1]
    x, y = s.centres(16, 4)
    distance = np.sqrt(x * x + y * y + height**2)
    cosine = height / distance
    step = np.clip((cosine - np.cos(cone / 2)) / ((1 - np.cos(cone / 2)) * blend), 0, 1)
    expected = 5 / np.pi * cosine / distance**2 * step * step * (3 - 2 * step)
    np.testing.assert_allclose(image, expected, rtol=1e-4, atol=1e-4)
    assert (image[expected == 0] == 0).all()
    assert (expected == 0).sum() > 50


def test_an_occluder_throws_a_hard_shadow_where_geometry_says():
    things = (
        s.put(GROUND, s.diffuse()),
        s.put(s.quad((0.5, 0, 0), (0, 0.5, 0), (0, 0, 1)), s.diffuse()),
        s.point((0, 0, 2), 5.0),
    )
    view = s.orthographic((0, 0, 0.5), size=20, scale=4)  # below the occluder
    image = s.pixels(view, *things, **DIRECT)[..., 1]
    x, y = s.centres(20, 4)
    shadow = np.maximum(np.abs(x), np.abs(y)) < 1
    assert (image[shadow] == 0).all()
    assert (image[~shadow] > 0).all()


def test_lamps_do_not_light_the_side_that_is_turned_away():
    things = s.put(GROUND, s.diffuse()), s.sun((0, 0, 1)), s.point((0, 0, 1)), s.spot((0, 0, 1))
    below = s.pixels(s.orthographic((0, 0, -5), size=4), *things, **DIRECT)
    assert (below[..., :3] == 0).all()
    assert (below[..., 3] == 1).all()


def test_soft_shadows_of_an_area_lamp_agree_with_its_integral():
    # Half of the square lamp hides behind an edge that stands below its middle.
    lamp = s.area((0, 0, 2), radiance=3.0, size=(0.2, 0.2))
    wall = s.quad((5, 0, 0), (0, 5, 0), (5, 0, 1))
    view = s.orthographic((0, 0, 0.5), size=1, scale=1e-3)
    things = s.put(GROUND, s.diffuse()), s.put(wall, s.diffuse()), lamp
    half = s.means(view, *things, samples=64, max_bounces=0)
    whole = s.means(view, things[0], lamp, samples=64, max_bounces=0)
    assert_same_mean(half, whole.mean() / 2)


@pytest.mark.parametrize("light_samples", (1, 3, 4))
@pytest.mark.parametrize("pattern", ("SOBOL", "POISSON", "JITTERED", "RANDOM", "REGULAR"))
def test_patterns_and_light_samples_agree_in_the_mean(pattern, light_samples):
    things = (
        s.put(GROUND, s.diffuse(0.7)),
        s.put(s.box(0.3), s.diffuse(0.7), to_world=s.affine(1.0, (0, 0, 0.5))),
        s.area((0.5, 0, 2), radiance=4.0),
        s.point((-1, 0, 1), 1.0, radius=0.3),
    )
    view = s.camera((0, -3, 2), (0, 0, 0.3), size=6)
    options = {"samples": 16, "max_bounces": 1}
    one = s.means(view, *things, pattern=pattern, light_samples=light_samples, **options)
    expected = s.means(view, *things, pattern="RANDOM", count=16, **{**options, "samples": 64})
    # A regular grid always looks through the same points of a pixel.
    bias = 0.01 if pattern == "REGULAR" else 1e-6
    assert_same_mean(one, expected, tests=15, bias=bias)


@pytest.mark.parametrize("lamps", (3, 20))
def test_many_lamps_shine_as_much_as_their_sum(lamps):
    # Few lamps each get their shadow rays, of many one is chosen.
    spread = np.linspace(-1, 1, lamps)
    things = [s.point((x, x * x, 1 + x), 1 + x, radius=0.1 * (1 + x)) for x in spread]
    view = s.orthographic((0, 0, 5), size=4, scale=3)
    ground = s.put(GROUND, s.diffuse(0.5))
    expected = sum(s.means(view, ground, lamp, count=4, samples=256).mean() for lamp in things)
    assert_same_mean(s.means(view, ground, *things, samples=64), expected, bias=1e-4)
