"""Images that are fetched together are what each is alone, and materials then share a program."""

import numpy as np
import pytest

from penumbra.core.arrays import F32
from penumbra.core.images import ImageSource, make_image
from penumbra.core.images.lookup import find_taps, mix_grey, mix_taps
from penumbra.core.images.sheet import BLOCK, Sheet
from penumbra.core.scene import Link, Material, Node
from penumbra.core.shading import Arrival, Library, Rules, compile_surface, compile_table
from penumbra.core.shading.nodes.image import mixed
from penumbra.core.shading.sheets import keep_used, on_sheets
from penumbra.tests.support.points import points, vectors

SIZE = 12, 20
LARGEST = {"u": lambda dtype: np.iinfo(dtype).max, "f": lambda dtype: 1}


def picture(seed, channels=4, dtype=np.uint8):
    """Return random pixels (H, W, 4), grey and opaque, opaque, or with alpha."""
    largest = LARGEST[np.dtype(dtype).kind](dtype)
    numbers = np.random.default_rng(seed).random((*SIZE, channels)) * largest
    pixels = np.full((*SIZE, 4), largest, dtype)
    pixels[:, :, : 3 if channels < 4 else 4] = numbers.astype(dtype)
    return pixels


def taps_of(count):
    u, v = np.random.default_rng(9).uniform(-1, 2, (2, count)).astype(F32)
    return find_taps(u, v, SIZE[1], SIZE[0], "Linear", "REPEAT")


@pytest.mark.parametrize("dtype", (np.uint8, np.uint16, np.float16, np.float32))
@pytest.mark.parametrize("counts", ((1,), (3, 1), (1, 3, 4, 1, 3, 3, 1)), ids=str)
@pytest.mark.parametrize("is_one", (True, False), ids=("one set", "several"))
def test_what_is_fetched_together_is_what_each_image_gives(dtype, counts, is_one):
    sets = [
        tuple(make_image(picture(10 * k + i, n, dtype)) for i, n in enumerate(counts))
        for k in range(3)
    ]
    sheet = Sheet(sets, counts)
    sheet.pack()
    count = BLOCK + 100
    taps = taps_of(count)
    number = np.random.default_rng(1).integers(3, size=1 if is_one else count).astype(F32)
    found = sheet.fetch(taps, number)

    assert found.shape == (sum(counts), count)
    for place, images in enumerate(sets):
        some = np.flatnonzero(np.broadcast_to(number, count) == place)
        rows = iter(found[:, some])
        for image, channels in zip(images, counts, strict=True):
            whole = mix_grey(image, taps)[None] if image.is_grey else mix_taps(image, taps)
            for expected in whole[:channels, some]:
                np.testing.assert_array_equal(next(rows), expected)


# --- Materials -----------------------------------------------------------------------------------


def material(first, **uses):
    """Return a material with maps of colour, roughness and metal; `uses`: of the first, alpha."""

    def image(seed, channels, output="Color", space="Non-Color"):
        source = ImageSource(
            f"Image {seed}",
            pixels=picture(first + seed, channels),
            colorspace=space,
            is_data=space != "sRGB",
        )
        return Link(Node("TexImage", "", {"Vector": where}, {"image": source}), output)

    where = Link(Node("NewGeometry"), "Position")
    colour = image(0, 4 if uses.get("alpha") else 3, space="sRGB")
    inputs = {"Base Color": colour, "Roughness": image(1, 1), "Metallic": image(2, 1)}
    if uses.get("alpha"):
        inputs["Alpha"] = Link(colour.node, "Alpha")
    return Material("X", Node("BsdfPrincipled", "", inputs))


def compiled(materials, room):
    library = Library(room=room)
    surfaces = [compile_surface("Material 'X'", each, Rules(), library) for each in materials]
    joined = on_sheets(surfaces, library)
    keep_used(joined, library)
    return surfaces, joined, library


def numbers_of(table, at, count):
    """Return the weights, parameters and names of all lobes at each of `count` points."""
    found = [[] for _ in range(count)]
    for shaded in table.shade(at, Arrival(), None, False):
        index = range(count) if shaded.index is None else shaded.index
        for lobe in shaded.lobes:
            rows = [
                np.broadcast_to(each, (*each.shape[:-1], shaded.size)).reshape(-1, shaded.size)
                for each in (lobe.weight, *lobe.parameters)
            ]
            for point, column in zip(index, np.concatenate(rows).T, strict=True):
                found[point].append((lobe.module.NAME, *column.tolist()))
    return found


@pytest.mark.parametrize("alpha", (False, True), ids=("opaque", "alpha"))
def test_materials_that_differ_in_images_only_share_a_program_to_the_bit(alpha):
    surfaces, joined, library = compiled([material(k, alpha=alpha) for k in (0, 30, 60)], 1e9)
    apart, together = compile_table(surfaces), compile_table(joined)
    assert (len(apart.recipes), len(together.recipes)) == (3, 1)
    (sheet,) = library.sheets.values()
    assert library.memory == sheet.memory + library.store.memory

    count = 500
    rng = np.random.default_rng(2)
    wo = vectors(*np.abs(rng.normal(size=(count, 3))))
    position = rng.uniform(-1, 2, (3, count)).astype(F32)
    at = points(wo, material=rng.integers(3, size=count), position=position)
    assert numbers_of(together, at, count) == numbers_of(apart, at, count)
    np.testing.assert_array_equal(
        together.transparency(at, Arrival()), apart.transparency(at, Arrival())
    )


def test_without_room_images_stay_where_they_are():
    surfaces, joined, library = compiled([material(0), material(30)], 100)
    assert joined == surfaces and not library.sheets


def test_a_sheet_is_kept_while_somebody_uses_it():
    materials = [material(0), material(30)]
    surfaces, _, library = compiled(materials, 1e9)
    (sheet,) = library.sheets.values()
    again = on_sheets(surfaces, library)
    keep_used(again, library)
    assert list(library.sheets.values()) == [sheet]
    keep_used([], library)
    assert not library.sheets


def test_coordinates_from_another_image_are_fetched_before():
    source = ImageSource("Image", pixels=picture(3, 3), is_data=True)
    other = ImageSource("Image", pixels=picture(4, 3), is_data=True)
    where = Link(Node("NewGeometry"), "Position")
    first = Link(Node("TexImage", "", {"Vector": where}, {"image": source}), "Color")
    second = Link(Node("TexImage", "", {"Vector": first}, {"image": other}), "Color")
    third, fourth = (
        Link(Node("TexImage", "", {"Vector": at}, {"image": image}), "Color")
        for at, image in ((where, other), (first, source))
    )
    inputs = {"Base Color": second, "Specular Tint": third, "Coat Tint": fourth, "Coat Weight": 0.5}
    graph = Material("X", Node("BsdfPrincipled", "", inputs))
    surfaces, joined, library = compiled([graph], 1e9)
    assert len(library.sheets) == 1  # both pairs of lookups have the same images, in some order
    functions = {item.function for item in compile_table(joined).recipes[0].program.order}
    assert mixed not in functions
    rng = np.random.default_rng(5)
    wo = vectors(*np.abs(rng.normal(size=(50, 3))))
    at = points(wo, position=rng.random((3, 50)).astype(F32))
    one, two = (numbers_of(compile_table(each), at, 50) for each in (surfaces, joined))
    assert one == two
