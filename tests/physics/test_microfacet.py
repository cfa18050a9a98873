"""core.bsdf.microfacet -> the distributions by the book, the closures as Cycles evaluates them."""

import numpy as np
import pytest

from penumbra.core.bsdf import REGISTRY, beckmann, fresnel, ggx
from tests.physics.test_closures import towards

F32 = np.float32
ROUGH = ((0.05, 0.05), (0.3, 0.3), (1.0, 1.0), (0.5, 0.1))
DISTRIBUTIONS = {"ggx": ggx, "beckmann": beckmann}

distributions = pytest.mark.parametrize("distribution", DISTRIBUTIONS.values(), ids=DISTRIBUTIONS)
roughness = pytest.mark.parametrize("ax, ay", ROUGH)


def alphas(ax, ay):
    """The same array twice if isotropic, as the closures have it."""
    x = np.full(1, ax, F32)
    return (x, x) if ax == ay else (x, np.full(1, ay, F32))


def normals(ax, ay, size=700):
    """A grid of normals (3, n) float32 in slopes, and the area [sr] of each cell."""
    step = (np.arange(size) + 0.5) / size
    radius, phi = np.meshgrid(step, step * 2 * np.pi, indexing="ij")
    slope = (radius / (1 - radius)).ravel()
    x, y = slope * ax * np.cos(phi.ravel()), slope * ay * np.sin(phi.ravel())
    z = 1 / np.sqrt(1 + x * x + y * y)
    area = z**3 * ax * ay * slope / (1 - radius.ravel()) ** 2 * 2 * np.pi / size**2
    return np.stack([x * z, y * z, z]).astype(F32), area


def textbook(name, wo, wi, ax, ay):
    """D, G2 in float64 for unit directions (3,), by Heitz 2014 and Walter's fit for Beckmann."""
    h = wo + wi
    h /= np.linalg.norm(h)
    slope2 = (h[0] / ax) ** 2 + (h[1] / ay) ** 2
    tan2 = slope2 / h[2] ** 2
    if name == "ggx":
        density = 1 / (np.pi * ax * ay * h[2] ** 4 * (1 + tan2) ** 2)
    else:
        density = np.exp(-tan2) / (np.pi * ax * ay * h[2] ** 4)

    def masked(w):
        stretched = np.hypot(ax * w[0], ay * w[1]) / w[2]
        if name == "ggx":
            return (np.sqrt(1 + stretched**2) - 1) / 2
        a = 1 / stretched
        return (1 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a) if a < 1.6 else 0.0

    return density, 1 / (1 + masked(wo) + masked(wi))


@distributions
@roughness
def test_microfacets_cover_the_surface_once(distribution, ax, ay):
    h, area = normals(ax, ay)
    density, length2 = distribution.density(h, *alphas(ax, ay))
    np.testing.assert_allclose(length2, 1, atol=1e-6)
    np.testing.assert_allclose((density * h[2] * area).sum(), 1, rtol=1e-4)


@distributions
@roughness
@pytest.mark.parametrize("cosine", (1.0, 0.7, 0.2, 0.02))
def test_visible_microfacets_cover_what_the_viewer_sees(distribution, ax, ay, cosine):
    """The weak white furnace (Heitz 2014, section 5.4)."""
    h, area = normals(ax, ay)
    wo = towards(cosine)
    density, _ = distribution.density(h, *alphas(ax, ay))
    seen = (density * np.maximum((wo * h).sum(axis=0), 0) * area).sum()
    expected, _ = distribution.view(wo, *alphas(ax, ay))
    np.testing.assert_allclose(expected, seen, rtol=2e-4)


@pytest.mark.parametrize("name", DISTRIBUTIONS)
@roughness
def test_reflection_is_d_g_over_four_cosines(name, ax, ay):
    rng = np.random.default_rng(5)
    wo, wi = rng.normal(size=(2, 3, 50))
    wo[2], wi[2] = np.abs(wo[2]), np.abs(wi[2])
    wo /= np.linalg.norm(wo, axis=0)
    wi /= np.linalg.norm(wi, axis=0)
    kind = name if ax == ay else f"{name} anisotropic"
    given = (alphas(ax, ay)[0],) if ax == ay else alphas(ax, ay)
    found, _ = REGISTRY[f"{kind} reflection unit"].evaluate(given, wo.astype(F32), wi.astype(F32))
    for column in range(50):
        o, i = wo[:, column], wi[:, column]
        density, masking = textbook(name, o, i, ax, ay)
        np.testing.assert_allclose(
            found[column], density * masking / (4 * o[2]), rtol=3e-4, atol=1e-12
        )


