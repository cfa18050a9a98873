"""core.shading -> each shader node as lobes and emission, and a note for all it leaves out."""

import numpy as np
import pytest

from penumbra.core import Link, Node
from penumbra.core.bsdf import REGISTRY
from penumbra.core.shading import Arrival, Rules, compile_surface, compile_table
from penumbra.core.shading.shaders import SHADERS
from tests.support import scenes as s
from tests.support.points import seen_from

WHITE, RED, GREY = (1.0, 1.0, 1.0), (1.0, 0.25, 0.0), (0.8, 0.8, 0.8)
HALF_RED = (0.5, 0.125, 0.0)
F0 = 0.04  # of an index of 1.5


def node(kind, properties=None, name="", **inputs):
    return Node(kind, name, s.node(kind, **inputs).inputs, properties or {})


def principled(**inputs):
    basics = {"Base_Color": RED, "Roughness": 0.0, "Specular_IOR_Level": 0.0, "IOR": 1.0}
    return s.node("BsdfPrincipled", **{**basics, **inputs})


def mixed(first, second, fac):
    return s.shader(first, second, "MixShader", fac)


def compiled(shader, rules=Rules()):  # noqa: B008
    return compile_surface("Material 'X'", s.Material("X", shader), rules)


def seen(surface, cosine=1.0, arrival=Arrival(), **point):  # noqa: B008
    """Lobes (closure, weight, parameters) and what else there is, at one point from the front."""
    table, at = compile_table([surface]), seen_from(cosine, **point)
    lobes = [
        (lobe.module.NAME, lobe.weight[:, 0], [p.reshape(-1) for p in lobe.parameters])
        for shaded in table.shade(at, arrival, None, False)
        for lobe in shaded.lobes
    ]
    other = [
        [np.broadcast_to(found, (3, 1))[:, 0] for _, found in made(at, arrival)]
        for made in (table.emission, table.holdout)
    ]
    return lobes, *(parts[0] if parts else np.zeros(3) for parts in other)


MATTE = s.node("BsdfDiffuse", Color=RED)
GLOW = s.node("Emission", Color=RED, Strength=3.0)
CLEAR = s.node("BsdfTransparent", Color=RED)
GGX = {"distribution": "GGX"}

