"""core.shading -> each shader node as lobes and emission, and a note for all it leaves out."""

import numpy as np
import pytest

from penumbra.core import Link, Node
from penumbra.core.arrays import F32
from penumbra.core.bsdf import REGISTRY
from penumbra.core.shading import choose_lobe, compile_emission, compile_surface, compile_table
from penumbra.core.shading.closures import Closures, Group
from penumbra.core.shading.surfaces import SHADERS
from tests.support import scenes as s

WHITE, RED = (1.0, 1.0, 1.0), (1.0, 0.25, 0.0)
GREY = (0.8, 0.8, 0.8)


def principled(**inputs):
    basics = {"Base Color": RED, "Roughness": 0.0, "Specular IOR Level": 0.0, "IOR": 1.5}
    inputs = {key.replace("_", " "): value for key, value in inputs.items()}
    return Node("BsdfPrincipled", "", {**basics, **inputs})


def mixed(first, second, fac):
    return s.shader(first, second, "MixShader", fac)


MATTE, GLOW = s.node("BsdfDiffuse", Color=RED), s.node("Emission", Color=RED, Strength=3.0)

# node -> lobes (closure, weight, parameters), emission
MEANING = (
    (s.node("BsdfDiffuse", Color=RED, Roughness=0.0), [("diffuse", RED)], None),
    (s.node("BsdfDiffuse", Color=(*RED, 1.0)), [("diffuse", RED)], None),
    (s.node("BsdfDiffuse", Color=(0.0, 0.0, 0.0)), [], None),
    (s.node("BsdfDiffuse", Color=(-1.0, 0.5, 0.0)), [("diffuse", (0, 0.5, 0))], None),
    (
        s.node("BsdfAnisotropic", Color=RED, Roughness=0.0),
        [("mirror", RED, *WHITE, *WHITE)],
        None,
    ),
    (s.node("BsdfGlossy", Color=RED, Roughness=0.0), [("mirror", RED, *WHITE, *WHITE)], None),
    (
        s.node("BsdfGlass", Color=RED, IOR=1.3, Roughness=0.0),
        [("glass", WHITE, 1.3, *RED, *RED)],
        None,
    ),
    (s.node("BsdfRefraction", Color=RED, IOR=1.3, Roughness=0.0), [("refraction", RED, 1.3)], None),
    (GLOW, [], (3, 0.75, 0)),
    (s.node("Background", Color=RED, Strength=2.0), [], (2, 0.5, 0)),
    (s.shader(MATTE, GLOW), [("diffuse", RED)], (3, 0.75, 0)),
    (mixed(MATTE, GLOW, 0.25), [("diffuse", (0.75, 0.1875, 0))], (0.75, 0.1875, 0)),
    (mixed(MATTE, GLOW, 7.0), [], (3, 0.75, 0)),
    (mixed(MATTE, mixed(MATTE, GLOW, 1.0), 0.0), [("diffuse", RED)], None),
    (Node("MixShader", "", {"Shader": Link(MATTE, "BSDF")}), [("diffuse", (0.5, 0.125, 0))], None),
    (principled(), [("diffuse", RED)], None),
    (principled(Metallic=1.0), [("mirror", WHITE, *RED, *WHITE)], None),
    (
        principled(Metallic=0.25),
        [("mirror", (0.25,) * 3, *RED, *WHITE), ("diffuse", (0.75, 0.1875, 0))],
        None,
    ),
    (principled(Transmission_Weight=1.0), [("glass", WHITE, 1.5, *WHITE, 1.0, 0.5, 0.0)], None),
    (
        principled(Emission_Color=RED, Emission_Strength=2.0),
        [("diffuse", RED)],
        (2, 0.5, 0),
    ),
    (principled(Emission_Color=RED), [("diffuse", RED)], None),
)


def compiled(node):
    return compile_surface("Material 'X'", s.Material("X", node))


@pytest.mark.parametrize(("node", "lobes", "emission"), MEANING)
def test_a_node_means_these_lobes_and_nothing_goes_unsaid(node, lobes, emission):
    surface = compiled(node)
    assert surface.notes == []
    assert [lobe.closure for lobe in surface.lobes] == [name for name, *_ in lobes]
    for lobe, (name, weight, *parameters) in zip(surface.lobes, lobes, strict=True):
        np.testing.assert_allclose(lobe.weight, weight)
        np.testing.assert_allclose(lobe.parameters, parameters)
        assert len(lobe.parameters) == len(REGISTRY[name].PARAMETERS)
    np.testing.assert_allclose(surface.emission, emission or (0, 0, 0))


def test_every_shader_node_has_a_row_here_or_a_note_below():
    shown = {node.kind for node, _, _ in MEANING} | {node.kind for node, _ in NOTED}
    assert shown >= set(SHADERS)


