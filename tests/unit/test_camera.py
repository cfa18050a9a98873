"""core.camera -> rays where Blender's pixels look, and filters of the right shape."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Settings
from penumbra.core.camera import FILTER_ENTRIES, compile_camera
from penumbra.core.camera_motion import compile_moving_camera
from penumbra.core.optics import Aperture, Eye, Panorama
from tests.support import scenes as s

F32 = np.float32
HALF = np.full(1, 0.5, F32)
BOX = replace(s.DEFAULTS, pixel_filter_type="BOX")


def compile_(camera, settings=BOX, origin=(0, 0, 0), box=None):
    return compile_camera(camera, settings, np.asarray(origin, float), box)


def rays(compiled, x, y, *lens):
    """Rays through the middles of pixels x, y."""
    x, y = np.broadcast_arrays(np.asarray(x, F32), np.asarray(y, F32))
    half = np.full(x.size, 0.5, F32)
    return compiled.rays(x.ravel(), y.ravel(), half, half, *lens)


def test_perspective_rays_pass_through_the_centres_of_their_pixels():
    view = s.camera((1, 2, 3), (4, 6, 3.5), size=4, width=6, fov=50, clip_start=0.5)
    x, y = np.meshgrid(np.arange(6), np.arange(4))
    origin, direction, far, _ = rays(compile_(view), x, y)
    assert far is None
    assert origin.dtype == direction.dtype == F32
    np.testing.assert_allclose((direction**2).sum(axis=0), 1, atol=1e-6)

    local = view.to_world[:, :3].T @ direction
    half = np.tan(np.radians(25))
    np.testing.assert_allclose(
        local[0] / -local[2], ((x + 0.5) / 6 * 2 - 1).ravel() * half * 1.5, atol=1e-4
    )
    np.testing.assert_allclose(
        local[1] / -local[2], ((y + 0.5) / 4 * 2 - 1).ravel() * half, atol=1e-4
    )

    # They start on the near plane.
    start = view.to_world[:, :3].T @ (origin - view.to_world[:, 3:])
    np.testing.assert_allclose(start[2], -0.5, rtol=1e-5)
    np.testing.assert_allclose(start[:2] / 0.5, local[:2] / -local[2], atol=1e-5)


def test_orthographic_rays_are_parallel_and_start_in_their_pixels():
    view = s.orthographic((1, 2, 3), (4, 6, 3.5), size=4, scale=2.0, clip_start=0.5)
    x, y = np.meshgrid(np.arange(4), np.arange(4))
    origin, direction, far, _ = rays(compile_(view), x, y)
    assert far is None
    np.testing.assert_allclose(direction, np.repeat(-view.to_world[:, 2:3], 16, 1), atol=1e-6)
    start = view.to_world[:, :3].T @ (origin - view.to_world[:, 3:])
    np.testing.assert_allclose(start[0], ((x + 0.5) / 2 - 1).ravel(), atol=1e-4)
    np.testing.assert_allclose(start[1], ((y + 0.5) / 2 - 1).ravel(), atol=1e-4)
    np.testing.assert_allclose(start[2], -0.5, atol=1e-5)


@pytest.mark.parametrize("kind", (s.camera, s.orthographic))
def test_a_shifted_window_looks_aside(kind):
    view = kind((0, 0, 5), size=2)
    moved = replace(view, window=tuple(np.add(view.window, (0.3, 0.3, 0.1, 0.1))))
    origin, direction, *_ = rays(compile_(moved), (0, 1), (0, 1))
    centre = (origin + direction / np.abs(direction[2:]) * 1).mean(axis=1)
    plain, along, *_ = rays(compile_(view), (0, 1), (0, 1))
    before = (plain + along / np.abs(along[2:]) * 1).mean(axis=1)
    scale = 1.1 if kind is s.camera else 1.0  # the near plane and a metre
    np.testing.assert_allclose(centre - before, (0.3 * scale, 0.1 * scale, 0), atol=1e-5)


def test_rays_are_about_the_local_origin():
    far = np.array([1e7, -3e6, 2e7])
    view = s.camera(far + (1, 2, 3), far, clip_start=1e-3)
    near, *_ = rays(compile_(view, origin=far), 3, 4)
    np.testing.assert_allclose(near[:, 0], (1, 2, 3), atol=2e-3)


@pytest.mark.parametrize("kind", (s.camera, s.orthographic))
def test_clip_end_is_a_depth_and_absent_where_nothing_lies_beyond(kind):
    box = np.array([(-1.0, -1, -1), (1, 1, 1)])
    view = kind((0, 0, 5), clip_start=0.5, clip_end=5.0)
    assert compile_(replace(view, clip_end=6.5), box=box).far is None
    origin, direction, far, _ = rays(compile_(view, box=box), np.arange(8), 0)
    np.testing.assert_allclose((origin + direction * far)[2], 0, atol=1e-5)


@pytest.mark.parametrize("kind", (s.camera, s.orthographic))
def test_what_is_clipped_is_not_seen(kind):
    view = kind((0, 0, 5), size=6)
    things = [s.put(s.quad((9, 0, 0), (0, 9, 0), (0, 0, z)), s.emission(1 + z)) for z in (2, 0)]
    ranges = ((0.1, 100, 3), (3.1, 100, 1), (2.9, 100, 3), (3.1, 4.9, 0), (0.1, 2, 0))
    for start, end, seen in ranges:
        image = s.pixels(replace(view, clip_start=start, clip_end=end), *things)
        np.testing.assert_allclose(image[..., 1], seen, rtol=1e-6)


# --- Lenses -------------------------------------------------------------------------------------

APERTURE = Aperture(radius=0.05, focus=3.0, blades=5, rotation=0.2, ratio=1.5)
ASKEW = {"eye": (1, 2, 3), "target": (4, 6, 3.5)}


def lens_numbers(count=2000):
    return np.random.default_rng(2).random((2, count), F32)


def in_camera(view, origin, direction):
    """Return rays in camera space, float64."""
    rotation = view.to_world[:, :3].T
    return rotation @ (origin - view.to_world[:, 3:]), rotation @ direction


@pytest.mark.parametrize("kind", (s.camera, s.orthographic))
def test_rays_of_a_lens_start_in_the_aperture_and_meet_where_it_is_sharp(kind):
    view = kind((1, 2, 3), (4, 6, 3.5), size=8, clip_start=0.5)
    origin, direction, *_ = rays(compile_(view), 2, 6)
    start, way = in_camera(view, origin, direction)
    sharp = start + way * ((3.0 - 0.5) / -way[2])  # where the pinhole's ray is in focus

    u, v = lens_numbers()
    lens = replace(view, aperture=replace(APERTURE, blades=0))
    many = np.full(u.size, 2)
    origin, direction, far, index = rays(compile_(lens), many, 6, u, v)
    assert far is None
    assert index is None
    assert origin.dtype == direction.dtype == F32
    np.testing.assert_allclose((direction**2).sum(axis=0), 1, atol=1e-6)
    start, way = in_camera(view, origin, direction)
    to_sharp = (-3.0 - start[2]) / way[2]
    np.testing.assert_allclose(start + way * to_sharp, np.repeat(sharp, u.size, 1), atol=2e-6)

    # In the plane of the lens they fill the aperture, around the middle of the pixel if parallel
    in_lens = start - way * (start[2] / way[2])
    middle = sharp[:2] if kind is s.orthographic else 0
    across, up = in_lens[:2] - middle
    np.testing.assert_allclose(up.max(), 0.05, rtol=0.06)
    np.testing.assert_allclose(across.max(), 0.05 / 1.5, rtol=0.06)
    assert (np.hypot(across * 1.5, up) < 0.05 + 2e-6).all()


@pytest.mark.parametrize("focus", (1e-5, 1e-3, 1e6, 3e38))
@pytest.mark.parametrize("kind", (s.camera, s.orthographic))
def test_a_lens_may_focus_as_near_and_as_far_as_blenders(kind, focus):
    u, v = lens_numbers(100)
    view = kind((1, 2, 3), size=8, aperture=replace(APERTURE, focus=focus))
    _, direction, *_ = rays(compile_(view), np.full(100, 2), 5, u, v)
    np.testing.assert_allclose((direction**2).sum(axis=0), 1, atol=1e-6)
    if focus > 1e5:
        plain = rays(compile_(kind((1, 2, 3), size=8)), 2, 5).direction
        np.testing.assert_allclose(direction, np.repeat(plain, 100, 1), atol=1e-6)


def test_a_lens_starts_rays_on_the_near_plane_and_ends_them_on_the_far_one():
    box = np.array([(-50.0, -50, -50), (50, 50, 50)])
    u, v = lens_numbers(100)
    for kind in (s.camera, s.orthographic):
        view = kind((0, 0, 9), clip_start=0.5, clip_end=5.0, aperture=APERTURE)
        origin, direction, far, _ = rays(compile_(view, box=box), np.full(100, 4), 4, u, v)
        np.testing.assert_allclose(origin[2], 9 - 0.5, atol=1e-3)
        np.testing.assert_allclose((origin + direction * far)[2], 9 - 5, atol=1e-2)


@pytest.mark.parametrize("kind", (s.camera, s.orthographic))
def test_a_lens_sees_nothing_behind_the_far_plane(kind):
    box = np.array([(-1.0, -1, -1), (1, 1, 1)])
    wide = Aperture(radius=2.0, focus=1.0)
    view = kind((0, 0, 5), clip_end=6.5)
    assert compile_(view, box=box).far is None
    # Rays are as long as that of the middle: slanted ones end sooner
    assert compile_(replace(view, aperture=wide), box=box).far is not None


# --- Panoramas ----------------------------------------------------------------------------------


def around(kind="EQUIRECTANGULAR", window=(0.0, 1.0, 0.0, 1.0), size=16, **more):
    eye, target = ASKEW["eye"], ASKEW["target"]
    basics = {"projection": "PANO", "panorama": Panorama(kind), **more}
    return s.Camera(s.look_at(eye, target), window, 2 * size, size, **basics)


def all_pixels(view):
    x, y = np.meshgrid(np.arange(view.width), np.arange(view.height))
    return rays(compile_(view), x, y), ((x + 0.5) / view.width).ravel(), (y + 0.5).ravel()


def test_each_pixel_of_an_equirectangular_picture_looks_at_its_longitude_and_latitude():
    view = around()
    (origin, direction, far, index), u, y = all_pixels(view)
    assert far is None
    assert index is None
    local = view.to_world[:, :3].T @ direction  # x to the right, y up, z back
    longitude = np.arctan2(local[0], -local[2])
    np.testing.assert_allclose(longitude, (u - 0.5) * 2 * np.pi, atol=2e-5)
    np.testing.assert_allclose(np.arcsin(local[1]), (y / 16 - 0.5) * np.pi, atol=2e-5)
    np.testing.assert_allclose(
        origin, view.to_world[:, 3:] + 0.1 * direction, atol=1e-5
    )  # the near sphere


def test_a_shift_and_a_part_of_the_window_move_the_map():
    whole, *_ = all_pixels(around())
    part, *_ = all_pixels(replace(around(), window=(0.5, 1.0, 0.5, 1.0), width=16, height=8))
    expected = whole.direction.reshape(3, 16, 32)[:, 8:, 16:].reshape(3, -1)
    np.testing.assert_allclose(part.direction, expected, atol=1e-5)


def test_outside_of_a_round_picture_there_are_no_rays():
    view = replace(around("FISHEYE_EQUIDISTANT"), width=16)
    found, u, y = all_pixels(view)
    r = np.hypot(2 * u - 1, 2 * y / 16 - 1)
    np.testing.assert_array_equal(found.slot, np.flatnonzero(r <= 1))
    assert found.direction.shape == found.origin.shape == (3, found.slot.size)
    local = view.to_world[:, :3].T @ found.direction
    np.testing.assert_allclose(np.arccos(-local[2]), r[found.slot] * np.pi / 2, atol=1e-4)


@pytest.mark.parametrize("film_transparent", (False, True))
def test_outside_of_a_round_picture_is_black_and_opaque(film_transparent):
    """As in Cycles, where samples without a ray neither see the world nor pass through it."""
    view = replace(around("MIRRORBALL"), width=16)
    box = s.put(s.box(1.5), s.emission(2.0), to_world=s.affine(1.0, (4, 6, 3.5)))
    image = s.pixels(view, box, s.world(0.5), samples=4, film_transparent=film_transparent)
    x, y = np.meshgrid((np.arange(16) + 0.5) / 8 - 1, (np.arange(16) + 0.5) / 8 - 1)
    r = np.hypot(x, y)
    np.testing.assert_array_equal(
        image[r > 1.1], np.broadcast_to((0, 0, 0, 1), (np.count_nonzero(r > 1.1), 4))
    )
    inside = image[r < 0.8]
    np.testing.assert_array_equal(inside[:, 3].min(), 0.0 if film_transparent else 1.0)
    assert inside[:, 1].max() > 1.0


def test_a_picture_without_any_ray_is_black():
    view = replace(around("FISHEYE_EQUIDISTANT"), window=(2.0, 3.0, 2.0, 3.0))
    image = s.pixels(view, s.put(s.box(9.0), s.emission(2.0)), s.world(0.5), samples=2)
    np.testing.assert_array_equal(image, np.broadcast_to((0, 0, 0, 1), image.shape))


def test_panoramas_are_clipped_by_spheres():
    box = np.array([(-50.0, -50, -50), (50, 50, 50)])
    view = replace(around(), clip_start=0.5, clip_end=5.0)
    half = np.full(8, 0.5, F32)
    origin, direction, far, _ = compile_(view, box=box).rays(
        np.arange(8, dtype=F32), half, half, half
    )
    eye = view.to_world[:, 3:]
    np.testing.assert_allclose(np.linalg.norm(origin - eye, axis=0), 0.5, rtol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(origin + direction * far - eye, axis=0), 5, rtol=1e-5)
    near_box = np.array([(0.0, 0, 0), (3, 3, 3)])
    assert compile_(view, box=near_box).far is None


@pytest.mark.parametrize("kind", ("EQUIRECTANGULAR", "MIRRORBALL", "FISHEYE_EQUIDISTANT"))
def test_rays_of_a_panoramic_lens_meet_on_the_sphere_in_focus(kind):
    u, v = lens_numbers()
    many = np.full(u.size, 9)
    view = replace(around(kind), width=16)
    plain = rays(compile_(view), 9, 4)
    sharp = view.to_world[:, 3:] + plain.direction * 3.0
    lens = compile_(replace(view, aperture=replace(APERTURE, ratio=1.0, blades=0)))
    origin, direction, *_ = rays(lens, many, 4, u, v)
    away = sharp - origin
    distance = np.linalg.norm(away, axis=0)
    np.testing.assert_allclose(direction, away / distance, atol=3e-6)

    # Their starts fill a disk that faces the view
    start = origin - direction * 0.1 - view.to_world[:, 3:]
    np.testing.assert_allclose((start * plain.direction).sum(axis=0), 0, atol=2e-6)
    np.testing.assert_allclose(np.linalg.norm(start, axis=0).max(), 0.05, rtol=1e-2)
    np.testing.assert_allclose(start.mean(axis=1), 0, atol=2e-3)


def test_a_lens_that_looks_along_the_axis_of_a_panorama_is_whole():
    u, v = lens_numbers()
    view = replace(around("FISHEYE_EQUIDISTANT"), width=1, height=1, aperture=APERTURE)
    start = compile_(view)
    middle = replace(start, offsets=np.full_like(start.offsets, 0.5))
    zero = np.zeros(u.size, F32)
    origin, direction, *_ = middle.rays(zero, zero, u, v, u, v)
    assert np.isfinite(direction).all()
    place = origin - direction * 0.1 - view.to_world[:, 3:]
    assert np.linalg.matrix_rank(place, tol=1e-2) == 2


# --- Two eyes -----------------------------------------------------------------------------------


@pytest.mark.parametrize("projection", ("PERSP", "PANO"))
def test_two_eyes_look_apart_wherever_they_look(projection):
    view = replace(around(), width=16) if projection == "PANO" else s.camera((1, 2, 3), size=16)
    up = view.to_world[:, 1] if projection == "PANO" else np.array([0, 0, 1.0])  # Cycles
    x, y = np.meshgrid(np.arange(16), np.arange(16))
    plain = rays(compile_(view), x, y)
    found = [rays(compile_(replace(view, eye=Eye(side * 0.3, 2.0))), x, y) for side in (-1, 1)]
    near = 0.1 * np.ones(256)
    if projection == "PERSP":
        near = 0.1 / -(view.to_world[:, 2] @ plain.direction)
    left, right = (ray.origin - ray.direction * near - view.to_world[:, 3:] for ray in found)
    np.testing.assert_allclose(left, -right, atol=2e-6)
    np.testing.assert_allclose(np.linalg.norm(right, axis=0), 0.3, rtol=1e-4)
    np.testing.assert_allclose((right * plain.direction).sum(axis=0), 0, atol=2e-6)
    np.testing.assert_allclose(up @ right, 0, atol=2e-6)
    assert (np.cross(plain.direction.T, up) * right.T).sum(axis=1).min() > 0
    meeting = right + found[1].direction * np.hypot(2.0, 0.3)
    np.testing.assert_allclose(meeting, plain.direction * 2.0, atol=1e-5)


# --- What is not used ----------------------------------------------------------------------------


def test_a_pinhole_draws_no_numbers_for_a_lens(monkeypatch):
    from penumbra.core.sampling.dimensions import LENS
    from penumbra.core.sampling.draws import Draws

    drawn = set()
    pair = Draws.pair

    def spy(self, dimension, *rest, **options):
        drawn.add(dimension)
        return pair(self, dimension, *rest, **options)

    monkeypatch.setattr(Draws, "pair", spy)
    view = s.camera((0, -3, 0))
    s.pixels(view, s.put(s.sphere(), s.diffuse()), s.world())
    assert LENS not in drawn
    s.pixels(replace(view, aperture=APERTURE), s.put(s.sphere(), s.diffuse()), s.world())
    assert LENS in drawn


# --- The pixel filter ---------------------------------------------------------------------------


def density(kind, width, x):
    """Blender's filters, not normalised, at x pixels from the centre."""
    if kind == "BOX":
        return (np.abs(x) <= 0.5).astype(float)
    if kind == "GAUSSIAN":
        return np.where(np.abs(x) <= 1.5 * width, np.exp(-2 * (2 * x / width) ** 2), 0)
    phase = 2 * np.pi * (x / (2 * width) + 0.5)
    value = 0.35875 - 0.48829 * np.cos(phase) + 0.14128 * np.cos(2 * phase)
    return np.where(np.abs(x) <= width, value - 0.01168 * np.cos(3 * phase), 0)


