"""render -> light: furnaces, analytic values, images in mirrors and glass, limits and clamps."""

import numpy as np
import pytest

from penumbra.core import RayKinds, SceneError
from tests.support import scenes as s
from tests.support.statistics import assert_same_mean

DEEP = {
    "max_bounces": 200,
    "diffuse_bounces": 200,
    "glossy_bounces": 200,
    "transmission_bounces": 200,
}
DIRECT = {"max_bounces": 0, "samples": 1, "pattern": "REGULAR"}  # rays through pixel centres
UNSEEN = RayKinds(False, False, False, False)
FLAT_SPHERE = s.sphere(levels=2, smooth=False)
GROUND = s.quad((50, 0, 0), (0, 50, 0))


def centres(size, scale):
    """World x, y (size, size) of the pixel centres of `orthographic` pictures from above."""
    middle = ((np.arange(size) + 0.5) / size - 0.5) * scale
    return np.meshgrid(middle, middle)


# --- Furnaces -----------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", (s.box(), FLAT_SPHERE), ids=("box", "sphere"))
@pytest.mark.parametrize("bounces", (0, 1, 3))
@pytest.mark.parametrize("limit", ("max_bounces", "diffuse_bounces"))
def test_a_closed_furnace_shows_as_many_terms_of_its_series_as_bounces_allow(
    shape, bounces, limit
):
    inside = s.camera((0.1, 0.2, -0.1), (0.5, 0.3, 1), fov=90)
    walls = s.put(shape, s.glowing(0.5, (1.0, 2.0, 3.0)))
    image = s.pixels(inside, walls, samples=2, **{limit: bounces})
    series = sum(0.5**k for k in range(bounces + 2))
    np.testing.assert_allclose(image[..., :3] / (1, 2, 3), series, 1e-5)


@pytest.mark.parametrize("kind", ("diffuse", "mirror"))
def test_a_closed_furnace_converges_to_its_series(kind):
    albedo = 0.8
    material = {"diffuse": s.diffuse, "mirror": s.mirror}[kind](albedo)
    walls = s.Material("Walls", s.shader(material.surface, s.emission().surface))
    inside = s.camera((0.1, 0.2, -0.1), (0.5, 0.3, 1), fov=90)
    assert_same_mean(s.means(inside, s.put(s.box(), walls), **DEEP), 1 / (1 - albedo))


@pytest.mark.parametrize(
    ("shape", "material"),
    ((FLAT_SPHERE, s.diffuse()), (FLAT_SPHERE, s.mirror()), (s.sphere(levels=1), s.mirror())),
    ids=("matte", "mirror", "smooth mirror"),
)
def test_a_white_convex_object_vanishes_in_a_white_world(shape, material):
    image = s.pixels(s.camera((0, -3, 1), size=16), s.put(shape, material), s.world())
    np.testing.assert_allclose(image, 1, 1e-5)


def test_a_white_hollow_vanishes_in_a_white_world():
    bowl = (
        s.quad(),
        s.quad((0, 0, 1), (0, 1, 0), (-1, 0, 1)),
        s.quad((1, 0, 0), (0, 0, 1), (0, 1, 1)),
    )
    view = s.camera((2, -3, 2), (-0.3, 0.3, 0.5), fov=20)
    parts = [s.put(shape, s.diffuse()) for shape in bowl]
    image = s.pixels(view, *parts, s.world(), **DEEP)
    np.testing.assert_allclose(image, 1, 1e-5)


@pytest.mark.parametrize("ior", (1.0, 0.75, 1.5))
@pytest.mark.parametrize("splitting", (True, False))
def test_clear_glass_vanishes_in_a_white_world(ior, splitting):
    things = s.put(FLAT_SPHERE, s.glass(ior)), s.world()
    view = s.camera((0, -3, 1), size=12)
    assert_same_mean(s.means(view, *things, splitting=splitting, **DEEP), 1.0)


