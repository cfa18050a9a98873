"""core.camera -> rays where Blender's pixels look, and filters of the right shape."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Settings
from penumbra.core.camera import FILTER_ENTRIES, compile_camera
from tests.support import scenes as s

F32 = np.float32
HALF = np.full(1, 0.5, F32)
BOX = replace(s.DEFAULTS, pixel_filter_type="BOX")


def compile_(camera, settings=BOX, origin=(0, 0, 0), box=None):
    return compile_camera(camera, settings, np.asarray(origin, float), box)


def rays(compiled, x, y):
    """Rays through the middles of pixels x, y."""
    x, y = np.broadcast_arrays(np.asarray(x, F32), np.asarray(y, F32))
    half = np.full(x.size, 0.5, F32)
    return compiled.rays(x.ravel(), y.ravel(), half, half)


def test_perspective_rays_pass_through_the_centres_of_their_pixels():
    view = s.camera((1, 2, 3), (4, 6, 3.5), size=4, width=6, fov=50, clip_start=0.5)
    x, y = np.meshgrid(np.arange(6), np.arange(4))
    origin, direction, far = rays(compile_(view), x, y)
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
    origin, direction, far = rays(compile_(view), x, y)
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
    origin, direction, _ = rays(compile_(moved), (0, 1), (0, 1))
    centre = (origin + direction / np.abs(direction[2:]) * 1).mean(axis=1)
    plain, along, _ = rays(compile_(view), (0, 1), (0, 1))
    before = (plain + along / np.abs(along[2:]) * 1).mean(axis=1)
    scale = 1.1 if kind is s.camera else 1.0  # the near plane and a metre
    np.testing.assert_allclose(centre - before, (0.3 * scale, 0.1 * scale, 0), atol=1e-5)


def test_rays_are_about_the_local_origin():
    far = np.array([1e7, -3e6, 2e7])
    view = s.camera(far + (1, 2, 3), far, clip_start=1e-3)
    near, _, _ = rays(compile_(view, origin=far), 3, 4)
    np.testing.assert_allclose(near[:, 0], (1, 2, 3), atol=2e-3)


@pytest.mark.parametrize("kind", (s.camera, s.orthographic))
def test_clip_end_is_a_depth_and_absent_where_nothing_lies_beyond(kind):
    box = np.array([(-1.0, -1, -1), (1, 1, 1)])
    view = kind((0, 0, 5), clip_start=0.5, clip_end=5.0)
    assert compile_(replace(view, clip_end=6.5), box=box).far is None
    origin, direction, far = rays(compile_(view, box=box), np.arange(8), 0)
    np.testing.assert_allclose((origin + direction * far)[2], 0, atol=1e-5)


@pytest.mark.parametrize("kind", (s.camera, s.orthographic))
def test_what_is_clipped_is_not_seen(kind):
    view = kind((0, 0, 5), size=6)
    things = [s.put(s.quad((9, 0, 0), (0, 9, 0), (0, 0, z)), s.emission(1 + z)) for z in (2, 0)]
    ranges = ((0.1, 100, 3), (3.1, 100, 1), (2.9, 100, 3), (3.1, 4.9, 0), (0.1, 2, 0))
    for start, end, seen in ranges:
        image = s.pixels(replace(view, clip_start=start, clip_end=end), *things)
        np.testing.assert_allclose(image[..., 1], seen, rtol=1e-6)


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
    origin, direction, _ = compiled.rays(zero, zero, last, last)
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
