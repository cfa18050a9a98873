"""limits and shadows of worlds -> which samples of their light are taken."""

from dataclasses import replace

import numpy as np

from penumbra.core import Link, Node
from tests.support import scenes as s

# A sky that is brighter above, so that it is sampled
ONES = (1.0, 1.0, 1.0)
WHERE = Link(Node("NewGeometry"), "Position")
UP = Link(Node("Mapping", "", {"Vector": WHERE, "Location": ONES, "Scale": ONES}), "Vector")
SKY = replace(s.world(), surface=Node("Background", "", {"Color": UP, "Strength": 2.0}))
FLOOR = s.put(s.quad((5, 0, 0), (0, 5, 0)), s.diffuse(0.8))
WALL = s.put(s.quad((0, 5, 0), (0, 0, 5), (-2, 0, 0)), s.diffuse(0.8))
VIEW = s.camera((4, 0, 3), size=16, fov=30)


def shadow_rays(limit, **settings):
    done = s.picture(VIEW, FLOOR, WALL, replace(SKY, max_bounces=limit), **settings)
    return done.statistics["rays_shadow"]


def test_paths_beyond_the_worlds_limit_take_no_samples_of_it():
    every = shadow_rays(1024, max_bounces=2)
    assert shadow_rays(2, max_bounces=2) == every
    assert shadow_rays(0, max_bounces=2) == shadow_rays(1024, max_bounces=0)
    assert shadow_rays(0, max_bounces=2) < shadow_rays(1, max_bounces=2) < every


def test_a_world_without_shadows_shines_through():
    lid = s.put(s.quad((4, 0, 0), (0, 4, 0), (0, 0, 0.5)), s.diffuse(0.0))
    below = s.camera((0, -0.5, 0.25), size=4, fov=10)
    shaded, open_ = (
        s.pixels(below, FLOOR, lid, replace(SKY, casts_shadow=casts), samples=64, max_bounces=0)[
            ..., 2
        ].mean()
        for casts in (True, False)
    )
    assert shaded < 0.2 * open_


def test_a_sky_that_is_not_sampled_gives_the_same_light():
    sampled, chance = (
        s.means(VIEW, FLOOR, WALL, replace(SKY, sampled=yes), samples=64, max_bounces=1)
        for yes in (True, False)
    )
    error = np.sqrt((sampled.var(ddof=1) + chance.var(ddof=1)) / sampled.size)
    assert abs(sampled.mean() - chance.mean()) < 4 * error
    assert error < 0.05 * abs(sampled.mean())
