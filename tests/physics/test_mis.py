"""lights -> the same picture, whether lamps are sampled, met by chance, or both with weights."""

from functools import cache

import numpy as np
import pytest

from penumbra.core import Link, Material, Node, World
from penumbra.core.compile.light import LAMPS_TRIED_EACH
from penumbra.core.lights import SAMPLED_EACH
from penumbra.core.scene import RayKinds
from penumbra.core.transport import direct, emission
from tests.support import scenes as s
from tests.support.statistics import assert_same_mean

F32 = np.float32
DEEP = {"max_bounces": 100, "diffuse_bounces": 100, "glossy_bounces": 100}


def nothing(own, other):
    """The weight of samples that are left out wherever the other way could find them."""
    return np.where((own > 0) & (own < np.inf) & (other > 0), F32(0), F32(1))


def everything(own, other):
    """The weight of samples that are counted in full."""
    return np.ones(np.broadcast_shapes(own.shape, other.shape), F32)


# How samples of lights, and light met by chance, are weighted
WAYS = {"light": (everything, nothing), "scattering": (nothing, everything)}


def node(kind, properties=None, **inputs):
    return Node(kind, "", s.node(kind, **inputs).inputs, properties or {})


GGX = {"distribution": "GGX"}
MATTE = s.node("BsdfDiffuse", Color=s.colour(0.7))
ROUGH = node("BsdfGlossy", GGX, Roughness=0.6, Color=(0.9, 0.8, 0.7))
SHINY = node("BsdfGlossy", GGX, Roughness=0.35)
BRUSHED = node("BsdfGlossy", GGX, Roughness=0.5, Anisotropy=0.5)
MIXTURE = s.shader(MATTE, ROUGH, "MixShader", 0.4)
PRINCIPLED = node(
    "BsdfPrincipled",
    {"distribution": "MULTI_GGX"},
    Base_Color=(0.6, 0.5, 0.3),
    Roughness=0.5,
    Metallic=0.3,
    Coat_Weight=0.5,
    Coat_Roughness=0.4,
    Sheen_Weight=0.3,
)
THIN = s.shader(s.node("BsdfTranslucent", Color=s.colour(0.6)), MATTE, "MixShader", 0.5)
SURFACES = {
    "matte": MATTE,
    "rough": ROUGH,
    "shiny": SHINY,
    "brushed": BRUSHED,
    "mixture": MIXTURE,
    "principled": PRINCIPLED,
    "thin": THIN,
}

VIEW = s.camera((0, -2.5, 1.2), (0, 0, 0), size=8, fov=30)
GROUND = s.quad((2, 0, 0), (0, 2, 0))


def ground(surface):
    return s.put(GROUND, Material("Ground", SURFACES[surface]))


def glow(half, height=1.0, radiance=5.0, turned=False):
    """A square that glows, above the ground, or upright beside it."""
    u, v, centre = (half, 0, 0), (0, half, 0), (0.2, 0.3, height)
    if turned:
        u, v, centre = (half, 0, 0), (0, 0, half), (0, 1.2, half + 0.1)
    return s.put(s.quad(u, v, centre), s.emission(radiance))


def spotted_world():
    """A dim world with a bright spot, some 20 degrees wide."""
    where = Link(Node("TexCoord"), "Generated")
    height = Link(Node("SeparateXYZ", "", {"Vector": where}), "Z")

    def math(operation, a, b):
        return Link(
            Node("Math", "", {"Value": a, "Value_001": b}, {"operation": operation}), "Value"
        )

    spot = math("POWER", math("MAXIMUM", height, 0.0), 30.0)
    strength = math("ADD", math("MULTIPLY", spot, 20.0), 0.2)
    return World("Sky", s.node("Background", Strength=strength))


def sheet(colour=0.5):
    """A transparent sheet close above the ground."""
    clear = Material("Clear", s.node("BsdfTransparent", Color=s.colour(colour)))
    return s.put(s.quad((9, 0, 0), (0, 9, 0), (0, 0, 0.4)), clear)


