"""stars -> pictures.  All of their light, wherever they are; what hides, smears and blurs them."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import (
    Aperture,
    Eye,
    Material,
    Mesh,
    Panorama,
    RayKinds,
    SceneError,
    StarField,
    Stars,
    compile_plan,
    render,
)
from penumbra.core.camera import pixel_filter
from penumbra.core.film.film import Film
from penumbra.core.interactive import Asked, Renderer
from penumbra.core.layer import Layer
from penumbra.core.stars.field import make_field
from tests.support import scenes as s
from tests.support.statistics import SIGNIFICANCE

SIZE, DISTANCE, FOV = 32, 4.0, 40.0
VIEW = s.camera((0, -DISTANCE, 0), size=SIZE, fov=FOV)
PIXEL = 2 * np.tan(np.radians(FOV) / 2) / SIZE  # at distance 1
FILTERS = ("BOX", "GAUSSIAN", "BLACKMAN_HARRIS")
FIELD = StarField(5000, 1.0)
RADIUS = 0.03  # of spheres in place of stars


def stars(*positions, intensity=1.0, **more):
    points = Mesh("Points", np.array(positions, float), np.zeros((0, 3), np.int32))
    light = np.broadcast_to(np.float32(intensity), (len(positions), 3)).copy()
    return Stars("Stars", points, s.affine(), light, **more)


def drawn(view, *things, threads=1, more=None, **settings):
    """The picture of stars, instances, a world."""
    own = tuple(thing for thing in things if isinstance(thing, Stars))
    rest = [thing for thing in things if not isinstance(thing, Stars)]
    described = replace(s.scene(view, *rest), stars=own, **(more or {}))
    settings = replace(s.DEFAULTS, **{"samples": 1, **settings})
    return render(compile_plan(described, settings), threads=threads)


def light(view, *things, **settings):
    """The sum (3,) of all pixels."""
    return drawn(view, *things, **settings).combined()[..., :3].sum(axis=(0, 1), dtype=float)


def exact(place, intensity=1.0):
    """The sum of all pixels of a star: irradiance by the solid angle of a pixel there."""
    away = np.array(place, float) - (0, -DISTANCE, 0)
    cosine = away[1] / np.linalg.norm(away)
    return intensity / (away @ away) / (PIXEL**2 * cosine**3)


def moved(thing, *shifts):
    keys = np.stack([thing.to_world] * len(shifts))
    keys[:, :, 3] += np.array(shifts)
    return replace(thing, motion=keys)


def spread(line):
    """The middle and the variance of a row of pixels."""
    place = np.arange(line.size) + 0.5
    middle = (line * place).sum() / line.sum()
    return middle, (line * (place - middle) ** 2).sum() / line.sum()


# --- How bright --------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", FILTERS)
@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.313, 0.2, 0.77), (-1.0, -0.5, 0.4)])
def test_one_sample_has_all_of_the_light(kind, place):
    found = light(VIEW, stars(place, intensity=(1.0, 2.0, 0.5)), pixel_filter_type=kind)
    np.testing.assert_allclose(found, exact(place) * np.array([1.0, 2.0, 0.5]), rtol=1e-5)


@pytest.mark.parametrize("kind", FILTERS)
def test_a_star_is_steady_while_the_camera_moves_by_parts_of_a_pixel(kind):
    left, right, bottom, top = VIEW.window
    shifts = np.random.default_rng(3).random((16, 2)) * PIXEL
    found = [
        light(
            replace(VIEW, window=(left + x, right + x, bottom + y, top + y)),
            stars((0.1, 0, 0.1)),
            pixel_filter_type=kind,
        )[1]
        for x, y in shifts
    ]
    np.testing.assert_allclose(found, exact((0.1, 0, 0.1)), rtol=1e-5)


@pytest.mark.parametrize("width", [0.01, 1.5, 3.0])
@pytest.mark.parametrize("kind", FILTERS)
def test_a_star_has_the_shape_of_the_pixel_filter(kind, width):
    place = (0.313, 0.0, 0.1)
    picture = drawn(VIEW, stars(place), pixel_filter_type=kind, filter_width=width).combined()
    x = place[0] / DISTANCE / PIXEL + SIZE / 2
    line = picture[..., 1].astype(float).sum(axis=0)
    reach, density = pixel_filter(kind, width)
    off = np.arange(SIZE) + 0.5 - x
    shape = np.where(np.abs(off) <= reach, density(off), 0)
    if not shape.any():
        shape[int(x)] = 1
    np.testing.assert_allclose(line / line.sum(), shape / shape.sum(), atol=1e-5)


def panoramic(kind, **more):
    return replace(VIEW, projection="PANO", window=(0, 1, 0, 1), panorama=Panorama(kind), **more)


LENS, EYE = Aperture(0.3, 2.0), Eye(0.1, 5.0)
CAMERAS = {
    "perspective": VIEW,
    "lens": replace(VIEW, aperture=LENS),
    "blades": replace(VIEW, aperture=Aperture(0.3, 2.0, blades=5, rotation=0.3, ratio=1.5)),
    "eye": replace(VIEW, eye=EYE, aperture=LENS),
    "orthographic": s.orthographic((0, -4, 0), size=SIZE, scale=3.0),
    "parallel lens": s.orthographic((0, -4, 0), size=SIZE, scale=3.0, aperture=LENS),
    "equirectangular": panoramic("EQUIRECTANGULAR", aperture=LENS, eye=EYE),
    "cube face": panoramic("EQUIANGULAR_CUBEMAP_FACE", aperture=LENS),
    "mirror ball": panoramic("MIRRORBALL", aperture=LENS),
    "equidistant": panoramic("FISHEYE_EQUIDISTANT", eye=EYE),
    "equisolid": panoramic("FISHEYE_EQUISOLID", aperture=LENS),
    "cylinder": panoramic("CENTRAL_CYLINDRICAL", eye=EYE),
}


SMOOTH = {"pixel_filter_type": "BLACKMAN_HARRIS", "filter_width": 3.0}


def assert_agree(view, star, ball, count=12):
    """A star has the light, the middle and the spread of a small sphere, up to chance."""
    if view.panorama is not None:
        # Look at a tenth of the panorama around it
        image = drawn(view, star, **SMOOTH).combined()[..., 1].astype(float)
        u, v = (spread(image.sum(axis=axis))[0] / SIZE for axis in (0, 1))
        view = replace(view, window=(u - 0.1, u + 0.1, v - 0.1, v + 0.1))

    def facts(picture):
        image = picture[..., 1].astype(float)
        rows = [image.sum(axis=axis) for axis in (0, 1)]
        return np.array([image.sum(), *spread(rows[0]), *spread(rows[1])])

    found = facts(drawn(view, star, **SMOOTH).combined())
    every = np.array(
        [facts(s.pixels(view, ball, samples=512, seed=seed, **SMOOTH)) for seed in range(count)]
    )
    mean, error = every.mean(axis=0), every.std(axis=0, ddof=1) / np.sqrt(count)
    # The size of a sphere, and that it is nearer than its middle, count a little; seven errors of
    # 12 seeds are passed by chance once in 40,000 numbers
    slack = np.array([0.01 * mean[0], 0.03, 0.1, 0.03, 0.1])
    assert (np.abs(found - mean) < 7 * error + slack).all(), (found, mean, error)


@pytest.mark.parametrize("name", CAMERAS)
def test_a_star_is_what_a_small_sphere_converges_to(name):
    place = (0.3, -1.0, 0.2)
    glow = s.emission(1 / (np.pi * RADIUS**2))
    ball = s.put(s.sphere(RADIUS, 4), glow, to_world=s.affine(1.0, place))
    assert_agree(CAMERAS[name], stars(place), ball)


# --- Blur ---------------------------------------------------------------------------------------


def filter_variance():
    reach, density = pixel_filter("BLACKMAN_HARRIS", 1.5)
    x = np.linspace(-reach, reach, 10001)
    return (density(x) * x**2).sum() / density(x).sum()


SHARP = {"pixel_filter_type": "BLACKMAN_HARRIS"}


@pytest.mark.parametrize("what", ("star", "camera"))
def test_a_streak_is_even_and_as_long_as_the_way(what):
    way = 10.37 * PIXEL * DISTANCE
    ends = (-way / 2, 0, 0), (way / 2, 0, 0)
    view, star = VIEW, stars((0, 0, 0))
    if what == "star":
        star = moved(star, *ends)
    else:
        keys = [replace(VIEW, to_world=VIEW.to_world + np.pad([end], ((0, 0), (0, 0))).T
                @ np.array([[0, 0, 0, 1.0]])) for end in ends]  # fmt: skip
        view = replace(VIEW, motion=tuple(keys))
    line = drawn(view, star, **SHARP).combined()[..., 1].astype(float).sum(axis=0)
    np.testing.assert_allclose(line.sum(), exact((0, 0, 0)), rtol=5e-3)  # nearer in the middle
    np.testing.assert_allclose(line[13:19], exact((0, 0, 0)) / 10.37, rtol=0.01)
    middle, variance = spread(line)
    assert abs(middle - SIZE / 2) < 0.01
    np.testing.assert_allclose(variance, 10.37**2 / 12 + filter_variance(), rtol=0.01)


def test_a_bokeh_is_an_even_disk_of_the_formulas_size():
    radius, focus = 0.3, 2.0
    view = replace(VIEW, aperture=Aperture(radius, focus))
    image = drawn(view, stars((0, 0, 0)), **SHARP).combined()[..., 1].astype(float)
    blur = radius * abs(1 / focus - 1 / DISTANCE) / PIXEL
    np.testing.assert_allclose(image.sum(), exact((0, 0, 0)), rtol=0.02)  # the lens is wide
    for axis in (0, 1):
        _, variance = spread(image.sum(axis=axis))
        np.testing.assert_allclose(variance, blur**2 / 4 + filter_variance(), rtol=0.02)
    inside = image[14:18, 14:18] * np.pi * blur**2 / image.sum()
    np.testing.assert_allclose(inside, 1, atol=0.1)


def test_a_rolling_shutter_and_its_curve_treat_stars_like_spheres():
    curve = np.array([0.0, 1.0, 0.5])
    ends = (-0.5, 0, -0.7), (0.5, 0, 0.7)
    glow = s.emission(1 / (np.pi * RADIUS**2))
    ball = moved(s.put(s.sphere(RADIUS, 3), glow), *ends)
    star = moved(stars((0, 0, 0)), *ends)
    for way in ({}, {"rolling_shutter_type": "TOP", "rolling_shutter_duration": 0.2}):
        found = drawn(VIEW, star, more={"shutter": curve}, **way).combined()[..., 1]
        every = []
        for seed in range(12):
            settings = replace(s.DEFAULTS, samples=512, seed=seed, **way)
            plan = compile_plan(s.scene(VIEW, ball, shutter=curve), settings)
            every.append(render(plan, threads=1).combined()[..., 1])
        every = np.array(every, float).reshape(12, 8, 4, SIZE).sum(axis=(2, 3))
        error = every.std(axis=0, ddof=1) / np.sqrt(12)
        found = found.astype(float).reshape(8, 4, SIZE).sum(axis=(1, 2))
        assert (found > 0).sum() >= 2
        assert (np.abs(found - every.mean(axis=0)) < 7 * error + 0.05 * found.max()).all()


# --- What is in the way -------------------------------------------------------------------------


def wall(material=None, y=-1.0, x=0.0, half=0.5, **more):
    """A wall between the camera and a star in the middle."""
    shape = s.quad((half, 0, 0), (0, 0, 0.5), (x, y, 0))
    return replace(s.put(shape, material or s.diffuse()), **more)


def clear(*colour):
    return Material("Clear", s.node("BsdfTransparent", Color=colour))


def through(*walls, view=VIEW, star=None):
    """The share (3,) of a star's light that passes walls."""
    star = star or stars((0.0, 0.0, 0.0))
    return light(view, star, *walls) / light(view, star)


