"""things that move -> what the shutter sees: ramps, arcs, streaks, and rest in a common motion."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Settings, compile_plan
from penumbra.core.scene import Deformation
from penumbra.core.shutter import ENTRIES, compile_shutter
from tests.support import scenes as s
from tests.support.statistics import chi2_probability

GLOW = s.emission(1.0)
BOX = {"pixel_filter_type": "BOX"}


def turn(angle, axis=(0.0, 0.0, 1.0)):
    """The rotation (3, 3) by an angle [rad] about an axis (Rodrigues)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)


def after(linear, shift, matrix):
    """A matrix (3, 4) moved on in the world."""
    return np.hstack([linear @ matrix[:, :3], (linear @ matrix[:, 3] + shift)[:, None]])


def shifted(instance, *shifts):
    """An instance that passes through places at equal steps."""
    keys = [after(np.eye(3), np.array(shift, float), instance.to_world) for shift in shifts]
    return replace(instance, motion=np.array(keys))


def rendered(view, *things, count=16, **settings):
    """The mean (H, W) of the green channel over seeds, and its standard error."""
    every = np.array(
        [s.pixels(view, *things, **settings, seed=seed)[..., 1] for seed in range(count)], float
    )
    return every.mean(axis=0), every.std(axis=0, ddof=1) / np.sqrt(count)


def assert_is(exact, mean, error, slack=1e-3):
    """No pixel is further from the exact value than 5 standard errors and some slack."""
    assert mean.size and (np.abs(mean - exact) < 5 * error + slack).all()


# --- Coverage -----------------------------------------------------------------------------------


def test_a_moving_edge_is_a_ramp():
    size, scale, half, reach = 16, 4.0, 0.5, 1.0
    view = s.orthographic((0, 0, 5), size=size, scale=scale)
    bar = s.put(s.quad(u=(half, 0, 0), v=(0, 10, 0)), GLOW)
    moving = shifted(bar, (-reach, 0, 0), (reach, 0, 0))
    mean, error = rendered(view, moving, samples=64, **BOX)

    fine = ((np.arange(size * 64) + 0.5) / 64 / size - 0.5) * scale
    low, high = np.maximum(fine - half, -reach), np.minimum(fine + half, reach)
    exact = (np.maximum(high - low, 0) / (2 * reach)).reshape(size, 64).mean(axis=1)
    assert_is(exact[None], mean, error)


@pytest.mark.parametrize("steps", [3, 9])
def test_a_turning_blade_goes_along_arcs(steps):
    # Half a turn of a bar about its middle covers each angle once: asin(h / r) on either side.
    size, scale, long, wide = 24, 4.0, 1.8, 0.2
    view = s.orthographic((0, 0, 5), size=size, scale=scale)
    bar = s.put(s.quad(u=(long, 0, 0), v=(0, wide, 0)), GLOW)
    keys = [s.affine(turn(angle)) for angle in np.linspace(0, np.pi, steps)]
    mean, error = rendered(view, replace(bar, motion=np.array(keys)), samples=256, **BOX)

    x, y = s.centres(size * 16, scale)
    radius = np.hypot(x, y)
    exact = 2 * np.arcsin(np.minimum(wide / radius, 1)) / np.pi
    tip = np.arctan2(np.sqrt(np.maximum(radius**2 - long**2, 0)), long)
    exact = np.maximum(exact - 2 * tip * (radius > long) / np.pi, 0)
    exact = exact.reshape(size, 16, size, 16).mean(axis=(1, 3))
    assert_is(exact, mean, error, slack=2e-3)


def test_a_fast_streak_has_no_ghosts():
    view = s.orthographic((0, 0, 5), size=64, scale=4.0, border=(0, 30, 64, 34))
    dot = s.put(s.quad(u=(0.02, 0, 0), v=(0, 2, 0)), GLOW)
    moving = shifted(dot, (-3, 0, 0), (3, 0, 0))
    views = (s.pixels(view, moving, samples=512, seed=seed, **BOX) for seed in range(24))
    columns = np.array([seen[..., 1].mean(axis=0) for seen in views], float)
    assert columns.shape == (24, 64)
    error = columns.std(axis=0, ddof=1) / np.sqrt(24)
    assert_is(0.04 / 6, columns.mean(axis=0), error, slack=1e-4)


