"""Skies have the radiance that Cycles' Sky Texture has, and their suns are where they seem."""

import json

import numpy as np
import pytest

from penumbra.core.arrays import F32
from penumbra.core.images.projection import equirectangular_invert
from penumbra.core.shading.sky import compile_sky
from tests.physics.cycles_skies import FILE, HEIGHT, KEPT, SKIES, WIDTH


def directions(width, height, kept=slice(None)):
    """Return the middles (3, N) of pixels of an equirectangular picture."""
    u = ((np.arange(width) + 0.5) / width)[kept]
    v = ((np.arange(height) + 0.5) / height)[kept]
    u, v = np.meshgrid(u, v)
    return equirectangular_invert(u.ravel().astype(F32), v.ravel().astype(F32))


def cycles(name):
    """Return Cycles' radiance (3, N) of `directions(WIDTH, HEIGHT, KEPT)`."""
    return np.array(json.loads(FILE.read_text("utf-8"))[name]).reshape(-1, 3).T


@pytest.mark.parametrize("name", SKIES)
def test_a_sky_is_the_one_that_cycles_renders(name):
    expected = cycles(name)
    seen = compile_sky(SKIES[name]).radiance(directions(WIDTH, HEIGHT, KEPT))
    assert seen.dtype == np.float32
    scale = np.maximum(expected, 0.1 * expected.mean(axis=0))  # as some have next to no blue
    scale = np.maximum(scale, 1e-3 * expected.mean())
    error = (np.abs(seen - expected) / scale).max(axis=0).reshape(8, 16)
    assert error[4:].max() < 5e-4

    # Below the horizon float32 places the ground, in Cycles, up to 0.2 % off
    assert error[:4].max() < 2e-3


def sunny(**changes):
    return SKIES["multiple"] | {"sun_disc": True, "sun_size": 0.01, "sun_intensity": 1.0} | changes


@pytest.mark.parametrize("kind", ["SINGLE_SCATTERING", "MULTIPLE_SCATTERING"])
@pytest.mark.parametrize(("elevation", "rotation"), [(0.5, 0.0), (0.3, 2.0), (2.0, -1.0)])
def test_the_disc_is_where_the_sun_is_and_has_its_mean_radiance(kind, elevation, rotation):
    sky = compile_sky(sunny(sky_type=kind, sun_elevation=elevation, sun_rotation=rotation))
    (disc,) = sky.discs
    middle = np.array(disc.direction).reshape(3, 1)

    # Look at the disc in rings of equal area
    side = np.cross(middle[:, 0], (0.3, 0.2, 0.1)).reshape(3, 1)
    side /= np.linalg.norm(side)
    other = np.cross(middle[:, 0], side[:, 0]).reshape(3, 1)
    radius, phi = np.meshgrid(
        np.sqrt((np.arange(64) + 0.5) / 64) * disc.half_angle, np.arange(32) / 32 * 2 * np.pi
    )
    radius, phi = radius.ravel(), phi.ravel()
    direction = middle * np.cos(radius)
    direction = direction + (side * np.cos(phi) + other * np.sin(phi)) * np.sin(radius)
    direction = direction.astype(F32)
    sun = sky.radiance(direction) - sky.radiance(direction, with_sun=False)
    assert sun.mean(axis=1) == pytest.approx(disc.radiance, rel=5e-3)

    # The rim is dark, and beyond it there is none
    order = np.argsort(radius)
    assert sun[:, order[-32:]].mean() < 0.6 * sun[:, order[:32]].mean()
    around = directions(512, 256)
    outside = disc.chord(around) > disc.largest_chord
    both = sky.radiance(around), sky.radiance(around, with_sun=False)
    assert (both[0][:, outside] == both[1][:, outside]).all()


def test_a_sun_below_the_horizon_shines_on_nobody():
    for kind in ("SINGLE_SCATTERING", "MULTIPLE_SCATTERING"):
        sky = compile_sky(sunny(sky_type=kind, sun_elevation=-0.2))
        assert not sky.discs
        assert sky.radiance(directions(32, 16)).max() < 1


@pytest.mark.parametrize("kind", ["SINGLE_SCATTERING", "MULTIPLE_SCATTERING"])
@pytest.mark.parametrize("elevation", [-1.5, -0.1, 0.0, 1.57])
def test_no_air_and_no_sun_makes_a_sky_that_is_not_finite(kind, elevation):
    around = np.concatenate(
        [directions(16, 8), np.eye(3, dtype=F32), -np.eye(3, dtype=F32)], axis=1
    )
    for density, altitude in ((0.0, 0.0), (10.0, 60000.0), (10.0, 0.0)):
        air = dict.fromkeys(("air_density", "aerosol_density", "ozone_density"), density)
        sky = compile_sky(
            sunny(sky_type=kind, sun_elevation=elevation, altitude=altitude, sun_size=1.5, **air)
        )
        radiance = sky.radiance(around)
        assert np.isfinite(radiance).all()
        assert radiance.min() >= 0


def test_the_sky_of_blender_4_is_nearly_that_of_5_and_covered_by_its_sun():
    new = SKIES["single"] | {"sun_disc": True, "sun_size": 0.4, "sun_intensity": 1e-3}
    old = dict(new, sky_type="NISHITA")
    old["dust_density"] = old.pop("aerosol_density")
    around = directions(64, 32)
    four, five = compile_sky(old), compile_sky(new)
    seen = four.radiance(around, with_sun=False)
    assert seen[:, 1024:] == pytest.approx(
        five.radiance(around, with_sun=False)[:, 1024:], rel=0.02
    )

    # The ground is the horizon, faded by the direction's own z
    u = np.full(3, 0.3, F32)
    ground = equirectangular_invert(u, F32(0.5) - np.array([0, 0.05, 0.2], F32))
    seen = four.radiance(ground, with_sun=False)
    fade = np.maximum(1 + 2.5 * ground[2], 0) ** 3
    assert seen == pytest.approx(seen[:, :1] * fade, rel=1e-3)

    # In front of the sun there is no sky, and no sun below the horizon
    disc = four.discs[0]
    inside = (disc.chord(around) < disc.largest_chord) & (around[2] > 0)
    assert inside.sum() > 5
    added = five.radiance(around) - five.radiance(around, with_sun=False)
    assert four.radiance(around)[:, inside] == pytest.approx(added[:, inside], rel=0.01)
    below = around[2] < 0
    half = compile_sky(old | {"sun_size": 1.0})
    both = half.radiance(around), half.radiance(around, with_sun=False)
    assert (both[0] != both[1]).any()
    assert (both[0][:, below] == both[1][:, below]).all()


def test_a_kind_that_is_not_known_is_none():
    assert compile_sky({"sky_type": "HOSEK_WILKIE"}) is None


def test_turning_the_sun_turns_the_sky():
    still = compile_sky(SKIES["multiple"]).radiance(directions(64, 8)).reshape(3, 8, 64)
    turned = compile_sky(SKIES["multiple"] | {"sun_rotation": np.pi / 2})
    seen = turned.radiance(directions(64, 8)).reshape(3, 8, 64)
    assert seen == pytest.approx(np.roll(still, 16, axis=2), rel=1e-4)
