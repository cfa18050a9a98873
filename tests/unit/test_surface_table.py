"""core.shading.closures, world -> points get the lobes of their own material, and choose one."""

import numpy as np
import pytest

from penumbra.core import Link, Node, World
from penumbra.core.arrays import F32
from penumbra.core.bsdf import CAMERA, DIFFUSE, GLOSSY, REGISTRY
from penumbra.core.shading import (
    Arrival,
    LobeAt,
    Rules,
    Shaded,
    choose,
    compile_surface,
    compile_table,
    compile_world,
)
from penumbra.core.shading.closures import Frame
from tests.support import scenes as s
from tests.support.points import points, seen_from, vectors

RED = (1.0, 0.25, 0.0)
MATTE = s.node("BsdfDiffuse", Color=RED)
NEAR = {"rtol": 1e-5, "atol": 1e-6}


def compiled(shader, **rules):
    return compile_surface("Material 'X'", s.Material("X", shader), Rules(**rules))


def table_of(*shaders, **rules):
    return compile_table([compiled(shader, **rules) for shader in shaders])


def mixed(first, second, fac):
    return s.shader(first, second, "MixShader", fac)


def shade(table, at, arrival=Arrival(), throughput=None, is_chosen=False):  # noqa: B008
    return tuple(table.shade(at, arrival, throughput, is_chosen))


# --- Tables -------------------------------------------------------------------------------------


def test_points_get_the_lobes_of_their_own_material():
    glass = s.node("BsdfGlass", IOR=1.3, Roughness=0.0)
    mixture = mixed(s.node("BsdfGlossy", Roughness=0.0), MATTE, 0.75)
    table = table_of(mixture, MATTE, glass, None)
    at = seen_from(*[1.0] * 5, material=(2, 0, 3, 1, 0))
    found = {}
    for shaded in shade(table, at):
        index = range(5) if shaded.index is None else shaded.index
        assert shaded.size == len(index)
        for number, lobe in enumerate(shaded.lobes):
            for point in index:
                found[int(point), number] = (lobe.module.NAME, float(lobe.weight[0, 0]))
    assert found == {
        (0, 0): ("smooth glass", 1.0),
        (1, 0): ("smooth reflection unit", 0.25),
        (1, 1): ("diffuse", 0.75),
        (3, 0): ("diffuse", 1.0),
        (4, 0): ("smooth reflection unit", 0.25),
        (4, 1): ("diffuse", 0.75),
    }


def test_weights_are_multiplied_by_what_the_path_carries():
    table = table_of(MATTE, s.node("BsdfTranslucent", Color=RED))
    at = seen_from(*[1.0] * 4, material=(0, 1, 1, 0))
    throughput = np.arange(12, dtype=F32).reshape(3, 4)
    for shaded in shade(table, at, throughput=throughput):
        expected = np.array(RED)[:, None] * throughput[:, shaded.index]
        np.testing.assert_allclose(shaded.lobes[0].weight, expected)


def test_a_table_knows_what_its_surfaces_are():
    glow = s.node("Emission", Color=RED, Strength=2.0)
    clear = s.node("BsdfTransparent", Color=RED)
    table = table_of(MATTE, s.shader(MATTE, glow), mixed(MATTE, clear, 0.5), s.node("Holdout"))
    assert table.glows.tolist() == [False, True, False, False]
    assert table.is_transparent.tolist() == [False, False, True, False]
    black, half = (0, 0, 0), (0.5, 0.125, 0)
    np.testing.assert_allclose(table.plain_emission.T, [black, (2, 0.5, 0), black, black])
    np.testing.assert_allclose(table.plain_transparency.T, [black, black, half, black])
    assert table.has_holdout and not table.has_specular and not table.lights_both_sides
    assert not table_of(MATTE).has_holdout
    assert table_of(s.node("BsdfGlossy", Roughness=0.5)).has_specular
    assert table_of(s.node("BsdfTranslucent")).lights_both_sides
    assert [module.NAME for module in table.modules] == ["diffuse", "transparent"]


def test_emission_and_transparency_may_depend_on_the_point():
    back = Link(Node("NewGeometry", ""), "Backfacing")
    table = table_of(
        s.node("Emission", Color=RED, Strength=back), mixed(MATTE, s.node("BsdfTransparent"), back)
    )
    assert table.plain_emission is None and table.plain_transparency is None
    at = seen_from(*[1.0] * 4, material=(0, 0, 1, 1), back=(False, True, False, True))
    light = np.zeros((3, 4))
    for index, some in table.emission(at, Arrival()):
        light[:, index] = some
    np.testing.assert_allclose(light.T, [(0, 0, 0), RED, (0, 0, 0), (0, 0, 0)])
    np.testing.assert_allclose(table.transparency(at, Arrival()), [[0, 0, 0, 1]] * 3)
    # Lamps are chosen by how a surface glows to who looks at its front.
    np.testing.assert_allclose(table.typical_emission(), 0)