@pytest.mark.parametrize("lobes", ("glass", "mixture"))
def test_splitting_does_not_change_the_mean(lobes):
    mixture = s.Material(
        "Mix", s.shader(s.mirror((0.2, 0.5, 0.7)).surface, s.diffuse(0.6).surface, "MixShader", 0.4)
    )
    material = s.glass(1.5, (0.9, 0.7, 0.5)) if lobes == "glass" else mixture
    things = (
        s.put(s.sphere(0.9, 2, smooth=False), material, to_world=s.affine(1.0, (0, 0, 1))),
        s.put(GROUND, s.diffuse(0.5)),
        s.area((1, -1, 3), radiance=5.0),
        s.world(0.3),
    )
    view = s.camera((0, -4, 2), (0, 0, 1))
    one, other = (
        s.means(view, *things, splitting=on, samples=64, max_bounces=6) for on in (True, False)
    )
    assert_same_mean(one, other)


@pytest.mark.parametrize("splitting", (True, False))
def test_a_camera_inside_glass_sees_a_white_world(splitting):
    things = s.put(FLAT_SPHERE, s.glass(1.5)), s.world()
    view = s.camera((0, 0.3, 0), (0, 1, 0.2), fov=100)
    assert_same_mean(s.means(view, *things, splitting=splitting, **DEEP), 1.0)


# --- Lamps over a plane -------------------------------------------------------------------------


def test_a_point_lamp_lights_a_plane_by_the_inverse_square():
    height, intensity, albedo = 2.0, 7.0, 0.6
    things = s.put(GROUND, s.diffuse(albedo)), s.point((0.3, -0.2, height), intensity)
    image = s.pixels(s.orthographic((0, 0, 5), size=8, scale=6), *things, **DIRECT)
    x, y = centres(8, 6)
    squared = (x - 0.3) ** 2 + (y + 0.2) ** 2 + height**2
    np.testing.assert_allclose(
        image[..., 1], albedo / np.pi * intensity * height / squared**1.5, rtol=2e-4
    )


def test_the_sun_lights_a_plane_by_the_cosine():
    towards = np.array([1.0, 0.5, 2.0])
    things = s.put(GROUND, s.diffuse(0.6)), s.sun(towards, (3.0, 2.0, 1.0))
    image = s.pixels(s.orthographic((0, 0, 5), scale=6), *things, **DIRECT)
    cosine = 2 / np.linalg.norm(towards)
    expected = np.array([3, 2, 1]) * 0.6 / np.pi * cosine
    np.testing.assert_allclose(image[..., :3], np.broadcast_to(expected, (8, 8, 3)), 2e-5)


def test_a_spot_lights_its_cone_with_a_smooth_rim_and_nothing_else():
    height, cone, blend = 2.0, np.radians(60), 0.5
    things = (
        s.put(GROUND, s.diffuse()),
        s.spot((0, 0, height), intensity=5.0, spot_angle=cone, spot_blend=blend),
    )
    image = s.pixels(s.orthographic((0, 0, 5), size=16, scale=4), *things, **DIRECT)[..., 1]
    x, y = centres(16, 4)
    distance = np.sqrt(x * x + y * y + height**2)
    cosine = height / distance
    step = np.clip((cosine - np.cos(cone / 2)) / ((1 - np.cos(cone / 2)) * blend), 0, 1)
    expected = 5 / np.pi * cosine / distance**2 * step * step * (3 - 2 * step)
    np.testing.assert_allclose(image, expected, rtol=1e-4, atol=1e-4)
    assert (image[expected == 0] == 0).all()
    assert (expected == 0).sum() > 50