def test_a_deforming_edge_is_a_ramp_too():
    # A bar that is stretched to one side: its edge goes straight while the shutter is open.
    size, scale = 16, 4.0
    view = s.orthographic((0, 0, 5), size=size, scale=scale)
    shape = s.quad(u=(0.5, 0, 0), v=(0, 10, 0))
    end = shape.positions + (shape.positions[:, :1] > 0) * np.array([1.0, 0, 0])
    shape = replace(shape, deformation=Deformation(np.stack([shape.positions, end])))
    mean, error = rendered(view, s.put(shape, GLOW), samples=64, **BOX)
    fine = ((np.arange(size * 64) + 0.5) / 64 / size - 0.5) * scale
    exact = np.clip(1.5 - fine, 0, 1) * (fine > -0.5)
    assert_is(exact.reshape(size, 64).mean(axis=1)[None], mean, error)


def test_growth_and_a_mirrored_object_cover_what_they_should():
    # The half width grows from 0 to 1 while the object is inside out.
    size, scale = 16, 4.0
    view = s.orthographic((0, 0, 5), size=size, scale=scale)
    bar = s.put(s.quad(u=(1, 0, 0), v=(0, 10, 0)), GLOW)
    keys = [s.affine((-width, 1, 1)) for width in (1e-9, 1.0)]
    mean, error = rendered(view, replace(bar, motion=np.array(keys)), samples=64, **BOX)
    fine = np.abs(((np.arange(size * 64) + 0.5) / 64 / size - 0.5) * scale)
    exact = np.maximum(1 - fine, 0).reshape(size, 64).mean(axis=1)
    assert_is(exact[None], mean, error)


# --- The shutter --------------------------------------------------------------------------------


def curves():
    x = np.linspace(0, 1, 256)
    return {"ramp": x, "bump": np.sin(np.pi * x) ** 2, "gap": np.where(abs(x - 0.5) < 0.2, 0.0, 1)}


@pytest.mark.parametrize("name", list(curves()))
def test_times_are_spread_as_the_curve_of_the_shutter_says(name):
    curve = curves()[name]
    shutter = compile_shutter(curve, Settings(), 100)
    u = np.random.default_rng(3).random(1 << 17, np.float32)
    times = shutter.open(u, np.zeros_like(u))
    assert times.min() >= 0 and times.max() < 1

    edges = np.linspace(0, 1, 52)  # whose cells are 5 of the curve's straight lines each
    at = np.linspace(0, 1, 255 * 8 + 1)
    density = np.interp(at, np.linspace(0, 1, 256), curve)
    whole = np.concatenate([[0], np.cumsum(density[1:] + density[:-1])])
    expected = np.diff(np.interp(edges, at, whole)) / whole[-1] * u.size
    counts = np.histogram(times, edges)[0]
    # One step of the table crosses what is closed.
    assert counts[expected == 0].sum() <= 2 * u.size / ENTRIES
    assert chi2_probability(counts[expected > 0], expected[expected > 0]) > 1e-4


def test_a_rolling_shutter_exposes_the_top_first():
    settings = Settings(rolling_shutter_type="TOP", rolling_shutter_duration=0.25)
    shutter = compile_shutter(None, settings, 8)
    u = np.array([0.0, 0.5, 1 - 2**-24], np.float32)
    top, low = (shutter.open(u, np.full(3, y, np.float32)) for y in (0.0, 8.0))
    np.testing.assert_allclose(low, 0.25 * (u - 0.5) + 0.125, atol=1e-6)
    np.testing.assert_allclose(top, 0.25 * (u - 0.5) + 0.875, atol=1e-6)


# --- What rests ---------------------------------------------------------------------------------


def test_a_scene_at_rest_has_no_shutter_and_no_time():
    view = s.camera((0, -4, 2))
    ball = s.put(s.sphere(levels=1), s.diffuse(0.5))
    plan = compile_plan(s.scene(view, ball, s.world(), shutter=np.linspace(0, 1, 9)), s.DEFAULTS)
    assert plan.shutter is None and plan.camera_motion is None
    assert plan.triangles.movement is None
    assert [part.traits.moves for part in plan.accel.parts] == [False]


def test_only_what_moves_is_a_part_of_its_own():
    view = s.camera((0, -4, 2))
    ball = s.put(s.sphere(levels=1), s.diffuse(0.5))
    plan = compile_plan(s.scene(view, ball, shifted(ball, (0, 0, 0), (1, 0, 0))), s.DEFAULTS)
    assert [part.traits.moves for part in plan.accel.parts] == [False, True]
    assert plan.triangles.movement.moves.tolist() == [False, True]


# --- A common motion ----------------------------------------------------------------------------


def lime(kind, coordinates):
    """A matte material coloured by where a point is in its object."""
    node = s.node("TexCoord")
    return s.Material(kind, s.node("BsdfDiffuse", Color=s.Link(node, coordinates)))