# What Cycles of Blender 5.2.3 shows of a plane, roughness and index given, under a sun of strength
# 1: seen at 20 degrees from the normal, lit from so many degrees on the other side of it, 0 being
# straight below.  From (0.5, 1.5, 60) on are five directions into which no facet bends light.
BY_CYCLES = (
    ("ggx glass", 0.5, 1.5, 10, 18.3457),
    ("ggx glass", 0.5, 1.5, 30, 0.366017),
    ("ggx glass", 1.0, 1.5, 120, 0.00252788),
    ("ggx glass", 1.0, 1.5, 170, 0.00326429),
    ("ggx glass", 0.7, 0.7, 40, 1.14047),
    ("ggx glass", 0.2, 1.5, 25, 0.0398786),
    ("ggx glass", 0.2, 1.5, 160, 2.13098),
    ("beckmann glass", 0.5, 1.5, 10, 23.8258),
    ("beckmann glass", 1.0, 1.5, 200, 0.00380529),
    ("beckmann glass", 0.7, 0.7, 60, 0.0335264),
    ("ggx refraction", 0.5, 1.5, 10, 19.1348),
    ("ggx refraction", 0.7, 0.7, 60, 0.0446389),
    ("ggx refraction", 1.0, 1.5, 120, 0.0),
    ("beckmann refraction", 1.0, 1.5, 10, 2.19359),
    ("ggx glass", 0.5, 1.5, 60, 0.00335446),
    ("ggx glass", 1.0, 1.5, 75, 0.00798583),
    ("ggx glass", 0.7, 0.7, -30, 0.00167973),
    ("ggx refraction", 1.0, 1.5, 60, 0.0600705),
    ("beckmann refraction", 1.0, 1.5, 75, 0.0116687),
    ("ggx reflection unit", 0.3, None, 170, 2.80526876),
    ("ggx reflection unit", 1.0, None, 100, 0.02482343),
    ("beckmann reflection unit", 0.6, None, 120, 0.30152911),
    ("beckmann reflection unit", 1.0, None, 100, 0.05032563),
    ("ggx reflection f82", 0.6, None, 100, (0.05535055, 0.0389333, 0.0156716)),
    ("beckmann reflection f82", 1.0, None, 120, (0.08296806, 0.05885958, 0.0240163)),
    ("ggx reflection conductor", 0.6, None, 100, (0.05266524, 0.03443148, 0.02872779)),
    ("ggx reflection conductor", 0.3, None, 170, (2.67105079, 1.73973286, 1.43230939)),
)
GOLD, EDGE = (1.0, 0.71, 0.29), (0.9, 0.5, 0.2)
COPPER = (0.2, 0.92, 1.1), (3.91, 2.45, 2.14)


@pytest.mark.parametrize("name, rough, ior, angle, expected", BY_CYCLES)
def test_closures_evaluate_as_cycles_does(name, rough, ior, angle, expected):
    def colour(*values):
        return np.array(values, F32)[:, None]

    white = colour(1, 1, 1)
    alpha = np.full(1, rough**2, F32)
    optics = ()
    if ior is not None:
        eta = np.full(1, ior, F32)
        optics = (eta, fresnel.f0_from_ior(eta) * white, white, white)
    elif name.endswith("f82"):
        optics = colour(*GOLD), fresnel.f82_b(colour(*GOLD), colour(*EDGE))
    elif name.endswith("conductor"):
        optics = tuple(colour(*each) for each in COPPER)
    parameters = (alpha, *optics)[: len(REGISTRY[name].PARAMETERS)]
    wo = towards(np.cos(np.radians(20)), 0)
    below = np.radians(angle)
    wi = np.array([[-np.sin(below)], [0], [-np.cos(below)]], F32)
    value, pdf = REGISTRY[name].evaluate(parameters, wo, wi)
    np.testing.assert_allclose(np.ravel(value), expected, rtol=2e-5)
    assert pdf.dtype == F32


@pytest.mark.parametrize("alpha", (0.0, 1e-6, 1e-4))
@pytest.mark.parametrize("eta", (1.0, 1.00001, 1.5, 0.7))
@pytest.mark.parametrize("kind", ("glass", "refraction"))
def test_glass_is_its_smooth_limit_as_roughness_goes_to_0(kind, eta, alpha):
    rng = np.random.default_rng(2)
    u, v, w = rng.random((3, 4000), F32)
    wo = np.repeat(towards(0.8), u.size, axis=1)
    white, size = np.ones((3, 1), F32), np.full(1, eta, F32)
    optics = (size, fresnel.f0_from_ior(size) * white, white, white)
    optics = optics[: len(REGISTRY[f"smooth {kind}"].PARAMETERS)]
    wi, weight, pdf = REGISTRY[f"ggx {kind}"].sample((np.full(1, alpha, F32), *optics), wo, u, v, w)
    assert np.isfinite(wi).all()
    assert np.isfinite(weight).all()
    assert np.isfinite(pdf).all()
    *_, (straight, _) = REGISTRY[f"smooth {kind}"].branches(optics, wo[:, :1])
    below = wi[:, np.flatnonzero(wi[2] < 0)]
    away = np.linalg.norm(below - straight, axis=0)
    assert np.median(away) < 2 * max(alpha, 1e-4)
    assert np.median(weight) > 0.999
