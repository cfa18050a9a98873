"""core.lights -> Cycles' light.  Golden values; what is sampled is what is met."""

from math import pi, sin

import numpy as np
import pytest

from penumbra.core.lights import compile_lights
from penumbra.core.scene import Lamp

F32 = np.float32
BELOW_ONE = F32(1 - 2.0**-24)


def place(at=(0.0, 0.0, 2.0), euler=(0.0, 0.0, 0.0), scale=(1.0, 1.0, 1.0)):
    """Blender's matrix (3, 4) of location, XYZ rotation [rad] and scale."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(euler), np.sin(euler)
    x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.column_stack([z @ y @ x * np.array(scale), np.array(at)])


TILT = (0.2, 0.1, 0.3)


def lamp(kind, strength=1.0, matrix=None, **more):
    return Lamp("L", kind, place() if matrix is None else matrix, (strength,) * 3, **more)


def only(made, origin=(0.0, 0.0, 0.0)):
    """The compiled lamp, seen by all points."""
    return compile_lights((made,), np.array(origin, float)).single(0)


def squares(side, seed=0):
    """side^2 jittered points u, v (N,) of the unit square."""
    cell = np.stack(np.meshgrid(np.arange(side), np.arange(side))).reshape(2, -1)
    return np.minimum((cell + np.random.default_rng(seed).random(cell.shape)) / side, BELOW_ONE)


def at(point, count):
    return np.repeat(np.array(point, F32)[:, None], count, axis=1)


def irradiance(light, point, side=256, normal=(0.0, 0.0, 1.0)):
    """Estimate what a lamp of one unit of strength gives to a surface, from side^2 samples."""
    u, v = squares(side).astype(F32)
    to_light, gain, *_ = light.kind.sample(light.rows, at(point, u.size), u, v)
    to_light = to_light.astype(float)
    cosine = np.tensordot(normal, to_light, 1) / np.maximum(np.linalg.norm(to_light, axis=0), 1e-30)
    return (gain * np.maximum(cosine, 0)).mean()


# --- Golden values: radiance of a white plane z = 0 under 100 W (sun: 3 W/m2), Cycles 5.2.3, ------
# --- 4 million samples each --------------------------------------------------------------------

CENTRE, NEAR_BY, ASIDE, FAR = (0, 0, 0), (0.7, 0.3, 0), (1.5, -0.4, 0), (4, 0, 0)
TILTED = place(euler=TILT)
STRETCHED = place(euler=TILT, scale=(2, 0.7, 1.3))
INTENSITY = 100 / (4 * pi)
SPOT = {"matrix": place(euler=(0.2, 0.1, 0)), "spot_angle": 1.2}
GOLDEN = {
    "point": (lamp("POINT", INTENSITY), {CENTRE: 0.633257, NEAR_BY: 0.516857, FAR: 0.0566398}),
    "disk": (
        lamp("POINT", INTENSITY, radius=0.5),
        {CENTRE: 0.596007, NEAR_BY: 0.490102, FAR: 0.0559405},
    ),
    "big disk": (lamp("POINT", INTENSITY, radius=1.5), {CENTRE: 0.405286, NEAR_BY: 0.346588}),
    "sphere": (
        lamp("POINT", INTENSITY, radius=1.5, soft_falloff=False),
        {CENTRE: 0.633257, NEAR_BY: 0.516857, ASIDE: 0.312167, FAR: 0.05664},
    ),
    "scaled point": (
        lamp("POINT", INTENSITY, place(scale=(3, 2, 0.5)), radius=0.5),
        {CENTRE: 0.596007, FAR: 0.0559405},
    ),
    "hard spot": (
        lamp("SPOT", INTENSITY, radius=0.4, spot_blend=0.0, **SPOT),
        {CENTRE: 0.608902, NEAR_BY: 0.488735, ASIDE: 0},
    ),
    "soft spot": (
        lamp("SPOT", INTENSITY, spot_blend=1.0, **SPOT),
        {CENTRE: 0.598505, NEAR_BY: 0.234094, ASIDE: 0},
    ),
    "spot sphere": (
        lamp("SPOT", INTENSITY, radius=0.4, soft_falloff=False, **SPOT),
        {CENTRE: 0.633257, NEAR_BY: 0.476812, ASIDE: 0},
    ),
    "wide spot": (
        lamp("SPOT", INTENSITY, radius=0.1, spot_blend=0.5, spot_angle=3.1),
        {CENTRE: 0.631678, FAR: 0.0539868},
    ),
    "stretched spot": (
        lamp("SPOT", INTENSITY, STRETCHED, radius=0.1, spot_blend=0.5, spot_angle=1.2),
        {CENTRE: 0.630988, NEAR_BY: 0.50319, ASIDE: 0},
    ),
    "parallel sun": (lamp("SUN", 3, place(euler=(0.4, 0.2, 0))), {CENTRE: 0.862013}),
    "sun": (lamp("SUN", 3, place(euler=(0.4, 0.2, 0)), angle=0.5), {CENTRE: 0.862017}),
    "sun, half the sky": (
        lamp("SUN", 3, place(euler=(0.4, 0.2, 0)), angle=3.14159),
        {CENTRE: 0.908475},
    ),
    "square": (
        lamp("AREA", 100 / (pi * 0.64), TILTED, size=(0.8, 0.8)),
        {CENTRE: 2.35643, NEAR_BY: 1.7911, ASIDE: 0.831733, FAR: 0.0689782},
    ),
    "rectangle": (
        lamp("AREA", 100 / (pi * 0.4), TILTED, size=(0.8, 0.5)),
        {CENTRE: 2.38812, NEAR_BY: 1.81488, ASIDE: 0.831048, FAR: 0.0691204},
    ),
    "disk lamp": (
        lamp("AREA", 100 / (pi * pi * 0.16), TILTED, size=(0.8, 0.8), ellipse=True),
        {CENTRE: 2.38379, NEAR_BY: 1.80048, ASIDE: 0.828041, FAR: 0.0687245},
    ),
    "ellipse": (
        lamp("AREA", 100 / (pi * pi * 0.1), TILTED, size=(0.8, 0.5), ellipse=True),
        {CENTRE: 2.40809, NEAR_BY: 1.81832, ASIDE: 0.827638, FAR: 0.0688306},
    ),
    "stretched ellipse": (
        lamp("AREA", 100 / (pi * pi * 0.1 * 1.4), STRETCHED, size=(0.8, 0.5), ellipse=True),
        {CENTRE: 2.29169, NEAR_BY: 1.82196, ASIDE: 0.853771, FAR: 0.0717509},
    ),
    "spread of 90 degrees": (
        lamp("AREA", 100 / (pi * 0.4), TILTED, size=(0.8, 0.5), spread=pi / 2),
        {CENTRE: 8.35141, NEAR_BY: 4.10682, ASIDE: 0.026951, FAR: 0},
    ),
    "ellipse, 90 degrees": (
        lamp("AREA", 100 / (pi * pi * 0.1), TILTED, size=(0.8, 0.5), ellipse=True, spread=pi / 2),
        {CENTRE: 8.48555, NEAR_BY: 4.08665, FAR: 0},
    ),
    "narrow spread": (
        lamp("AREA", 100 / (pi * 0.4), TILTED, size=(0.8, 0.5), spread=0.08),
        {(-0.312, 0.33, 0): 77.6513, (-0.212, 0.38, 0): 77.6513, CENTRE: 0},
    ),
    "beam": (
        lamp("AREA", 100 / (pi * 0.4), TILTED, size=(0.8, 0.5), spread=0.0),
        {(-0.312, 0.33, 0): 77.6016, (-0.212, 0.38, 0): 77.6016, CENTRE: 0},
    ),
    "huge and near": (
        lamp("AREA", 100 / (pi * 400), place((0, 0, 0.05)), size=(20, 20)),
        {CENTRE: 0.079576, (9.99, 0, 0): 0.047582},
    ),
    "upright": (
        lamp("AREA", 100 / pi, place((0, 0, 0.5), (pi / 2, 0, 0))),
        {(0, 0.2, 0): 11.154, (0, 1, 0): 2.2629, (0, -1, 0): 0, (3, 2, 0): 0.0577655},
    ),
}


@pytest.mark.parametrize("name", GOLDEN)
def test_a_lamp_lights_a_white_plane_as_in_cycles(name):
    made, values = GOLDEN[name]
    light = only(made)
    for point, value in values.items():
        ours = made.strength[0] * irradiance(light, point, 512) / pi
        # both have noise where a cone's or a lamp's edge is seen
        assert ours == pytest.approx(value, rel=5e-4, abs=1e-9), point


def test_a_spread_of_90_degrees_is_4_64_times_brighter_on_axis():
    full, narrow = (only(lamp("AREA", size=(0.01,) * 2, spread=s)) for s in (pi, pi / 2))
    assert irradiance(narrow, CENTRE) / irradiance(full, CENTRE) == pytest.approx(4.65, abs=0.02)
    assert 1 / (1 - pi / 4) == pytest.approx(4.66, abs=0.01)


# --- Densities ------------------------------------------------------------------------------------

KINDS = {
    "rectangle": lamp("AREA", matrix=STRETCHED, size=(0.8, 1.5)),
    "rectangle with spread": lamp("AREA", matrix=STRETCHED, size=(0.8, 1.5), spread=2.6),
    "ellipse": lamp("AREA", matrix=STRETCHED, size=(0.8, 1.5), ellipse=True),
    "ellipse with spread": lamp("AREA", matrix=TILTED, size=(0.8, 1.5), ellipse=True, spread=2.6),
    "disk": lamp("POINT", radius=0.5),
    "sphere": lamp("POINT", radius=0.5, soft_falloff=False),
    "spot disk": lamp("SPOT", radius=0.5, spot_angle=2.0, matrix=STRETCHED),
    "spot sphere": lamp("SPOT", radius=0.5, soft_falloff=False, spot_angle=2.0),
    "sun": lamp("SUN", angle=0.6, matrix=TILTED),
    "sun of 1 degree": lamp("SUN", angle=0.0175, matrix=TILTED),
}
POINTS = {"far": (3, -2, -20), "middle": (0.5, 0.3, 0.2), "near": (0.1, -0.1, 1.4)}


@pytest.mark.parametrize("where", POINTS)
@pytest.mark.parametrize("name", KINDS)
def test_a_ray_along_a_sample_meets_the_lamp_with_the_same_density(name, where):
    light = only(KINDS[name])
    u, v = squares(64).astype(F32)
    point = at(POINTS[where], u.size)
    to_light, gain, pdf, length = light.kind.sample(light.rows, point, u, v, True)
    sent = np.flatnonzero((gain > 0) & (np.minimum(u, v) > 1e-3) & (np.maximum(u, v) < 0.999))
    assert sent.size > u.size / 20

    distance = np.linalg.norm(to_light, axis=0)
    np.testing.assert_allclose(length[sent], distance[sent], rtol=1e-5)
    t, radiance, density = light.kind.intersect(light.rows, point, to_light / distance)
    assert np.isfinite(t[sent]).mean() > 0.999, "samples that the ray misses"
    sent = sent[np.isfinite(t[sent])]
    # single precision: a spot's edge and a grazed disk multiply its error
    np.testing.assert_allclose(density[sent], pdf[sent], rtol=2e-3)
    np.testing.assert_allclose(
        radiance[sent], gain[sent] * pdf[sent], rtol=2e-3, atol=1e-3 * radiance.max()
    )
    if not light.kind.DISTANT:
        np.testing.assert_allclose(t[sent], distance[sent], rtol=2e-3)


def chart(made, point):
    """Functions square (2, N) -> direction and back, that cover what a point sees of a lamp."""
    centre, axes = made.to_world[:, 3], made.to_world[:, :3]
    if made.kind == "AREA":
        sides = axes[:, :2] * np.array(made.size)

        def direction(ab):
            r, phi = np.sqrt(ab[0]) / 2, 2 * pi * ab[1]
            st = np.stack([r * np.cos(phi), r * np.sin(phi)]) if made.ellipse else ab - 0.5
            way = (centre - point)[:, None] + sides @ st
            return way / np.linalg.norm(way, axis=0)

        def square(way):
            normal = axes[:, 2]
            way = way * (normal @ (centre - point) / (normal @ way)) - (centre - point)[:, None]
            s, t = (sides.T @ way) / (sides**2).sum(axis=0)[:, None]
            if made.ellipse:
                return np.stack([4 * (s * s + t * t), np.arctan2(t, s) / (2 * pi) % 1])
            return np.stack([s + 0.5, t + 0.5])

        return direction, square

    # Round things: a cone around the way to the centre
    way = axes[:, 2] if made.kind == "SUN" else centre - point
    distance = np.linalg.norm(way)
    z = way / distance
    x = np.cross(z, [0.3, 0.5, -0.8])
    x /= np.linalg.norm(x)
    frame = np.stack([x, np.cross(z, x), z])
    ratio = made.radius / distance
    disk = made.soft_falloff and made.kind != "SUN"
    sine = sin(made.angle / 2) if made.kind == "SUN" else ratio / np.hypot(1, ratio * disk)
    lowest = np.sqrt(1 - sine**2) if made.kind == "SUN" or sine < 1 else -1.0

    def direction(ab):
        cosine = 1 - ab[0] * (1 - lowest)
        r, phi = np.sqrt(1 - cosine**2), 2 * pi * ab[1]
        return frame.T @ np.stack([r * np.cos(phi), r * np.sin(phi), cosine])

    def square(way):
        local = frame @ way
        across = (local[:2] ** 2).sum(axis=0)
        low = across / (1 + np.sqrt(1 - across)) if lowest > 0.5 else 1 - local[2]
        return np.stack([low / (1 - lowest), np.arctan2(local[1], local[0]) / (2 * pi) % 1])

    return direction, square


@pytest.mark.parametrize("where", POINTS)
@pytest.mark.parametrize("name", KINDS)
def test_directions_are_distributed_as_their_density_says(name, where):
    """chi2 of 16 x 16 bins and 160 000 samples; z > 4 in one of 30 000 tests by chance."""
    made, point, side, fine = KINDS[name], np.array(POINTS[where], float), 16, 24
    light = only(made)
    direction, square = chart(made, point)
    u, v = np.random.default_rng(1).random((2, 160_000)).astype(F32)
    to_light, _, pdf, _ = light.kind.sample(light.rows, at(point, u.size), u, v, True)
    reached = np.flatnonzero(pdf > 0)
    assert reached.size == u.size
    place = square(to_light.astype(float) / np.linalg.norm(to_light.astype(float), axis=0))
    inside = np.flatnonzero(((place > -1e-4) & (place < 1 + 1e-4)).all(axis=0))
    bins = np.clip((place[:, inside] * side).astype(int), 0, side - 1)
    counts = np.bincount(bins[0] * side + bins[1], minlength=side * side)

    # Integrate the density over the bins: midpoints, and the solid angle by differences
    a, b = (np.stack(np.meshgrid(*[np.arange(side * fine)] * 2, indexing="ij")) + 0.5) / (
        side * fine
    )
    ab, step = np.stack([a.ravel(), b.ravel()]), 1e-5
    along, across = (
        (direction(ab + d) - direction(ab - d)) / (2 * step)
        for d in np.array([[[step], [0]], [[0], [step]]])
    )
    way = direction(ab)
    solid = np.linalg.norm(np.cross(along.T, across.T), axis=1)
    _, _, density = light.kind.intersect(light.rows, at(point, ab.shape[1]), way.astype(F32))
    mass = (density * solid).reshape(side, fine, side, fine).mean(axis=(1, 3)).ravel() / side**2
    share = inside.size / u.size  # an ellipse, when near, rejects samples
    assert mass.sum() == pytest.approx(share, abs=4e-3)
    assert share == 1 or made.ellipse

    expected = mass / mass.sum() * inside.size
    ratio = ((counts - expected) ** 2 / expected).sum() / (side**2 - 1)
    spread = 2 / (9 * (side**2 - 1))
    assert (ratio ** (1 / 3) - (1 - spread)) / spread**0.5 < 4