@pytest.mark.parametrize("width", (0.5, 1.5, 3.0))
@pytest.mark.parametrize("kind", ("BOX", "GAUSSIAN", "BLACKMAN_HARRIS"))
def test_offsets_follow_the_filter(kind, width):
    settings = Settings(pixel_filter_type=kind, filter_width=width)
    offset = compile_(s.camera((0, 0, 5)), settings).offsets.astype(float) - 0.5
    assert offset.size == FILTER_ENTRIES
    assert (np.diff(offset) > 0).all()
    np.testing.assert_allclose(offset, -offset[::-1], atol=1e-5)

    x = np.linspace(-6, 6, 400_001)
    weight = density(kind, width, x)
    weight /= weight.sum()
    np.testing.assert_allclose(offset.var(), (weight * x * x).sum(), rtol=3e-3)
    edges = np.linspace(-1.2 * width, 1.2 * width, 9)
    share = np.searchsorted(offset, edges) / offset.size
    np.testing.assert_allclose(share, np.interp(edges, x, np.cumsum(weight)), atol=1e-3)


def test_the_ends_of_the_random_numbers_stay_within_the_filter():
    compiled = compile_(s.camera((0, 0, 5), size=1))
    last = np.array([0, 1 - 2.0**-24], F32)
    zero = np.zeros(2, F32)
    _, direction, *_ = compiled.rays(zero, zero, last, last)
    assert np.isfinite(direction).all()
    np.testing.assert_allclose(direction[:, 0], direction[:, 1] * (-1, -1, 1), atol=1e-6)


