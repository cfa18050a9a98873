"""core.lights -> energy.  Power, cones, precision at every scale, choice, what rays meet."""

from itertools import product
from math import cos, pi

import numpy as np
import pytest

from penumbra.core.lights import AT_INFINITY, compile_hulls, compile_lights
from penumbra.core.scene import Lamp, RayKinds

F32 = np.float32
BELOW_ONE = F32(1 - 2.0**-24)
ORIGIN = np.zeros(3)


def at(x=0.0, y=0.0, z=0.0, scale=(1.0, 1.0, 1.0)):
    """Blender's matrix (3, 4): a lamp that looks down from there."""
    return np.column_stack([np.diag(scale), [x, y, z]])


def lamp(kind, matrix=None, name="L", strength=(1.0, 1.0, 1.0), **more):
    return Lamp(name, kind, at() if matrix is None else matrix, strength, **more)


def only(made):
    return compile_lights((made,), ORIGIN).single(0)


def squares(side, seed=0):
    """side^2 jittered points u, v (N,) of the unit square, float32."""
    cell = np.stack(np.meshgrid(np.arange(side), np.arange(side))).reshape(2, -1)
    uv = (cell + np.random.default_rng(seed).random(cell.shape)) / side
    return np.minimum(uv.astype(F32), BELOW_ONE)


def columns(*vector, count=1):
    return np.repeat(np.array(vector, F32)[:, None], count, axis=1)


# --- Power ----------------------------------------------------------------------------------------

POWER = {
    "point": (lamp("POINT"), 4 * pi),
    "disk": (lamp("POINT", radius=0.5), None),
    "sphere": (lamp("POINT", radius=0.5, soft_falloff=False), 4 * pi),
    "spot": (lamp("SPOT", spot_angle=1.4, spot_blend=0.0), 2 * pi * (1 - cos(0.7))),
    "spot sphere": (
        lamp("SPOT", radius=0.5, soft_falloff=False, spot_angle=1.4, spot_blend=0.0),
        2 * pi * (1 - cos(0.7)),
    ),
    "rectangle": (lamp("AREA", size=(1, 2)), 2 * pi),
    "ellipse": (lamp("AREA", size=(1, 2), ellipse=True), 2 * pi * pi / 4),
    "rectangle with spread": (lamp("AREA", size=(1, 2), spread=1.5), 2 * pi),
    "ellipse with spread": (lamp("AREA", size=(1, 2), ellipse=True, spread=1.5), 2 * pi * pi / 4),
    "scaled rectangle": (lamp("AREA", at(scale=(2, 3, 9)), size=(1, 2)), 12 * pi),
}


@pytest.mark.parametrize("radius", [5.0, 100.0])
@pytest.mark.parametrize("name", POWER)
def test_all_power_arrives_at_a_sphere_around_the_lamp(name, radius):
    made, power = POWER[name]
    if power is None:  # a disk that turns to each point lights it by I / (d^2 + r^2)
        power = 4 * pi * radius**2 / (radius**2 + 0.25)
    light = only(made)

    # 410 000 points, each with one sample: standard error below 0.3 %
    a, b = squares(640, 1).astype(float)
    z, phi = 1 - 2 * a, 2 * pi * b
    normal = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z])
    u, v = np.random.default_rng(2).random((2, a.size)).astype(F32)
    to_light, gain, *_ = light.kind.sample(light.rows, (radius * normal).astype(F32), u, v)
    cosine = -(normal * to_light).sum(axis=0) / np.linalg.norm(to_light, axis=0)
    arriving = (gain * np.maximum(cosine, 0)).mean() * 4 * pi * radius**2
    assert arriving == pytest.approx(power, rel=0.01)


@pytest.mark.parametrize("angle", [0.0, 1e-4, 0.01, 1.0, 3.0])
def test_a_sun_gives_its_irradiance_whatever_its_angle(angle):
    light = only(lamp("SUN", angle=angle))
    u, v = squares(128)
    to_light, gain, *_ = light.kind.sample(light.rows, columns(0, 0, 0, count=u.size), u, v)
    assert (gain * to_light[2]).mean() == pytest.approx(1, rel=1e-4)
    np.testing.assert_allclose(np.linalg.norm(to_light, axis=0), 1, rtol=1e-6)


