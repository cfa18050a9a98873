"""surfaces held out, clear glass -> holes in the picture and its alpha, against Cycles' rules."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import scenes as s

ABOVE = s.orthographic((0, 0, 3), size=4)
GLOW = s.emission((1.0, 2.0, 3.0))
HALF_HELD = s.Material("Half", s.shader(s.node("Holdout"), GLOW.surface, "MixShader", 0.5))
CLEAR_GLASS = {"film_transparent": True, "film_transparent_glass": True}


def floor(material, z=0.0, half=4.0, **flags):
    return replace(s.put(s.quad((half, 0, 0), (0, half, 0), (0, 0, z)), material), **flags)


def pane(opacity, shader=GLOW.surface, colour=1.0):
    """A surface that is partly transparent."""
    clear = s.node("BsdfTransparent", Color=s.colour(colour))
    return s.Material("Pane", s.shader(clear, shader, "MixShader", opacity))


def rough_refraction(roughness):
    return s.Material("Lens", s.node("BsdfRefraction", IOR=1.5, Roughness=roughness))


def shown(*things, view=ABOVE, samples=64, **settings):
    """Return the mean of the picture, (4,)."""
    return s.pixels(view, *things, samples=samples, **settings).mean(axis=(0, 1))


def assert_shows(expected, *things, atol=1e-6, **settings):
    np.testing.assert_allclose(shown(*things, **settings), expected, atol=atol, rtol=1e-5)


both_films = pytest.mark.parametrize("film_transparent", (False, True))


@both_films
def test_an_object_held_out_is_a_hole_even_if_it_glows(film_transparent):
    things = floor(GLOW, is_holdout=True), floor(s.diffuse(), -1), s.world(0.5), s.sun()
    assert_shows((0, 0, 0, 0), *things, film_transparent=film_transparent)


@both_films
def test_what_lies_behind_shows_through_an_object_held_out_as_far_as_it_is_transparent(
    film_transparent,
):
    held = floor(pane(0.25), is_holdout=True)
    seen = 0.0 if film_transparent else 0.375
    alpha = 0.0 if film_transparent else 0.75
    assert_shows((seen,) * 3 + (alpha,), held, s.world(0.5), film_transparent=film_transparent)
    behind = held, floor(GLOW, -1)
    assert_shows((0.75, 1.5, 2.25, 0.75), *behind, film_transparent=film_transparent)


@both_films
def test_the_holdout_shader_leaves_the_other_part_of_a_mixture_alone(film_transparent):
    things = floor(HALF_HELD), s.world(0.5)
    assert_shows((0.5, 1.0, 1.5, 0.5), *things, film_transparent=film_transparent)


def test_a_hole_behind_a_coloured_pane_is_the_mean_of_its_channels():
    front = floor(pane(0.0, colour=(0.9, 0.5, 0.1)), 1)
    for held in (floor(GLOW, is_holdout=True), floor(s.Material("H", s.node("Holdout")))):
        assert_shows((0, 0, 0, 0.5), front, held)


def test_no_more_surfaces_are_passed_behind_one_held_out_than_the_limit_allows():
    sheets = [floor(pane(0.5), z, is_holdout=True) for z in (0, -1, -2)]
    things = *sheets, floor(GLOW, -3)
    assert_shows((0.125, 0.25, 0.375, 0.125), *things, transparent_max_bounces=3)
    two_passed = 1 - 0.5 - 0.25 - 0.125
    found = shown(*things, transparent_max_bounces=1)
    np.testing.assert_allclose(found, (0, 0, 0, two_passed), atol=1e-6)


@pytest.mark.parametrize("splitting", (False, True))
@pytest.mark.parametrize("between", (s.mirror(), s.refraction()), ids=("mirror", "refraction"))
def test_what_a_mirror_or_a_lens_shows_is_not_held_out(between, splitting):
    z = 4 if between.name == "Mirror" else -1
    for material, colour in ((GLOW, (1, 2, 3)), (HALF_HELD, (0.5, 1, 1.5))):
        held = floor(material, z, is_holdout=material is GLOW)
        things = floor(between), held
        assert_shows((*colour, 1), *things, film_transparent=True, splitting=splitting)


def test_an_object_held_out_casts_its_shadow():
    ground, light = floor(s.diffuse(), half=1), s.sun((1, 0, 1))
    blocker = s.put(s.quad((0, 1, 0), (1, 0, -1), (3, 0, 3)), s.diffuse(0.0))
    assert shown(ground, light)[1] > 0.1
    found = shown(ground, light, replace(blocker, is_holdout=True))
    np.testing.assert_allclose(found, (0, 0, 0, 1), atol=1e-6)


def test_an_object_held_out_lights_what_the_camera_sees():
    ground, glow = floor(s.diffuse(), half=1), s.put(s.quad(centre=(3, 0, 1)), GLOW)
    as_usual, held = (shown(ground, replace(glow, is_holdout=h)) for h in (False, True))
    assert as_usual[1] > 0.01
    np.testing.assert_array_equal(as_usual, held)


# --- Clear glass --------------------------------------------------------------------------------


@pytest.mark.parametrize("splitting", (False, True))
@pytest.mark.parametrize("roughness, is_clear", ((0.0, True), (0.1, True), (0.11, False)))
def test_glass_is_clear_up_to_the_roughness_that_is_set(roughness, is_clear, splitting):
    things = floor(rough_refraction(roughness), half=40), s.world(0.5)
    settings = CLEAR_GLASS | {"splitting": splitting, "film_transparent_roughness": 0.1}
    found = shown(*things, **settings)
    if is_clear:
        np.testing.assert_allclose(found, (0, 0, 0, 0), atol=0.02)  # rough glass loses a little
    else:
        np.testing.assert_allclose(found, (0.5, 0.5, 0.5, 1), atol=0.01)


@pytest.mark.parametrize("splitting", (False, True))
def test_what_clear_glass_reflects_is_not_transparent(splitting):
    things = floor(s.glass(1.5)), s.world(0.5)
    reflected = 0.04  # ((1.5 - 1) / (1.5 + 1))^2
    settings = CLEAR_GLASS | {"splitting": splitting, "samples": 4096}
    assert_shows((reflected / 2,) * 3 + (reflected,), *things, **settings, atol=2e-3)


def test_glass_is_clear_only_for_a_transparent_film_that_asks_for_it():
    things = floor(s.refraction()), s.world(0.5)
    assert_shows((0.5, 0.5, 0.5, 1), *things, film_transparent_glass=True)
    assert_shows((0.5, 0.5, 0.5, 1), *things, film_transparent=True)
    held = floor(s.refraction()), floor(GLOW, -1, is_holdout=True)
    assert_shows((1, 2, 3, 1), *held, film_transparent_glass=True)


def test_what_a_mirror_shows_is_not_transparent_even_behind_clear_glass():
    things = floor(s.mirror()), floor(s.refraction(), 4), s.world(0.5)
    assert_shows((0.5, 0.5, 0.5, 1), *things, **CLEAR_GLASS)


def test_glass_is_clear_at_the_end_of_all_bounces_and_without_any_light():
    assert_shows((0, 0, 0, 0), floor(s.refraction()), **CLEAR_GLASS, max_bounces=0)


def test_what_is_held_out_is_so_behind_clear_glass_but_not_behind_its_mirror_image():
    held = floor(GLOW, -1, is_holdout=True)
    assert_shows((0, 0, 0, 0), floor(s.refraction()), held, **CLEAR_GLASS)
    seen_in_mirror = floor(s.mirror(), -1), floor(GLOW, 4, is_holdout=True)
    assert_shows((1, 2, 3, 1), *seen_in_mirror, **CLEAR_GLASS)


def test_shadow_rays_through_rough_glass_end_before_a_light_nearby_however_large_the_glass():
    """What is held out is lit by samples of the light alone: what scattered rays find is a hole."""
    glass = s.Material("Frosted", s.node("BsdfGlass", Roughness=0.3, IOR=1.5))
    settings = CLEAR_GLASS | {"film_transparent_roughness": 1.0, "samples": 1024}
    small, large = (
        shown(floor(glass, half=half), floor(GLOW, -1, is_holdout=True), **settings)[1]
        for half in (2, 20)
    )
    assert small > 0.02
    np.testing.assert_allclose(large, small, rtol=0.02)