def test_an_occluder_throws_a_hard_shadow_where_geometry_says():
    things = (
        s.put(GROUND, s.diffuse()),
        s.put(s.quad((0.5, 0, 0), (0, 0.5, 0), (0, 0, 1)), s.diffuse()),
        s.point((0, 0, 2), 5.0),
    )
    view = s.orthographic((0, 0, 0.5), size=20, scale=4)  # below the occluder
    image = s.pixels(view, *things, **DIRECT)[..., 1]
    x, y = centres(20, 4)
    shadow = np.maximum(np.abs(x), np.abs(y)) < 1
    assert (image[shadow] == 0).all()
    assert (image[~shadow] > 0).all()


def test_lamps_do_not_light_the_side_that_is_turned_away():
    things = s.put(GROUND, s.diffuse()), s.sun((0, 0, 1)), s.point((0, 0, 1)), s.spot((0, 0, 1))
    below = s.pixels(s.orthographic((0, 0, -5), size=4), *things, **DIRECT)
    assert (below[..., :3] == 0).all()
    assert (below[..., 3] == 1).all()


def test_soft_shadows_of_an_area_lamp_agree_with_its_integral():
    # Half of the square lamp hides behind an edge that stands below its middle.
    lamp = s.area((0, 0, 2), radiance=3.0, size=(0.2, 0.2))
    wall = s.quad((5, 0, 0), (0, 5, 0), (5, 0, 1))
    view = s.orthographic((0, 0, 0.5), size=1, scale=1e-3)
    things = s.put(GROUND, s.diffuse()), s.put(wall, s.diffuse()), lamp
    half = s.means(view, *things, samples=64, max_bounces=0)
    whole = s.means(view, things[0], lamp, samples=64, max_bounces=0)
    assert_same_mean(half, whole.mean() / 2)


@pytest.mark.parametrize("light_samples", (1, 3, 4))
@pytest.mark.parametrize("pattern", ("SOBOL", "POISSON", "JITTERED", "RANDOM", "REGULAR"))
def test_patterns_and_light_samples_agree_in_the_mean(pattern, light_samples):
    things = (
        s.put(GROUND, s.diffuse(0.7)),
        s.put(s.box(0.3), s.diffuse(0.7), to_world=s.affine(1.0, (0, 0, 0.5))),
        s.area((0.5, 0, 2), radiance=4.0),
        s.point((-1, 0, 1), 1.0, radius=0.3),
    )
    view = s.camera((0, -3, 2), (0, 0, 0.3), size=6)
    options = {"samples": 16, "max_bounces": 1}
    one = s.means(view, *things, pattern=pattern, light_samples=light_samples, **options)
    expected = s.means(view, *things, pattern="RANDOM", count=16, **{**options, "samples": 64})
    # A regular grid always looks through the same points of a pixel.
    bias = 0.01 if pattern == "REGULAR" else 1e-6
    assert_same_mean(one, expected, tests=15, bias=bias)


@pytest.mark.parametrize("lamps", (3, 20))
def test_many_lamps_shine_as_much_as_their_sum(lamps):
    # Few lamps each get their shadow rays, of many one is chosen.
    spread = np.linspace(-1, 1, lamps)
    things = [s.point((x, x * x, 1 + x), 1 + x, radius=0.1 * (1 + x)) for x in spread]
    view = s.orthographic((0, 0, 5), size=4, scale=3)
    ground = s.put(GROUND, s.diffuse(0.5))
    expected = sum(s.means(view, ground, lamp, count=4, samples=256).mean() for lamp in things)
    assert_same_mean(s.means(view, ground, *things, samples=64), expected, bias=1e-4)


# --- Images in mirrors and through glass --------------------------------------------------------


def colours(flip):
    """Three glowing squares over the ground, or where a mirror on the ground shows them."""
    sign = -1 if flip else 1
    places = ((-0.6, 0.5, 0.9), (0.1, 0.2, 1.2), (0.7, 0.9, 0.7))
    return [
        s.put(
            s.quad((0.3, 0, 0), (0, 0, 0.3), (x, y, sign * z)),
            s.emission(np.eye(3)[number] + 0.2),
        )
        for number, (x, y, z) in enumerate(places)
    ]