LINKED = Link(Node("TexNoise", "Grain"), "Color", (0.2, 0.3, 0.4))
NOTED = (
    (s.node("BsdfToon", "Comic"), "BsdfToon 'Comic' is not honoured: it is rendered black"),
    (s.node("BsdfDiffuse", Color=LINKED), "TexNoise 'Grain' feeding Color of BsdfDiffuse"),
    (s.node("BsdfDiffuse", Color=RED, Roughness=0.3), "BsdfDiffuse: Roughness"),
    (s.node("BsdfDiffuse", Color=RED, Normal=LINKED), "BsdfDiffuse: its normal"),
    (s.node("BsdfGlossy", Color=RED, Roughness=0.2), "BsdfGlossy: Roughness 0.2"),
    (s.node("BsdfGlossy", Color=RED, Roughness=0.8), "BsdfGlossy: Roughness 0.8"),
    (s.node("BsdfGlass", Roughness=0.2), "BsdfGlass: Roughness 0.2"),
    (s.node("BsdfGlass", Roughness=0.0, Thin_Film_Thickness=300.0), "BsdfGlass: Thin Film"),
    (s.node("BsdfRefraction", Roughness=0.2), "BsdfRefraction: Roughness 0.2"),
    (s.node("BsdfTransparent"), "BsdfTransparent: transparency"),
    (principled(Alpha=0.5), "BsdfPrincipled: transparency"),
    (principled(Specular_IOR_Level=0.5), "BsdfPrincipled: the specular layer"),
    (principled(Coat_Weight=0.5), "BsdfPrincipled: Coat Weight"),
    (principled(Sheen_Weight=0.5), "BsdfPrincipled: Sheen Weight"),
    (principled(Subsurface_Weight=0.5), "BsdfPrincipled: Subsurface Weight"),
    (principled(Normal=LINKED), "BsdfPrincipled: the normal input"),
    (principled(Metallic=1.0, Roughness=0.3), "BsdfPrincipled: Roughness 0.3"),
    (principled(Transmission_Weight=1.0, Roughness=0.3), "BsdfPrincipled: Roughness 0.3"),
    (principled(Metallic=1.0, Specular_Tint=RED), "BsdfPrincipled: Specular Tint"),
)


@pytest.mark.parametrize(("node", "what"), NOTED, ids=[what for _, what in NOTED])
def test_what_is_not_honoured_is_noted_by_name_once(node, what):
    surface = compiled(s.shader(node, node))
    (note,) = surface.notes
    assert note.owner == "Material 'X'"
    assert note.what.startswith(what)


def test_an_input_that_cannot_be_honoured_keeps_its_own_value():
    (lobe,) = compiled(s.node("BsdfDiffuse", Color=LINKED)).lobes
    assert lobe.weight == (0.2, 0.3, 0.4)


def test_value_and_colour_nodes_are_folded():
    value = Node("Value", "", {"Value": 0.5})
    colour = Node("RGB", "", {"Color": (0.1, 0.2, 0.3, 1.0)})
    node = s.node("BsdfGlass", Color=Link(colour, "Color"), IOR=Link(value, "Value"), Roughness=0.0)
    surface = compiled(node)
    assert surface.notes == []
    np.testing.assert_allclose(surface.lobes[0].parameters[:4], (0.5, 0.1, 0.2, 0.3))


def test_no_material_is_grey_and_no_surface_is_black():
    (lobe,) = compile_surface("Default material", None).lobes
    assert (lobe.closure, lobe.weight) == ("diffuse", GREY)
    assert compile_surface("Material 'X'", s.BLACK).lobes == []


def test_the_world_is_its_background():
    assert compile_emission("World", None) == ((0.0, 0.0, 0.0), [])
    radiance, notes = compile_emission("World", s.node("Background", Color=RED, Strength=2.0))
    assert (radiance, notes) == ((2.0, 0.5, 0.0), [])
    _, notes = compile_emission("World 'Sky'", s.node("Background", Color=LINKED))
    assert [note.owner for note in notes] == ["World 'Sky'"]


# --- Tables -------------------------------------------------------------------------------------


class At:
    """Points of nothing but a material."""

    def __init__(self, *material):
        self.material = np.array(material, np.int32)


def test_points_get_the_lobes_of_their_own_material():
    nodes = (principled(Metallic=0.25), MATTE, s.node("BsdfGlass", IOR=1.3, Roughness=0.0), None)
    table = compile_table([compiled(node) for node in nodes])
    assert table.emission is None
    closures = table.run(At(2, 0, 3, 1, 0))
    assert not closures.single
    found = {}
    for group in closures.groups:
        index = range(5) if group.index is None else group.index
        for column, point in enumerate(index):
            found[int(point), group.lobe] = (group.module.NAME, group.weight[0, column])
            if group.module.NAME == "glass":
                np.testing.assert_allclose(group.parameters[0, column], 1.3)
    assert found == {
        (0, 0): ("glass", 1.0),
        (1, 0): ("mirror", 0.25),
        (1, 1): ("diffuse", 0.75),
        (3, 0): ("diffuse", 1.0),
        (4, 0): ("mirror", 0.25),
        (4, 1): ("diffuse", 0.75),
    }


def test_choosing_one_lobe_keeps_the_sum_of_the_weights():
    count = 20_000
    u = (np.arange(count, dtype=F32) + F32(0.5)) / F32(count)
    weights = np.array([[0.1, 0.5, 0.0], [0.6, 0.2, 0.1], [0.0, 0.2, 0.0]], F32)
    groups = tuple(
        Group(REGISTRY[name], None, np.repeat(w[:, None], count, 1), np.zeros((7, count), F32), row)
        for row, (name, w) in enumerate(zip(("diffuse", "mirror", "glass"), weights, strict=True))
    )
    chosen = choose_lobe(Closures(groups, False), count, u)
    assert chosen.single
    seen = np.concatenate([group.index for group in chosen.groups])
    assert sorted(seen) == list(range(count))
    for group, weight in zip(chosen.groups, weights, strict=True):
        np.testing.assert_allclose(group.weight.sum(axis=1) / count, weight, atol=1e-3)


def test_lobes_without_weight_are_never_chosen():
    black, white = np.zeros((3, 4), F32), np.ones((3, 4), F32)
    groups = tuple(
        Group(REGISTRY["diffuse"], None, weight, np.zeros((0, 4), F32), row)
        for row, weight in enumerate((black, white, black))
    )
    u = np.array([0, 0.5, 0.9, 1 - 2.0**-24], F32)
    (only,) = choose_lobe(Closures(groups, False), 4, u).groups
    np.testing.assert_array_equal(only.index, np.arange(4))
    np.testing.assert_array_equal(only.weight, white)
