"""rays that leave surfaces -> no stipple, no leak, at every scale and far from the origin.

Each scene has a known value in every pixel, without noise; not one pixel may miss it.
"""

from dataclasses import replace

import numpy as np
import pytest

from tests.support import scenes as s

SCALES = (1e-4, 1.0, 1e5)
SHIFTS = ((0.0, 0.0, 0.0), (3e5, -2e5, 7e4))
SPHERE = s.sphere(levels=3)

at_every_place = pytest.mark.parametrize(
    ("scale", "shift"),
    [
        pytest.param(scale, shift, id=f"{scale:g}-{'far' if any(shift) else 'here'}")
        for scale in SCALES
        for shift in SHIFTS
    ],
)


def picture(scale, shift, *things, **settings):
    """Render a scene made `scale` times as large and then moved; light keeps its brightness."""
    shift = np.asarray(shift) * scale

    def move(matrix, linear):
        moved = matrix.copy()
        moved[:, :3] *= linear
        moved[:, 3] = matrix[:, 3] * scale + shift
        return moved

    placed = []
    for thing in things:
        if isinstance(thing, s.Camera):
            factor = 1.0 if thing.projection == "PERSP" else scale
            thing = replace(
                thing,
                to_world=move(thing.to_world, 1.0),
                window=tuple(edge * factor for edge in thing.window),
                clip_start=thing.clip_start * scale,
            )
        elif isinstance(thing, s.Instance):
            thing = replace(thing, to_world=move(thing.to_world, scale))
        elif isinstance(thing, s.Lamp):
            gain = scale**2 if thing.kind in ("POINT", "SPOT") else 1.0
            thing = replace(
                thing,
                to_world=move(thing.to_world, 1.0),
                strength=tuple(gain * value for value in thing.strength),
                radius=thing.radius * scale,
            )
        placed.append(thing)
    return s.picture(*placed, **settings)


def tilted(half, angle=0.3):
    """A square ground of two triangles, its normal, and two directions along it."""
    normal = np.array([np.sin(angle), 0.2, np.cos(angle)])
    normal /= np.linalg.norm(normal)
    along = np.cross(normal, [0.3, 1, 0.1])
    along /= np.linalg.norm(along)
    across = np.cross(normal, along)
    return s.quad(along * half, across * half), normal, along, across


@at_every_place
@pytest.mark.parametrize("half", (1.0, 1e4), ids=("2m", "20km"))
def test_no_pixel_of_a_lit_plane_shadows_itself(half, scale, shift):
    ground, normal, along, across = tilted(half)
    view = s.camera(0.3 * normal - 0.4 * along, 0.1 * across, size=64, clip_start=0.01)
    for height in (90.0, 30.0, 3.0, 0.3):
        slope = np.radians(height)
        towards = np.sin(slope) * normal + np.cos(slope) * along
        done = picture(
            scale, shift, view, s.put(ground, s.diffuse(0.8)), s.sun(towards), max_bounces=0
        )
        expected = 0.8 / np.pi * np.sin(slope)
        seen = done.combined()[..., 1]
        assert (np.abs(seen / expected - 1) > 2e-3).sum() == 0, height


@at_every_place
@pytest.mark.parametrize("half", (1.0, 1e4), ids=("2m", "20km"))
def test_no_ray_that_leaves_a_plane_meets_it_again(half, scale, shift):
    ground, normal, along, across = tilted(half)
    view = s.camera(0.3 * normal - 0.4 * along, 0.1 * across, size=64, clip_start=0.01)
    for material in (s.diffuse(), s.mirror(), s.refraction(1.0)):
        done = picture(scale, shift, view, s.put(ground, material), s.world(), samples=2)
        assert (np.abs(done.combined()[..., :3] - 1) > 1e-5).sum() == 0
        assert done.statistics["self_hits"] == 0


@at_every_place
def test_a_plane_seen_at_a_grazing_angle_is_lit_up_to_the_horizon(scale, shift):
    ground, normal, along, _ = tilted(1e4)
    eye = 1.7 * normal
    view = s.camera(eye, eye + along - 0.05 * normal, size=64, fov=60)
    done = picture(scale, shift, view, s.put(ground, s.diffuse()), s.sun(normal), max_bounces=0)
    seen = done.combined()[..., 1]
    lit = seen > 0
    assert lit.mean() > 0.4
    assert (np.abs(seen[lit] * np.pi - 1) > 1e-4).sum() < 64  # pixels on the horizon
    # Below the horizon no pixel is dark.
    below = np.cumprod(lit, axis=0).astype(bool)
    np.testing.assert_array_equal(below, lit)


def first_hits(view, mesh):
    """Ray centres of an orthographic view against a mesh: triangle (-1 none), u, v; float64."""
    left, right, bottom, top = view.window
    x = left + (np.arange(view.width) + 0.5) / view.width * (right - left)
    y = bottom + (np.arange(view.height) + 0.5) / view.height * (top - bottom)
    x, y = (grid.ravel() for grid in np.meshgrid(x, y))
    axes, eye = view.to_world[:, :3], view.to_world[:, 3]
    a, b, c = mesh.positions[mesh.triangles].transpose(1, 0, 2) - eye
    a, b, c = a @ axes, b @ axes, c @ axes
    e1, e2 = b - a, c - a
    area = e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]
    px, py = x[:, None] - a[:, 0], y[:, None] - a[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):  # triangles seen edge on
        u = (px * e2[:, 1] - py * e2[:, 0]) / area
        v = (py * e1[:, 0] - px * e1[:, 1]) / area
        depth = a[:, 2] + u * e1[:, 2] + v * e2[:, 2]
        z = np.where((u >= 0) & (v >= 0) & (u + v <= 1), depth, -np.inf)
    triangle = z.argmax(axis=1)
    row = np.arange(x.size)
    missed = np.isinf(z[row, triangle])
    return np.where(missed, -1, triangle), u[row, triangle], v[row, triangle]


