"""core.sampling.warp -> samples, densities and inverses that belong together."""

import numpy as np
import pytest

from penumbra.core.sampling import warp

F32 = np.float32
EDGE = np.array([0, 2.0**-24, 2.0**-12, 0.25, 0.5, 0.75, 1 - 2.0**-12, 1 - 2.0**-24], F32)

# name: (sample, pdf(wi), invert, 1 - cos of the widest angle)
DIRECTIONS = {
    "cosine hemisphere": (
        warp.cosine_hemisphere,
        warp.cosine_hemisphere_pdf,
        warp.cosine_hemisphere_invert,
        1.0,
    ),
    "uniform hemisphere": (
        warp.uniform_hemisphere,
        warp.uniform_hemisphere_pdf,
        warp.uniform_hemisphere_invert,
        1.0,
    ),
    "uniform sphere": (
        warp.uniform_sphere,
        warp.uniform_sphere_pdf,
        warp.uniform_sphere_invert,
        2.0,
    ),
}
for _width in (1.5, 0.3, 1e-4, 1e-9):
    DIRECTIONS[f"cone of {_width}"] = (
        lambda u, v, w=_width: warp.uniform_cone(u, v, F32(w)),
        lambda wi, w=_width: np.full(wi.shape[1], warp.uniform_cone_pdf(F32(w))),
        lambda wi, w=_width: warp.uniform_cone_invert(wi, F32(w)),
        _width,
    )
POINTS = {
    "concentric disk": (warp.concentric_disk, warp.concentric_disk_invert),
    "uniform triangle": (warp.uniform_triangle, warp.uniform_triangle_invert),
}
ALL = {name: (row[0], row[2]) for name, row in DIRECTIONS.items()} | POINTS


def square(values):
    """All pairs of the values, as u, v."""
    u, v = np.meshgrid(values, values)
    return u.ravel().astype(F32), v.ravel().astype(F32)


def uniform(count):
    """Random u, v."""
    return np.random.default_rng(3).random((2, count), F32)


def height(wi):
    """1 - cos(theta), exact for small angles."""
    x, y, z = wi.astype(float)
    return np.where(z > 0, (x * x + y * y) / (1 + np.abs(z)), 1 - z)


@pytest.mark.parametrize("name", ALL)
def test_every_corner_of_the_square_gives_finite_float32(name):
    sample, invert = ALL[name]
    out = sample(*square(EDGE))
    assert out.dtype == F32
    assert np.isfinite(out).all()
    for number in invert(out):
        assert number.dtype == F32
        assert number.min() >= 0
        assert number.max() < 1


@pytest.mark.parametrize("name", ALL)
def test_invert_undoes_sample(name):
    """Away from the seam of the azimuth and the poles, where v has no meaning."""
    sample, invert = ALL[name]
    u, v = square(np.linspace(0.003, 0.997, 61))
    back_u, back_v = invert(sample(u, v))
    assert np.abs(back_u - u).max() < 2e-6
    assert np.abs(back_v - v).max() < 2e-6


def test_an_azimuth_just_below_the_seam_stays_below_one():
    wi = np.array([[1, 0.6], [-1e-9, -1e-30], [0, 0.8]], F32)
    for invert in (warp.cosine_hemisphere_invert, warp.uniform_sphere_invert):
        assert invert(wi)[1].max() < 1


@pytest.mark.parametrize("name", DIRECTIONS)
def test_directions_have_unit_length(name):
    wi = DIRECTIONS[name][0](*square(np.concatenate([EDGE, np.linspace(0, 0.99, 50)])))
    assert np.abs((wi.astype(float) ** 2).sum(axis=0) - 1).max() < 5e-7


def bins(name, size):
    """Expected share (size, size) of samples in bins of 1 - cos(theta) and azimuth."""
    _, pdf, _, width = DIRECTIONS[name]
    fine = 16 * size
    h, phi = np.meshgrid(
        (np.arange(fine) + 0.5) / fine * width,
        (np.arange(fine) + 0.5) / fine * 2 * np.pi,
        indexing="ij",
    )
    sine = np.sqrt(h * (2 - h))
    wi = np.stack([sine * np.cos(phi), sine * np.sin(phi), 1 - h]).reshape(3, -1).astype(F32)
    density = pdf(wi).astype(float).reshape(size, 16, size, 16)
    return density.sum(axis=(1, 3)) * (width / fine) * (2 * np.pi / fine)


@pytest.mark.parametrize("name", DIRECTIONS)
def test_the_pdf_integrates_to_one(name):
    assert abs(bins(name, 16).sum() - 1) < 1e-5


