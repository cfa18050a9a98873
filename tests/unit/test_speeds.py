"""Speeds in the picture whose answers are known [pixels per frame]."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import compile_plan, render
from penumbra.core.layer import Layer
from penumbra.core.scene import Deformation, SceneError
from tests.support.passes import from_above, half_clear
from tests.support.scenes import (
    DEFAULTS,
    affine,
    camera,
    diffuse,
    look_at,
    orthographic,
    put,
    quad,
    scene,
)

VECTORS = Layer(passes=("Vector",))
WAYS = (-0.25, 0.125, 0), (0, 0, 0), (0.5, 0, 0)  # at 4 pixels a metre, of `from_above`
SPEED = (-1.0, 0.5, -2.0, 0.0)  # there - here, here - there


def raised(matrix, ways=WAYS):
    """Return a matrix (3, 4) in three frames, moved on in the world."""
    keys = np.repeat(matrix[None], len(ways), axis=0)
    keys[:, :, 3] += ways
    return keys


def moving(thing):
    return replace(thing, motion=raised(thing.to_world))


def panning(view, keys):
    return replace(view, motion=tuple(replace(view, to_world=key) for key in keys))


def plan_of(view, *things, layer=VECTORS, spans_frames=True, **more):
    described = scene(view, *things, layer=layer, spans_frames=spans_frames, **more)
    return compile_plan(described, replace(DEFAULTS, samples=4))


def vectors(*things, **more):
    picture = render(plan_of(*things, **more), threads=1)
    return {each.name: pixels for each, pixels in picture.passes()}["Vector"]


def floor(**more):
    return put(quad((9, 0, 0), (0, 9, 0)), diffuse(0.5), **more)


def test_an_object_that_moves_has_the_way_there_and_the_way_back():
    found = vectors(*from_above(moving(floor())))
    np.testing.assert_allclose(found, np.broadcast_to(SPEED, found.shape), atol=1e-5)


def test_what_rests_below_a_camera_that_moves_goes_the_other_way():
    view, thing = from_above(floor())
    found = vectors(panning(view, raised(view.to_world)), thing)
    expected = -np.array(SPEED)
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=1e-5)


def test_what_moves_with_the_camera_rests_in_the_picture():
    view, thing = from_above(moving(floor()))
    found = vectors(panning(view, raised(view.to_world)), thing)
    np.testing.assert_allclose(found, 0, atol=1e-5)


def test_a_mesh_that_deforms_has_the_ways_of_its_points():
    thing = floor()
    positions = thing.mesh.positions.astype(np.float32)
    keys = np.stack([positions * (1 - 0.1), positions, positions * (1 + 0.2)])
    thing = replace(thing, mesh=replace(thing.mesh, deformation=Deformation(keys)))
    turned = replace(thing, to_world=affine(1, (0.5, 0, 0)))
    view = orthographic((0, 0, 10), size=8, scale=2.0)
    found = vectors(view, turned)
    grown = replace(VECTORS, passes=("Vector", "Position"))
    picture = render(plan_of(view, turned, layer=grown), threads=1)
    where = {each.name: pixels for each, pixels in picture.passes()}["Position"]
    x, y = 4 * (where[..., 0] - 0.5), 4 * where[..., 1]  # from the middle of the growth
    expected = np.stack([-0.1 * x, -0.1 * y, -0.2 * x, -0.2 * y], axis=-1)
    np.testing.assert_allclose(found, expected, atol=0.11)  # samples are about a pixel's middle
    np.testing.assert_allclose(found.mean((0, 1)), expected.mean((0, 1)), atol=0.02)


def test_an_object_that_turns_goes_around_its_own_origin():
    thing = floor()
    keys = np.stack([affine(1, (0, 0, 0))] * 3)
    angle = 0.3
    keys[2, :2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    view = orthographic((0, 0, 10), size=8, scale=2.0)
    found = vectors(view, replace(thing, motion=keys))
    x, y = np.meshgrid((np.arange(8) - 3.5), (np.arange(8) - 3.5))
    gone_x = x - (np.cos(angle) * x - np.sin(angle) * y)
    gone_y = y - (np.sin(angle) * x + np.cos(angle) * y)
    np.testing.assert_allclose(found[..., :2], 0, atol=1e-5)
    np.testing.assert_allclose(found[..., 2], gone_x, atol=0.2)
    np.testing.assert_allclose(found[..., 3], gone_y, atol=0.2)
    assert np.corrcoef(found[..., 2].ravel(), gone_x.ravel())[0, 1] > 0.99


def test_the_surroundings_turn_and_do_not_shift():
    view = camera((0, 0, 5), (0, 4, 5), size=32)
    left, right = view.window[:2]
    angle = 0.05
    keys = np.stack([look_at((0, 0, 5), (4 * np.sin(a), 4 * np.cos(a), 5)) for a in (0, 0, angle)])
    keys[0, :, 3] += 3.0  # a way that nothing far away shows
    found = vectors(panning(view, keys))
    across = (np.arange(32) + 0.5) / 32 * (right - left) + left
    expected = (across - np.tan(np.arctan(across) - angle)) * 32 / (right - left)
    assert np.ptp(expected) > 0.05
    np.testing.assert_allclose(found[16, :, 2], expected, atol=0.02)
    np.testing.assert_allclose(found[..., :2], 0, atol=1e-4)


def test_surfaces_below_the_threshold_show_what_moves_behind_them():
    clear, solid = (
        put(quad((9, 0, 0), (0, 9, 0), (0, 0, 4)), half_clear(share), name="Veil")
        for share in (0.7, 0.3)
    )
    assert not vectors(*from_above(moving(clear), floor())).any()
    found = vectors(*from_above(moving(solid), floor()))
    np.testing.assert_allclose(found, np.broadcast_to(SPEED, found.shape), atol=1e-5)
    alone = vectors(*from_above(moving(solid)))  # what is far behind it does not count besides
    np.testing.assert_allclose(alone, found, atol=1e-5)


def test_nothing_is_blurred_by_what_only_tells_speeds():
    edge = put(quad((1, 0, 0), (0, 9, 0), (1, 0, 1)), diffuse(0.5), name="Edge")
    view, *things = from_above(moving(edge), floor())
    moved = plan_of(panning(view, raised(view.to_world)), *things)
    still = plan_of(view, edge, floor(), layer=Layer(), spans_frames=False)
    assert moved.shutter is None and moved.camera_motion is None
    assert moved.triangles.movement is None and not moved.triangles.objects.moves.any()
    assert still.speeds is None and still.triangles.frames is None and still.ledger is None
    one, other = (render(plan, threads=1).combined() for plan in (moved, still))
    np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-6)


def test_with_motion_blur_the_pass_is_blank():
    assert not vectors(*from_above(moving(floor())), spans_frames=False).any()


def test_a_camera_with_two_frames_is_refused():
    view, thing = from_above(floor())
    with pytest.raises(SceneError, match="three steps"):
        plan_of(panning(view, raised(view.to_world)[:2]), thing)