def test_surfaces_hide_stars_as_the_camera_sees_them():
    assert (through(wall()) == 0).all()
    np.testing.assert_allclose(through(wall(y=1.0)), 1, rtol=1e-6)
    np.testing.assert_allclose(through(wall(x=2.0)), 1, rtol=1e-6)
    np.testing.assert_allclose(through(wall(seen_by=RayKinds(camera=False))), 1, rtol=1e-6)
    assert (through(wall(seen_by=RayKinds(shadow=False))) == 0).all()
    assert (through(wall(is_holdout=True)) == 0).all()


def test_transparent_surfaces_dim_stars_by_their_colours():
    one = wall(clear(0.5, 0.25, 0.0))
    np.testing.assert_allclose(through(one), (0.5, 0.25, 0), rtol=1e-5)
    two = wall(clear(0.5, 1.0, 1.0), y=-1.5)
    np.testing.assert_allclose(through(one, two), (0.25, 0.25, 0), rtol=1e-5)
    assert (through(one, wall(y=-1.5)) == 0).all()
    walls = [wall(clear(0.9, 0.9, 0.9), y=-1.0 - k / 10) for k in range(8)]
    np.testing.assert_allclose(through(*walls), 0.9**8, rtol=1e-5)


def test_what_covers_a_part_of_the_lens_or_of_the_time_takes_that_part():
    view = replace(VIEW, aperture=Aperture(0.2, 2.0))
    half = through(wall(x=0.5, y=-2.0), view=view)
    np.testing.assert_allclose(half, 0.5, atol=0.02)
    door = moved(wall(half=1.0), (0.6, 0, 0), (1.6, 0, 0))  # its edge passes at 0.4 of the time
    np.testing.assert_allclose(through(door), 0.6, atol=0.02)


