"""core.images.levels, core.shading.filtering -> images looked up smaller, and the same picture."""

import numpy as np
import pytest

from penumbra.core.geometry.attributes import DENSITY, compile_attributes
from penumbra.core.geometry.mesh import compile_triangles
from penumbra.core.images import ImageSource, make_image
from penumbra.core.images.levels import Levels, LevelTaps, choose_level, level_sizes, mix_levels
from penumbra.core.images.lookup import decode_srgb, lookup
from penumbra.core.scene import ACTIVE_UV, Attribute, Link, Material, Mesh, Node
from penumbra.core.shading import Library
from penumbra.core.shading.filtering import footprint
from penumbra.core.shading.rules import Rules
from penumbra.core.shading.surfaces import compile_surface
from penumbra.core.shading.values import walk
from tests.support import scenes as s

F32 = np.float32
NOISE = np.random.default_rng(5).integers(0, 256, (256, 256, 4), np.uint8)
NOISE[..., 3] = 255


def texels(levels, number):
    """Return the pixels (H, W, 4) of a level, linear."""
    width, height, first = level_sizes(levels.finest.width, levels.finest.height)[:, number]
    part = levels.coarse.texels[first : first + width * height].view(levels.finest.dtype)
    one = 255 if levels.finest.dtype == np.uint8 else 1
    found = part.reshape(height, width, -1).astype(F32) / F32(one)
    if levels.finest.is_srgb:
        found[..., :3] = decode_srgb(found[..., :3])
    return found


def test_sides_are_halved_while_both_are_even():
    assert level_sizes(256, 512).T.tolist() == [
        [128, 256, 0], [64, 128, 32768], [32, 64, 40960], [16, 32, 43008]
    ]  # fmt: skip
    assert level_sizes(1000, 3000)[0].tolist() == [500, 250, 125]
    assert level_sizes(255, 256).shape == (3, 0)


@pytest.mark.parametrize("is_srgb", [True, False])
@pytest.mark.parametrize("alpha", [True, False])
def test_a_texel_of_a_level_is_the_mean_of_what_lookups_give_there(is_srgb, alpha):
    pixels = NOISE.copy()
    pixels[..., 3] = NOISE[..., 0] if alpha else 255
    image = make_image(pixels, is_srgb)
    levels = Levels(image)
    # Eight lookups along each texel of four along each side of one of the third level
    place = (np.arange(256 * 8, dtype=F32) + F32(0.5)) / F32(256 * 8)
    x, y = place[8 * 64 : 8 * 72], place[8 * 128 : 8 * 136]
    u, v = (each.ravel() for each in np.meshgrid(x, y))
    expected = lookup(image, u, v)
    np.testing.assert_allclose(texels(levels, 2)[16, 8], expected.mean(axis=1), atol=0.006)
    at_finest = lookup(image, *np.random.default_rng(1).random((2, 200_000)).astype(F32))
    for number in range(level_sizes(256, 256).shape[1]):
        mean = texels(levels, number).mean(axis=(0, 1))
        np.testing.assert_allclose(mean, at_finest.mean(axis=1), atol=0.003)


def test_levels_of_grey_images_and_of_floats_are_their_means():
    bright = np.random.default_rng(2).random((256, 512, 4)).astype(F32) * 9
    grey = NOISE.copy()
    grey[..., 1] = grey[..., 2] = grey[..., 0]
    for pixels, is_srgb in ((bright, False), (bright[..., :1].repeat(4, axis=2), False)):
        pixels = pixels.copy()
        pixels[..., 3] = 1
        image = make_image(pixels, is_srgb)
        found = texels(Levels(image), 3).mean(axis=(0, 1))
        expected = pixels.mean(axis=(0, 1))[: found.size]
        np.testing.assert_allclose(found, expected, rtol=1e-4)
    image = make_image(grey, True)
    assert image.is_grey
    mean = lookup(image, *np.random.default_rng(1).random((2, 200_000)).astype(F32))[0].mean()
    assert texels(Levels(image), 0).mean() == pytest.approx(mean, abs=0.003)