def test_a_mirror_shows_the_mirrored_scene():
    view = s.camera((0, -2, 1.2), (0, 0.5, -0.6), size=24)
    floor = s.put(s.quad((4, 0, 0), (0, 4, 0)), s.mirror((0.5, 0.8, 1.0)))
    image = s.pixels(view, floor, *colours(False))[..., :3]
    mirrored = s.pixels(view, *colours(True))[..., :3] * np.float32([0.5, 0.8, 1.0])
    # Rays next to an edge may fall to its other side.
    same = np.isclose(image, mirrored, rtol=1e-4, atol=1e-6).all(axis=2)
    assert same.mean() > 0.99
    assert mirrored.max() > 0.5
    assert np.unique(np.argmax(mirrored[mirrored.max(axis=2) > 0.5], axis=1)).size == 3


def test_a_slab_of_glass_shifts_what_stands_behind_it_by_snell():
    # A glowing edge at x = 0, seen at an angle: shifted by d sin(angle - inside) / cos(inside).
    angle, thickness, ior = np.radians(50), 0.5, 1.5
    inside = np.arcsin(np.sin(angle) / ior)
    slab = s.put(s.box(), s.glass(ior), to_world=s.affine((9, 9, thickness / 2)))
    glow = s.put(s.quad((5, 0, 0), (0, 5, 0), (5, 0, -1)), s.emission())
    eye = np.array([8 * np.sin(angle), 0, 8 * np.cos(angle) - 1])
    view = s.orthographic(eye, (0, 0, -1), size=400, scale=2, border=(200, 0, 201, 400))
    edges = []
    for things in ((glow,), (glow, slab)):
        image = s.pixels(view, *things, max_bounces=4, samples=1, pattern="REGULAR")
        edges.append((image[:, 0, 1] > 0.3).sum())
    shift = thickness * np.sin(angle - inside) / np.cos(inside)
    assert shift > 0.1
    assert abs(abs(edges[1] - edges[0]) * 2 / 400 - shift) <= 2 / 400


def test_a_viewer_under_water_sees_the_sky_only_within_snells_window():
    # One surface, its outside up; the camera below looks out at a glowing sky.
    water = s.put(s.quad((500, 0, 0), (0, 500, 0)), s.glass(1.33))
    sky = s.put(s.quad((9e3, 0, 0), (0, 9e3, 0), (0, 0, 5)), s.emission())
    view = s.camera((0, 0, -1), (0, 0, 0), size=32, fov=140)
    image = s.pixels(view, water, sky, max_bounces=4, samples=1, pattern="REGULAR")[..., 1]
    x, y = centres(32, 2 * np.tan(np.radians(70)))
    cosine = 1 / np.sqrt(1 + x * x + y * y)
    sine = 1.33 * np.sqrt(1 - cosine**2)
    beyond = np.sqrt(np.maximum(1 - sine**2, 0))
    perpendicular = (1.33 * cosine - beyond) / (1.33 * cosine + beyond)
    parallel = (cosine - 1.33 * beyond) / (cosine + 1.33 * beyond)
    expected = np.where(sine < 1, 1 - (perpendicular**2 + parallel**2) / 2, 0)
    assert (image[expected == 0] == 0).all()
    assert (expected == 0).sum() > 100
    assert (expected > 0.9).sum() > 50
    clear = np.abs(sine - 1) > 0.02
    np.testing.assert_allclose(image[clear], expected[clear], atol=1e-3)


MEETING = {
    "camera": (),
    "glossy": (s.put(s.quad((4, 0, 0), (0, 4, 0)), s.mirror()),),
    "transmission": (s.put(s.quad((4, 0, 0), (0, 4, 0)), s.refraction(1.0)),),
}


