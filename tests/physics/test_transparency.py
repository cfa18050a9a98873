"""transparent surfaces -> what passes them, as formulas say: mixtures, stacks, shadows, limits."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Link, Material, Node, compile_plan, render
from tests.support import scenes as s
from tests.support.statistics import assert_same_mean

TINT = np.array((0.9, 0.5, 0.2))
LIGHT = np.array((1.0, 2.0, 3.0))
VIEW = s.orthographic((0, 0, 5), size=4)
BACK = s.put(s.quad((9, 0, 0), (0, 9, 0), (0, 0, -2)), s.emission(LIGHT))
ways = pytest.mark.parametrize("splitting", (True, False), ids=("split", "one"))


def clear(colour=TINT):
    return s.node("BsdfTransparent", Color=tuple(colour))


def sheet(surface, z=0.0):
    return s.put(s.quad((9, 0, 0), (0, 9, 0), (0, 0, z)), Material("Sheet", surface))


def mixed(first, second, fac):
    return s.shader(first, second, "MixShader", fac)


def seen(*things, **settings):
    """The mean colour (3,) of a picture."""
    return s.pixels(VIEW, *things, **settings)[..., :3].mean(axis=(0, 1))


@ways
@pytest.mark.parametrize("count", (1, 3, 6))
def test_a_stack_of_sheets_lets_through_the_product(count, splitting):
    stack = [sheet(clear((0.9, 0.8, 0.7)), -0.1 * n) for n in range(count)]
    found = seen(*stack, BACK, splitting=splitting, max_bounces=0, transparent_max_bounces=6)
    np.testing.assert_allclose(found, LIGHT * np.array((0.9, 0.8, 0.7)) ** count, rtol=1e-5)


@ways
@pytest.mark.parametrize("limit", (0, 1, 2, 3, 4))
def test_behind_more_sheets_than_are_passed_it_is_dark(limit, splitting):
    # As with other bounces, what follows the last one still shows what glows (Cycles).
    stack = [sheet(clear(), -0.1 * n) for n in range(3)]
    found = seen(*stack, BACK, transparent_max_bounces=limit, splitting=splitting)
    np.testing.assert_allclose(found, LIGHT * TINT**3 if limit >= 3 else 0, rtol=1e-5)


ALPHAS = {
    "Principled": lambda a: s.node(
        "BsdfPrincipled",
        Alpha=a,
        Base_Color=s.colour(0.0),
        Specular_IOR_Level=0.0,
        IOR=1.0,
        Emission_Color=(3.0, 2.0, 1.0),
        Emission_Strength=1.0,
    ),
    "Mix Shader": lambda a: mixed(clear((1, 1, 1)), s.emission((3.0, 2.0, 1.0)).surface, a),
}


@ways
@pytest.mark.parametrize("kind", ALPHAS)
@pytest.mark.parametrize("alpha", (0.0, 0.25, 0.9, 1.0))
def test_alpha_mixes_what_is_before_and_behind(kind, alpha, splitting):
    found = seen(sheet(ALPHAS[kind](alpha)), BACK, splitting=splitting)
    expected = alpha * np.array((3, 2, 1)) + (1 - alpha) * LIGHT
    np.testing.assert_allclose(found, expected, rtol=1e-5)


@ways
def test_a_matte_mixture_scatters_its_share_and_lets_the_rest_through(splitting):
    # The sheet gets light of a sun; behind it something glows, which lights its back only.
    things = (
        sheet(mixed(s.node("BsdfDiffuse", Color=s.colour(0.8)), clear(), 0.3)),
        BACK,
        s.sun((0, 0.6, 0.8), 2.0),
    )
    settings = {"splitting": splitting, "max_bounces": 0, "samples": 16}
    expected = 0.7 * 0.8 / np.pi * 0.8 * 2.0 + 0.3 * TINT[1] * LIGHT[1]
    found = s.means(VIEW, *things, **settings)
    assert_same_mean(found, expected, tests=2)
    if splitting:
        np.testing.assert_allclose(found, expected, rtol=1e-4)


@pytest.mark.parametrize("count", (1, 2, 5))
@pytest.mark.parametrize("varies", (False, True), ids=("constant", "of the point"))
def test_shadows_of_sheets_have_their_colour(count, varies):
    colour = tuple(TINT)
    if varies:
        front = Node("Math", "", {"Value": 1.0, "Value_001": BACKFACING}, {"operation": "SUBTRACT"})
        colour = Link(Node("MixRGB", "", {"Fac": Link(front, "Value"), "Color1": tuple(TINT),
                                          "Color2": tuple(TINT)}), "Color")  # fmt: skip
    stack = [sheet(s.node("BsdfTransparent", Color=colour), 1 + 0.1 * n) for n in range(count)]
    things = s.put(s.quad((9, 0, 0), (0, 9, 0)), s.diffuse(0.8)), s.point((0, 0, 2), 10.0)
    below = s.orthographic((0, -0.3, 0.5), (0, 0, 0), size=4, scale=1e-3)
    found = s.pixels(below, *stack, *things, max_bounces=0)[..., :3].mean(axis=(0, 1))
    np.testing.assert_allclose(found, 0.8 / np.pi * 10 / 4 * TINT**count, rtol=1e-4)


@pytest.mark.parametrize("above", (0, 2), ids=("none above", "two above"))
def test_sheets_tell_shadow_rays_how_many_they_and_the_path_have_passed(above):
    # A sheet that n others were passed before lets 1 / (1 + n) through.
    deeper = Node("Math", "", {"Value": 1.0, "Value_001": DEPTH}, {"operation": "ADD"})
    share = Node("Math", "", {"Value": 1.0, "Value_001": Link(deeper, "Value")},
                 {"operation": "DIVIDE"})  # fmt: skip
    surface = s.node("BsdfTransparent", Color=Link(share, "Value"))
    stack = [sheet(surface, 1 + 0.1 * n) for n in range(3)]
    stack += [sheet(surface, 0.1 + 0.1 * n) for n in range(above)]
    things = s.put(s.quad((9, 0, 0), (0, 9, 0)), s.diffuse(0.8)), s.point((0, 0, 2), 10.0)
    below = s.orthographic((0, -0.3, 0.5), (0, 0, 0), size=4, scale=1e-3)
    found = s.pixels(below, *stack, *things, max_bounces=0)[..., :3].mean(axis=(0, 1))
    expected = {0: 1 / (1 * 2 * 3), 2: 1 / (1 * 2) / (3 * 4 * 5 * 6 * 7)}[above]
    np.testing.assert_allclose(found, 0.8 / np.pi * 10 / 4 * expected, rtol=1e-4)


DEPTH = Link(Node("LightPath", ""), "Transparent Depth")
BACKFACING = Link(Node("NewGeometry", ""), "Backfacing")


@pytest.mark.parametrize("limit", (1, 2, 3))
def test_shadow_rays_pass_as_many_sheets_as_others(limit):
    stack = [sheet(clear(), 1 + 0.1 * n) for n in range(2)]
    things = s.put(s.quad((9, 0, 0), (0, 9, 0)), s.diffuse(0.8)), s.point((0, 0, 2), 10.0)
    below = s.orthographic((0, -0.3, 0.5), (0, 0, 0), size=4, scale=1e-3)
    found = s.pixels(below, *stack, *things, transparent_max_bounces=limit, max_bounces=0)
    assert (found[..., 1] > 0).all() == (limit >= 2)


@pytest.mark.parametrize("spare", (0, 1))
def test_paths_but_not_shadow_rays_may_pass_more_sheets_than_the_limit(spare):
    stack = [sheet(clear(), 1 + 0.1 * n) for n in range(3)]
    settings = replace(s.DEFAULTS, transparent_max_bounces=2, max_bounces=0)

    def shown(view, *things):
        scene = s.scene(view, *stack, *things, spare_passes=spare)
        return render(compile_plan(scene, settings), threads=1).combined()[..., :3].mean((0, 1))

    np.testing.assert_allclose(shown(VIEW, BACK), LIGHT * TINT**3 * spare, rtol=1e-5)
    below = s.orthographic((0, -0.3, 0.5), (0, 0, 0), size=4, scale=1e-3)
    things = s.put(s.quad((9, 0, 0), (0, 9, 0)), s.diffuse(0.8)), s.point((0, 0, 2), 10.0)
    assert not shown(below, *things).any()


@pytest.mark.parametrize("roughness", (0.0, 0.4))
def test_a_smooth_thin_wall_is_a_pane_to_shadow_rays_a_rough_one_is_not(roughness):
    wall = s.node(
        "BsdfPrincipled",
        Thin_Wall=1.0,
        Transmission_Weight=1.0,
        Roughness=roughness,
        IOR=1.5,
        Base_Color=s.colour(1.0),
    )
    things = s.put(s.quad((9, 0, 0), (0, 9, 0)), s.diffuse(0.8)), s.point((0, 0, 2), 10.0)
    below = s.orthographic((0, -0.3, 0.5), (0, 0, 0), size=4, scale=1e-3)
    found = s.pixels(below, sheet(wall, 1), *things, max_bounces=0)[..., :3].mean(axis=(0, 1))
    # Both of its sides reflect 4 %, again and again.
    passed = (1 - 0.04) / (1 + 0.04) if roughness == 0 else 0
    np.testing.assert_allclose(found, 0.8 / np.pi * 10 / 4 * passed, rtol=1e-4)


def test_a_material_without_transparent_shadow_throws_a_full_one():
    opaque = Material("Sheet", clear(), transparent_shadow=False)
    things = (
        s.put(s.quad((9, 0, 0), (0, 9, 0)), s.diffuse(0.8)),
        s.put(s.quad((9, 0, 0), (0, 9, 0), (0, 0, 1)), opaque),
        s.point((0, 0, 2), 10.0),
    )
    below = s.orthographic((0, -0.3, 0.5), (0, 0, 0), size=4, scale=1e-3)
    assert not s.pixels(below, *things, max_bounces=0)[..., :3].any()
    assert s.pixels(s.orthographic((0, 0, 5), size=4), *things)[..., 1].mean() == 0


def test_straight_rays_are_no_bounce_and_keep_their_kind():
    # Camera, sheets, matte ground, lamp behind sheets: direct light only.
    kind = Link(Node("LightPath", ""), "Is Camera Ray")
    ground = s.node("Emission", Strength=kind)
    stack = [sheet(clear((1, 1, 1)), 0.1 * n) for n in range(1, 5)]
    limits = {"max_bounces": 0, "diffuse_bounces": 0, "glossy_bounces": 0}
    found = seen(*stack, sheet(ground), **limits, transmission_bounces=0)
    np.testing.assert_allclose(found, 1, rtol=1e-6)


def test_a_transparent_film_shows_holes_behind_sheets():
    image = s.pixels(VIEW, sheet(clear((0.5, 0.5, 0.5))), film_transparent=True)
    np.testing.assert_allclose(image[..., 3], 0.5, rtol=1e-5)
    image = s.pixels(VIEW, sheet(clear((0.5,) * 3)), BACK, film_transparent=True)
    np.testing.assert_allclose(image[..., 3], 1, rtol=1e-5)