@pytest.mark.parametrize("more", [{}, {"ellipse": True}, {"spread": 1.0}, {"spread": 0.0}])
def test_an_area_lamp_is_dark_from_behind(more):
    light = only(lamp("AREA", **more))
    for z in (0.0, 1e-6, 0.3, 5.0):
        point = columns(0.1, 0.1, z, count=3)
        uv = columns(0.2, 0.5, count=3)
        to_light, gain, pdf, _ = light.kind.sample(light.rows, point, *uv, True)
        assert not gain.any() and not pdf.any() and np.isfinite(to_light).all()
        t, gain, pdf = light.kind.intersect(light.rows, point, columns(0, 0, -1, count=3))
        assert np.isinf(t).all() and not gain.any() and not pdf.any()


@pytest.mark.parametrize("full", [pi, float(F32(pi)), 4.0])
def test_180_degrees_in_single_or_double_precision_are_no_spread(full):
    assert only(lamp("AREA", spread=full)).kind.name == "rectangle"
    assert only(lamp("AREA", spread=full, ellipse=True)).kind.name == "ellipse"


@pytest.mark.parametrize("blend", [0.0, 0.15, 1.0])
def test_a_spot_fades_by_smoothstep_of_the_cosine(blend):
    light = only(lamp("SPOT", at(z=2), spot_angle=1.0, spot_blend=blend))
    angle = np.linspace(0, 1.5, 1001)
    angle = angle[np.abs(angle - 0.5) > 1e-5]
    way = np.stack([np.sin(angle), np.zeros_like(angle), -np.cos(angle)])
    point = (way + np.array([[0], [0], [2]])).astype(F32)
    uv = squares(40)[:, : angle.size]
    _, gain, pdf, _ = light.kind.sample(light.rows, point, *uv, True)
    step = (np.cos(angle) - cos(0.5)) / max((1 - cos(0.5)) * blend, 1e-9)
    step = np.clip(step, 0, 1)
    np.testing.assert_allclose(gain, step * step * (3 - 2 * step), atol=2e-3)
    assert not pdf.any()


@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.2, -0.3, 0.1), (0.0, 0.49, 0.0)])
def test_inside_of_a_sphere_all_directions_have_its_radiance(place, kind):
    light = only(lamp(kind, radius=0.5, soft_falloff=False))
    u, v = squares(256)
    point = columns(*place, count=u.size)
    to_light, gain, pdf, _ = light.kind.sample(light.rows, point, u, v, True)
    np.testing.assert_allclose(np.linalg.norm(point + to_light, axis=0), 0.5, atol=1e-6)
    way = to_light / np.linalg.norm(to_light, axis=0)
    assert (gain * np.maximum(way[0], 0)).mean() == pytest.approx(1 / 0.25, rel=2e-3)
    t, radiance, density = light.kind.intersect(light.rows, point, way)
    np.testing.assert_allclose(radiance, 1 / (pi * 0.25), rtol=1e-6)
    np.testing.assert_allclose(t, np.linalg.norm(to_light, axis=0), atol=1e-6)
    np.testing.assert_allclose(density, pdf, rtol=1e-6)


def test_a_ray_that_leads_away_from_a_disk_misses_it_from_as_near_as_can_be():
    light = only(lamp("POINT", radius=0.5))
    t, gain, _ = light.kind.intersect(light.rows, columns(0, 0, -1e-8), columns(0, 0, -1))
    assert np.isinf(t).all() and not gain.any()


# --- Precision ------------------------------------------------------------------------------------


def parallel_rectangle(x, y, z, side):
    """Irradiance of a square of radiance 1 on a parallel surface at (x, y, z) from its centre.

    Lambert's formula, in float64; where it cancels, the far field.
    """
    if side < 1e-3 * np.hypot(z, np.hypot(x, y)):
        return side * side * z * z / (x * x + y * y + z * z) ** 2
    corner = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * side / 2 - np.array([x, y])
    corner = np.column_stack([corner, np.full(4, z)])
    total = 0.0
    for a, b in zip(corner, np.roll(corner, -1, axis=0), strict=True):
        normal = np.cross(a, b)
        length = np.linalg.norm(normal)
        total += np.arctan2(length, a @ b) * normal[2] / length / 2
    return abs(total)


