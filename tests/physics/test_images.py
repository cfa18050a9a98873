"""mirrors, glass, lamps, world -> what is seen of them, where, and by which kinds of ray."""

import numpy as np
import pytest

from penumbra.core import RayKinds
from tests.support import scenes as s

GROUND = s.quad((50, 0, 0), (0, 50, 0))


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
    x, y = s.centres(32, 2 * np.tan(np.radians(70)))
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
