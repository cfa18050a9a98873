"""shadow terminator settings of objects -> what light that grazes smooth surfaces does."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Settings, compile_plan
from tests.support import scenes as s

VIEW = s.orthographic((0, -5, 0), (0, 0, 0), size=32, scale=2.2)
SUN = s.sun((1.0, 0.0, 0.0))
BALL = s.put(s.sphere(1.0, 5), s.diffuse(1.0))


def lit(ball, sun=SUN):
    return s.pixels(VIEW, ball, sun, max_bounces=0, samples=16, pattern="JITTERED")[..., 1]


def test_objects_of_blenders_default_ask_for_nothing():
    plan = compile_plan(s.scene(VIEW, BALL, SUN), Settings())
    assert plan.triangles.objects.terminator_geometry is None
    assert not plan.shifts_terminators
    assert not plan.triangles.is_numbered


@pytest.mark.parametrize("offset", (0.2, 1.0))
def test_a_shading_offset_makes_the_cosine_fall_faster(offset):
    # From aside: x is the cosine of the light in the middle row, angle times speed its new one.
    before = lit(BALL)[15:17].mean(axis=0)
    after = lit(replace(BALL, terminator_shading=offset))[15:17].mean(axis=0)
    x = ((np.arange(32) + 0.5) / 32 - 0.5) * 2.2
    some = np.flatnonzero((x > 0.15) & (x < 0.9))
    speed = 1 / (1 - 0.5 * offset)
    expected = np.maximum(np.cos(np.arccos(x[some]) * speed), 0) / x[some]
    np.testing.assert_allclose(after[some] / before[some], expected, atol=0.06)
    assert before[some].min() > 0.03


def test_scattered_rays_are_dimmed_too():
    ball = replace(BALL, terminator_shading=1.0)
    sky = s.world()
    # A white ball under a white sky is 1; with cos(2 a) for cos(a), up to 45 degrees, it is the
    # integral of 2 cos(2 a) sin(a): (2 sqrt(2) - 2) / 3
    hit = s.pixels(s.camera((0, -4, 0), size=4, fov=4), ball, sky, samples=4096, max_bounces=1)
    assert hit[..., 1].mean() == pytest.approx((2 * np.sqrt(2) - 2) / 3, abs=0.01)


def test_without_a_geometry_offset_facets_show_at_the_terminator():
    coarse = s.put(s.sphere(1.0, 0), s.diffuse(1.0))
    sun = s.sun((0.6, -0.2, 0.9))
    usual = lit(coarse, sun)
    without = lit(replace(coarse, terminator_geometry=0.0), sun)
    assert without.sum() < 0.95 * usual.sum()
    assert (without <= usual).all()


def test_each_object_has_its_own():
    # Two balls that do not shade each other
    pair = [
        s.put(s.sphere(1.0, 3), s.diffuse(1.0), to_world=s.affine(None, (0, 0, z))) for z in (-2, 2)
    ]
    view = s.orthographic((0, -5, 0), (0, 0, 0), size=32, scale=6.2)
    pair[1] = replace(pair[1], terminator_shading=1.0)
    image = s.pixels(view, *pair, SUN, max_bounces=0, samples=4)[..., 1]
    lower, upper = image[:16].sum(), image[16:].sum()
    assert min(lower, upper) < 0.7 * max(lower, upper)
    assert upper < lower
