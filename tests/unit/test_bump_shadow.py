"""core.geometry.terminator.bump_shadow -> what closures with bent normals keep of light."""

import numpy as np
import pytest

from penumbra.core.geometry.terminator import SOFTENINGS, bump_shadow

F32 = np.float32
UP = F32([[0], [0], [1]])


def towards(degrees):
    """Return unit vectors (3, n) tilted from up towards +x."""
    angle = np.radians(np.atleast_1d(degrees))
    return np.array([np.sin(angle), 0 * angle, np.cos(angle)], F32)


def kept(tilt, light, softening, is_diffuse=True, is_sampled=False):
    """Return what a normal tilted so keeps of light from these angles [degrees]."""
    wi = towards(light)
    smooth, normal = (np.broadcast_to(each, wi.shape) for each in (UP, towards(tilt)))
    return bump_shadow(smooth, normal, wi, softening, is_diffuse, is_sampled)


@pytest.mark.parametrize("softening", [*SOFTENINGS, "NONE"])
@pytest.mark.parametrize("tilt", (-70, -20, 20, 70))
def test_nothing_comes_from_behind_the_smooth_surface_where_the_bent_one_sees_it(softening, tilt):
    light = np.linspace(-89.5, 269.5, 360)
    smooth, bent = np.cos(np.radians(light)), np.cos(np.radians(light - tilt))
    found = kept(tilt, light, softening)
    assert (found[smooth * bent < 0] == 0).all()
    assert (found[smooth * bent > 0] > 0).all()
    assert found.max() <= 1 + 1e-6


@pytest.mark.parametrize("softening", SOFTENINGS)
def test_matte_closures_fade_to_black_at_the_terminator_and_keep_light_from_above(softening):
    found = kept(40, np.linspace(0, 90, 901), softening)
    assert found[0] == pytest.approx(1, abs=0.02)
    assert found[-1] == pytest.approx(0, abs=1e-3)
    assert (np.diff(found) <= 1e-6).all()
    assert 0.05 < found[700] < 0.95


def test_the_cubic_is_that_of_the_share_that_the_smooth_surface_gets():
    light = np.array([30.0, 60.0, 85.0])
    share = np.cos(np.radians(light)) / np.cos(np.radians(light - 50)) / np.cos(np.radians(50))
    expected = np.where(share < 1, share + share**2 - share**3, 1)
    assert (expected < 1).any() and (expected == 1).any()
    np.testing.assert_allclose(kept(50, light, "CUBIC"), expected, rtol=1e-5)


def test_without_softening_all_is_kept_in_front():
    assert (kept(60, np.linspace(-29, 89, 100), "NONE") == 1).all()


def test_glossy_closures_do_not_fade_and_keep_what_they_sent():
    light = np.array([0.0, 80.0, 95.0])
    assert kept(60, light, "CUBIC", is_diffuse=False).tolist() == [1, 1, 0]
    assert kept(60, light, "CUBIC", is_diffuse=False, is_sampled=True).tolist() == [1, 1, 1]