def test_stars_are_clipped_with_the_camera():
    star = stars((0, 0, 0))
    assert light(replace(VIEW, clip_end=3.9), star).sum() == 0
    assert light(replace(VIEW, clip_start=4.1), star).sum() == 0
    assert light(replace(VIEW, clip_start=3.9, clip_end=4.1), star).sum() > 0
    assert light(VIEW, stars((0, -8, 0))).sum() == 0  # behind the camera


# --- The picture around them --------------------------------------------------------------------


def test_light_passes_add_up_and_stars_have_light_groups():
    layer = Layer(
        passes=("Emission", "Environment", "Diffuse Direct", "Diffuse Indirect", "Diffuse Color"),
        light_groups=("A", "W"),
    )
    here = s.world(0.2)
    here = replace(here, stars=replace(FIELD, irradiance=0.01), light_group="W")
    things = stars((0.5, -1, 0.5), light_group="A"), here, wall(s.diffuse(0.5), x=-0.5)
    found = drawn(VIEW, *things, more={"layer": layer}, samples=4)
    passes = {each.name: pixels for each, pixels in found.passes()}
    total = passes["Emission"] + passes["Environment"]
    colour = passes["Diffuse Color"]
    total += colour * (passes["Diffuse Direct"] + passes["Diffuse Indirect"])
    np.testing.assert_allclose(total, found.combined()[..., :3], rtol=1e-4, atol=1e-5)
    one = light(VIEW, stars((0.5, -1, 0.5)))
    np.testing.assert_allclose(passes["Emission"].sum(axis=(0, 1)), one, rtol=1e-4)
    np.testing.assert_allclose(passes["Combined_A"].sum(axis=(0, 1)), one, rtol=1e-4)
    without = drawn(VIEW, replace(here, stars=None), things[2], samples=4, more={"layer": layer})
    plain = {each.name: pixels for each, pixels in without.passes()}
    assert (passes["Combined_W"] - plain["Combined_W"]).max() > 0.1