@pytest.mark.parametrize("hidden", (None, "camera", "glossy", "transmission"))
@pytest.mark.parametrize("way", MEETING)
@pytest.mark.parametrize("kind", ("point", "sun", "area"))
def test_lamps_are_seen_by_the_kinds_of_ray_they_allow(way, hidden, kind):
    seen_by = RayKinds(**({hidden: False} if hidden else {}))
    up = 1 if way == "glossy" else -1
    lamp = {
        "point": s.point((0, 0, up), 4.0, radius=0.4, seen_by=seen_by, soft_falloff=False),
        "sun": s.sun((0, 0, up), 4.0, angle=0.4, seen_by=seen_by),
        "area": s.area((0, 0, up), (0, 0, 0), 4.0, (0.5, 0.5), seen_by=seen_by),
    }[kind]
    radiance = {"point": 4 / (np.pi * 0.16), "sun": 4 / (np.pi * np.sin(0.2) ** 2), "area": 4.0}
    view = s.camera((0, 0, 0.5), (0, 0, 0), size=4, fov=10)
    image = s.pixels(view, lamp, *MEETING[way])[..., 1]
    expected = 0 if hidden == way else radiance[kind]
    np.testing.assert_allclose(image, expected, rtol=1e-4)


@pytest.mark.parametrize("lamps", (1, 20))
def test_lamps_that_matte_surfaces_do_not_see_do_not_light_them(lamps):
    # Few lamps each get their shadow rays, of many one is chosen.
    lamp = s.point((0, 0, 1), 5.0, seen_by=RayKinds(camera=False, diffuse=False))
    image = s.pixels(s.orthographic((0, 0, 3)), s.put(GROUND, s.diffuse()), *[lamp] * lamps)
    assert image[..., :3].max() == 0


def test_lamps_do_not_light_paths_beyond_their_own_bounce_limit():
    floor = s.put(GROUND, s.diffuse(0.5))
    roof = s.put(s.quad((50, 0, 0), (0, 50, 0), (0, 0, 2)), s.diffuse(0.5))
    view = s.camera((0, 0, 1), (0, 0.1, 0))
    results = [
        s.pixels(view, floor, roof, s.point((0, 0, 1.5), 5.0, max_bounces=limit), max_bounces=total)
        for limit, total in ((0, 3), (1024, 0))
    ]
    np.testing.assert_allclose(*results, rtol=1e-5)


@pytest.mark.parametrize("hidden", (None, "camera", "diffuse", "glossy", "transmission"))
def test_the_world_is_seen_by_the_kinds_of_ray_it_allows(hidden):
    seen_by = RayKinds(**({hidden: False} if hidden else {}))
    sky = s.World("World", s.world().surface, seen_by=seen_by)
    view = s.orthographic((0, 0, 5), size=4, scale=1.0)
    surfaces = {
        "camera": (),
        "diffuse": (s.put(GROUND, s.diffuse()),),
        "glossy": (s.put(GROUND, s.mirror()),),
        "transmission": (s.put(GROUND, s.refraction(1.0)),),
    }
    for way, things in surfaces.items():
        image = s.pixels(view, *things, sky)[..., 1]
        np.testing.assert_allclose(image, 0 if way == hidden else 1, rtol=1e-5, err_msg=way)


# --- Bounce limits ------------------------------------------------------------------------------


def test_without_bounces_there_is_direct_light_only():
    walls = s.put(s.box(), s.diffuse(0.5))
    lamp = s.point((0.2, 0.1, 0.3), 1.0)
    view = s.camera((0, 0, 0), (0, 0, -1), fov=60, size=8)
    image = s.pixels(view, walls, lamp, max_bounces=0, samples=1, pattern="REGULAR")[..., 1]
    x, y = centres(8, 2 * np.tan(np.radians(30)))
    squared = (x - 0.2) ** 2 + (y - 0.1) ** 2 + 1.3**2
    expected = 0.5 / np.pi * 1.3 / squared**1.5
    np.testing.assert_allclose(image, expected, rtol=2e-4)
    more = s.pixels(view, walls, lamp, max_bounces=1, samples=4)[..., 1]
    assert (more > expected * 1.05).all()