def street(count):
    """Area lamps in rows, all seen by reflections."""
    side = int(np.ceil(count**0.5))
    places = [(i % side, i // side) for i in range(count)]
    scale = 3 / side
    return [
        s.area(
            ((x - side / 2) * scale, (y - side / 2) * scale, 0.8 + 0.05 * x),
            ((x - side / 2) * scale, (y - side / 2) * scale, 0),
            radiance=6.0 * (1 + x % 3),
            size=(0.6 * scale, 0.4 * scale),
            seen_by=RayKinds(camera=False),
        )
        for x, y in places
    ]


AREA = s.area((0.2, 0.8, 0.9), (0, 0, 0), radiance=5.0, size=(0.8, 0.5))
SCENES = {
    "area lamp, rough": ([ground("rough"), AREA], {}),
    "area lamp, shiny": ([ground("shiny"), AREA], {}),
    "area lamp, brushed": ([ground("brushed"), AREA], {}),
    "area lamp, mixture": ([ground("mixture"), AREA], {}),
    "area lamp, mixture, split": ([ground("mixture"), AREA], {"splitting": True}),
    "area lamp, principled": ([ground("principled"), AREA], {}),
    "area lamp, principled, split": ([ground("principled"), AREA], {"splitting": True}),
    "area lamp, four samples": ([ground("rough"), AREA], {"light_samples": 4}),
    "area lamp, mixture, four rays on": ([ground("mixture"), AREA], {"scatter_samples": 4}),
    "area lamp, principled, split, three of each": (
        [ground("principled"), AREA],
        {"splitting": True, "light_samples": 3, "scatter_samples": 3},
    ),
    "sphere lamp": (
        [ground("rough"), s.point((0, 0.5, 0.7), 1.0, radius=0.3, soft_falloff=False)],
        {},
    ),
    "disk lamp": ([ground("rough"), s.point((0, 0.5, 0.7), 1.0, radius=0.3)], {}),
    "spot lamp": (
        [ground("rough"), s.spot((0, 0.5, 0.9), intensity=1.0, radius=0.25, spot_angle=1.5)],
        {},
    ),
    "sun": ([ground("rough"), s.sun((0, 0.5, 1), angle=0.7)], {}),
    "lamps of a street": ([ground("rough"), *street(SAMPLED_EACH + 3)], {}),
    "lamps of a town": ([ground("rough"), *street(LAMPS_TRIED_EACH + 9)], {}),
    "large mesh, matte": ([ground("matte"), glow(1.5)], {}),
    "small mesh, matte": ([ground("matte"), glow(0.25)], {}),
    "large mesh, rough": ([ground("rough"), glow(1.5)], {}),
    "large mesh, mixture": ([ground("mixture"), glow(1.5)], {}),
    "small mesh, rough": ([ground("rough"), glow(0.25)], {}),
    "upright mesh, matte": ([ground("matte"), glow(0.5, turned=True)], {}),
    "upright mesh, shiny": ([ground("shiny"), glow(0.5, turned=True)], {}),
    "mesh, mixture, split": ([ground("mixture"), glow(0.5)], {"splitting": True}),
    "mesh, principled": ([ground("principled"), glow(0.5)], {}),
    "mesh, four samples": ([ground("mixture"), glow(0.5)], {"light_samples": 4}),
    "mesh, mixture, four rays on": ([ground("mixture"), glow(0.5)], {"scatter_samples": 4}),
    "mesh below a thin sheet": ([ground("thin"), glow(0.6, -0.7)], {}),
    "meshes and lamps": ([ground("mixture"), glow(0.3), AREA], {"splitting": True}),
    "world, matte": ([ground("matte"), spotted_world()], {}),
    "world, shiny": ([ground("shiny"), spotted_world()], {}),
    "world, principled": ([ground("principled"), spotted_world()], {}),
    "world, principled, split": ([ground("principled"), spotted_world()], {"splitting": True}),
    "world, four samples": ([ground("mixture"), spotted_world()], {"light_samples": 4}),
    "world, mixture, four rays on": (
        [ground("mixture"), spotted_world()],
        {"scatter_samples": 4},
    ),
    "mesh behind a sheet": ([ground("mixture"), glow(0.5), sheet()], {}),
    "lamp behind a sheet": ([ground("rough"), AREA, sheet()], {}),
    "town behind a sheet": ([ground("rough"), *street(LAMPS_TRIED_EACH + 9), sheet()], {}),
    "world behind a sheet": ([ground("mixture"), spotted_world(), sheet()], {"splitting": True}),
    "between walls": (
        [
            ground("mixture"),
            glow(0.4),
            s.put(s.quad((0, 2, 0), (0, 0, 2), (0.9, 0, 0)), Material("W", ROUGH)),
        ],
        {"max_bounces": 3},
    ),
}


def means(things, **settings):
    settings = {"splitting": False, "max_bounces": 1, "samples": 64, **settings}
    return s.means(VIEW, *things, **settings)


@cache
def weighted(name):
    """What both ways give together."""
    things, settings = SCENES[name]
    return means(things, **settings)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", SCENES)
def test_weights_change_the_noise_and_not_the_mean(name, way, monkeypatch):
    things, settings = SCENES[name]
    both = weighted(name)
    assert both.std(ddof=1) < 0.1 * both.mean()
    sampled, met = WAYS[way]
    monkeypatch.setattr(direct, "power_weight", sampled)
    monkeypatch.setattr(emission, "power_weight", met)
    alone = means(things, **settings)
    assert not np.array_equal(alone, both)
    assert_same_mean(alone, both, tests=len(SCENES) * len(WAYS))