# node -> lobes (closure, weight, *parameters); None is any
MEANING = (
    (MATTE, [("diffuse", RED)]),
    (s.node("BsdfDiffuse"), [("diffuse", WHITE)]),
    (s.node("BsdfDiffuse", Color=(*RED, 1.0)), [("diffuse", RED)]),
    (s.node("BsdfDiffuse", Color=(0.0, 0.0, 0.0)), []),
    (s.node("BsdfDiffuse", Color=(-1.0, 0.5, 0.0)), [("diffuse", (0, 0.5, 0))]),
    (s.node("BsdfDiffuse", Color=RED, Roughness=0.5), [("oren nayar", RED, None, None, None)]),
    (s.node("BsdfTranslucent", Color=RED), [("translucent", RED)]),
    (s.node("SubsurfaceScattering", Color=RED), [("diffuse", RED)]),
    (s.node("BsdfSheen", Color=RED, Roughness=0.5), [("sheen", None, None, None)]),
    (node("BsdfSheen", {"distribution": "ASHIKHMIN"}, Roughness=0.5), [("velvet", WHITE, 0.5)]),
    (node("BsdfVelvet", {"distribution": "ASHIKHMIN"}, Roughness=0.5), [("velvet", WHITE, 0.5)]),
    (s.node("BsdfToon", Color=RED, Size=0.3, Smooth=0.1), [("toon diffuse", RED, 0.3, 0.1)]),
    (node("BsdfToon", {"component": "GLOSSY"}, Color=RED), [("toon glossy", RED, 0.5, 0)]),
    (s.node("BsdfAnisotropic", Color=RED, Roughness=0.0), [("smooth reflection unit", RED)]),
    (s.node("BsdfGlossy", Color=RED, Roughness=0.5), [("ggx reflection unit", RED, 0.25)]),
    (node("BsdfGlossy", {"distribution": "BECKMANN"}), [("beckmann reflection unit", WHITE, 0.25)]),
    (
        node("BsdfGlossy", {"distribution": "ASHIKHMIN_SHIRLEY"}, Color=RED),
        [("ashikhmin shirley", RED, 0.25, 0.25)],
    ),
    (node("BsdfGlossy", {"distribution": "MULTI_GGX"}), [("ggx reflection unit", None, 0.25)]),
    (
        node("BsdfMetallic", {**GGX, "fresnel_type": "F82"}, Base_Color=RED, Edge_Tint=WHITE),
        [("ggx reflection f82", WHITE, 0.25, RED, (0, 0, 0))],
    ),
    (
        node(
            "BsdfMetallic",
            {"distribution": "BECKMANN", "fresnel_type": "PHYSICAL_CONDUCTOR"},
            IOR=RED,
            Extinction=(2.0, 3.0, 4.0),
        ),
        [("beckmann reflection conductor", WHITE, 0.25, RED, (2, 3, 4))],
    ),
    (
        s.node("BsdfGlass", Color=RED, IOR=1.5, Roughness=0.0),
        [("smooth glass", WHITE, 1.5, (F0,) * 3, RED, RED)],
    ),
    (
        node("BsdfGlass", {"distribution": "BECKMANN"}, IOR=1.5, Roughness=0.5),
        [("beckmann glass", WHITE, 0.25, 1.5, (F0,) * 3, WHITE, WHITE)],
    ),
    (
        s.node("BsdfGlass", Roughness=0.0, IOR=1.5, Thin_Film_Thickness=300.0, Thin_Film_IOR=1.4),
        [("smooth glass film", WHITE, 1.5, (F0,) * 3, 300, 1.4, WHITE, WHITE)],
    ),
    (s.node("BsdfRefraction", Color=RED, IOR=1.3), [("smooth refraction", RED, 1.3)]),
    (
        node("BsdfRefraction", GGX, Color=RED, IOR=1.3, Roughness=0.5),
        [("ggx refraction", RED, 0.25, 1.3)],
    ),
    (s.shader(MATTE, GLOW), [("diffuse", RED)]),
    (mixed(MATTE, GLOW, 0.25), [("diffuse", (0.75, 0.1875, 0))]),
    (mixed(MATTE, GLOW, 7.0), []),
    (mixed(MATTE, mixed(MATTE, GLOW, 1.0), 0.0), [("diffuse", RED)]),
    (Node("MixShader", "", {"Shader": Link(MATTE, "BSDF")}), [("diffuse", HALF_RED)]),
    (Node("AddShader", "", {}), []),
    (CLEAR, [("transparent", RED)]),
    (mixed(MATTE, CLEAR, 0.5), [("diffuse", HALF_RED), ("transparent", HALF_RED)]),
    (principled(), [("diffuse", RED)]),
    (principled(Diffuse_Roughness=0.5), [("oren nayar", RED, None, None, None)]),
    (principled(Alpha=0.5), [("diffuse", HALF_RED), ("transparent", (0.5, 0.5, 0.5))]),
    (principled(Alpha=0.0), [("transparent", WHITE)]),
    (
        principled(Metallic=0.25),
        [("smooth reflection f82", (0.25,) * 3, RED, None), ("diffuse", (0.75, 0.1875, 0))],
    ),
    (
        principled(Transmission_Weight=1.0, IOR=1.5),
        [("smooth glass", WHITE, 1.5, (F0,) * 3, WHITE, (1, 0.5, 0))],
    ),
    (principled(Subsurface_Weight=0.5), [("diffuse", HALF_RED), ("diffuse", HALF_RED)]),
    (
        principled(IOR=1.5, Specular_IOR_Level=0.5, Roughness=0.5),
        [("ggx reflection remapped", None, 0.25, 1.5, (F0,) * 3), ("diffuse", None)],
    ),
    (
        principled(Coat_Weight=0.5, Coat_Roughness=0.5, Coat_IOR=1.6),
        [("ggx reflection dielectric", None, 0.25, 1.6), ("diffuse", None)],
    ),
    (principled(Sheen_Weight=0.5), [("sheen", None, None, None), ("diffuse", None)]),
    (
        principled(Metallic=1.0, Thin_Film_Thickness=300.0, Thin_Film_IOR=1.4),
        [("smooth reflection f82 film", WHITE, RED, None, 300, 1.4)],
    ),
    (
        node(
            "BsdfPrincipled",
            {"films_metal": False},
            Base_Color=RED,
            Metallic=1.0,
            Roughness=0.0,
            Thin_Film_Thickness=300.0,
        ),
        [("smooth reflection f82", WHITE, RED, None)],
    ),
    (
        principled(Metallic=1.0, Roughness=0.5, Anisotropic=0.5),
        [("ggx anisotropic reflection f82", None, None, None, RED, None)],
    ),
)
SHINING = (
    (GLOW, (3, 0.75, 0)),
    (s.node("Background", Color=RED, Strength=2.0), (2, 0.5, 0)),
    (s.node("Emission"), WHITE),
    (s.shader(MATTE, GLOW), (3, 0.75, 0)),
    (mixed(MATTE, GLOW, 0.25), (0.75, 0.1875, 0)),
    (mixed(MATTE, GLOW, 7.0), (3, 0.75, 0)),
    (mixed(MATTE, GLOW, 0.0), (0, 0, 0)),
    (s.shader(GLOW, GLOW), (6, 1.5, 0)),
    (s.node("Emission", Strength=-2.0), (-2, -2, -2)),
    (principled(Emission_Color=RED, Emission_Strength=2.0), (2, 0.5, 0)),
    (principled(Emission_Color=RED, Emission_Strength=2.0, Alpha=0.5), (1, 0.25, 0)),
    (principled(Emission_Color=RED), (0, 0, 0)),
)