def still_life():
    """A floor, balls, glass, a coloured pane, lamps of all kinds."""
    pane = s.Material("Pane", s.node("BsdfTransparent", Color=(0.9, 0.5, 0.2)))
    box = s.affine(turn(0.4), (-1.2, 0.3, 0.41))
    place = s.affine
    return [
        s.put(s.quad(u=(4, 0, 0), v=(0, 4, 0)), s.diffuse((0.6, 0.5, 0.4))),
        s.put(s.sphere(levels=3), s.diffuse(0.7), to_world=place(0.6, (0.2, 0.6, 0.6))),
        s.put(s.sphere(levels=3), lime("Object", "Object"), to_world=place(0.4, (1.3, 0, 0.4))),
        s.put(s.box(0.4), lime("Generated", "Generated"), to_world=box),
        s.put(s.box(0.3), lime("Normal", "Normal"), to_world=place((-1, 1, 2), (0.1, -0.9, 0.61))),
        s.put(s.quad(u=(0.5, 0, 0), v=(0, 0.5, 0)), pane, to_world=place(1, (0.7, -0.8, 0.9))),
        s.put(s.sphere(levels=3, radius=0.3), s.mirror(0.8), to_world=place(1, (-0.6, -0.7, 0.3))),
    ]


def lamps():
    return [
        s.point((-2, -2, 3), intensity=4.0, radius=0.2),
        s.area((2, -1, 3), radiance=6.0, size=(0.8, 0.5)),
        s.spot((0, -3, 3), intensity=9.0, spot_angle=0.9),
        s.sun((0.3, 0.2, 1.0), irradiance=0.5, angle=0.1),
    ]


def carried(things, start, end, axis, shift):
    """Things that all go the same way in the same time; the picture is that of things at rest."""
    angles = np.linspace(start[0], end[0], 5)
    parts = np.linspace(start[1], end[1], 5)
    places = parts[:, None] * np.asarray(shift, float)
    keys = [(turn(a, axis), place) for a, place in zip(angles, places, strict=True)]
    moved = []
    for thing in things:
        path = np.array([after(linear, way, thing.to_world) for linear, way in keys])
        if isinstance(thing, s.Camera):
            steps = tuple(replace(thing, to_world=matrix) for matrix in path)
            moved.append(replace(thing, motion=steps))
        else:
            moved.append(replace(thing, motion=path))
    return moved


WAYS = {
    "straight": (((0.0, 0.0), (0.0, 1.0)), (0, 0, 1), (1.0, -2.0, 0.5)),
    "turning": (((-0.3, 0.0), (0.4, 1.0)), (0.3, 1.0, 2.0), (1.0, 0.5, -0.2)),
    "fast": (((0.0, -0.5), (0.1, 0.5)), (0, 0, 1), (300, -200, 10)),
}


# What is far from where it is in the frame is lit as it should be, but many lamps are chosen
# there by what they give here, which takes too many samples to tell.
CASES = [(way, many) for way in WAYS for many in (False, True) if (way, many) != ("fast", True)]


@pytest.mark.parametrize(("way", "many"), CASES)
def test_what_moves_with_the_camera_looks_as_if_at_rest(way, many):
    view = s.camera((0, -6, 3), (0, 0, 0.4), size=16, fov=40)
    lights = lamps()
    if many:
        lights += [s.point((x, y, 2.5), 0.3) for x in (-3, -1, 1, 3) for y in (-3, -1, 1, 3)]
    things, around = [view, *still_life(), *lights], s.world(0.2)
    settings = {"samples": 16, "max_bounces": 3, "splitting": False}
    (start, end), axis, shift = WAYS[way]
    moving = carried(things, start, end, axis, shift)
    still = [s.pixels(*things, around, **settings, seed=seed) for seed in range(12)]
    seen = [s.pixels(*moving, around, **settings, seed=seed) for seed in range(12)]

    # The same numbers give nearly the same paths; where they do not, in the mean it is the same.
    pairs = np.array(seen, float)[..., :3] - np.array(still, float)[..., :3]
    error = pairs.std(axis=0, ddof=1) / np.sqrt(len(pairs))
    assert_is(0.0, pairs.mean(axis=0), error, slack=2e-3)
    whole = pairs.mean(axis=(1, 2, 3))
    error = whole.std(ddof=1) / np.sqrt(len(whole))
    assert abs(whole.mean()) < 4 * error + 1e-4