def test_levels_are_made_when_they_are_needed_and_take_a_third():
    levels = Levels(make_image(NOISE, True))
    place = np.array([0.1, 0.6], F32)
    near = LevelTaps(place, place, np.zeros(1, F32), (256, 256), "Linear", "REPEAT")
    np.testing.assert_array_equal(mix_levels(levels, near), lookup(levels.finest, place, place))
    assert levels._coarse is None
    wide = np.array([0, 8 / 256], F32)
    both = mix_levels(levels, LevelTaps(place, place, wide, (256, 256), "Linear", "REPEAT"))
    np.testing.assert_array_equal(both[:, 0], lookup(levels.finest, place, place)[:, 0])
    np.testing.assert_allclose(both[:, 1], texels(levels, 2)[19, 19], atol=1e-6)
    assert levels.coarse.memory == levels.memory <= levels.finest.memory / 3


def test_texels_are_at_most_as_wide_as_the_footprint():
    footprint = np.array([0, 1.99, 2, 3.99, 4, 1e9], F32) / F32(256)
    assert choose_level(footprint, 256, 4).tolist() == [0, 0, 1, 1, 2, 4]
    assert choose_level(footprint[:2], 256, 4) is None


def test_the_density_of_a_map_is_its_least_growth_in_the_world():
    # Twice as large along v as along u, and an instance larger still
    corners = np.array([(0, 0, 0), (2, 0, 0), (0, 4, 0), (0, 0, 0)], F32)
    faces = np.array([(0, 1, 2), (0, 1, 3)], np.int32)
    uv = Attribute("POINT", np.array([(0, 0), (1, 0), (0, 1), (0.5, 0.5)], F32))
    mesh = Mesh("Stretched", corners, faces, attributes={ACTIVE_UV: uv})
    things = tuple(s.put(mesh, to_world=s.affine(scale)) for scale in (1.0, 3.0))
    triangles, _ = compile_triangles(things, {id(None): 0}, np.zeros(3), 1e9, 9, bool)
    tables = compile_attributes(things, {(ACTIVE_UV, DENSITY)}, triangles)
    numbers = np.arange(triangles.count, dtype=np.int32)
    zero = np.zeros(numbers.size, F32)
    instance = triangles.ids[:, 2].astype(np.int32)
    found = tables[ACTIVE_UV, DENSITY].at(numbers, instance, zero, zero)[0]
    expected = np.where(instance == 0, 0.25, 0.25 / 3)
    is_broken = triangles.count == 4  # the triangle without area may be left out
    np.testing.assert_allclose(found[:: 2 if is_broken else 1], expected[:: 2 if is_broken else 1])


# --- Which surfaces ------------------------------------------------------------------------------

SOURCE = ImageSource("Image 'Noise'", pixels=NOISE, colorspace="sRGB")
OTHER = ImageSource("Image 'Other'", pixels=NOISE[::-1].copy(), colorspace="sRGB")


def image(source=SOURCE, output="Color", vector=None, **properties):
    inputs = {} if vector is None else {"Vector": vector}
    return Link(Node("TexImage", "", inputs, {"image": source, **properties}), output)


def shader(kind, **inputs):
    return Link(Node(kind, "", inputs), "BSDF")


def plain(kind, **inputs):
    return Link(Node(kind, "", inputs), "Color")


def mapped(scale):
    uv = Link(Node("UVMap"), "UV")
    return Link(Node("Mapping", "", {"Vector": uv, "Scale": scale}), "Vector")


def footprints(link, library=None):
    material = Material("X", link.node)
    library = library or Library(0, 1e9)
    outputs = compile_surface("Material 'X'", material, Rules(), library).outputs()
    order = walk(each for each in outputs if each is not None)
    return [item for item in order if item.function is footprint]


