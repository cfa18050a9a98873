"""core.optics.panoramas -> the directions that each map is defined by, and its inverse."""

import numpy as np
import pytest

from penumbra.core.optics import PANORAMAS, Panorama, panoramas

F32 = np.float32
COUNT = 4000
LENS = Panorama("FISHEYE_EQUISOLID", fov=3.0, lens=9.0, sensor=(30.0, 22.0))
K = (-0.01, -0.06, -0.001, 2e-5, -3e-6)
MAPS = (
    Panorama("EQUIRECTANGULAR"),
    Panorama("EQUIRECTANGULAR", longitude=(-1.0, 2.0), latitude=(-0.4, 1.3)),
    Panorama("EQUIANGULAR_CUBEMAP_FACE"),
    Panorama("MIRRORBALL"),
    Panorama("FISHEYE_EQUIDISTANT", fov=4.0),
    LENS,
    Panorama("FISHEYE_LENS_POLYNOMIAL", fov=2.9, sensor=(30.0, 22.0), polynomial=K),
    Panorama("CENTRAL_CYLINDRICAL", around=(-1.0, 2.0), height=(-0.5, 1.5)),
)


def places(count=COUNT):
    u, v = np.random.default_rng(7).random((2, count))
    return u, v


def expected(p, u, v):
    """Return in float64 the directions (n, 3) that the map is defined by, and which exist."""
    if p.kind == "EQUIRECTANGULAR":
        # To the right is east, and west is to the left of x, where y points
        longitude = p.longitude[0] + u * (p.longitude[1] - p.longitude[0])
        latitude = p.latitude[0] + v * (p.latitude[1] - p.latitude[0])
        east, north = np.array([0, -1.0, 0]), np.array([0, 0, 1.0])
        level = np.cos(longitude)[:, None] * [1, 0, 0] + np.sin(longitude)[:, None] * east
        return np.cos(latitude)[:, None] * level + np.sin(latitude)[:, None] * north, None
    if p.kind == "EQUIANGULAR_CUBEMAP_FACE":
        # Where the face of a cube of half size 1 is hit: equal steps are equal angles
        hit = np.stack([np.ones_like(u), np.tan(np.pi / 4 - u * np.pi / 2)], axis=1)
        hit = np.column_stack([hit, np.tan(v * np.pi / 2 - np.pi / 4)])
        return hit / np.linalg.norm(hit, axis=1, keepdims=True), None
    if p.kind == "MIRRORBALL":
        # A distant viewer who looks along y sees a ball: mirror the view about its normal
        x, z = 2 * u - 1, 2 * v - 1
        inside = x**2 + z**2 <= 1
        normal = np.column_stack([x, -np.sqrt(np.maximum(1 - x**2 - z**2, 0)), z])
        view = np.array([0, 1.0, 0])
        return view - 2 * (normal @ view)[:, None] * normal, inside
    if p.kind == "CENTRAL_CYLINDRICAL":
        longitude = p.around[0] + u * (p.around[1] - p.around[0])
        z = p.height[0] + v * (p.height[1] - p.height[0])
        hit = np.column_stack([np.cos(longitude), -np.sin(longitude), z])
        return hit / np.linalg.norm(hit, axis=1, keepdims=True), None

    # Fisheyes: the angle off the axis by the distance from the middle
    scale = (2.0, 2.0) if p.kind == "FISHEYE_EQUIDISTANT" else p.sensor
    x, y = (u - 0.5) * scale[0], (v - 0.5) * scale[1]
    r = np.hypot(x, y)
    if p.kind == "FISHEYE_EQUIDISTANT":
        theta = r * p.fov / 2
    elif p.kind == "FISHEYE_EQUISOLID":
        theta = 2 * np.arcsin(np.minimum(r / 2 / p.lens, 1))
        theta = np.where(r > 2 * p.lens, np.pi, theta)
    else:
        theta = -np.polynomial.polynomial.polyval(r, p.polynomial)
    aside = np.column_stack([np.zeros_like(x), -x, y]) / np.maximum(r, 1e-12)[:, None]
    direction = np.cos(theta)[:, None] * [1, 0, 0] + np.sin(theta)[:, None] * aside
    limit = 1.0 if p.kind == "FISHEYE_EQUIDISTANT" else None
    return direction, (r <= limit) if limit else np.abs(theta) <= p.fov / 2


def name(p):
    return p.kind.lower()


@pytest.mark.parametrize("p", MAPS, ids=name)
def test_a_place_on_the_picture_looks_where_the_map_says(p):
    u, v = places()
    direction, inside = panoramas.direction(p, u.astype(F32), v.astype(F32))
    assert direction.dtype == F32
    assert np.isfinite(direction).all()
    wanted, exist = expected(p, u.astype(F32).astype(float), v.astype(F32).astype(float))
    if exist is None:
        assert inside is None
        exist = np.ones(u.size, bool)
    else:
        assert (inside != exist).sum() <= 1  # by rounding
        assert 0.05 < exist.mean() < 0.999
        exist = exist & inside
    unit = direction / np.linalg.norm(direction, axis=0)
    # At the rim of the mirror ball a little step is a long way
    atol = 2e-3 if p.kind == "MIRRORBALL" else 3e-6
    np.testing.assert_allclose(unit.T[exist], wanted[exist], atol=atol)
    assert np.median(np.abs(unit.T - wanted)[exist]) < 2e-7


@pytest.mark.parametrize("p", MAPS, ids=name)
def test_a_direction_is_found_again_on_the_picture(p):
    u, v = places()
    direction, inside = panoramas.direction(p, u.astype(F32), v.astype(F32))
    direction /= np.linalg.norm(direction, axis=0)
    again = np.stack(panoramas.place(p, direction))
    if inside is not None:
        again, u, v = again[:, inside], u[inside], v[inside]
    np.testing.assert_allclose(again, np.stack([u, v]), atol=3e-5)


@pytest.mark.parametrize("p", MAPS, ids=name)
def test_every_direction_has_a_finite_place(p):
    axes = np.concatenate([np.eye(3), -np.eye(3)], axis=1).astype(F32)
    assert np.isfinite(np.stack(panoramas.place(p, axes))).all()
    assert np.isfinite(panoramas.direction(p, *np.full((2, 1), 0.5, F32))[0]).all()


def test_all_maps_are_tested():
    assert {p.kind for p in MAPS} == set(PANORAMAS)


def test_the_middle_of_a_picture_looks_ahead():
    half = np.full((2, 1), 0.5, F32)
    for kind in PANORAMAS:
        ahead = (0, -1, 0) if kind == "MIRRORBALL" else (1, 0, 0)
        direction, _ = panoramas.direction(Panorama(kind, polynomial=(0, -0.1, 0, 0, 0)), *half)
        np.testing.assert_allclose(direction[:, 0], ahead, atol=1e-6)


def test_ranges_that_are_empty_have_a_finite_place():
    p = Panorama("EQUIRECTANGULAR", longitude=(1.0, 1.0), latitude=(0.5, 0.5))
    assert np.isfinite(np.stack(panoramas.place(p, np.eye(3, dtype=F32)))).all()