def test_normals_of_glossy_lobes_are_bent_those_of_matte_ones_are_not():
    table = table_of(mixed(s.node("BsdfGlossy", Roughness=0.5), MATTE, 0.5))
    wo, normal = vectors((1, 0, 0.1)), vectors((-0.08, 0, 1))
    (shaded,) = shade(table, points(wo, normal=normal))
    glossy, matte = shaded.lobes
    np.testing.assert_array_equal(matte.frame.normal, normal)
    bent = glossy.frame.normal
    mirrored = 2 * (bent * wo).sum() * bent - wo
    assert not np.array_equal(bent, normal) and 0 < mirrored[2, 0] < 0.02


# --- Filter glossy and caustics -----------------------------------------------------------------


def test_blurred_points_get_the_surfaces_that_are_blurred():
    glossy = s.node("BsdfGlossy", Roughness=0.2), s.node("BsdfGlossy", Roughness=0.0), MATTE
    table, blurred = table_of(*glossy), table_of(*glossy, is_blurred=True)
    both = compile_table([compiled(shader) for shader in glossy])
    both = type(both)(**{**vars(both), "blurred": blurred})
    at = seen_from(*[1.0] * 6, material=(0, 0, 1, 1, 2, 2))
    arrival = Arrival(blur=np.array([0, 0.3, 0, 0.3, 0, 0.3], F32))
    found = {}
    for shaded in shade(both, at, arrival):
        (lobe,) = shaded.lobes
        for column, point in enumerate(shaded.index):
            alpha = [float(p[min(column, p.size - 1)]) for p in lobe.parameters]
            found[int(point)] = lobe.module.NAME, alpha
    rough, matte = "ggx reflection unit", ("diffuse", [])
    expected = {
        0: (rough, [0.04]),
        1: (rough, [0.3]),
        2: ("smooth reflection unit", []),
        3: (rough, [0.3]),
        4: matte,
        5: matte,
    }
    assert {k: (name, np.round(a, 6).tolist()) for k, (name, a) in found.items()} == expected
    assert table.blurred is None


CAUSTICS = (
    (s.node("BsdfGlossy", Roughness=0.5), "reflective"),
    (s.node("BsdfMetallic", Roughness=0.5), "reflective"),
    (s.node("BsdfRefraction", IOR=1.3, Roughness=0.5), "refractive"),
    (s.node("BsdfRefraction", IOR=1.3, Roughness=0.0), "refractive"),
    (Node("BsdfToon", "", {}, {"component": "GLOSSY"}), "reflective"),
)


@pytest.mark.parametrize(("shader", "kind"), CAUSTICS, ids=lambda x: getattr(x, "kind", x))
@pytest.mark.parametrize("switched", ("reflective", "refractive"))
def test_matte_surfaces_see_no_caustics_that_are_switched_off(shader, kind, switched):
    table = table_of(shader, **{f"has_{switched}_caustics": False})
    arrival = Arrival(np.array([CAMERA, DIFFUSE, GLOSSY], np.uint8))
    (shaded,) = shade(table, seen_from(1.0, 1.0, 1.0), arrival)
    weight = np.broadcast_to(shaded.lobes[0].weight, (3, 3))[0]
    assert ((weight > 0) == (True, kind != switched, True)).all()


# --- Choosing -----------------------------------------------------------------------------------


def lobes_at(count, shares, names=("diffuse", "translucent", "sheen")):
    """Lobes with these shares, each (n,) or one for all."""
    up = vectors((0, 0, 1)).repeat(count, axis=1)
    frame = Frame(up, None, lambda: up)
    lobes = tuple(
        LobeAt(REGISTRY[name], np.full((3, 1), row, F32), (), frame, np.array(share, F32))
        for row, (name, share) in enumerate(zip(names, shares, strict=False))
    )
    return Shaded(None, count, lobes)


def test_lobes_are_chosen_as_often_as_their_shares_say():
    count = 20_000
    u = (np.arange(count, dtype=F32) + F32(0.5)) / F32(count)
    shaded = lobes_at(count, ([0.125], [0.625], [0.25]))
    seen = []
    for (index, lobe), share in zip(choose(shaded, u), (0.125, 0.625, 0.25), strict=True):
        assert abs(index.size / count - share) < 1e-3
        assert lobe.frame.normal.shape == (3, index.size)
        seen.append(index)
    np.testing.assert_array_equal(np.sort(np.concatenate(seen)), np.arange(count))


def test_each_point_chooses_by_its_own_shares():
    first = np.array([1, 0, 0.5, 0.5], F32)
    shaded = lobes_at(4, (first, 1 - first))
    chosen = {lobe.module.NAME: index.tolist() for index, lobe in choose(shaded, F32([0.7] * 4))}
    assert chosen == {"diffuse": [0], "translucent": [1, 2, 3]}