PLACE = Link(Node("NewGeometry"), "Position")
LINEAR = {
    "diffuse": shader("BsdfDiffuse", Color=image()),
    "emission": shader("Emission", Color=image(), Strength=2.0),
    "principled": shader("BsdfPrincipled", **{"Base Color": image(), "Roughness": 0.4}),
    "mixed shaders": shader("MixShader", Fac=image(), Shader=shader("BsdfDiffuse"),
                            Shader_001=shader("BsdfGlossy", Roughness=0.3)),
    "scaled": shader("BsdfDiffuse", Color=image(vector=mapped((3.0, 5.0, 1.0)))),
    "inverted": shader("BsdfDiffuse", Color=plain("Invert", Fac=1.0, Color=image())),
}  # fmt: skip
OTHERS = {
    "two images": shader("BsdfDiffuse", Color=plain("MixRGB", Fac=0.5, Color1=image(),
                         Color2=image(OTHER))),
    "a texture beside": shader("MixShader", Fac=Link(Node("TexNoise"), "Fac"),
                               Shader=shader("BsdfDiffuse", Color=image()),
                               Shader_001=shader("BsdfDiffuse")),
    "a texture in space": shader("MixShader", Fac=Link(Node("TexNoise", "", {"Vector": PLACE}),
                                 "Fac"), Shader=shader("BsdfDiffuse", Color=image()),
                                 Shader_001=shader("BsdfDiffuse")),
    "bumps": shader("BsdfDiffuse", Color=image(), Normal=Link(Node("Bump", "", {
        "Height": Link(Node("TexNoise", "", {"Vector": PLACE}), "Fac")}), "Normal")),
    "bumps of its own": shader("BsdfDiffuse", Color=image(), Normal=Link(Node("Bump", "", {
        "Height": image()}), "Normal")),
    "roughness": shader("BsdfGlossy", Roughness=image()),
    "curved": shader("BsdfDiffuse", Color=plain("Gamma", Color=image(), Gamma=2.0)),
    "single texels": shader("BsdfDiffuse", Color=image(interpolation="Closest")),
    "clipped": shader("BsdfDiffuse", Color=image(extension="CLIP")),
    "uneven": shader("BsdfDiffuse", Color=image(vector=Link(
        Node("VectorMath", "", {"Vector": Link(Node("UVMap"), "UV")},
             {"operation": "SINE"}), "Vector"))),
    "projected": shader("BsdfDiffuse", Color=image(projection="BOX")),
    "of generated coordinates": shader("BsdfDiffuse", Color=image(vector=Link(
        Node("TexCoord"), "Generated"))),
}  # fmt: skip


@pytest.mark.parametrize("name", LINEAR)
def test_an_image_that_light_is_linear_in_is_filtered(name):
    assert len(footprints(LINEAR[name])) == 1


@pytest.mark.parametrize("name", OTHERS)
def test_what_would_change_the_converged_picture_is_not(name):
    assert footprints(OTHERS[name]) == []


def test_there_are_no_levels_if_they_do_not_fit_or_shall_not_be():
    whole = NOISE.nbytes // 3
    assert footprints(LINEAR["diffuse"], Library(0, whole)) != []
    assert footprints(LINEAR["diffuse"], Library(0, whole / 2)) == []
    assert footprints(LINEAR["diffuse"], Library(0, None)) == []
    library = Library(0, whole)
    first = footprints(LINEAR["diffuse"], library)
    assert first and footprints(LINEAR["emission"], library)
    assert footprints(shader("BsdfDiffuse", Color=image(OTHER)), library) == []
    assert library.store.memory == NOISE.nbytes * 2 + Levels(make_image(NOISE, True)).memory


# --- In pictures ---------------------------------------------------------------------------------


def ground():
    """Return a glowing square that shows the image six times along each side."""
    corners = np.array([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], F32)
    uv = Attribute("POINT", (corners[:, :2] + 9) / F32(3))
    mesh = Mesh("Ground", corners, np.int32([[0, 1, 2], [0, 2, 3]]), attributes={ACTIVE_UV: uv})
    return s.put(mesh, Material("Glow", Node("Emission", "", {"Color": image(), "Strength": 1.0})))


def test_far_images_have_less_noise_and_the_same_light():
    view = s.camera((0, -8, 1.5), size=32, fov=50)
    truth = s.pixels(view, ground(), samples=1024, seed=9, texture_filter=False)
    error = {}
    for is_filtered in (True, False):
        found = s.pixels(view, ground(), samples=64, seed=1, texture_filter=is_filtered)
        error[is_filtered] = np.sqrt(np.mean((found - truth) ** 2))
        assert found.mean() == pytest.approx(truth.mean(), rel=0.005)
    assert 0 < error[True] < error[False] * 0.6


def test_what_mirrors_show_is_not_filtered():
    # A camera below a mirror sees the ground in it, as if it were as far away
    view = s.camera((0, -8, 1.5), (0, -4, 4), size=16, fov=50)
    pane = s.put(s.quad((60.0, 0, 0), (0, -60.0, 0), (0, 0, 4.0)), s.mirror())
    seen = [
        s.pixels(view, pane, ground(), samples=256, texture_filter=is_filtered)
        for is_filtered in (True, False)
    ]
    assert seen[0].max() > 0.1
    np.testing.assert_array_equal(*seen)
