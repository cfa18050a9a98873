"""core.images.shelf -> images stay from one picture to the next, unless their files change."""

import os
from pathlib import Path

import numpy as np
import pytest

from penumbra.core.compile import compile_plan
from penumbra.core.images import MAGENTA, ImageSource, Tiles, files, make_image, sheet
from penumbra.core.images.shelf import Pixels, Shelf
from penumbra.core.images.store import Store
from penumbra.core.kept import KeepNothing
from penumbra.core.scene import Link, Material, Node
from penumbra.core.settings import Settings
from tests.support import scenes


def written(path, seed, size=64, channels=3):
    """Write a picture that looks like no other."""
    oiio = pytest.importorskip("OpenImageIO")
    pixels = np.random.default_rng(seed).integers(0, 256, (size, size, channels), np.uint8)
    file = oiio.ImageOutput.create(str(path))
    file.open(str(path), oiio.ImageSpec(size, size, channels, "uint8"))
    file.write_image(pixels)
    file.close()
    return str(path)


def source(path, **options):
    return ImageSource(f"Image '{Path(path).name}'", path=path, **options)


@pytest.fixture
def reads(monkeypatch):
    """Return the paths of the files that are read from now on."""
    found, read = [], files._read

    def counted(path):
        found.append(path)
        return read(path)

    monkeypatch.setattr(files, "_read", counted)
    return found


def test_a_file_is_read_once_for_all_pictures_and_again_when_it_changes(tmp_path, reads):
    path, shelf = written(tmp_path / "a.png", 1), Shelf()
    first = Store(shelf=shelf).get(source(path), [])
    again = Store(shelf=shelf).get(source(path), [])
    assert again.texels is first.texels
    assert reads == [path]
    data = Store(shelf=shelf).get(source(path, is_data=True, colorspace="Non-Color"), [])
    assert data.texels is first.texels and not data.is_srgb
    written(path, 2)
    os.utime(path, ns=(1, 1))  # even if that was within one tick of the clock
    changed = Store(shelf=shelf).get(source(path), [])
    assert reads == [path, path]
    assert (changed.texels != first.texels).any()
    assert Store(shelf=shelf).get(source(path, side=16), []).width == 16
    assert Store(16, shelf=shelf).get(source(path), []).width == 16


def test_each_colour_space_that_is_converted_has_its_own_texels(tmp_path, reads):
    path, shelf = written(tmp_path / "a.png", 1), Shelf()
    seen = [
        Store(shelf=shelf).get(source(path, colorspace=space, working_space="ACEScg"), [])
        for space in ("sRGB", "Linear Rec.709", "sRGB")
    ]
    assert len(reads) == 2
    assert seen[0].texels is seen[2].texels
    assert (seen[0].texels != seen[1].texels).any()


def test_a_file_that_cannot_be_read_is_named_each_time_and_found_when_it_is_there(tmp_path):
    pytest.importorskip("OpenImageIO")
    path, shelf = tmp_path / "late.png", Shelf()
    path.write_bytes(b"nothing that an image begins with")
    for _ in range(2):
        notes = []
        assert Store(shelf=shelf).get(source(str(path)), notes) is MAGENTA
        assert len(notes) == 1
    path.unlink()
    assert Store(shelf=shelf).get(source(str(path)), []) is MAGENTA
    written(path, 1)
    assert Store(shelf=shelf).get(source(str(path)), []) is not MAGENTA


def test_pixels_are_made_into_an_image_once_if_they_have_a_digest(monkeypatch):
    pixels = np.random.default_rng(1).integers(0, 256, (8, 8, 3), np.uint8)
    shelf = Shelf()

    def get(**options):
        made = ImageSource("Image 'packed'", pixels=pixels, **options)
        return Store(shelf=shelf).get(made, [])

    assert get(digest=1).texels is get(digest=1).texels
    assert get(digest=2).texels is not get(digest=1).texels
    assert get().texels is not get().texels
    for _ in range(2):
        notes = []
        unknown = ImageSource("Image 'odd'", pixels=pixels, colorspace="None such", digest=1)
        assert Store(shelf=shelf).get(unknown, notes) is not MAGENTA
        assert [note.owner for note in notes] == ["Image 'odd'"]


def test_the_shelf_forgets_what_was_not_asked_for_the_longest():
    shelf = Shelf()
    arrays = {name: np.zeros(100, np.uint8) for name in "abc"}
    for name, array in arrays.items():
        shelf.put(name, Pixels(array))
    shelf.put("a view of a", Pixels(arrays["a"].reshape(10, 10)))  # which takes nothing
    shelf.limit(300)
    assert all(shelf.find(name) for name in "cba")
    shelf.limit(200)
    assert [shelf.find(name) is not None for name in "abc"] == [True, True, False]
    shelf.limit(0)
    assert [shelf.find(name) for name in "abc"] == [None] * 3