def test_stars_add_light_and_leave_alpha():
    found = drawn(VIEW, stars((0, 0, 0)), more={"film_transparent": True}).combined()
    assert found[..., 1].sum() > 0
    assert (found[..., 3] == 0).all()
    field = replace(s.world(0.0), stars=FIELD)
    assert light(VIEW, field).sum() > 0
    assert light(VIEW, field, more={"film_transparent": True}).sum() == 0
    assert light(VIEW, replace(field, seen_by=RayKinds(camera=False))).sum() == 0


def test_exposure_counts_and_the_denoiser_does_not_see_stars():
    one = light(VIEW, stars((0, 0, 0)))
    np.testing.assert_allclose(light(VIEW, stars((0, 0, 0)), film_exposure=2.5), 2.5 * one)
    film = Film(2, 1, ("combined",), np.ones((3, 2)), np.array([1, 0]))
    film.stars = {"combined": np.full((3, 2), 5.0)}
    assert film.combined(2.0)[0, :, 0].tolist() == [12.0, 2.0]
    film.denoised = np.full((1, 2, 3), 7.0, np.float32)
    assert film.combined(2.0)[0, :, 0].tolist() == [24.0, 14.0]
    assert film.noisy(1.0)[0, :, 0].tolist() == [6.0, 1.0]
    assert film.sampled(1.0)[0, :, 0].tolist() == [1.0, 1.0]


