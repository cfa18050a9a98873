"""core.bsdf.smooth -> mirrors and glass obey the laws of reflection, Snell and Fresnel."""

import numpy as np
import pytest

from penumbra.core.bsdf import REGISTRY, fresnel
from tests.physics.test_closures import COSINES, FLIP, towards

F32 = np.float32
ETAS = (0.5, 0.9, 1.0001, 1.33, 1.5, 2.4, 1 / 1.5)
WHITE = np.ones((3, 1), F32)

etas = pytest.mark.parametrize("eta", ETAS)
transmitting = pytest.mark.parametrize("name", ("smooth glass", "smooth refraction"))


def parameters(name, eta):
    """A dielectric's own curve, without tints."""
    eta = np.full(1, eta, F32)
    return (eta, fresnel.f0_from_ior(eta) * WHITE, WHITE, WHITE)[: len(REGISTRY[name].PARAMETERS)]


def refracted(name, eta, wo):
    """The refracted direction (3, n) and its weight (n,)."""
    *_, (wi, weight) = REGISTRY[name].branches(parameters(name, eta), wo)
    return wi, np.broadcast_to(weight, wo.shape)[0]


def test_a_mirror_reflects_by_the_law_and_by_its_model():
    wo = towards(COSINES)
    f0 = np.array([[0.9], [0.5], [0.1]], F32)
    ((wi, weight),) = REGISTRY["smooth reflection f82"].branches((f0, np.zeros((3, 1), F32)), wo)
    np.testing.assert_array_equal(wi, wo * F32([[-1], [-1], [1]]))
    np.testing.assert_allclose(weight, f0 + (1 - f0) * (1 - COSINES) ** 5, atol=1e-6)


@etas
def test_glass_reflects_what_fresnel_says(eta):
    wo = towards(COSINES)
    (_, weight), _ = REGISTRY["smooth glass"].branches(parameters("smooth glass", eta), wo)
    expected, _ = fresnel.dielectric(wo[2], np.full(1, eta, F32))
    np.testing.assert_allclose(weight, np.broadcast_to(expected, weight.shape), atol=1e-6)


@etas
@transmitting
def test_nothing_is_refracted_where_reflection_is_total(name, eta):
    wo = towards(COSINES)
    _, weight = refracted(name, eta, wo)
    total = np.sqrt(1 - wo[2].astype(float) ** 2) > float(F32(eta))
    np.testing.assert_array_equal(weight == 0, total)


def test_glass_of_index_1_is_transparent():
    wo = towards(COSINES)
    (_, reflected), (wi, through) = REGISTRY["smooth glass"].branches(
        parameters("smooth glass", 1), wo
    )
    assert reflected.max() == 0
    assert through.min() == 1
    np.testing.assert_allclose(wi, -wo, atol=1e-7)


def test_a_thin_pane_lets_light_go_straight_on():
    wo = towards(COSINES)
    ((wi, weight),) = REGISTRY["smooth thin"].branches((), wo)
    np.testing.assert_array_equal(wi, -wo)
    assert weight.min() == weight.max() == 1


@etas
@transmitting
def test_refracted_directions_obey_snell(name, eta):
    wo = towards(COSINES)
    wi, weight = refracted(name, eta, wo)
    through = np.flatnonzero(weight > 0)
    assert through.size > 30
    np.testing.assert_allclose(wi[:2, through] * F32(eta), -wo[:2, through], atol=1e-6)
    np.testing.assert_allclose((wi[:, through] ** 2).sum(axis=0), 1, atol=2e-6)
    assert wi[2, through].max() < 0


@etas
@transmitting
def test_refracted_light_finds_its_way_back(name, eta):
    wo = towards(COSINES)
    wi, there = refracted(name, eta, wo)
    open_ = np.flatnonzero((there > 0) & (wo[2] > 0.02) & (wi[2] < -0.02))
    assert open_.size > 50

    # The same surface seen from the other side: its frame is the mirrored one.
    home, back = refracted(name, 1 / eta, (wi * FLIP)[:, open_])
    np.testing.assert_allclose(home, (wo * FLIP)[:, open_], atol=3e-5)
    np.testing.assert_allclose(back, there[open_], atol=1e-4)