def test_wide_filters_gather_light_from_neighbours():
    dot = s.put(s.quad((0.5, 0, 0), (0, 0.5, 0), (0.5, 0.5, 0)), s.emission())
    view = s.orthographic((0, 0, 5), size=8, scale=8)
    for kind, reach in (("BOX", 0), ("BLACKMAN_HARRIS", 1), ("GAUSSIAN", 1)):
        image = s.pixels(view, dot, samples=256, pixel_filter_type=kind)[..., 1]
        lit = np.argwhere(image > 1e-3)
        assert lit.min(axis=0).tolist() == [4 - reach] * 2
        assert lit.max(axis=0).tolist() == [4 + reach] * 2
        np.testing.assert_allclose(image.sum(), 1, atol=0.02)


# --- The border ---------------------------------------------------------------------------------


@pytest.mark.parametrize("pattern", ("SOBOL", "RANDOM", "POISSON"))
def test_a_border_has_the_pixels_of_the_whole_picture(pattern):
    things = s.put(s.sphere(), s.diffuse(0.7)), s.area((2, -2, 3), radiance=4.0), s.world(0.1)
    view = s.camera((0, -3, 0), size=24, width=32)
    whole = s.pixels(view, *things, pattern=pattern)
    part = s.pixels(replace(view, border=(5, 7, 18, 20)), *things, pattern=pattern)
    assert part.shape == (13, 13, 4)
    np.testing.assert_array_equal(part, whole[7:20, 5:18])


