"""core.shading.nodes.hit -> what is read of the hit point, against values by hand."""

import math

import numpy as np
import pytest

from penumbra.core import Link, Node
from penumbra.core.arrays import F32
from penumbra.core.bsdf import CAMERA, DIFFUSE, GLOSSY, SHADOW, SINGULAR, TRANSMISSION
from tests.support.nodes import of
from tests.support.points import context, points, seen_from, vectors


def layer_weight(blend, output="Facing", **more):
    return Link(Node("LayerWeight", "", {"Blend": blend, **more}), output)


# --- What is read of the hit point --------------------------------------------------------------


def fresnel(cosine, eta):
    """Reflectance of a dielectric, from amplitudes of both polarisations; 1 where it is total."""
    sine2 = (1 - cosine**2) / eta**2
    if sine2 >= 1:
        return 1.0
    beyond = math.sqrt(1 - sine2)
    s = (cosine - eta * beyond) / (cosine + eta * beyond)
    p = (eta * cosine - beyond) / (eta * cosine + beyond)
    return (s * s + p * p) / 2


COSINES = (1.0, 0.9, 0.5, 0.2, 0.05)


@pytest.mark.parametrize("ior", (1.5, 1.1, 2.4, 0.7, 0.0))
@pytest.mark.parametrize("back", (False, True))
def test_fresnel_is_the_reflectance_of_a_dielectric(ior, back):
    at = context(seen_from(*COSINES, back=back))
    found = of(Node("Fresnel", "", {"IOR": ior}), "Fac", at)
    eta = max(ior, 1e-5)
    expected = [fresnel(cosine, 1 / eta if back else eta) for cosine in COSINES]
    np.testing.assert_allclose(found, expected, rtol=2e-4, atol=2e-6)


@pytest.mark.parametrize("blend", (0.0, 0.2, 0.5, 0.8, 1.0))
@pytest.mark.parametrize("back", (False, True))
def test_layer_weight_is_fresnel_or_a_power_of_the_cosine(blend, back):
    at = context(seen_from(*COSINES, back=back))
    found = of(layer_weight(blend, "Fresnel").node, "Fresnel", at)
    eta = max(1 - blend, 1e-5)
    expected = [fresnel(cosine, eta if back else 1 / eta) for cosine in COSINES]
    np.testing.assert_allclose(found, expected, rtol=2e-4, atol=2e-6)

    found = of(layer_weight(blend).node, "Facing", at)
    limited = min(blend, 1 - 1e-5)
    power = 2 * limited if limited < 0.5 else 0.5 / (1 - limited)
    np.testing.assert_allclose(found, [1 - c**power for c in COSINES], rtol=1e-5, atol=1e-6)


def test_fresnel_and_layer_weight_take_a_normal():
    tilted = vectors((0.6, 0, 0.8), (-0.6, 0, 0.8))
    at = context(points(vectors((0.6, 0, 0.8), (0.6, 0, 0.8)), normal=tilted))
    cosines = (1.0, 0.28)
    plain = of(layer_weight(0.5).node, "Facing", at)
    np.testing.assert_allclose(plain, [1 - c for c in cosines], atol=1e-6)
    true = Link(Node("NewGeometry", ""), "True Normal")
    linked = of(layer_weight(0.5, Normal=true).node, "Facing", at)
    np.testing.assert_allclose(linked, [0.2, 0.2], atol=1e-6)
    found = of(Node("Fresnel", "", {"IOR": 1.5, "Normal": true}), "Fac", at)
    np.testing.assert_allclose(found, fresnel(0.8, 1.5), rtol=1e-4)


def test_geometry_reads_the_point():
    wo, normal = vectors((0.6, 0, 0.8), (0, 0, 1)), vectors((0.28, 0, 0.96), (0, 0, 1))
    at = context(points(wo, normal=normal, back=(False, True), position=np.ones((3, 2)) * 4))
    up = vectors((0, 0, 1), (0, 0, 1))
    expected = {"Position": 4, "Normal": normal, "True Normal": up, "Incoming": wo}
    for output, array in expected.items():
        found = of(Node("NewGeometry", ""), output, at, "vector")
        np.testing.assert_array_equal(found, np.broadcast_to(array, (3, 2)))
    np.testing.assert_array_equal(of(Node("NewGeometry", ""), "Backfacing", at), [0, 1])


PATHS = {
    "Is Camera Ray": CAMERA,
    "Is Shadow Ray": SHADOW,
    "Is Diffuse Ray": DIFFUSE,
    "Is Glossy Ray": GLOSSY,
    "Is Singular Ray": SINGULAR,
    "Is Transmission Ray": TRANSMISSION,
}
KINDS = (
    CAMERA,
    SHADOW,
    DIFFUSE,
    GLOSSY,
    GLOSSY | SINGULAR,
    GLOSSY | TRANSMISSION,
    DIFFUSE | TRANSMISSION,
)


@pytest.mark.parametrize("output", (*PATHS, "Is Reflection Ray", "Is Volume Scatter Ray"))
def test_light_path_tells_the_kind_of_ray(output):
    at = seen_from(*([0.7] * len(KINDS)))
    found = of(Node("LightPath", ""), output, context(at, kind=np.array(KINDS, np.uint8)))
    reflected = (False, False, True, True, True, False, False)
    expected = {"Is Reflection Ray": reflected, "Is Volume Scatter Ray": (False,)}
    expected = expected.get(output) or [bool(kind & PATHS[output]) for kind in KINDS]
    np.testing.assert_array_equal(found, np.array(expected, float))
    for kind, yes in zip(KINDS, np.broadcast_to(expected, len(KINDS)), strict=True):
        one = of(Node("LightPath", ""), output, context(at, kind=kind))
        np.testing.assert_array_equal(one, float(yes))


def test_light_path_counts_bounces():
    at = seen_from(0.5, 0.5, distance=2.0)
    known = context(
        at,
        depth=9,
        count=np.array([[0, 1], [2, 3], [4, 5]], np.int16),
        total=np.array([6, 7], np.int16),
        passed=np.array([0, 8], np.int16),
        length=np.array([0, 1.5], F32),
    )
    matte = context(at, depth=3)
    for output, expected, alone in (
        ("Ray Depth", (6, 7), 3),
        ("Diffuse Depth", (0, 1), 3),
        ("Glossy Depth", (2, 3), 0),
        ("Transmission Depth", (4, 5), 0),
        ("Transparent Depth", (0, 8), 0),
        ("Ray Length", (2, 3.5), 2),
    ):
        np.testing.assert_array_equal(of(Node("LightPath", ""), output, known), expected)
        np.testing.assert_array_equal(of(Node("LightPath", ""), output, matte), alone)


def test_some_of_the_points_are_read_alone():
    cosines = (1.0, 0.9, 0.5, 0.2)
    at = context(seen_from(*cosines), np.array([3, 1]))
    np.testing.assert_allclose(of(layer_weight(0.5).node, "Facing", at), [0.8, 0.1], atol=1e-6)
