"""core.images.store -> files once in memory, in their own numbers, smaller where limits say so."""

import numpy as np
import pytest

from penumbra.core.arrays import F32
from penumbra.core.images import ImageSource, image_size, make_image
from penumbra.core.images.files import load_image
from penumbra.core.images.lookup import TAPS, lookup
from penumbra.core.images.store import Store, fit

EXTENSIONS = ("REPEAT", "EXTEND", "CLIP", "MIRROR")


def written(folder, name="a.png", width=64, height=32, channels=3, kind="uint8", values=None):
    oiio = pytest.importorskip("OpenImageIO")
    if values is None:
        values = np.random.default_rng(3).random((height, width, channels)).astype(F32)
    path = str(folder / name)
    file = oiio.ImageOutput.create(path)
    file.open(path, oiio.ImageSpec(width, height, channels, kind))
    file.write_image(values)
    file.close()
    return path


def source(path, name="a", **options):
    return ImageSource(f"Image '{name}'", path=path, **options)


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("interpolation", TAPS)
@pytest.mark.parametrize("is_srgb", [False, True])
def test_grey_images_take_a_quarter_and_look_the_same(interpolation, extension, is_srgb):
    random = np.random.default_rng(1)
    pixels = np.full((8, 16, 4), 255, np.uint8)
    pixels[:, :, :3] = random.integers(0, 256, (8, 16, 1))
    grey = make_image(pixels, is_srgb)
    pixels[0, 0, 3] = 254  # which makes it an image of four channels
    whole = make_image(pixels, is_srgb)
    assert grey.is_grey and not whole.is_grey
    assert grey.memory * 4 == whole.memory == 8 * 16 * 4
    u, v = random.uniform(-1, 2, (2, 500)).astype(F32)
    seen = [lookup(image, u, v, interpolation, extension) for image in (grey, whole)]
    assert seen[0][:3] == pytest.approx(seen[1][:3], abs=1e-6)
    assert seen[0][3] == pytest.approx(seen[1][3], abs=0.005)


def test_an_image_with_one_coloured_texel_is_not_grey():
    pixels = np.full((70, 3, 4), 1, F32)
    assert make_image(pixels).is_grey
    pixels[69, 2, 2] = 0.5
    assert not make_image(pixels).is_grey


@pytest.mark.parametrize(
    ("kind", "channels", "each"),
    [("uint8", 3, 4), ("uint8", 1, 1), ("uint16", 3, 8), ("half", 3, 8), ("float", 1, 4)],
)
def test_texels_stay_in_the_numbers_of_the_file(tmp_path, kind, channels, each):
    name = "a.png" if kind.startswith("u") else "a.exr"
    path = written(tmp_path, name, channels=channels, kind=kind)
    space = "sRGB" if kind.startswith("u") else "Linear Rec.709"
    assert load_image(source(path, colorspace=space), []).memory == 64 * 32 * each


def test_a_file_is_in_memory_once_whatever_its_colour_space(tmp_path):
    path = written(tmp_path)
    store = Store()
    colour, again = (store.get(source(path), []) for _ in range(2))
    data = store.get(source(path, is_data=True, colorspace="Non-Color"), [])
    assert colour is again
    assert data.texels is colour.texels
    assert (colour.is_srgb, data.is_srgb) == (True, False)
    assert (len(store.images), store.memory) == (1, 64 * 32 * 4)
    other = store.get(source(written(tmp_path, "b.png")), [])
    assert other.texels is not colour.texels
    assert (len(store.images), store.memory) == (2, 2 * 64 * 32 * 4)


def test_limits_halve_until_both_sides_fit():
    assert image_size(4096, 2048, 0) == (4096, 2048)
    assert image_size(4096, 2048, 1024) == (1024, 512)
    assert image_size(1000, 600, 512) == (500, 300)
    assert image_size(4096, 4, 128) == (128, 1)
    assert image_size(100, 100, 0, 0.3) == (25, 25)
    assert image_size(100, 100, 70, 0.5) == (50, 50)


def test_a_smaller_image_has_the_means_of_squares(tmp_path):
    values = np.zeros((4, 6, 3), F32)
    values[2:, 2:4] = np.array([[10, 20], [30, 41]])[:, :, None] / 255
    path = written(tmp_path, width=6, height=4, values=values)
    image = load_image(source(path, is_data=True, side=3), [])
    assert (image.width, image.height) == (3, 2)
    u, v = np.array([0.5, 0.1], F32), np.array([0.25, 0.25], F32)
    assert lookup(image, u, v, "Closest")[0] * 255 == pytest.approx([25, 0])


def test_images_are_halved_until_they_fit_the_memory_and_named(tmp_path):
    large = source(written(tmp_path, "l.png", 256, 128), "large")
    small = source(written(tmp_path, "s.png", 64, 64, 1), "small")
    total = 256 * 128 * 4 + 64 * 64
    notes = []
    assert fit([large, small, large], total, notes) == (0, 0)
    assert not notes
    side, _ = fit([large, small], total - 1, notes)
    assert side == 128
    assert [note.owner for note in notes] == ["Image 'large'"]
    assert "128 x 64 instead of 256 x 128" in notes[0].what
    store = Store(side)
    assert [store.get(each, []).width for each in (large, small)] == [128, 64]


def test_what_cannot_be_read_takes_no_memory(tmp_path):
    pytest.importorskip("OpenImageIO")
    lost = source(str(tmp_path / "lost.png"))
    assert fit([lost, source("")], 1.0, []) == (0, 1)
    store, notes = Store(), []
    store.get(lost, notes)
    assert (store.images, store.memory, len(notes)) == ([], 0, 1)