def named(row):
    shader, *_ = row
    return ", ".join([shader.kind, *(f"{k} {v}" for k, v in shader.inputs.items())])[:60]


@pytest.mark.parametrize(("shader", "lobes"), MEANING, ids=map(named, MEANING))
def test_a_node_means_these_lobes(shader, lobes):
    surface = compiled(shader)
    anisotropic = "Anisotropic" in shader.inputs
    if anisotropic:  # needs an object's space for its tangent
        found = [(x.closure, None, [None] * len(x.parameters)) for x in surface.lobes]
    else:
        found, _, _ = seen(surface)
    assert [name for name, _, _ in found] == [name for name, *_ in lobes]
    for (name, weight, parameters), (_, expected, *rest) in zip(found, lobes, strict=True):
        assert len(parameters) == len(REGISTRY[name].PARAMETERS) == len(rest)
        if anisotropic:
            continue
        if expected is not None:
            np.testing.assert_allclose(weight, expected, rtol=1e-6)
        for array, number in zip(parameters, rest, strict=True):
            if number is not None:
                np.testing.assert_allclose(array, number, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("shader", "radiance"), SHINING, ids=map(named, SHINING))
def test_a_node_shines_so(shader, radiance):
    surface = compiled(shader)
    _, emission, _ = seen(surface)
    np.testing.assert_allclose(emission, radiance, rtol=1e-6)
    assert (surface.emission is None) == (not any(radiance))


def test_a_holdout_cuts_as_deep_as_its_weight():
    for shader, depth in ((s.node("Holdout"), 1), (mixed(MATTE, s.node("Holdout"), 0.25), 0.25)):
        _, _, holdout = seen(compiled(shader))
        np.testing.assert_allclose(holdout, depth)


def test_every_shader_node_has_a_row_here():
    shown = {row[0].kind for row in (*MEANING, *SHINING)} | {"Holdout"}
    assert shown == set(SHADERS)


def test_anisotropy_stretches_along_the_tangent_and_narrows_across():
    for shader, along, across in (
        (s.node("BsdfGlossy", Roughness=0.5, Anisotropy=0.5), 0.125, 0.5),
        (s.node("BsdfGlossy", Roughness=0.5, Anisotropy=-0.5), 0.5, 0.125),
        (node("BsdfMetallic", GGX, Roughness=0.5, Anisotropy=0.5), 0.25 / 0.55**0.5, None),
        (principled(Metallic=1.0, Roughness=0.5, Anisotropic=1.0), 0.25 / 0.1**0.5, None),
    ):
        (lobe,) = compiled(shader).lobes
        x, y = (parameter.constant[0] for parameter in lobe.parameters[:2])
        np.testing.assert_allclose((x, y), (along, across or 0.0625 / along), rtol=1e-5)
        assert lobe.tangent is not None


# --- What is left out ---------------------------------------------------------------------------

LINKED = Link(Node("TexStrange", "Grain"), "Color", (0.2, 0.3, 0.4))
REPLACED = "TexStrange 'Grain' feeding {} of {} is replaced by the input's own value"
NOTED = (
    (node("BsdfHair", name="Curl"), "BsdfHair 'Curl' is not honoured: it is rendered black"),
    (s.node("BsdfDiffuse", Color=LINKED), REPLACED.format("Color", "BsdfDiffuse")),
    (s.node("Emission", Strength=LINKED), REPLACED.format("Strength", "Emission")),
    (principled(Metallic=LINKED), REPLACED.format("Metallic", "BsdfPrincipled")),
    (s.node("SubsurfaceScattering"), "Subsurface Scattering '' is rendered as diffuse"),
    (principled(Subsurface_Weight=0.5), "Principled '': Subsurface is rendered as diffuse"),
)


