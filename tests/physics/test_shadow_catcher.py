"""shadow catchers -> the shadow alone, in the picture's alpha, against Cycles' formula."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import compile_plan, render
from penumbra.core.scene import RayKinds
from tests.support import scenes as s

VIEW = s.orthographic((0, 0, 3), size=2, scale=0.2)
WORLD, SUN = 0.2, 1.0
SLANT = SUN * np.sqrt(0.5) / np.pi  # what a sun at 45 degrees adds to the radiance of white
IN_SHADOW = WORLD / (WORLD + SLANT)
CASTS_NOTHING = RayKinds(diffuse=False, glossy=False, transmission=False, shadow=False)


def floor(material=None, z=0.0, half=1.0, centre=(0, 0), **flags):
    shape = s.quad((half, 0, 0), (0, half, 0), (*centre, z))
    return replace(s.put(shape, material or s.diffuse(0.8)), **flags)


def catcher(material=None, **more):
    return floor(material, is_shadow_catcher=True, **more)


def sun(side=1.0, colour=SUN, **more):
    return s.sun((side, 0, 1), colour, **more)


def blocker(side=1.0):
    """A small black surface far away, that hides the sun and next to nothing of the world."""
    shape = s.quad((0, 0.2, 0), (0.2, 0, -side * 0.2), (100 * side, 0, 100))
    return s.put(shape, s.diffuse(0.0))


def half(shader):
    """A surface that is half transparent."""
    return s.Material("Pane", s.shader(s.node("BsdfTransparent"), shader, "MixShader", 0.5))


def shown(*things, view=VIEW, samples=256, **settings):
    """Return the mean of the picture, (4,)."""
    return s.pixels(view, *things, samples=samples, **settings).mean(axis=(0, 1))


def assert_shows(expected, *things, atol=1e-6, **settings):
    np.testing.assert_allclose(shown(*things, **settings), expected, atol=atol)


LIT = catcher(), s.world(WORLD), sun()


def test_a_catcher_without_a_shadow_shows_what_is_behind_it():
    assert_shows((0, 0, 0, 0), *LIT, film_transparent=True)
    assert_shows((WORLD,) * 3 + (1,), *LIT)


def test_a_shadow_is_the_share_of_light_that_is_missing():
    things = *LIT, blocker()
    assert_shows((0, 0, 0, 1 - IN_SHADOW), *things, film_transparent=True, atol=2e-3)
    assert_shows((WORLD * IN_SHADOW,) * 3 + (1,), *things, atol=1e-3)


def test_shadows_do_not_depend_on_the_exposure_but_the_background_does():
    things = *LIT, blocker()
    assert_shows((WORLD * IN_SHADOW * 3,) * 3 + (1,), *things, film_exposure=3.0, atol=3e-3)
    expected = (0, 0, 0, 1 - IN_SHADOW)
    assert_shows(expected, *things, film_exposure=3.0, film_transparent=True, atol=2e-3)


def test_the_depth_of_a_coloured_shadow_is_the_mean_of_the_channels():
    red, cyan = (1.0, 0.0, 0.0), (0.0, 1.0, 1.0)
    only_red = catcher(), sun(colour=red), blocker()
    for things in (only_red, (*only_red, sun(-1, cyan))):
        assert_shows((0, 0, 0, 1 / 3), *things, film_transparent=True)


def test_light_that_objects_add_is_not_seen_but_fills_shadows():
    glow = s.put(s.quad((0, 1, 0), (0, 0, 1), (3, 0, 1)), s.emission(1.0))
    assert_shows((0, 0, 0, 0), *LIT, glow, film_transparent=True)
    added = shown(floor(), glow, samples=4096)[1] / 0.8
    alpha = 1 - (WORLD + added) / (WORLD + SLANT)
    things = *LIT, blocker(), glow
    # The glowing surface hides a part of the world; so it has to stand for it.
    hidden = shown(floor(), s.put(glow.mesh, s.diffuse(0.0)), s.world(WORLD), samples=4096)[1] / 0.8
    alpha += (WORLD - hidden) / (WORLD + SLANT)
    found = shown(*things, film_transparent=True, samples=4096)
    np.testing.assert_allclose(found, (0, 0, 0, alpha), atol=4e-3)


def test_lamps_that_do_not_light_catchers_cast_no_shadow_there():
    things = catcher(), s.world(WORLD), sun(lights_catchers=False), blocker()
    assert_shows((0, 0, 0, 0), *things, film_transparent=True, atol=1e-3)
    assert_shows((0, 0, 0, 0), *things[:-1], film_transparent=True)


@pytest.mark.parametrize("lamps", (1, 12))  # each has its own shadow rays, or one is chosen
def test_each_lamp_decides_for_itself_whether_it_lights_catchers(lamps):
    on, off = [sun()] * lamps, [sun(-1, lights_catchers=False)] * lamps
    ground = catcher(), s.world(WORLD)
    expected = 1 - WORLD / (WORLD + lamps * SLANT)
    things = *ground, *on, *off, blocker(1), blocker(-1)
    assert_shows((0, 0, 0, expected), *things, film_transparent=True, atol=5e-3, samples=1024)
    assert_shows((0, 0, 0, 0), *ground, *on, *off, blocker(-1), film_transparent=True, atol=1e-3)


@pytest.mark.parametrize("is_catcher", (False, True))
def test_only_glowing_catchers_light_catchers_when_they_are_alone(is_catcher):
    glow = s.put(s.quad((0, 0.1, 0), (0, 0, 0.1), (3, 0, 1)), s.emission(5.0))
    wall = s.put(s.quad((0, 1, 0), (0, 0, 2), (2, 0, 1)), s.diffuse(0.0))
    things = catcher(), replace(glow, is_shadow_catcher=is_catcher), wall
    assert_shows((0, 0, 0, is_catcher), *things, film_transparent=True)


def test_catchers_shade_each_other_without_a_shadow():
    roof = s.put(s.quad((0, 1, 0), (1, 0, -1), (3, 0, 3)), s.diffuse(0.0))
    things = *LIT, replace(roof, is_shadow_catcher=True)
    assert_shows((0, 0, 0, 0), *things, film_transparent=True)
    assert shown(*LIT, roof, film_transparent=True)[3] > 0.3


def test_what_is_no_catcher_looks_as_ever():
    things = floor(s.emission((1, 2, 3)), 1, seen_by=replace(CASTS_NOTHING, camera=True)), *LIT
    for film_transparent in (False, True):
        assert_shows((1, 2, 3, 1), *things, film_transparent=film_transparent)


@pytest.mark.parametrize("film_transparent", (False, True))
def test_pixels_that_an_object_covers_in_part_are_put_over_the_shadow(film_transparent):
    glow = floor(s.emission(1.0), 1, centre=(1, 0), seen_by=CASTS_NOTHING)
    one_pixel = s.orthographic((0, 0, 3), size=1, scale=0.2)
    things = *LIT, blocker(), glow
    alpha = 0.5 + 0.5 * (1 - IN_SHADOW)
    colour = 0.5 + (not film_transparent) * 0.5 * WORLD * (1 - alpha)
    expected = (colour,) * 3 + (alpha if film_transparent else 1,)
    assert_shows(
        expected,
        *things,
        view=one_pixel,
        film_transparent=film_transparent,
        atol=4e-3,
        samples=4096,
    )


def test_a_pane_before_a_catcher_counts_twice_before_the_background():
    """As in Cycles: the background has passed the pane before it is weighted with alpha."""
    pane = floor(half(s.diffuse(0.0).surface), 1, seen_by=CASTS_NOTHING)
    assert_shows((WORLD / 4,) * 3 + (1,), pane, *LIT, atol=1e-3)
    assert_shows((0, 0, 0, 0.5), pane, *LIT, film_transparent=True, atol=1e-3)


def test_a_transparent_catcher_shows_twice_the_background():
    """As in Cycles, which adds what is behind it to what is seen through it."""
    things = catcher(half(s.diffuse(0.8).surface)), s.world(WORLD), sun()
    assert_shows((2 * WORLD,) * 3 + (1,), *things, atol=2e-3)
    assert_shows((0, 0, 0, 0), *things, blocker(), film_transparent=True, atol=3e-3)


@pytest.mark.parametrize("between", (s.mirror(), s.refraction()), ids=("mirror", "refraction"))
def test_a_mirror_or_a_lens_shows_a_catcher_as_any_object(between):
    z = 4 if between.name == "Mirror" else -1
    things = floor(between), catcher(s.emission((1, 2, 3)), z=z), s.world(WORLD)
    assert_shows((1, 2, 3, 1), *things, film_transparent=True)


def test_clear_glass_shows_the_shadow_of_what_is_behind_it():
    ground = catcher(z=-1), s.world(WORLD), sun()
    glass = floor(s.refraction(), seen_by=CASTS_NOTHING)
    settings = {"film_transparent": True, "film_transparent_glass": True}
    assert_shows((0, 0, 0, 0), glass, *ground, **settings)
    shape = s.quad((0, 0.2, 0), (0.2, 0, -0.2), (100, 0, 99))
    things = glass, *ground, s.put(shape, s.diffuse(0.0))
    assert_shows((0, 0, 0, 1 - IN_SHADOW), *things, **settings, atol=2e-3)


def test_a_catcher_that_is_held_out_is_a_hole_without_shadows():
    things = catcher(is_holdout=True), *LIT[1:], blocker()
    assert_shows((0, 0, 0, 0), *things, film_transparent=True)
    assert_shows((0, 0, 0, 1), *things)  # a background there is none, which is opaque


def test_a_catcher_behind_coloured_glass_leaves_the_picture_by_the_mean_of_the_channels():
    clear = s.Material("Pane", s.node("BsdfTransparent", Color=(0.9, 0.5, 0.1)))
    pane = floor(clear, 1, seen_by=CASTS_NOTHING)
    assert_shows((0, 0, 0, 0.5), pane, *LIT, film_transparent=True)


def test_pictures_with_catchers_have_the_same_bits_on_any_number_of_threads():
    ball = s.put(s.sphere(0.05), s.glass(), to_world=s.affine(1.0, (0, 0, 0.1)))
    described = s.scene(s.orthographic((0, 0, 3), size=24, scale=0.3), *LIT, ball)
    plan = compile_plan(described, replace(s.DEFAULTS, samples=20))
    one, three = (render(plan, threads=threads) for threads in (1, 3))
    np.testing.assert_array_equal(one.film.sums, three.film.sums)
    assert np.isfinite(one.combined()).all()


def test_a_picture_without_catchers_sums_up_nothing_of_theirs():
    film = s.picture(VIEW, floor(), s.world(WORLD)).film
    assert film.passes == ("combined",)
    assert len(film.sums) == 3