SIZES = [1e-6, 1e-3, 1.0, 30.0, 1e3]
DISTANCES = [1e-3, 0.1, 1.0, 30.0, 1e3, 1e5]


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.4, 0.1), (0.49, 0.49)])
@pytest.mark.parametrize(("side", "z"), list(product(SIZES, DISTANCES)))
def test_irradiance_of_a_square_is_right_at_every_size_and_distance(side, z, offset):
    light = only(lamp("AREA", at(z=z), size=(side, side)))
    x, y = np.array(offset) * side
    u, v = squares(256)
    point = columns(x, y, 0, count=u.size)
    to_light, gain, pdf, _ = light.kind.sample(light.rows, point, u, v, True)
    for array in (to_light, gain, pdf):
        assert array.dtype == F32 and np.isfinite(array).all()
    to_light = to_light.astype(float)
    ours = (gain * to_light[2] / np.linalg.norm(to_light, axis=0)).mean()
    exact = parallel_rectangle(float(F32(x)), float(F32(y)), z, side)
    assert ours == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("z", [1e-5, 1e-4, 1e-3, 1e-2, 0.1])
def test_irradiance_beside_a_square_that_is_seen_at_a_grazing_angle(z):
    light = only(lamp("AREA", at(z=z), size=(1, 1)))
    u, v = squares(512)
    to_light, gain, *_ = light.kind.sample(light.rows, columns(0.7, 0.2, 0, count=u.size), u, v)
    to_light = to_light.astype(float)
    ours = (gain * to_light[2] / np.linalg.norm(to_light, axis=0)).mean()
    assert ours == pytest.approx(parallel_rectangle(0.7, 0.2, z, 1), rel=1e-3)


ALL = {
    **{name: made for name, (made, _) in POWER.items()},
    "beam": lamp("AREA", spread=0.0),
    "narrow": lamp("AREA", spread=0.01),
    "sliver": lamp("AREA", size=(1000.0, 1e-4)),
    "spot disk": lamp("SPOT", radius=0.3),
    "sun": lamp("SUN", angle=0.3),
    "tiny sun": lamp("SUN", angle=1e-7),
    "parallel sun": lamp("SUN"),
}


@pytest.mark.parametrize("name", ALL)
def test_a_sample_tells_its_distance_and_its_pdf_only_if_asked(name):
    light = only(ALL[name])
    rng = np.random.default_rng(3)
    point = rng.normal(0, 2, (3, 500)).astype(F32)
    uv = rng.random((2, 500)).astype(F32)
    to_light, gain, pdf, distance = light.kind.sample(light.rows, point, *uv)
    assert pdf is None
    np.testing.assert_allclose(distance, np.linalg.norm(to_light, axis=0), rtol=2e-5, atol=1e-6)
    asked = light.kind.sample(light.rows, point, *uv, True)
    assert asked.pdf.shape == asked.distance.shape == (500,)
    for a, b in ((asked.to_light, to_light), (asked.gain, gain), (asked.distance, distance)):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e4])
@pytest.mark.parametrize("name", ALL)
def test_nothing_is_ever_not_finite(name, size):
    """Points at the lamp's centre, edges, plane, axis, and the ends of the random numbers."""
    made = ALL[name]
    light = only(
        Lamp(
            "L",
            made.kind,
            made.to_world * size,
            (1.0,) * 3,
            radius=made.radius * size,
            **{
                k: getattr(made, k)
                for k in ("soft_falloff", "angle", "size", "ellipse", "spread", "spot_angle")
            },
        )
    )
    near = [0.0, -0.5, 0.5, 1e-4, 1e-7, -1e-7, 1.0, -1.0, 3e3, -1e6]
    point = np.array(list(product(near, near, near)), F32).T * F32(size)
    with np.errstate(invalid="raise", divide="raise", over="raise"):
        for u, v in product([0.0, 1e-7, 0.25, 0.5, BELOW_ONE], repeat=2):
            uv = columns(u, v, count=point.shape[1])
            sampled = light.kind.sample(light.rows, point, *uv, True)
            assert all(np.isfinite(array).all() for array in sampled)
            _, gain, pdf, distance = sampled
            assert (distance >= 0).all()
            assert (gain >= 0).all() and (pdf >= 0).all()
        for way in [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, 0, 0.8), (0.6, 0.8, 1e-9)]:
            t, gain, pdf = light.kind.intersect(light.rows, point, columns(*way))
            assert not np.isnan(t).any() and np.isfinite(gain).all() and np.isfinite(pdf).all()
            assert (t >= 0).all()


