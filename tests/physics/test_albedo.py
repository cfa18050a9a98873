"""core.bsdf.albedo -> tables are the integrals they claim to be; energy is kept, never made.

The tables were integrated over the facets that a viewer sees; here, all the facets of the
distribution are drawn instead, and weighed by how they are seen.
"""

import subprocess
import sys
import tomllib
from fnmatch import fnmatch

import numpy as np
import pytest

from penumbra.core.bsdf import albedo, fresnel
from penumbra.tools.environment import ROOT
from penumbra.tools.package import sources

F32 = np.float32
GRID16, GRID32 = np.linspace(0, 1, 16), np.linspace(0, 1, 32)
TABLES = {
    "reflection": (32, 32),
    "reflection_average": (32,),
    "glass": (2, 16, 16, 16),
    "glass_average": (2, 16, 16),
    "remapped": (16, 16, 16),
    "schlick": (16, 16),
    "film": (6, 512),
    "sheen": (3, 32, 32),
}


def f32(*values):
    return np.array(values, F32)


def colour(*values):
    return np.array(values, F32)[:, None]


def ior_at(z):
    return (1 + z * z) / (1 - z * z)


# --- Another quadrature -------------------------------------------------------------------------


def facets(alpha, mu, side=700):
    """h_z and wi . h of facets by their share of the area, and what of it the viewer sees."""
    middle = (np.arange(side) + 0.5) / side
    u, phi = (middle**2 * (3 - 2 * middle))[:, None], np.pi * middle[None, :]
    weight = (6 * middle * (1 - middle))[:, None] / side**2
    tangent = alpha * np.sqrt(u / (1 - u))
    hz = 1 / np.sqrt(1 + tangent * tangent) + 0 * phi
    toward = hz * (mu + np.sqrt(1 - mu * mu) * tangent * np.cos(phi))
    return hz, toward, np.where(toward > 0, weight * toward / (hz * mu), 0)


def slope(alpha, z):
    return (np.sqrt(1 + alpha**2 * (1 / z**2 - 1)) - 1) / 2


def kept(alpha, mu, out):
    """G2 for light that leaves at cosine `out`, none below the horizon."""
    together = 1 + slope(alpha, mu) + slope(alpha, np.maximum(np.abs(out), 1e-9))
    return np.where(out > 0, 1 / together, 0)


def reflected(alpha, mu, curve=lambda cosine: 1.0):
    hz, toward, weight = facets(alpha, mu)
    return (weight * curve(toward) * kept(alpha, mu, 2 * toward * hz - mu)).sum()


def dielectric(cosine, eta):
    g = np.sqrt(np.maximum(eta * eta - 1 + cosine * cosine, 0))
    s = (cosine - g) / (cosine + g)
    p = (eta * eta * cosine - g) / (eta * eta * cosine + g)
    return (s * s + p * p) / 2, g / eta


def glassy(alpha, mu, eta, lost):
    """Reflected and refracted; `lost` keeps what leaves a facet on the wrong side."""
    hz, toward, weight = facets(alpha, mu)
    share, beyond = dielectric(np.maximum(toward, 1e-9), eta)
    up = kept(alpha, mu, 2 * toward * hz - mu)
    out = mu / eta - (toward / eta - beyond) * hz
    down = kept(alpha, mu, np.abs(out) if lost else out)
    return (weight * (share * up + (1 - share) * down)).sum()


def rise(alpha, mu, curve):
    """The mean of a curve over the facets that are seen and reflect upwards."""
    hz, toward, weight = facets(alpha, mu)
    seen = weight / (1 + slope(alpha, mu)) * (2 * toward * hz > mu)
    return (seen * curve(np.clip(toward, 1e-9, 1))).sum()


# --- Tables -------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", TABLES)
def test_tables_are_finite_float32_of_the_size_that_is_looked_up(name):
    found = albedo.table(name)
    assert found.dtype == F32
    assert found.shape == TABLES[name]
    assert np.isfinite(found).all()


def test_tables_are_small_and_travel_with_the_extension_and_the_package():
    files = sorted(path.name for path in albedo.TABLES.iterdir())
    assert files == sorted(f"{name}.npy" for name in TABLES)
    assert sum((albedo.TABLES / name).stat().st_size for name in files) < 150_000
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    patterns = project["tool"]["setuptools"]["package-data"]["penumbra.core.bsdf"]
    for name in files:
        assert f"core/bsdf/tables/{name}" in sources()
        assert any(fnmatch(f"tables/{name}", pattern) for pattern in patterns)