# What looks around, as the colour of what glows: output, node
TRACED = {
    "occlusion": ("AO", s.node("AmbientOcclusion", Distance=1.0)),
    "own occlusion": (
        "AO",
        s.Node("AmbientOcclusion", "", {"Distance": 1.0}, {"only_local": True}),
    ),
    "bevel": ("Normal", s.node("Bevel", Radius=0.3)),
    "raycast": ("Hit Distance", s.node("Raycast", Length=3.0)),
}


@pytest.mark.parametrize("what", TRACED)
def test_what_looks_around_and_moves_sees_as_if_at_rest(what):
    output, node = TRACED[what]
    shown = s.Material("Shown", s.node("Emission", Color=s.Link(node, output), Strength=1.0))
    view = s.camera((0, -6, 3), (0, 0, 0.4), size=16, fov=40)
    # No lamps: as light, nodes that trace give what they give where nobody may trace.
    things = [view, *(replace(each, materials=(shown,)) for each in still_life())]
    # Bevelled normals are those of the world: they may not turn.
    turns = (0.0, 0.0) if what == "bevel" else (-0.3, 0.4)
    ends = (turns[0], 0.0), (turns[1], 1.0)
    moving = carried(things, *ends, (0.3, 1.0, 2.0), (40.0, 30.0, -20.0))
    settings = {"samples": 16, "max_bounces": 0}
    still = np.array([s.pixels(*things, **settings, seed=seed) for seed in range(8)], float)
    seen = np.array([s.pixels(*moving, **settings, seed=seed) for seed in range(8)], float)
    pairs = (seen - still)[..., :3]
    error = pairs.std(axis=0, ddof=1) / np.sqrt(len(pairs))
    assert still[..., :3].std() > 0.05
    assert_is(0.0, pairs.mean(axis=0), error, slack=5e-3)


def test_nothing_that_moves_shades_itself():
    # A tilted ground of one kilometre under a lamp: a single dark pixel would be a stipple.
    view = s.camera((0, 0, 3), (0.5, 0.5, 0), size=64, fov=60)
    tilt = turn(0.3, (1, 0.4, 0))
    ground = s.put(s.quad(u=(500, 0, 0), v=(0, 500, 0)), s.diffuse(0.8), to_world=s.affine(tilt))
    light = s.sun((0.2, -0.3, 1.0), irradiance=2.0)
    start, end = (0.0, 0.0), (0.5, 1.0)
    things = [view, ground, light]
    still = s.pixels(*things, samples=16, max_bounces=0)
    for axis, shift in (((0, 0, 1), (30, 20, 5)), ((1, 2, 3), (-3, 200, 100))):
        seen = s.pixels(*carried(things, start, end, axis, shift), samples=16, max_bounces=0)
        np.testing.assert_allclose(seen, still, rtol=2e-3, atol=1e-5)


def test_vertices_that_move_look_like_an_object_that_moves():
    view = s.camera((0, -6, 3), (0, 0, 0.4), size=32, fov=40)
    rest = [*lamps(), s.world(0.2), still_life()[0]]
    ball = s.put(s.sphere(levels=3), s.diffuse(0.7), to_world=s.affine(0.6, (0.2, 0.6, 0.6)))
    moving = shifted(ball, (0, 0, 0), (1.2, -0.6, 0.6))
    shape = ball.mesh
    ends = np.stack([shape.positions, shape.positions + np.array([1.2, -0.6, 0.6]) / 0.6])
    normals = None if shape.normals is None else np.stack([shape.normals] * 2)
    bent = replace(ball, mesh=replace(shape, deformation=Deformation(ends, normals)))
    settings = {"samples": 16, "max_bounces": 2}
    one, two = (s.pixels(view, each, *rest, **settings) for each in (moving, bent))
    difference = np.abs(one - two)[..., :3].max(axis=2)
    assert np.mean(difference > 0.02 * one[..., :3].max(axis=2)) < 0.02


def test_what_glows_and_moves_gives_the_light_it_should():
    # A lamp of two triangles over a floor; it goes nowhere, so the floor must not change.
    view = s.orthographic((0, 0, 3), size=8, scale=2.0, clip_start=1.5)
    floor = s.put(s.quad(u=(1, 0, 0), v=(0, 1, 0)), s.diffuse(0.8))
    lamp = s.put(s.quad(u=(0.7, 0, 0), v=(0, -0.7, 0), centre=(0, 0, 2)), s.emission(3.0))
    settings = {"samples": 64, "max_bounces": 0}
    still, _ = rendered(view, floor, lamp, **settings)
    going = shifted(lamp, (0, 0, 0), (0, 0, 0.0))
    mean, error = rendered(view, floor, going, **{**settings, "max_bounces": 1})
    assert_is(still, mean, error)
    assert mean.min() > 0.1
