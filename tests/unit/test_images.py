"""Images are read, converted and looked up as their settings say."""

import importlib.util

import numpy as np
import pytest

from penumbra.core.arrays import F32
from penumbra.core.images import ImageSource, make_image
from penumbra.core.images.files import load_image
from penumbra.core.images.lookup import TAPS, decode_srgb, lookup
from penumbra.core.images.projection import PROJECTIONS, equirectangular, equirectangular_invert

needs_files = pytest.mark.skipif(
    importlib.util.find_spec("OpenImageIO") is None, reason="needs OpenImageIO"
)
EXTENSIONS = ("REPEAT", "EXTEND", "CLIP", "MIRROR")


def grey(values, **options):
    """Return an image of one channel's values (H, W), opaque."""
    values = np.asarray(values, F32)
    pixels = np.ones((*values.shape, 4), F32)
    pixels[:, :, :3] = values[:, :, None]
    return make_image(pixels, **options)


def at(image, u, v=0.5, **options):
    u = np.atleast_1d(np.asarray(u, F32))
    return lookup(image, u, np.full(u.shape, v, F32), **options)[0]


ROW = grey([[1, 2, 4, 8]])


@pytest.mark.parametrize(
    ("extension", "expected"),
    [
        ("REPEAT", [8, 1, 2, 4, 8, 1, 2]),
        ("EXTEND", [1, 1, 2, 4, 8, 8, 8]),
        ("CLIP", [0, 1, 2, 4, 8, 0, 0]),
        ("MIRROR", [1, 1, 2, 4, 8, 8, 4]),
    ],
)
def test_beyond_the_edges_is_what_the_extension_says(extension, expected):
    u = (np.arange(-1, 6) + 0.5) / 4
    assert at(ROW, u, interpolation="Closest", extension=extension) == pytest.approx(expected)
    assert at(ROW, u[1:5], extension=extension) == pytest.approx(expected[1:5])


def test_closest_takes_one_texel_and_linear_mixes_two():
    assert at(ROW, [0.26, 0.49], interpolation="Closest") == pytest.approx([2, 2])
    assert at(ROW, [0.25, 0.5, 0.4375]) == pytest.approx([1.5, 3, 2.5])
    assert at(ROW, [0.0, 1.0]) == pytest.approx([4.5, 4.5])  # half the first, half the last
    assert at(ROW, [1 - 2.0**-24]) == pytest.approx([4.5])
    assert at(ROW, [0.0, 1.0], extension="MIRROR") == pytest.approx([1, 8])
    assert at(ROW, [0.0], extension="CLIP") == pytest.approx([0.5])


def test_cubic_is_the_b_spline():
    image = grey([[0, 0, 6, 0, 0, 0]])
    u = np.array([1.5, 2.5, 3.5, 2.0]) / 6
    assert at(image, u, interpolation="Cubic") == pytest.approx([1, 4, 1, 6 * 23 / 48])
    assert at(image, u, interpolation="Smart") == pytest.approx(at(image, u, interpolation="Cubic"))


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("interpolation", TAPS)
def test_rows_and_columns_are_alike_and_constants_stay(extension, interpolation):
    values = np.random.default_rng(1).random((5, 5))
    u, v = np.random.default_rng(2).random((2, 500), dtype=F32) * F32(3) - F32(1)
    options = {"interpolation": interpolation, "extension": extension}
    one = lookup(grey(values), u, v, **options)[0]
    other = lookup(grey(values.T), v, u, **options)[0]
    assert one == pytest.approx(other, abs=1e-5)
    inside = F32(0.9) * np.abs(u) % F32(1)
    if extension != "CLIP":
        assert lookup(grey(np.ones((1, 3))), u, v, **options) == pytest.approx(1, abs=1e-6)
    elif interpolation == "Closest":
        assert lookup(grey(np.ones((3, 3))), inside, inside, **options) == pytest.approx(1)


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("interpolation", TAPS)
def test_no_coordinate_leaves_the_image(extension, interpolation):
    odd = np.array([0, 1, -1, 1e-9, 1 - 2**-24, 1 + 2**-23, -1e-9, 1e6, -1e6, 2, 3.5], F32)
    u, v = (each.ravel() for each in np.meshgrid(odd, odd))
    for shape in ((1, 1), (1, 2), (3, 1), (7, 5)):
        image = grey(np.full(shape, 3.0))
        seen = lookup(image, u, v, interpolation, extension)
        assert np.isfinite(seen).all()
        assert seen.min() >= -1e-6
        assert seen.max() <= 3 + 1e-5
    assert seen.dtype == np.float32


def test_the_first_row_is_the_lowest():
    image = grey([[1.0], [5.0]])
    assert at(image, 0.5, 0.1, interpolation="Closest") == pytest.approx([1])
    assert at(image, 0.5, 0.9, interpolation="Closest") == pytest.approx([5])


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float32])
def test_every_number_format_gives_the_same_colours(dtype):
    one = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    pixels = (np.array([[[1, 0, 0.2, 1], [0, 1, 0.6, 1]]]) * one).astype(dtype)
    seen = lookup(make_image(pixels), np.array([0.25, 0.75], F32), np.full(2, 0.5, F32), "Closest")
    expected = np.array([[1, 0, 0.2, 1], [0, 1, 0.6, 1]]).T
    assert seen == pytest.approx(expected, abs=3e-3)


def test_srgb_is_decoded_after_mixing():
    image = grey([[0.0, 1.0]], is_srgb=True)
    assert at(image, 0.5) == pytest.approx([0.21404], abs=1e-4)  # not 0.5
    assert decode_srgb(np.array([0.02, 0.5, 1, -1], F32)) == pytest.approx(
        [0.02 / 12.92, ((0.5 + 0.055) / 1.055) ** 2.4, 1, 0], rel=1e-4
    )


