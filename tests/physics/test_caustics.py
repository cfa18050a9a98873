"""filter glossy, caustics switches, splitting -> they change what they name, and nothing else."""

import numpy as np
import pytest

from penumbra.core import Material, Node
from tests.support import scenes as s
from tests.support.statistics import assert_same_mean

GROUND = s.put(s.quad((2, 0, 0), (0, 2, 0)), s.diffuse(0.8))
DOWN = s.orthographic((-0.5, 0, 1.5), (-0.5, 0, 0), size=4, scale=0.5)
# A lamp that glows, and the wall x = 0.5 between it and its mirror image
LAMP, IMAGE = (
    s.put(s.quad((0, 0.3, 0), (0, 0, 0.3), (x, 0, 0.6)), s.emission(10.0)) for x in (-1.2, 2.2)
)
WALL = s.quad((0, 9, 0), (0, 0, 9), (0.5, 0, 0))
BLACK = s.put(WALL, s.diffuse(0.0))


def node(kind, properties=None, **inputs):
    return Node(kind, "", s.node(kind, **inputs).inputs, properties or {})


def means(*things, view=DOWN, **settings):
    settings = {"samples": 256, "max_bounces": 2, **settings}
    return s.means(view, *things, **settings)


# --- Caustics -----------------------------------------------------------------------------------

REFLECTING = {
    "mirror": s.node("BsdfGlossy", Roughness=0.0, Color=s.colour(0.6)),
    "glossy": node("BsdfGlossy", {"distribution": "GGX"}, Roughness=0.3),
    "metal": s.node("BsdfPrincipled", Metallic=1.0, Roughness=0.2),
}


@pytest.mark.parametrize("kind", REFLECTING)
def test_without_reflective_caustics_matte_surfaces_see_mirrors_black(kind):
    wall = s.put(WALL, Material("Wall", REFLECTING[kind]))
    on, off, black = (
        means(GROUND, LAMP, wall),
        means(GROUND, LAMP, wall, caustics_reflective=False),
        means(GROUND, LAMP, BLACK),
    )
    assert_same_mean(off, black, tests=6)
    assert on.mean() > 1.03 * black.mean()
    assert_same_mean(means(GROUND, LAMP, wall, caustics_refractive=False), on, tests=6)


def test_a_caustic_of_a_mirror_is_the_light_of_the_mirror_image():
    # The floor's own mirror image, behind the wall, does not block the image's light.
    wall = s.put(WALL, s.mirror(0.6))
    caustic = means(GROUND, LAMP, wall) - means(GROUND, LAMP, wall, caustics_reflective=False)
    floor = s.put(s.quad((5, 0, 0), (0, 2, 0)), s.diffuse(0.8))
    assert_same_mean(caustic, 0.6 * means(floor, IMAGE, max_bounces=0), tests=1)


@pytest.mark.parametrize("roughness", (0.0, 0.3))
def test_without_refractive_caustics_nothing_shines_through_glass(roughness):
    pane = s.quad((9, 0, 0), (0, 9, 0), (0, 0, 1))
    lamp = s.put(s.quad((0.5, 0, 0), (0, 0.5, 0), (-0.5, 0, 2)), s.emission(10.0))
    low = s.orthographic((-0.5, -0.5, 0.9), (-0.5, 0, 0), size=4, scale=0.3)
    lens = Material("Lens", s.node("BsdfRefraction", IOR=1.0, Roughness=roughness))
    things = GROUND, lamp, s.put(pane, lens)
    # An index of 1 bends nothing: with caustics, the pane is not there.
    bare = means(GROUND, lamp, view=low, max_bounces=1)
    assert_same_mean(means(*things, view=low), bare, tests=2, bias=1e-3)
    assert means(*things, view=low, caustics_refractive=False).max() == 0
    assert_same_mean(means(*things, view=low, caustics_reflective=False), bare, tests=2, bias=1e-3)


def test_caustics_switches_do_not_touch_what_the_camera_sees():
    shiny = s.put(s.sphere(0.5, 2), Material("Glass", s.node("BsdfGlass", Roughness=0.2)))
    things = shiny, s.put(WALL, s.mirror(0.6)), LAMP, s.world(0.3)
    view = s.camera((0, -3, 1))
    off = {"caustics_reflective": False, "caustics_refractive": False}
    settings = {"samples": 8, "max_bounces": 8}
    a, b = (s.pixels(view, *things, **settings, **more) for more in ({}, off))
    np.testing.assert_allclose(a, b, rtol=1e-6)


# --- Filter glossy ------------------------------------------------------------------------------


SMOOTH = (
    s.put(WALL, s.mirror(0.6)),
    s.put(s.box(0.2), s.glass(), to_world=s.affine(1.0, (-0.7, 0, 0))),
)
LONE = (s.put(s.sphere(0.4, 2, smooth=False), Material("Rough", REFLECTING["glossy"])),)


@pytest.mark.parametrize("things", (SMOOTH, LONE), ids=("mirror and glass", "rough and alone"))
def test_filter_glossy_changes_nothing_that_is_seen_directly_or_in_mirrors(things):
    view = s.camera((0, -3, 1))
    settings = {"samples": 8, "max_bounces": 6}
    sharp, blurred = (
        s.pixels(view, *things, LAMP, s.world(0.3), **settings, blur_glossy=b) for b in (0.0, 10.0)
    )
    np.testing.assert_array_equal(sharp, blurred)


@pytest.mark.parametrize("kind", REFLECTING)
def test_filter_glossy_spreads_caustics(kind):
    wall = s.put(WALL, Material("Wall", REFLECTING[kind]))
    sharp, blurred = (means(GROUND, LAMP, wall, blur_glossy=b) for b in (0.0, 1.0))
    assert not np.array_equal(sharp, blurred)
    assert blurred.mean() > 1.01 * means(GROUND, LAMP, BLACK).mean()
    # Less noise is what it is for.
    assert blurred.std(ddof=1) < 1.5 * sharp.std(ddof=1)


# --- Splitting ----------------------------------------------------------------------------------

PRINCIPLED = {
    "plastic": {"Roughness": 0.3},
    "metal and coat": {"Metallic": 0.6, "Roughness": 0.3, "Coat_Weight": 0.8},
    "sheen": {"Sheen_Weight": 0.7, "Roughness": 0.6, "Diffuse_Roughness": 0.5},
    "glass": {"Transmission_Weight": 0.7, "Roughness": 0.2},
    "clear glass": {"Transmission_Weight": 0.7, "Roughness": 0.0, "Alpha": 0.7},
    "thin wall": {"Thin_Wall": 1.0, "Transmission_Weight": 0.5, "Subsurface_Weight": 0.3},
}


@pytest.mark.parametrize("name", PRINCIPLED)
def test_splitting_principled_surfaces_changes_no_mean(name):
    inputs = {"Base_Color": (0.7, 0.5, 0.3), "IOR": 1.5, **PRINCIPLED[name]}
    ball = s.put(
        s.sphere(0.5, 2, smooth=False),
        Material("Ball", s.node("BsdfPrincipled", **inputs)),
        to_world=s.affine(1.0, (-0.5, 0, 0.5)),
    )
    things = ball, GROUND, LAMP, s.area((0, -1, 2), radiance=3.0), s.world(0.3)
    view = s.camera((-0.5, -2.5, 1.5), (-0.5, 0, 0.4), fov=30)
    one, other = (
        means(*things, view=view, splitting=on, samples=64, max_bounces=5) for on in (True, False)
    )
    assert one.std(ddof=1) < 0.02 * one.mean()
    assert_same_mean(one, other, tests=len(PRINCIPLED))