def test_files_that_are_read_ahead_are_those_that_are_asked_for(tmp_path, reads):
    paths = [written(tmp_path / f"{k}.png", k, channels=1 + k % 4) for k in range(6)]
    lost = str(tmp_path / "lost.png")
    tiles = [(1001, source(paths[4])), (1002, source(lost)), (1003, source(paths[5]))]
    asked = [source(path) for path in paths[:4]]
    asked += [source(paths[0], is_data=True), source(""), ImageSource("Image 'x'", tiles=(*tiles,))]
    one, other = Store(), Store()
    other.read(asked)
    assert sorted(reads) == sorted([*paths, lost])
    for each in asked:
        notes = [], []
        plain, ahead = one.get(each, notes[0]), other.get(each, notes[1])
        assert notes[0] == notes[1]
        assert len(notes[0]) == (1 if each.tiles else 0)
        pairs = [(plain, ahead)]
        if isinstance(plain, Tiles):
            pairs = [(a, b) for (_, a), (_, b) in zip(plain.images, ahead.images, strict=True)]
        for a, b in pairs:
            np.testing.assert_array_equal(a.texels, b.texels)
    assert len(reads) == 2 * (len(paths) + 1)  # by the first store; the other had read them


def scene_with(*paths):
    """Return a scene whose only material shows files as colour, roughness and metal."""

    def image(path, space):
        is_data = space != "sRGB"
        shown = source(path, colorspace=space, is_data=is_data)
        return Link(Node("TexImage", "", {"Vector": where}, {"image": shown}), "Color")

    where = Link(Node("NewGeometry"), "Position")
    sockets = zip(("Base Color", "Roughness", "Metallic"), paths, strict=False)
    inputs = {
        socket: image(path, "sRGB" if socket == "Base Color" else "Non-Color")
        for socket, path in sockets
    }
    item = scenes.put(scenes.quad(), Material("X", Node("BsdfPrincipled", "", inputs)))
    return scenes.scene(scenes.camera((0, 0, 2), size=16), item, scenes.world((0.5, 0.6, 0.7)))


def picture(scene, kept, **options):
    plan = compile_plan(scene, Settings(samples=16, **options), kept=kept)
    return scenes.render(plan, threads=1).combined()


def test_the_second_picture_of_a_scene_reads_and_packs_nothing(tmp_path, reads, monkeypatch):
    paths = [written(tmp_path / f"{k}.png", k, channels=3 if k == 0 else 1) for k in range(3)]
    first = picture(scene_with(*paths), KeepNothing())
    assert first[..., :3].std() > 0.01
    kept = KeepNothing(Shelf())
    np.testing.assert_array_equal(picture(scene_with(*paths), kept), first)
    assert sorted(reads) == sorted(2 * paths)
    monkeypatch.setattr(sheet, "_planes", None)  # nobody writes records
    np.testing.assert_array_equal(picture(scene_with(*paths), kept), first)
    assert len(reads) == 6


def test_files_of_earlier_scenes_are_forgotten_when_images_take_too_much(tmp_path, reads):
    one, other = (written(tmp_path / f"{k}.png", k, size=448) for k in range(2))
    kept = KeepNothing(Shelf())
    for path in (one, other, other, one):
        picture(scene_with(path), kept, texture_memory=0.001)  # one of 0.8 MB fits
    assert reads == [one, other, one]


def test_blocks_of_an_image_and_of_its_pixels_are_the_same_memory():
    pixels = np.zeros((4, 4, 4), np.uint8)
    pixels[..., 0] = 9
    assert make_image(pixels).blocks() == Pixels(pixels).blocks() == Pixels(pixels[:]).blocks()
    assert list(Pixels(pixels).blocks().values()) == [64]


def test_images_on_which_nothing_depends_are_not_read_ahead(tmp_path, reads):
    paths = [written(tmp_path / f"{k}.png", k) for k in range(4)]

    def shown(first, second):
        images = [Node("TexImage", path, {}, {"image": source(path)}) for path in (first, second)]
        inputs = {"Color": Link(images[0], "Color"), "Roughness": Link(images[1], "Color")}
        return Node("BsdfDiffuse", "", inputs)

    mixed = scenes.shader(shown(*paths[:2]), shown(*paths[2:]), "MixShader", 0.0)
    plane = scenes.put(scenes.quad((1, 0, 0), (0, 1, 0)), Material("Mixed", mixed))
    plan = compile_plan(scenes.scene(scenes.camera((0, 0, 3), (0, 0, 0)), plane), Settings())
    assert sorted(reads) == sorted(paths[:2])
    assert plan.prepared.textures == 2