# --- Motion -------------------------------------------------------------------------------------

MOVING = (
    ("PERSP", None, (-0.4, 0.5, -0.4, 0.4)),
    ("ORTHO", None, (-2.5, 2.0, -2.5, 2.5)),
    ("PANO", Panorama("EQUIRECTANGULAR"), (0.3, 0.6, 0.4, 0.6)),
    ("PANO", Panorama("FISHEYE_EQUIDISTANT", fov=0.8), (0.0, 1.0, 0.0, 1.0)),
    ("PANO", Panorama("MIRRORBALL"), (0.0, 1.0, 0.0, 1.0)),
)


@pytest.mark.parametrize("aperture", (None, Aperture(0.4, 5.0, blades=5, ratio=1.5)))
@pytest.mark.parametrize(("projection", "panorama", "window"), MOVING)
def test_rays_of_a_camera_that_moves_are_those_of_one_that_rests_where_it_is(
    projection, panorama, window, aperture
):
    """It turns along an arc, zooms and pulls its focus; rays are compared at single times."""
    zoom = 1.0 if projection == "PANO" else 1.4

    def at(time):
        target = (np.sin(1.2 * time), np.cos(1.2 * time), 0.0)
        width = 1 + (zoom - 1) * time
        lens = aperture and replace(aperture, radius=0.4 - 0.1 * time, focus=5 + 4 * time)
        matrix = s.look_at((0, 0, 0), target)
        matrix[:, 3] = (time, 2 * time, 3)
        size = tuple(width * side for side in window)
        return s.Camera(
            matrix, size, 16, 16, projection, clip_start=0.5, aperture=lens, panorama=panorama
        )

    view = replace(at(0.5), motion=(at(0.0), at(0.5), at(1.0)))
    moving = compile_moving_camera(view, BOX, np.zeros(3), None)
    x, y = (each.ravel().astype(F32) for each in np.meshgrid(np.arange(16), np.arange(16)))
    u, v = np.random.default_rng(3).random((2, 256)).astype(F32)
    middle, lens = np.full(256, 0.5, F32), () if aperture is None else (u, v)
    for time in (0.0, 0.3, 0.77, 1.0):
        expected = compile_(at(time)).rays(x, y, middle, middle, *lens)
        found = moving.at(np.full(256, time, F32)).rays(x, y, middle, middle, *lens)
        for one, other in zip(found, expected, strict=True):
            if other is None:
                assert one is None
            else:
                other = np.broadcast_to(other, one.shape)
                np.testing.assert_allclose(one, other, atol=2e-4)
