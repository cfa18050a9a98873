"""render -> light is kept: white surfaces vanish in a white world, furnaces show their series."""

import pytest

from penumbra.core import Material, Node
from tests.support import scenes as s
from tests.support.statistics import SIGNIFICANCE, assert_same_mean, sidak, t_probability

WHITE = (1.0, 1.0, 1.0)
DEEP = {
    "max_bounces": 100,
    "diffuse_bounces": 100,
    "glossy_bounces": 100,
    "transmission_bounces": 100,
}
SPHERE = s.sphere(levels=2, smooth=False)
VIEW = s.camera((0, -3, 1), size=12, fov=36)


def node(kind, properties=None, **inputs):
    return Node(kind, "", s.node(kind, **inputs).inputs, properties or {})


MULTIPLE, SINGLE = {"distribution": "MULTI_GGX"}, {"distribution": "GGX"}


def principled(**inputs):
    white = {"Base_Color": WHITE, "Specular_Tint": WHITE, "IOR": 1.5}
    return node("BsdfPrincipled", MULTIPLE, **{**white, **inputs})


# What may be lost: GGX's tables hold 32 roughnesses and cosines, glass's 16 and 16 indices; layers
# let down what the upper one is estimated to leave.
REFLECTED, LAYERED, REFRACTED = 0.003, 0.004, 0.02
ROUGHNESSES = (0.1, 0.5, 1.0)
# Name -> surface by roughness, and what it may lose
SURFACES = {
    "matte": (lambda r: node("BsdfDiffuse", Roughness=r), REFLECTED),
    "glossy": (lambda r: node("BsdfGlossy", MULTIPLE, Roughness=r), REFLECTED),
    "metal": (lambda r: principled(Metallic=1.0, Roughness=r), REFLECTED),
    "dielectric": (lambda r: principled(Roughness=r), LAYERED),
    "half metal": (lambda r: principled(Metallic=0.5, Roughness=r), LAYERED),
    "coat": (lambda r: principled(Coat_Weight=1.0, Coat_Roughness=r), LAYERED),
    "sheen": (lambda r: principled(Sheen_Weight=1.0, Sheen_Roughness=r), LAYERED),
    "pane": (lambda r: principled(Thin_Wall=1.0, Transmission_Weight=1.0, Roughness=r), LAYERED),
    "glass": (lambda r: node("BsdfGlass", MULTIPLE, IOR=1.5, Roughness=r), REFRACTED),
    "principled glass": (lambda r: principled(Transmission_Weight=1.0, Roughness=r), REFRACTED),
}


def in_white_world(surface, **settings):
    """What a sphere shows in a white world, by seeds."""
    things = s.put(SPHERE, Material("White", surface)), s.world()
    return s.means(VIEW, *things, samples=32, **{**DEEP, **settings})


def is_below(estimates, bound, tests):
    """Tell whether a mean may be below a bound."""
    t = (estimates.mean() - bound) / (estimates.std(ddof=1) / estimates.size**0.5 + 1e-6)
    return t < 0 or t_probability(t, estimates.size - 1) > sidak(SIGNIFICANCE, tests)


@pytest.mark.parametrize("splitting", (True, False), ids=("split", "one"))
@pytest.mark.parametrize("roughness", ROUGHNESSES)
@pytest.mark.parametrize("name", SURFACES)
def test_white_surfaces_vanish_in_a_white_world(name, roughness, splitting):
    made, loss = SURFACES[name]
    found = in_white_world(made(roughness), splitting=splitting)
    tests = 2 * len(SURFACES) * len(ROUGHNESSES) * 2
    assert is_below(found, 1.002, tests)
    assert is_below(-found, loss - 1, tests), found.mean()
    # A test that can tell
    assert found.std(ddof=1) < 0.02


@pytest.mark.parametrize("roughness", (0.5, 1.0))
@pytest.mark.parametrize("kind", ("BsdfGlossy", "BsdfGlass"))
def test_without_light_between_the_facets_rough_surfaces_are_darker(kind, roughness):
    found = in_white_world(node(kind, SINGLE, Roughness=roughness, IOR=1.5)).mean()
    assert 0.3 < found < {0.5: 0.99, 1.0: 0.75}[roughness]


# --- Closed furnaces whose walls are sampled ----------------------------------------------------

INSIDE = s.camera((0.1, 0.2, -0.1), (0.5, 0.3, 1), fov=90)


@pytest.mark.parametrize("shape", (s.box(), SPHERE), ids=("box", "sphere"))
@pytest.mark.parametrize("bounces", (0, 1, 3))
@pytest.mark.parametrize(
    "numbers", ({}, {"light_samples": 3}, {"scatter_samples": 3}), ids=("one", "light", "scatter")
)
def test_a_furnace_shows_as_many_terms_as_bounces_allow(shape, bounces, numbers):
    walls = s.put(shape, s.glowing(0.5, (1.0, 2.0, 3.0)))
    settings = {"max_bounces": bounces, "samples": 32, **numbers}
    series = sum(0.5**k for k in range(bounces + 2))
    found = s.means(INSIDE, walls, **settings) / 2
    assert found.std(ddof=1) < 0.02
    assert_same_mean(found, series, tests=18)


MIXTURES = {
    "mixture": (
        s.shader(
            node("BsdfDiffuse", Color=s.colour(0.6)),
            node("BsdfTranslucent", Color=s.colour(0.6)),
            "MixShader",
            0.5,
        ),
        0.6,
    ),
    "mirror and matte": (
        s.shader(s.mirror(0.7).surface, node("BsdfDiffuse", Color=s.colour(0.5)), "MixShader", 0.5),
        0.6,
    ),
}


@pytest.mark.parametrize("scatter_samples", (1, 4))
@pytest.mark.parametrize("splitting", (True, False), ids=("split", "one"))
@pytest.mark.parametrize("name", ("mixture", "mirror and matte"))
def test_a_furnace_of_mixtures_converges_to_its_series(name, splitting, scatter_samples):
    # A box in a box, so that what passes the inner walls comes from somewhere.
    shader, albedo = MIXTURES[name]
    walls = Material("Walls", s.shader(shader, s.emission().surface))
    things = s.put(s.box(), walls), s.put(s.box(2.0), s.glowing(0.6, 1.0))
    how = {"splitting": splitting, "scatter_samples": scatter_samples}
    found = s.means(INSIDE, *things, samples=32, **how, **DEEP)
    assert_same_mean(found, 1 / (1 - albedo), tests=8)


@pytest.mark.parametrize("scatter_samples", (1, 4))
def test_rays_that_all_hit_smooth_walls_go_on_as_often_as_is_asked(scatter_samples):
    wall = Material("Walls", s.shader(s.diffuse(0.5).surface, s.emission().surface))
    found = s.means(
        INSIDE, s.put(s.sphere(), wall), samples=16, scatter_samples=scatter_samples, **DEEP
    )
    assert_same_mean(found, 2.0, tests=2)
