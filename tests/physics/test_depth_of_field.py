"""lens -> circles of confusion.  Blurred pictures have the size, shape and light of thin lenses."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core.optics import Aperture, Panorama
from tests.support import scenes as s

SIZE, SAMPLES, FOCUS, RADIUS = 64, 512, 4.0, 0.3
SQUARE = 8  # pixels that the spark is wide


def spark(distance, half):
    """A square that faces an eye at the origin which looks along y."""
    return s.put(s.quad((half, 0, 0), (0, 0, half), (0, distance, 0)), s.emission(1.0))


def moments(image):
    """Return the light (in pixels) of a picture, its middle and its variances across and up."""
    light = image[..., 1].astype(float)
    total = light.sum()
    y, x = np.mgrid[: light.shape[0], : light.shape[1]] + 0.5
    middle = np.array([(light * x).sum(), (light * y).sum()]) / total
    spread = np.array([(light * (x - middle[0]) ** 2).sum(), (light * (y - middle[1]) ** 2).sum()])
    return total, middle, spread / total


def gauge(aperture):
    """Return the variances (2,) of points in an opening, right and up."""
    variance = aperture.radius**2 / 4
    if aperture.blades >= 3:
        variance = aperture.radius**2 / 12 * (2 + np.cos(2 * np.pi / aperture.blades))
    return variance * np.array([aperture.ratio**-2, 1.0])


def camera(kind, **more):
    """Return a view along y and how many pixels a radian or a metre takes."""
    if kind == "PERSP":
        view = s.camera((0, 0, 0), (0, 1, 0), size=SIZE, fov=20.0, **more)
        return view, SIZE / (2 * np.tan(np.radians(10)))
    if kind == "ORTHO":
        return s.orthographic((0, 0, 0), (0, 1, 0), size=SIZE, scale=1.5, **more), SIZE / 1.5
    angle = np.radians(20.0) / 2
    panorama = Panorama("EQUIRECTANGULAR", longitude=(-angle, angle), latitude=(-angle, angle))
    matrix = s.look_at((0, 0, 0), (0, 1, 0))
    square = (0.0, 1.0, 0.0, 1.0)
    view = s.Camera(matrix, square, SIZE, SIZE, projection="PANO", panorama=panorama, **more)
    return view, SIZE / (2 * angle)


APERTURES = (
    Aperture(RADIUS, FOCUS),
    Aperture(RADIUS, FOCUS, blades=2),
    Aperture(RADIUS, FOCUS, blades=3, rotation=0.3),
    Aperture(RADIUS, FOCUS, blades=6, rotation=0.1),
    Aperture(RADIUS, FOCUS, ratio=2.0),
    Aperture(RADIUS, FOCUS, blades=4, ratio=0.8),
)


@pytest.mark.parametrize("kind", ("PERSP", "ORTHO", "PANO"))
@pytest.mark.parametrize("distance", (2.5, 9.0))
def test_the_circle_of_confusion_has_the_diameter_of_the_formula(kind, distance):
    """A |d - F| / (d F) of the frame at distance 1; in parallel projection A |d - F| / F."""
    view, pixels = camera(kind, aperture=APERTURES[0])
    scale = pixels if kind == "ORTHO" else pixels / distance
    image = s.pixels(view, spark(distance, SQUARE / 2 / scale), samples=SAMPLES, max_bounces=0)
    total, middle, spread = moments(image)
    np.testing.assert_allclose(total, SQUARE**2, rtol=0.02)  # no light is lost
    np.testing.assert_allclose(middle, SIZE / 2, atol=0.1)

    # Take away the square itself and the pixels; a disk's variance is d^2 / 16
    spread -= (SQUARE**2 + 1) / 12
    diameter = 2 * RADIUS * abs(distance - FOCUS) / FOCUS * scale
    assert diameter > 9
    np.testing.assert_allclose(spread, diameter**2 / 16, rtol=0.03)


@pytest.mark.parametrize("kind", ("PERSP", "ORTHO", "PANO"))
def test_what_is_in_focus_is_as_sharp_as_through_a_pinhole(kind):
    view, pixels = camera(kind, aperture=APERTURES[3])
    scale = pixels if kind == "ORTHO" else pixels / FOCUS
    image = s.pixels(view, spark(FOCUS, 3.5 * 0.999 / scale), samples=8)[..., 1]
    np.testing.assert_array_equal(image[29:35, 29:35], 1)
    np.testing.assert_array_equal(image[:28], 0)
    np.testing.assert_array_equal(image[36:], 0)
    np.testing.assert_array_equal(image[:, :28], 0)
    np.testing.assert_array_equal(image[:, 36:], 0)


@pytest.mark.parametrize("kind", ("PERSP", "ORTHO"))
@pytest.mark.parametrize("aperture", APERTURES, ids=lambda a: f"{a.blades}-{a.ratio}")
def test_what_is_out_of_focus_has_the_shape_of_the_aperture(kind, aperture):
    view, pixels = camera(kind, aperture=aperture)
    scale = pixels if kind == "ORTHO" else pixels / 2.5
    image = s.pixels(view, spark(2.5, SQUARE / 2 / scale), samples=SAMPLES, max_bounces=0)
    total, _, spread = moments(image)
    np.testing.assert_allclose(total, SQUARE**2, rtol=0.02)
    blur = (1.5 / FOCUS * scale) ** 2 * gauge(aperture)
    np.testing.assert_allclose(spread - (SQUARE**2 + 1) / 12, blur, rtol=0.04)


@pytest.mark.parametrize("aperture", APERTURES, ids=lambda a: f"{a.blades}-{a.ratio}")
def test_the_aperture_of_a_fisheye_turns_about_its_axis(aperture):
    """Its first side lies towards the axis: to the right of the middle, across is radial."""
    theta, fov, distance, width = np.radians(50), np.radians(180), 2.5, 0.1
    place = 0.5 + theta / fov
    window = (place - width / 2, place + width / 2, 0.5 - width / 2, 0.5 + width / 2)
    panorama = Panorama("FISHEYE_EQUIDISTANT", fov=fov)
    matrix = s.look_at((0, 0, 0), (0, 1, 0))
    more = {"projection": "PANO", "panorama": panorama, "aperture": aperture}
    view = s.Camera(matrix, window, SIZE, SIZE, **more)

    # Put a square that faces the eye; a radian is longer across than along the rim
    ahead, aside = (np.sin(theta), np.cos(theta), 0), (np.cos(theta), -np.sin(theta), 0)
    pixels = SIZE / width / fov * np.array([1.0, theta / np.sin(theta)])
    half = SQUARE / 2 * distance / pixels
    square = s.quad(half[0] * np.array(aside), (0, 0, half[1]), distance * np.array(ahead))
    lit = s.put(square, s.emission())
    total, _, spread = moments(s.pixels(view, lit, samples=SAMPLES, max_bounces=0))
    np.testing.assert_allclose(total, SQUARE**2, rtol=0.03)
    blur = (1.5 / FOCUS / distance * pixels) ** 2 * gauge(aperture)
    np.testing.assert_allclose(spread - (SQUARE**2 + 1) / 12, blur, rtol=0.05)


def test_before_the_focus_the_picture_of_the_aperture_is_upside_down():
    """A triangle with a corner to the right: it is so behind the focus, and mirrored before it."""
    aperture = Aperture(RADIUS, FOCUS, blades=3, rotation=np.pi / 3)
    view, pixels = camera("PERSP", aperture=aperture)
    third = RADIUS**3 / 40  # the third moment of an equilateral triangle, towards a corner
    for distance in (2.5, 12.0):
        lit = spark(distance, SQUARE / 2 * distance / pixels)
        light = s.pixels(view, lit, samples=SAMPLES, max_bounces=0)[..., 1].astype(float)
        x = np.arange(SIZE) + 0.5 - SIZE / 2
        found = (light * x**3).sum() / light.sum()
        expected = third * (pixels * (1 / FOCUS - 1 / distance)) ** 3
        np.testing.assert_allclose(found, expected, rtol=0.1)


@pytest.mark.parametrize("kind", ("PERSP", "ORTHO", "PANO"))
@pytest.mark.parametrize(("radii", "focuses"), (((0.3, 0.3), (2.0, 7.0)), ((0.4, 0.1), (4.0, 4.0))))
def test_a_lens_that_changes_spreads_light_like_the_mean_of_all_times(kind, radii, focuses):
    """Focus and f-stop while the shutter is open: variances are the mean of those of the disks."""
    view, pixels = camera(kind, aperture=Aperture(9.0, 9.0))
    ends = [Aperture(*lens) for lens in zip(radii, focuses, strict=True)]
    view = replace(view, motion=tuple(replace(view, aperture=end) for end in ends))
    distance = 2.5
    scale = pixels if kind == "ORTHO" else pixels / distance
    image = s.pixels(view, spark(distance, SQUARE / 2 / scale), samples=4096, max_bounces=0)
    total, middle, spread = moments(image)
    np.testing.assert_allclose(total, SQUARE**2, rtol=0.02)
    np.testing.assert_allclose(middle, SIZE / 2, atol=0.1)

    time = (np.arange(1000) + 0.5) / 1000
    radius, focus = (low + (high - low) * time for low, high in (radii, focuses))
    blur = ((radius * (distance - focus) / focus * scale) ** 2).mean() / 4
    assert blur > 3
    np.testing.assert_allclose(spread - (SQUARE**2 + 1) / 12, blur, rtol=0.03)