def test_tables_are_read_when_first_asked_for():
    code = (
        "import penumbra.core; from penumbra.core.bsdf import albedo, thin_film\n"
        "assert albedo.table.cache_info().currsize == 0\n"
        "albedo.table('schlick')\n"
        "assert albedo.table.cache_info().currsize == 1\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


@pytest.mark.parametrize("seed", range(12))
def test_tables_hold_what_another_quadrature_finds(seed):
    x, y, z = np.random.default_rng(seed).integers(2, (16, 16, 15))
    mu, alpha, eta = GRID16[y], GRID16[x] ** 2, ior_at(GRID16[z])
    wide = np.random.default_rng(seed).integers(3, 32, 2)
    close = dict(rel=2e-3, abs=2e-4)
    of = albedo.table
    expected = reflected(GRID32[wide[0]] ** 2, GRID32[wide[1]])
    assert of("reflection")[wide[1], wide[0]] == pytest.approx(expected, **close)
    for side, index in enumerate((eta, 1 / eta)):
        expected = glassy(alpha, mu, index, lost=True)
        assert of("glass")[side, z, y, x] == pytest.approx(expected, **close)
    f0 = ((eta - 1) / (eta + 1)) ** 2
    expected = rise(alpha, mu, lambda c: np.clip((dielectric(c, eta)[0] - f0) / (1 - f0), 0, 1))
    assert of("remapped")[z, y, x] == pytest.approx(expected, **close)
    expected = rise(alpha, mu, lambda c: ((1 - c) ** (40 / 7) + (1 - c) ** (35 / 8)) / 2)
    assert of("schlick")[y, x] == pytest.approx(expected, **close)


def test_averages_are_the_integrals_of_2_mu_e():
    mu = (np.arange(4000) + 0.5) / 4000
    for name, size in (("reflection", 32), ("glass", 16)):
        grid, values = np.linspace(0, 1, size), albedo.table(name)
        curves = np.moveaxis(values, -2, -1).reshape(-1, size)
        average = [(2 * mu * np.interp(mu, grid, curve)).mean() for curve in curves]
        expected = np.reshape(average, np.delete(values.shape, -2))
        # Curves bend between the points of the grid, and fall steeply at the horizon
        np.testing.assert_allclose(albedo.table(f"{name}_average"), expected, atol=6e-3)


def test_light_that_leaves_glass_from_inside_at_the_wrong_side_counts_as_in_cycles():
    """Cycles' own table does so, as its renders show: the factor is smaller than needed."""
    mu, alpha, eta = GRID16[3], GRID16[8] ** 2, 1 / ior_at(GRID16[4])
    right, counted = glassy(alpha, mu, eta, False), glassy(alpha, mu, eta, True)
    assert counted > 1.05 * right
    assert albedo.table("glass")[1, 4, 3, 8] == pytest.approx(counted, rel=2e-3)


# --- Lookups ------------------------------------------------------------------------------------


def interpolated(values, coordinates):
    """Multilinear interpolation of one point in float64, by its 2^n corners."""
    if not coordinates:
        return values
    x = min(max(float(coordinates[0]), 0), 1) * (len(values) - 1)
    i = min(int(x), len(values) - 2)
    low, high = (interpolated(values[j], coordinates[1:]) for j in (i, i + 1))
    return low + (x - i) * (high - low)


@pytest.mark.parametrize("constant", range(8), ids=lambda c: f"{c:03b}")
@pytest.mark.parametrize("sided", (False, True))
def test_lookups_interpolate_linearly_whatever_is_constant(constant, sided):
    random = np.random.default_rng(constant)
    points = random.uniform(-0.1, 1.1, (3, 60)).astype(F32)
    points[:, :4] = 0, 1, 0.2, 1 / 15
    points = [p[7:8] if constant >> axis & 1 else p for axis, p in enumerate(points)]
    name, side = ("glass", random.integers(0, 2, 60)) if sided else ("remapped", None)
    found = albedo.lookup(name, *points, side=side)
    assert found.dtype == F32
    count = found.size
    assert count == (1 if constant == 7 and not sided else 60)
    for i in range(count):
        values = albedo.table(name).astype(float)
        values = values[side[i]] if sided else values
        at = [p[i % p.size] for p in points]
        assert found[i] == pytest.approx(interpolated(values, at), abs=2e-6)


# --- Energy -------------------------------------------------------------------------------------


@pytest.mark.parametrize("x, y", ((1, 3), (10, 5), (20, 20), (31, 2), (31, 31)))
def test_white_surfaces_return_all_light(x, y):
    factor, darkening = albedo.ggx_energy(f32(GRID32[x]), f32(GRID32[y]))
    assert factor[0] * reflected(GRID32[x] ** 2, GRID32[y]) == pytest.approx(1, abs=2e-3)
    assert darkening == 1
    same, _ = albedo.ggx_energy(f32(GRID32[x]), f32(GRID32[y]), colour(1, 1, 1))
    np.testing.assert_allclose(same[:, 0], factor[0], rtol=1e-5)


@pytest.mark.parametrize("x, y, z", ((1, 3, 5), (8, 2, 4), (15, 15, 10), (15, 1, 14)))
def test_clear_glass_returns_all_light_that_comes_from_outside(x, y, z):
    ior = ior_at(GRID16[z])
    where = f32(GRID16[x]), f32(GRID16[y])
    factor, _ = albedo.ggx_glass_energy(*where, f32(ior), np.array([False]))
    found = factor[0] * glassy(GRID16[x] ** 2, GRID16[y], ior, False)
    assert found == pytest.approx(1, abs=2e-3)
    # Looking in from behind is looking out of the inverse
    behind, _ = albedo.ggx_glass_energy(*where, f32(1 / ior), np.array([True]))
    assert behind[0] == pytest.approx(factor[0], rel=1e-4)


def test_smooth_surfaces_need_no_energy():
    mu = np.linspace(0, 1, 50, dtype=F32)
    factor, _ = albedo.ggx_energy(f32(0), mu, colour(0.9, 0.5, 0.1))
    np.testing.assert_allclose(factor, 1, atol=1e-5)
    factor, _ = albedo.ggx_glass_energy(f32(0), mu, f32(1.5), mu > 0.5, colour(0.9, 0.5, 0.1))
    np.testing.assert_allclose(factor, 1, atol=1e-5)


def test_colours_darken_and_no_light_is_made():
    random = np.random.default_rng(3)
    roughness, mu = random.random((2, 4000)).astype(F32)
    fss = random.random((3, 4000)).astype(F32)
    white, _ = albedo.ggx_energy(roughness, mu)
    factor, darkening = albedo.ggx_energy(roughness, mu, fss)
    assert darkening.min() >= 0
    assert darkening.max() <= 1 + 1e-6
    assert (factor <= white * (1 + 1e-5)).all()
    np.testing.assert_allclose(factor, white * darkening, rtol=1e-5)
    # Facets that reflect fss reflect at most fss in all: (fss E) times the factor
    assert (fss * factor / white <= fss + 1e-6).all()


def test_many_bounces_are_a_geometric_series():
    e, average, fss = 0.8, 0.7, 0.6
    bounces = sum(fss * average * (fss * (1 - average)) ** n for n in range(60))
    factor, _ = albedo.kept_energy(f32(e), f32(average), colour(fss, fss, fss))
    np.testing.assert_allclose(factor, 1 + bounces * (1 / e - 1), rtol=1e-5)


def test_colours_above_one_stay_finite_and_positive():
    factor, _ = albedo.ggx_energy(f32(1), f32(0.5), colour(1.5, 2.0, 100.0))
    assert np.isfinite(factor).all()
    assert factor.min() > 0


def test_constants_give_what_arrays_give():
    mu = np.linspace(0, 1, 40, dtype=F32)
    back = np.arange(40) % 2 == 0
    full = np.full(40, 0.43, F32)
    fss = colour(0.9, 0.5, 0.1)
    for one, many in (
        (albedo.ggx_energy(f32(0.43), mu, fss), albedo.ggx_energy(full, mu, fss + 0 * mu)),
        (
            albedo.ggx_glass_energy(f32(0.43), mu, f32(1.7), back, fss),
            albedo.ggx_glass_energy(full, mu, np.full(40, 1.7, F32), back, fss),
        ),
    ):
        for a, b in zip(one, many, strict=True):
            assert a.dtype == b.dtype == F32
            np.testing.assert_allclose(a, b, rtol=1e-5)


# --- Layers -------------------------------------------------------------------------------------


def test_a_smooth_layer_reflects_by_fresnel():
    mu = GRID16[1:].astype(F32)
    found = albedo.estimated_albedo_remapped(f32(0), mu, f32(ior_at(0.4)), colour(0.1, 0.2, 0.3))
    # Between the points of the grid of indices it is interpolated: z = 0.4 is one of them
    expected = fresnel.remapped(mu, f32(ior_at(0.4)), colour(0.1, 0.2, 0.3))
    np.testing.assert_allclose(found, expected, atol=1e-5)
    metal = albedo.estimated_albedo_f82(f32(0), f32(1), colour(0.9, 0.6, 0.3))
    np.testing.assert_allclose(metal, colour(0.9, 0.6, 0.3), atol=1e-6)


def test_layers_share_the_light():
    random = np.random.default_rng(5)
    weight = random.random((3, 1000)).astype(F32)
    weight[:, ::10] = 0
    top = weight * random.random((3, 1000)).astype(F32)
    below = albedo.layering(top, weight)
    assert below.dtype == F32
    assert (top + below <= weight + 1e-6).all()
    assert (below[:, ::10] == 0).all()
    # The strongest colour of the layer decides for all
    np.testing.assert_allclose(
        albedo.layering(colour(0.1, 0.2, 0.0), colour(0.5, 0.5, 1.0)), colour(0.3, 0.3, 0.6)
    )
    assert albedo.layering(colour(2, 0, 0), colour(1, 1, 1)).max() == 0