def test_lobes_without_share_are_never_chosen():
    u = np.array([0, 0.5, 0.9, 1 - 2.0**-24], F32)
    ((index, lobe),) = choose(lobes_at(4, ([0.0], [1.0], [0.0])), u)
    np.testing.assert_array_equal(index, np.arange(4))
    assert lobe.module.NAME == "translucent"


def test_one_lobe_needs_no_choice():
    (shaded,) = shade(table_of(MATTE), seen_from(0.5, 1.0), is_chosen=True)
    ((index, lobe),) = choose(shaded, F32([0.1, 0.9]))
    assert index is None and lobe is shaded.lobes[0]


def test_shares_add_up_to_one_and_follow_what_is_scattered():
    mixture = s.shader(
        mixed(s.node("BsdfGlossy", Roughness=0.4, Color=(0.2,) * 3), MATTE, 0.5),
        s.node("BsdfPrincipled", Base_Color=RED, Coat_Weight=0.5, Sheen_Weight=0.3),
    )
    at = seen_from(*np.linspace(0.05, 1, 20))
    (shaded,) = shade(table_of(mixture), at, is_chosen=True)
    shares = [np.broadcast_to(lobe.share, 20) for lobe in shaded.lobes]
    np.testing.assert_allclose(np.sum(shares, axis=0), 1, **NEAR)
    assert min(share.min() for share in shares) > 0
    weight = {lobe.module.NAME: lobe.weight for lobe in shaded.lobes}
    by_name = {lobe.module.NAME: share for lobe, share in zip(shaded.lobes, shares, strict=True)}
    ratio = by_name["ggx reflection unit"] / 0.1
    np.testing.assert_allclose(weight["ggx reflection unit"], 0.1, **NEAR)
    # The coat is the more likely the more it reflects: at grazing angles.
    assert (np.diff(by_name["ggx reflection dielectric"] / ratio) < 0).all()
    (plain,) = shade(table_of(mixture), at)
    assert all(lobe.share is None for lobe in plain.lobes)


def test_a_black_surface_has_shares_all_the_same():
    # Its factor is a number of the point, so that nobody knows it is 0 everywhere.
    back = Link(Node("NewGeometry", ""), "Backfacing")
    shader = mixed(
        s.node("BsdfDiffuse", Color=(0.0, 0.0, 0.0)),
        mixed(MATTE, s.node("BsdfTranslucent"), 0.5),
        back,
    )
    (shaded,) = shade(table_of(shader), seen_from(0.5, 1.0), is_chosen=True)
    for lobe in shaded.lobes:
        assert np.isfinite(lobe.share).all() and (lobe.share == 0).all()
    chosen = [index for index, _ in choose(shaded, F32([0.1, 0.9]))]
    np.testing.assert_array_equal(np.concatenate(chosen), [0, 1])


# --- The world ----------------------------------------------------------------------------------


def test_the_world_is_its_background():
    assert compile_world(None) == (None, [])
    assert compile_world(World()) == (None, [])
    assert compile_world(s.world(0.0)) == (None, [])
    shader, notes = compile_world(World("W", s.node("Background", Color=RED, Strength=2.0)))
    assert shader.is_constant and notes == []
    np.testing.assert_allclose(shader.radiance(vectors((0, 0, 1)), CAMERA)[:, 0], (2, 0.5, 0))


def test_what_a_world_leaves_out_is_noted_by_its_name():
    strange = Link(Node("TexStrange", "Grain"), "Color", RED)
    shader, (note,) = compile_world(World("Sky", s.node("Background", Color=strange)))
    assert note.owner == "World 'Sky'"
    np.testing.assert_allclose(shader.radiance(vectors((0, 0, 1)), CAMERA)[:, 0], RED)


def test_a_world_is_seen_by_direction_and_by_the_kind_of_ray():
    kind = Link(Node("LightPath", ""), "Is Camera Ray")
    up = Link(Node("SeparateXYZ", "", {"Vector": Link(Node("TexCoord", ""), "Generated")}), "Z")
    node = s.node("Background", Color=Link(Node("CombineXYZ", "", {"X": kind, "Y": up}), "Vector"))
    shader, notes = compile_world(World("W", node))
    assert not shader.is_constant and notes == []
    direction = vectors((0, 0, 1), (1, 0, 0), (0, 0.6, -0.8))
    found = shader.radiance(direction, np.array([CAMERA, DIFFUSE, CAMERA], np.uint8))
    np.testing.assert_allclose(found, [[1, 0, 1], [1, 0, -0.8], [0, 0, 0]], **NEAR)
    np.testing.assert_allclose(shader.radiance(direction, GLOSSY)[0], 0)