@at_every_place
def test_a_smooth_sphere_is_lit_by_its_normals_up_to_the_terminator(scale, shift):
    towards = np.array([1.0, -0.3, 0.2]) / np.linalg.norm([1.0, -0.3, 0.2])
    view = s.orthographic((0, -3, 0), size=48, scale=2.1)
    done = picture(
        scale,
        shift,
        view,
        s.put(SPHERE, s.diffuse()),
        s.sun(towards),
        max_bounces=0,
        samples=1,
        pattern="REGULAR",
    )
    seen = done.combined()[..., 1].ravel() * np.pi

    triangle, u, v = first_hits(view, SPHERE)
    corner = SPHERE.positions[SPHERE.triangles[triangle]]
    flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    smooth = corner[:, 0] * (1 - u - v)[:, None] + corner[:, 1] * u[:, None]
    smooth += corner[:, 2] * v[:, None]
    smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
    inner = (triangle >= 0) & (np.minimum(np.minimum(u, v), 1 - u - v) > 1e-3)

    lit = inner & (smooth @ towards > 1e-3) & (flat @ towards > 1e-3)
    assert lit.sum() > 700
    assert (np.abs(seen[lit] - (smooth @ towards)[lit]) > 1e-3).sum() == 0
    dark = inner & ((smooth @ towards < -1e-3) | (triangle < 0))
    assert dark.sum() > 400
    assert (seen[dark] != 0).sum() == 0


@at_every_place
def test_every_pixel_in_a_box_sees_a_lamp_in_its_corner(scale, shift):
    for gap in (0.1, 1e-3):
        lamp = np.full(3, gap - 1)
        for target in ((1, 0.3, 0.2), (-1, -0.3, -0.2), (0.1, 0.2, -1), (-0.1, 1, 0.2)):
            done = picture(
                scale, shift, s.camera((0, 0, 0), target, size=32, fov=90),
                s.put(s.box(), s.diffuse()), s.point(lamp, 1.0), max_bounces=0,
            )  # fmt: skip
            assert (done.combined()[..., 1] <= 0).sum() == 0, (gap, target)


CLOSED = {
    "box": s.box(),
    "sphere": s.sphere(levels=2, smooth=False),
    "smooth sphere": s.sphere(levels=2),
    # A tent with edges of a few degrees
    "wedge": s.mesh(
        [(-9, -1, 0), (9, -1, 0), (9, 1, 0), (-9, 1, 0), (-9, 0, 0.1), (9, 0, 0.1)],
        [(0, 2, 1), (0, 3, 2), (0, 1, 5), (0, 5, 4), (2, 3, 4), (2, 4, 5), (0, 4, 3), (1, 2, 5)],
    ),
}


@at_every_place
@pytest.mark.parametrize("shape", CLOSED)
def test_no_light_leaks_into_a_closed_shape(shape, scale, shift):
    outside = s.world(1e3), s.sun((1, 2, 3), 1e3), s.point((3, 4, 5), 1e5, radius=0.5)
    for material in (s.diffuse(), s.mirror()):
        done = picture(
            scale, shift, s.camera((0, 0, 0.05), (1, 0.2, 0.1), size=24, fov=120, clip_start=1e-3),
            s.put(CLOSED[shape], material), *outside, samples=8, max_bounces=8,
            diffuse_bounces=8, glossy_bounces=8,
        )  # fmt: skip
        assert (done.combined()[..., :3] != 0).any(axis=2).sum() == 0


@at_every_place
@pytest.mark.parametrize("shape", CLOSED)
def test_no_light_leaks_out_of_a_closed_shape(shape, scale, shift):
    inside = s.point((0, 0, 0.05), 1e3), s.point((0, 0.5, 0.03), 1e3, radius=0.01)
    ground = s.quad((50, 0, 0), (0, 50, 0), (0, 0, -1.5))
    done = picture(
        scale, shift, s.camera((2, -4, 3), size=32, fov=60),
        s.put(CLOSED[shape], s.diffuse()), s.put(ground, s.diffuse()), *inside,
        samples=4, max_bounces=4,
    )  # fmt: skip
    assert (done.combined()[..., :3] != 0).any(axis=2).sum() == 0


@at_every_place
@pytest.mark.parametrize("shape", CLOSED)
def test_nothing_stops_light_in_a_shape_of_index_one(shape, scale, shift):
    view = s.camera((0, -3, 1), size=32, fov=60)
    shell = s.put(CLOSED[shape], s.refraction(1.0))
    done = picture(scale, shift, view, shell, s.world(), samples=2)
    assert (np.abs(done.combined()[..., :3] - 1) > 1e-5).sum() == 0
    assert done.statistics["self_hits"] == 0