def test_alpha_is_taken_out_of_colours_when_asked_for():
    image = make_image(np.array([[[0.2, 0.1, 0, 0.5], [0, 0, 0, 0]]], F32))
    u, v = np.array([0.25, 0.75], F32), np.full(2, 0.5, F32)
    associated = np.array([[0.2, 0.1, 0, 0.5], [0, 0, 0, 0]]).T
    straight = np.array([[0.4, 0.2, 0, 0.5], [0, 0, 0, 0]]).T
    assert lookup(image, u, v, "Closest") == pytest.approx(associated)
    assert lookup(image, u, v, "Closest", unassociate=True) == pytest.approx(straight)


def test_the_middle_of_an_equirectangular_picture_is_x_and_its_top_is_z():
    there = np.array([[1, 0, 0, 0], [0, 1, -1, 0], [0, 0, 0, 1]], F32)
    u, v = equirectangular(there)
    assert u[:3] == pytest.approx([0.5, 0.25, 0.75])
    assert v == pytest.approx([0.5, 0.5, 0.5, 1])
    u, v = np.random.default_rng(3).random((2, 100), dtype=F32)
    back = equirectangular(equirectangular_invert(u, v))
    assert back[0] == pytest.approx(u, abs=1e-5)
    assert back[1] == pytest.approx(v, abs=1e-5)


def test_a_mirror_ball_reflects_its_directions():
    """Seen along +y: the normal at u, v halves the angle between -y and the direction."""
    direction = np.random.default_rng(4).normal(size=(3, 200))
    direction /= np.linalg.norm(direction, axis=0)
    u, v = PROJECTIONS["MIRROR_BALL"](direction.astype(F32))
    normal = direction - np.array([[0], [1], [0]])
    normal /= np.linalg.norm(normal, axis=0)
    assert u == pytest.approx(0.5 + normal[0] / 2, abs=1e-4)
    assert v == pytest.approx(0.5 + normal[2] / 2, abs=1e-4)
    ahead = PROJECTIONS["MIRROR_BALL"](np.array([[0], [1], [0]], F32))
    assert np.isfinite(ahead).all()


def test_pixels_need_no_file_and_take_the_alpha_mode_at_its_word():
    pixels = np.array([[[200, 100, 0, 51]]], np.uint8)

    def seen(**options):
        source = ImageSource("Image 'x'", pixels=pixels, colorspace="Linear Rec.709", **options)
        image = load_image(source, [])
        return lookup(image, np.full(1, 0.5, F32), np.full(1, 0.5, F32))[:, 0] * 255

    assert seen() == pytest.approx([40, 20, 0, 51])
    assert seen(alpha_mode="PREMUL") == pytest.approx([200, 100, 0, 51])
    assert seen(alpha_mode="NONE") == pytest.approx([200, 100, 0, 255])
    assert seen(alpha_mode="CHANNEL_PACKED") == pytest.approx([200, 100, 0, 51])
    assert seen(is_data=True) == pytest.approx([200, 100, 0, 51])


def test_what_cannot_be_read_is_magenta_and_named(tmp_path):
    pytest.importorskip("OpenImageIO")
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"no picture")
    for path in (tmp_path / "missing.png", broken):
        notes = []
        image = load_image(ImageSource("Image 'lost'", path=str(path)), notes)
        assert lookup(image, np.zeros(1, F32), np.zeros(1, F32))[:, 0].tolist() == [1, 0, 1, 1]
        assert [note.owner for note in notes] == ["Image 'lost'"]
        assert "magenta" in notes[0].what


@needs_files
@pytest.mark.parametrize(
    ("name", "kind", "channels"),
    [("a.png", "uint8", 3), ("b.png", "uint16", 1), ("c.exr", "half", 4), ("d.hdr", "float", 3)],
)
def test_files_are_read_with_the_lowest_row_first(tmp_path, name, kind, channels):
    import OpenImageIO as oiio

    values = np.random.default_rng(5).random((3, 4, channels)).astype(F32)
    values[:, :, 3:] = 1
    file = oiio.ImageOutput.create(str(tmp_path / name))
    file.open(str(tmp_path / name), oiio.ImageSpec(4, 3, channels, kind))
    file.write_image(values)
    file.close()
    notes = []
    source = ImageSource("Image", path=str(tmp_path / name), colorspace="Linear Rec.709")
    image = load_image(source, notes)
    u, v = np.meshgrid((np.arange(4) + 0.5) / 4, (np.arange(3) + 0.5) / 3)
    seen = lookup(image, u.ravel().astype(F32), v.ravel().astype(F32), "Closest")
    expected = np.broadcast_to(values[::-1].reshape(12, channels)[:, :3], (12, 3)).T
    assert seen[:3] == pytest.approx(expected, abs=6e-3)
    assert not notes
    assert (image.width, image.height) == (4, 3)


@needs_files
def test_an_unknown_colour_space_is_named_and_counts_as_linear(tmp_path):
    notes = []
    pixels = np.full((1, 1, 4), 128, np.uint8)
    image = load_image(ImageSource("Image 'x'", pixels=pixels, colorspace="No such space"), notes)
    assert "No such space" in notes[0].what
    assert not image.is_srgb


def test_a_source_with_nonsense_is_refused():
    with pytest.raises(ValueError, match="alpha mode 'MAYBE'"):
        ImageSource("Image", alpha_mode="MAYBE")
    with pytest.raises(ValueError, match="float64"):
        ImageSource("Image", pixels=np.zeros((1, 1, 4)))