def test_a_border_shows_a_part_of_the_same_picture():
    many = stars(*np.random.default_rng(0).uniform(-1, 1, (50, 3)))
    whole = drawn(VIEW, many).combined()
    part = drawn(replace(VIEW, border=(5, 7, 21, 19)), many).combined()
    np.testing.assert_array_equal(part, whole[7:19, 5:21])


def test_the_picture_does_not_depend_on_threads():
    random = np.random.default_rng(1)
    view = replace(VIEW, aperture=Aperture(0.05, 2.0))
    many = moved(stars(*random.uniform(-1, 1, (20_000, 3))), (0, 0, 0), (0.1, 0, 0))
    field = replace(s.world(0.0), stars=replace(FIELD, count=20_000))
    things = many, field, wall()
    first, second = (drawn(view, *things, threads=threads) for threads in (1, 4))
    np.testing.assert_array_equal(first.combined(), second.combined())
    np.testing.assert_array_equal(first.film.stars["combined"], second.film.stars["combined"])


def test_the_samples_of_the_picture_do_not_matter():
    view = replace(VIEW, aperture=LENS)
    star = stars((0.2, 0.5, 0))
    pictures = [drawn(view, star, samples=samples).combined() for samples in (1, 7)]
    np.testing.assert_allclose(*pictures, rtol=1e-6)


def test_what_has_no_stars_has_no_plan_for_them():
    for things in ((s.world(1.0),), (stars((0, 0, 0), intensity=0.0),)):
        found = drawn(VIEW, *things)
        assert found.plan.stars is None
        assert found.film.stars is None


def test_a_parallel_viewport_shows_stars_before_the_first_surface():
    view = s.orthographic((0, -4, 0), size=SIZE, scale=3.0)
    scene = replace(s.scene(view, wall(y=0.0)), stars=(stars((0, -3, 0)),))
    renderer = Renderer()
    picture = render(renderer._compile(Asked(scene, s.DEFAULTS), 1))
    renderer.close()
    assert picture.combined()[..., 1].max() > 10


def test_a_render_that_is_stopped_ends():
    stop = threading.Event()
    stop.set()
    scene = replace(s.scene(VIEW), stars=(stars((0, 0, 0)),))
    assert not render(compile_plan(scene, s.DEFAULTS), stop=stop).complete
    ticks = []

    def tick(progress):
        ticks.append(progress.picture().combined())
        return True

    picture = render(compile_plan(scene, s.DEFAULTS), on_tick=tick)
    assert ticks
    assert not picture.complete


# --- The world's --------------------------------------------------------------------------------