@pytest.mark.parametrize("bounces", (0, 1, 3))
@pytest.mark.parametrize("limit", ("glossy_bounces", "max_bounces"))
def test_mirrors_count_by_their_own_limit(limit, bounces):
    # As for matte walls, what follows the last bounce still shows what glows.
    walls = s.Material("Walls", s.shader(s.mirror(0.5).surface, s.emission().surface))
    inside = s.camera((0.1, 0.2, -0.1), (0.5, 0.3, 1), fov=90)
    options = {**DEEP, "diffuse_bounces": 0, "transmission_bounces": 0, limit: bounces}
    image = s.pixels(inside, s.put(s.box(), walls), **options)[..., 1]
    np.testing.assert_allclose(image, sum(0.5**k for k in range(bounces + 2)), 1e-5)


@pytest.mark.parametrize("bounces", (0, 1, 3))
@pytest.mark.parametrize("limit", ("transmission_bounces", "max_bounces"))
def test_refractions_count_by_their_own_limit(limit, bounces):
    pane = s.Material("Pane", s.shader(s.refraction(1.0, 0.5).surface, s.emission().surface))
    panes = [s.put(s.quad((9, 0, 0), (0, 9, 0), (0, 0, -z)), pane) for z in range(9)]
    options = {**DEEP, "diffuse_bounces": 0, "glossy_bounces": 0, limit: bounces}
    image = s.pixels(s.orthographic((0, 0, 5), size=4), *panes, **options)[..., 1]
    np.testing.assert_allclose(image, sum(0.5**k for k in range(bounces + 2)), 1e-5)


def test_behind_the_last_mirror_lamps_light_nothing_but_glowing_things_are_seen():
    floor = s.put(s.quad((4, 0, 0), (0, 4, 0)), s.mirror())
    view = s.camera((0, 0, 0.5), (0, 0, 0), size=4, fov=10)
    lamp = s.point((0, 0, 1), 5.0)
    for roof, seen in ((s.diffuse(), False), (s.emission(), True)):
        things = floor, s.put(s.quad((4, 0, 0), (0, 4, 0), (0, 0, 2)), roof), lamp
        without = s.pixels(view, *things, glossy_bounces=0)[..., 1]
        with_one = s.pixels(view, *things, glossy_bounces=1, max_bounces=1)[..., 1]
        assert (without > 0).all() == seen
        assert (without == 0).all() != seen
        assert (with_one > 0).all()


def test_limits_of_other_kinds_do_not_stop_a_path():
    # Camera, mirror, matte wall, lamp: one reflection, no diffuse bounce.
    things = (
        s.put(s.quad((4, 0, 0), (0, 4, 0)), s.mirror()),
        s.put(s.quad((4, 0, 0), (0, 4, 0), (0, 0, 2)), s.diffuse()),
        s.point((0, 0, 1), 5.0),
    )
    view = s.camera((0, 0, 0.5), (0, 0, 0), size=4, fov=10)
    image = s.pixels(view, *things, diffuse_bounces=0, transmission_bounces=0)[..., 1]
    assert (image > 0).all()


# --- Film ---------------------------------------------------------------------------------------


