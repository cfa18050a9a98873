"""closures -> their weight seen from elsewhere: what a shader gives that is run there."""

import numpy as np
import pytest

from penumbra.core import Link, Material, compile_plan
from penumbra.core.shading import Arrival
from penumbra.core.shading.values import walk
from tests.support import scenes as s
from tests.support.points import points


def material(kind, **inputs):
    return Material(kind, s.node(kind, **inputs))


PLACE = Link(s.node("NewGeometry"), "Position")
NOISE = Link(s.node("TexNoise", Scale=3.0, Vector=PLACE), "Color")
MATERIALS = {
    "matte": (s.diffuse(0.7), False),
    "textured": (material("BsdfDiffuse", Color=NOISE), False),
    "plastic": (material("BsdfPrincipled", Roughness=0.3), True),
    "textured plastic": (material("BsdfPrincipled", Base_Color=NOISE, Roughness=0.3), True),
    "coat": (
        material("BsdfPrincipled", Coat_Weight=1.0, Coat_Tint=(0.9, 0.4, 0.2), IOR=1.0),
        True,
    ),
    "sheen": (material("BsdfPrincipled", Sheen_Weight=1.0, Base_Color=NOISE), True),
    "facing": (
        material("BsdfDiffuse", Color=Link(s.node("LayerWeight", Blend=0.3), "Facing")),
        True,
    ),
    "reflection": (
        material(
            "BsdfDiffuse",
            Color=Link(s.node("TexNoise", Vector=Link(s.node("TexCoord"), "Reflection")), "Color"),
        ),
        True,
    ),
}


def surfaces_of(material):
    view = s.camera((0, -3, 1))
    return compile_plan(s.scene(view, s.put(s.quad(), material)), s.DEFAULTS).surfaces


def directions(seed, count=50):
    wo = np.random.default_rng(seed).normal(size=(3, count))
    wo[2] = np.abs(wo[2]) + 0.1
    return (wo / np.linalg.norm(wo, axis=0)).astype(np.float32)


def matte_of(surfaces, wo, position):
    at = points(wo, position=position)
    (shaded,) = surfaces.shade(at, Arrival(), None, True)
    return shaded.matte


@pytest.mark.parametrize("name", MATERIALS)
def test_the_weight_is_what_a_shader_gives_there(name):
    made, depends = MATERIALS[name]
    surfaces = surfaces_of(made)
    here, there = directions(1), directions(2)
    position = np.random.default_rng(3).uniform(-1, 1, (3, here.shape[1])).astype(np.float32)
    matte = matte_of(surfaces, here, position)
    expected = matte_of(surfaces, there, position).weight
    if not depends:
        assert matte.viewed is None
        np.testing.assert_array_equal(matte.weight, expected)
        return
    again = matte.viewed.weight(there)
    np.testing.assert_allclose(again, np.broadcast_to(expected, again.shape), rtol=1e-6)
    assert not np.allclose(again, matte.weight, rtol=1e-3)
    np.testing.assert_allclose(matte.viewed.weight(here), matte.weight, rtol=1e-6)


def test_textures_are_not_looked_up_again():
    made, _ = MATERIALS["textured plastic"]
    matte = matte_of(surfaces_of(made), directions(1), np.zeros((3, 50), np.float32))
    every = {item.function for item in walk([matte.viewed.view.weight]) if item.function}
    again = {item.function for item in matte.viewed.view.steps if item.function}
    kept = {item.function for item in matte.viewed.view.kept}
    assert again and kept and kept < every and not kept & again


def test_what_depends_on_the_distance_and_two_matte_closures_take_no_part():
    length = Link(s.node("LightPath"), "Ray Length")
    for surface in (
        s.node("BsdfDiffuse", Color=length),
        s.shader(s.diffuse(0.5).surface, s.diffuse(0.2).surface),
    ):
        surfaces = surfaces_of(Material("Mix", surface))
        assert matte_of(surfaces, directions(1), np.zeros((3, 50), np.float32)) is None