def test_places_are_relative_to_the_origin_before_they_are_rounded():
    far = 1e7 + 0.123
    light = compile_lights((lamp("POINT", at(far, 0, 2)),), np.array([1e7, 0, 0])).single(0)
    assert light.rows[0, 0] == F32(0.123 + 1e7 - 1e7 + (far - 1e7 - 0.123))


# --- Which lamps, which rays ----------------------------------------------------------------------


def test_lamps_that_cannot_shine_are_left_out():
    flat = at(scale=(1, 0, 1))
    dark = [
        lamp("POINT", strength=(0.0, 0.0, 0.0)),
        lamp("AREA", size=(0.0, 1.0)),
        lamp("AREA", flat),
        lamp("AREA", at(scale=(1, 1, 0))),
        lamp("SPOT", flat),
        lamp("SUN", at(scale=(1, 1, 0))),
    ]
    assert compile_lights((), ORIGIN) is None
    assert compile_lights(tuple(dark), ORIGIN) is None
    lights = compile_lights((*dark, lamp("POINT", flat, "last")), ORIGIN)
    assert [lamp.name for _, lamp in lights.lamps] == ["last"]


def scene():
    return compile_lights(
        (
            lamp("AREA", at(z=1), "a", (1.0, 0.0, 0.0), seen_by=RayKinds()),
            lamp("SUN", None, "sun", (0.0, 0.0, 2.0), angle=0.1, seen_by=RayKinds()),
            lamp("POINT", at(z=3), "p", (0.0, 5.0, 0.0), radius=0.5, max_bounces=2),
            lamp("AREA", at(z=2), "b", (0.0, 1.0, 0.0), seen_by=RayKinds(glossy=False)),
        ),
        ORIGIN,
    )


def test_every_light_keeps_its_own_numbers_in_single_and_in_split():
    lights = scene()
    assert sorted(lamp.name for _, lamp in lights.lamps) == ["a", "b", "p", "sun"]
    chosen = np.array([3, 1, 0, 2, 2, 0, 1], np.int32)
    seen = []
    for where, group in lights.split(chosen):
        seen += list(where)
        for column, number in enumerate(chosen[where]):
            alone = lights.single(number)
            assert alone.kind is group.kind and alone.first == number
            np.testing.assert_array_equal(alone.rows[:, 0], group.rows[:, column])
            np.testing.assert_array_equal(alone.colour[:, 0], group.colour[:, column])
            # What all lights of a group have in common is told once
            limits = np.broadcast_to(group.max_bounces, where.shape)
            assert alone.max_bounces[0] == limits[column]
    assert sorted(seen) == list(range(chosen.size))


def test_a_distant_light_is_met_at_infinity_and_nowhere_else():
    light = only(lamp("SUN", angle=0.1))
    t, _, _ = light.kind.intersect(light.rows, columns(0, 0, 0, count=2), columns(0, 0, 1, count=2))
    assert light.kind.DISTANT and (t == AT_INFINITY).all()


def test_hulls_enclose_every_point_that_is_sampled():
    shapes = [ALL[name] for name in ("disk", "sphere", "rectangle", "ellipse", "spot disk")]
    bare = compile_lights((lamp("POINT"), lamp("SUN"), ALL["beam"]), ORIGIN)
    assert compile_hulls(bare, ORIGIN) is None
    lights = compile_lights((*shapes, lamp("POINT")), ORIGIN)
    hulls = compile_hulls(lights, ORIGIN)
    vertices, triangles, owner = hulls.vertices, hulls.corners, hulls.light
    assert vertices.dtype == F32 and triangles.dtype == owner.dtype == np.int32
    for number in set(owner):
        corners = vertices[triangles[owner == number]]
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        light = lights.single(number)
        start = columns(0.3, -0.2, -2, count=4096)
        to_light, *_ = light.kind.sample(light.rows, start, *squares(64))
        points = (start + to_light).T
        assert (points >= low - 1e-6).all() and (points <= high + 1e-6).all()

        # A closed surface has its corners' directions on all sides; outward normals for none flat
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        if len(corners) > 2:
            outward = (normal * (corners.mean(axis=1) - (low + high) / 2)).sum(axis=1)
            assert (outward > 0).all() and np.abs(normal.sum(axis=0)).max() < 1e-5
        else:
            assert np.linalg.norm(normal, axis=1).sum() / 2 == pytest.approx(2)  # 1 x 2