@pytest.mark.parametrize(("shader", "what"), NOTED, ids=[what[:50] for _, what in NOTED])
def test_what_is_not_honoured_is_noted_by_name_once(shader, what):
    surface = compiled(s.shader(shader, s.shader(MATTE, shader)))
    (note,) = surface.notes
    assert (note.owner, note.what) == ("Material 'X'", what)


@pytest.mark.parametrize("shader", [row[0] for row in (*MEANING, *SHINING)], ids=lambda n: n.kind)
def test_nothing_else_is_noted(shader):
    notes = [note.what for note in compiled(shader).notes]
    assert all("Subsurface" in what for what in notes)


def test_an_input_that_cannot_be_honoured_keeps_its_own_value():
    ((_, weight, _),), _, _ = seen(compiled(s.node("BsdfDiffuse", Color=LINKED)))
    np.testing.assert_allclose(weight, (0.2, 0.3, 0.4), rtol=1e-6)


def test_value_and_colour_nodes_are_folded():
    value = Node("Value", "", {}, {"Value": 0.5})
    colour = Node("RGB", "", {}, {"Color": (0.1, 0.2, 0.3, 1.0)})
    inputs = {"Color": Link(colour, "Color"), "IOR": Link(value, "Value"), "Roughness": 0.0}
    surface = compiled(s.node("BsdfGlass", **inputs))
    assert surface.notes == []
    ((_, _, (ior, _, reflected, _)),), _, _ = seen(surface)
    np.testing.assert_allclose(ior, 0.5)
    np.testing.assert_allclose(reflected, (0.1, 0.2, 0.3), rtol=1e-6)


def test_no_material_is_grey_and_no_surface_is_black():
    ((name, weight, _),), _, _ = seen(compile_surface("Default material", None, Rules()))
    assert name == "diffuse"
    np.testing.assert_allclose(weight, GREY)
    assert compile_surface("Material 'X'", s.BLACK, Rules()).lobes == []


# --- Weights flow down --------------------------------------------------------------------------


def test_a_shader_used_twice_is_added_once_with_the_sum_of_its_weights():
    shared = s.shader(MATTE, GLOW)
    surface = compiled(mixed(shared, mixed(MATTE, shared, 0.5), 0.5))
    # 1/2 + 1/4 by way of the sum, and 1/4 by itself
    assert len(surface.lobes) == 1
    np.testing.assert_allclose(seen(surface)[0][0][1], RED, rtol=1e-6)
    np.testing.assert_allclose(seen(surface)[1], 0.75 * 3 * np.array(RED), rtol=1e-6)


def test_a_factor_that_depends_on_the_point_is_mixed_at_the_point():
    facing = Link(Node("LayerWeight", "", {"Blend": 0.5}), "Facing")
    surface = compiled(mixed(MATTE, s.node("BsdfTranslucent", Color=RED), facing))
    for cosine in (1.0, 0.75, 0.25):
        lobes, _, _ = seen(surface, cosine)
        weights = {name: weight[0] for name, weight, _ in lobes}
        np.testing.assert_allclose(weights["diffuse"], cosine, rtol=1e-6)
        np.testing.assert_allclose(weights["translucent"], 1 - cosine, rtol=1e-5, atol=1e-6)


def test_what_has_no_weight_is_not_even_looked_at():
    strange = s.node("BsdfHair")
    for shader in (mixed(MATTE, strange, 0.0), mixed(strange, MATTE, 1.0)):
        surface = compiled(shader)
        assert surface.notes == [] and len(surface.lobes) == 1


@pytest.mark.parametrize("kind", ("MixShader", "AddShader"))
def test_a_chain_of_two_thousand_shaders_needs_no_deep_recursion(kind):
    shader = MATTE
    for number in range(2000):
        other = GLOW if number == 1999 else s.node("BsdfTransparent", Color=(0.0, 0.0, 0.0))
        shader = s.shader(shader, other, kind, 0.001)
    surface = compiled(shader)
    share = 0.999**2000 if kind == "MixShader" else 1.0
    lobes, emission, _ = seen(surface)
    np.testing.assert_allclose(lobes[0][1][0], share, rtol=1e-3)
    np.testing.assert_allclose(emission[0], 3 * (0.001 if kind == "MixShader" else 1), rtol=1e-5)


def test_a_ladder_of_shared_shaders_is_walked_in_its_size_not_in_its_paths():
    shader = MATTE
    for _ in range(60):
        shader = mixed(shader, shader, 0.3)
    (lobe,) = compiled(shader).lobes
    np.testing.assert_allclose(lobe.weight.constant[:, 0], RED, rtol=1e-4)