def test_a_panorama_has_all_stars_of_the_world_across_its_seam_too():
    view = panoramic("EQUIRECTANGULAR", width=2 * SIZE)
    inner = replace(view, window=(0.0, 1.0, 0.1, 0.9), height=SIZE)  # without the poles
    field = replace(FIELD, count=3000)
    direction, irradiance = make_field(field)
    image = drawn(inner, replace(s.world(0.0), stars=field)).combined()[..., 1].astype(float)
    latitude = (0.1 + 0.8 * (np.arange(SIZE) + 0.5) / SIZE - 0.5) * np.pi
    area = np.cos(latitude) * (2 * np.pi / (2 * SIZE)) * (0.8 * np.pi / SIZE)
    is_in = np.abs(np.arcsin(direction[:, 2])) < 0.4 * np.pi
    np.testing.assert_allclose((image * area[:, None]).sum(), irradiance[is_in, 1].sum(), rtol=0.02)
    # A star in the seam is in the columns at both ends
    behind = np.array([[-0.01, -1.0, 0.0]]) * 3 + (0, -DISTANCE, 0)
    line = drawn(view, stars(*behind), **SHARP).combined()[..., 1].sum(axis=0)
    assert line[0] > 0.2 * line.max()
    assert line[-1] > 0.2 * line.max()


def test_magnitudes_follow_their_law_and_directions_are_even():
    field = StarField(20_000, 2.0, brightest=1.0, faintest=5.0, slope=0.6, spread=0.0)
    direction, light = make_field(field)
    white = light.sum(axis=1) / light.sum(axis=1).max()
    magnitude = 1.0 - 2.5 * np.log10(white)
    below = (10 ** (0.6 * np.sort(magnitude)) - 10**0.6) / (10**3.0 - 10**0.6)
    ranks = (np.arange(20_000) + 0.5) / 20_000
    bound = np.sqrt(-np.log(SIGNIFICANCE / 4 / 2) / 2 / 20_000) + 1e-3
    assert np.abs(below - ranks).max() < bound  # Kolmogorov and Smirnov
    for axis in range(3):
        place = np.sort(direction[:, axis] + 1) / 2
        assert np.abs(place - ranks).max() < bound
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1, rtol=1e-6)


def test_more_stars_leave_the_others_where_they_are_and_another_seed_does_not():
    few, many = (make_field(replace(FIELD, count=count)) for count in (10, 100))
    np.testing.assert_array_equal(few[0], many[0][:10])
    np.testing.assert_array_equal(few[1], many[1][:10])
    assert (make_field(replace(FIELD, count=10, seed=1))[0] != few[0]).all()


def test_the_world_is_as_bright_from_anywhere_and_parallel_rays_miss_it():
    field = replace(s.world(0.0), stars=FIELD)
    there = VIEW.to_world.copy()
    there[:, 3] += 1e4
    here, far = drawn(VIEW, field), drawn(replace(VIEW, to_world=there), field)
    np.testing.assert_allclose(here.combined(), far.combined(), rtol=1e-4, atol=1e-4)
    found = drawn(CAMERAS["orthographic"], field)
    assert found.plan.stars is None
    assert any("orthographic" in note.what for note in found.plan.notes)


@pytest.mark.parametrize("bad", (np.nan, np.inf))
def test_bad_stars_are_named(bad):
    with pytest.raises(SceneError, match="'Stars': the place of star 1"):
        stars((0, 0, 0), (0, bad, 0))
    with pytest.raises(SceneError, match="'Stars': the light of star 0"):
        stars((0, 0, 0), intensity=bad)
    with pytest.raises(SceneError, match="World: its stars"):
        StarField(1, bad)


def test_speeds_from_frame_to_frame_do_not_smear_stars():
    keys = np.array([s.affine(shift=(x, 0, 0)) for x in (-1, 0, 1)])
    still, moving = stars((0.3, 0, 0.2)), stars((0.3, 0, 0.2), motion=keys)
    more = {"spans_frames": True}
    one, two = (drawn(VIEW, each, more=more).combined() for each in (still, moving))
    np.testing.assert_array_equal(one, two)
    assert (drawn(VIEW, moving).combined()[..., 0] > 0).sum() > (one[..., 0] > 0).sum()