@pytest.mark.parametrize("name", DIRECTIONS)
def test_directions_are_spread_as_their_pdf_says(name, chi2):
    """Significance: z < 4.5 of 256 bins, of 7 in all."""
    count = 400_000
    wi = DIRECTIONS[name][0](*uniform(count))
    width = DIRECTIONS[name][3]
    ring = np.minimum(height(wi) / width * 16, 15).astype(int)
    sector = np.minimum(np.arctan2(wi[1], wi[0]) % (2 * np.pi) / (2 * np.pi) * 16, 15).astype(int)
    counts = np.bincount(ring * 16 + sector, minlength=256)
    assert chi2(counts, bins(name, 16) * count) < 4.5


@pytest.mark.parametrize("name", ["cosine hemisphere", "uniform hemisphere"])
def test_hemispheres_never_sample_where_their_pdf_is_zero(name):
    sample, pdf, *_ = DIRECTIONS[name]
    wi = sample(*square(EDGE))
    assert wi[2].min() > 0
    assert pdf(wi).min() > 0
    assert pdf(wi * np.array([[1], [1], [-1]], F32)).max() == 0


def test_a_cone_of_a_millionth_of_a_degree_keeps_its_shape():
    half_angle = np.radians(1e-6)
    width = F32(2 * np.sin(half_angle / 2) ** 2)
    wi = warp.uniform_cone(*uniform(100_000), width).astype(float)
    radius = np.hypot(wi[0], wi[1]) / half_angle
    assert radius.max() <= 1 + 1e-6
    assert abs((radius**2).mean() - 0.5) < 0.005
    assert abs(np.hypot(wi[0].mean(), wi[1].mean()) / half_angle) < 0.01


def test_cones_may_differ_from_direction_to_direction():
    u, v = uniform(1000)
    width = np.linspace(1e-6, 2, 1000).astype(F32)
    wi = warp.uniform_cone(u, v, width)
    one_by_one = [warp.uniform_cone(u[i : i + 1], v[i : i + 1], width[i]) for i in range(1000)]
    assert np.allclose(wi, np.concatenate(one_by_one, axis=1), rtol=0, atol=1e-6)
    assert np.allclose(warp.uniform_cone_pdf(width) * width, 1 / (2 * np.pi))


def test_points_are_uniform_on_the_disk(chi2):
    """Significance: z < 4.5 of 256 bins."""
    x, y = warp.concentric_disk(*uniform(400_000)).astype(float)
    ring = np.minimum((x * x + y * y) * 16, 15).astype(int)
    sector = np.minimum(np.arctan2(y, x) % (2 * np.pi) / (2 * np.pi) * 16, 15).astype(int)
    assert chi2(np.bincount(ring * 16 + sector, minlength=256), [400_000 / 256] * 256) < 4.5


def test_the_disk_has_its_density_inside_and_none_outside():
    point = warp.concentric_disk(*square(EDGE))
    assert np.allclose(warp.concentric_disk_pdf(point), 1 / np.pi)
    assert warp.concentric_disk_pdf(point[:, -1:] + F32(1))[0] == 0


def test_concentric_squares_become_circles():
    around = np.linspace(0.25, 0.75, 101)
    u, v = np.full(101, 0.25, F32), around.astype(F32)
    radius = np.hypot(*warp.concentric_disk(u, v))
    assert np.abs(radius - 0.5).max() < 1e-6
    angle = np.arctan2(*warp.concentric_disk(u, v)[::-1])
    assert np.allclose(np.diff(angle % (2 * np.pi)), -np.pi / 200, atol=1e-5)


def test_points_are_uniform_on_the_triangle(chi2):
    """Significance: z < 4.5 of 136 bins: squares of a grid, cut by the diagonal or not."""
    a, b = warp.uniform_triangle(*uniform(400_000)).astype(float)
    assert min(a.min(), b.min(), (1 - a - b).min()) >= -1e-7
    cell = np.minimum(a * 16, 15).astype(int) * 16 + np.minimum(b * 16, 15).astype(int)
    i, j = np.divmod(np.arange(256), 16)
    area = (i + j < 15) + 0.5 * (i + j == 15)
    inside = area > 0
    counts = np.bincount(cell, minlength=256)
    assert counts[~inside].sum() < 5  # rounded over the diagonal
    assert chi2(counts[inside], area[inside] / area.sum() * 400_000) < 4.5


def test_the_triangle_pdf_is_one_over_its_area():
    assert np.allclose(warp.uniform_triangle_pdf(np.array([0.5, 4], F32)), [2, 0.25])