def test_clamping_bounds_the_mean_of_the_channels_of_a_sample():
    # Twice the clamp, with the hue kept: the limit is three times the clamp for the sum.
    view = s.orthographic((0, 0, 5), size=2, scale=1)
    seen = s.put(GROUND, s.emission((2.0, 4.0, 6.0)))
    image = s.pixels(view, seen, sample_clamp_direct=2.0)
    np.testing.assert_allclose(image[0, 0, :3], (1, 2, 3), rtol=1e-5)
    image = s.pixels(view, seen, sample_clamp_indirect=2.0)
    np.testing.assert_allclose(image[0, 0, :3], (2, 4, 6), rtol=1e-5)

    # Light of lamps at the first hit is direct, after a bounce it is not.
    things = (
        s.put(s.quad((4, 0, 0), (0, 4, 0)), s.mirror()),
        s.put(s.quad((4, 0, 0), (0, 4, 0), (0, 0, 2)), s.diffuse()),
        s.point((0, 0, 1), 50.0),
    )
    view = s.camera((0, 0, 0.5), (0, 0, 0), size=2, fov=10)
    image = s.pixels(view, *things, sample_clamp_direct=2.0)[..., 1]
    assert (image > 10).all()
    image = s.pixels(view, *things, sample_clamp_indirect=2.0, max_bounces=1)[..., 1]
    np.testing.assert_allclose(image, 2.0, rtol=1e-5)
    view = s.orthographic((0, 0, 1.5), (0, 0, 3), size=2, scale=0.1)
    image = s.pixels(view, *things[1:], sample_clamp_direct=2.0, max_bounces=0)[..., 1]
    np.testing.assert_allclose(image, 2.0, rtol=1e-5)


def test_a_transparent_film_shows_how_much_of_a_pixel_is_covered():
    # The quad's edge passes through the middle of the second column of pixels.
    edge = s.put(s.quad((5, 0, 0), (0, 5, 0), (5.25, 0, 0)), s.diffuse())
    view = s.orthographic((0, 0, 5), size=4, scale=4)
    things = edge, s.world(0.7)
    image = s.pixels(view, *things, film_transparent=True, samples=64)
    alpha = image[0, :, 3]
    np.testing.assert_allclose(alpha, (0, 0, 0.75, 1), atol=0.02)
    np.testing.assert_allclose(image[..., 1], 0.7 * image[..., 3], rtol=1e-5)
    opaque = s.pixels(view, *things, film_transparent=False, samples=64)
    np.testing.assert_allclose(opaque[..., :3], 0.7, rtol=1e-5)
    assert (opaque[..., 3] == 1).all()


def test_glass_is_not_transparent_to_the_film():
    image = s.pixels(
        s.camera((0, -3, 0), fov=20, size=4), s.put(FLAT_SPHERE, s.glass()), s.world(),
        film_transparent=True,
    )
    assert (image[..., 3] == 1).all()


def test_exposure_is_a_factor_on_colour_but_not_on_alpha():
    things = s.orthographic((0, 0, 5), scale=2), s.put(s.quad(), s.emission((1, 2, 3)))
    image = s.pixels(*things, film_exposure=2.5)
    np.testing.assert_allclose(image[4, 4], (2.5, 5, 7.5, 1), rtol=1e-6)


@pytest.mark.parametrize("pattern", ("SOBOL", "RANDOM"))
def test_two_sample_subsets_average_to_the_whole(pattern):
    things = (
        s.camera((0, -3, 2), (0, 0, 0.3)),
        s.put(GROUND, s.diffuse(0.7)),
        s.put(FLAT_SPHERE, s.glass(), to_world=s.affine(0.5, (0, 0, 0.5))),
        s.area((0.5, 0, 2), radiance=4.0),
        s.world(0.2),
    )
    options = {"samples": 16, "pattern": pattern, "light_samples": 2}
    whole = s.pixels(*things, **options)
    first, second = (
        s.pixels(
            *things, **options, use_sample_subset=True, sample_offset=offset, sample_subset_length=8
        )
        for offset in (0, 8)
    )
    assert np.abs(first - second).max() > 1e-3
    np.testing.assert_allclose((first + second) / 2, whole, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("pattern", ("POISSON", "JITTERED", "REGULAR"))
def test_patterns_of_a_fixed_size_refuse_sample_subsets(pattern):
    with pytest.raises(SceneError, match=pattern):
        s.pixels(s.camera((0, -3, 0)), pattern=pattern, use_sample_subset=True)
