"""adaptive sampling, passes -> each pixel's passes are those of as many samples as it has."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Lamp, batches, compile_plan, render
from penumbra.core.film.denoise import Denoising
from penumbra.core.film.passes import BY_NAME, PASSES
from penumbra.core.layer import MATTES, Layer
from penumbra.core.scene import ACTIVE_UV, Attribute
from tests.support import scenes as s
from tests.support.passes import every_kind_of_surface, half_clear

LIGHT = tuple(
    each.name for each in PASSES if "Direct" in each.name or "Indirect" in each.name
) + tuple(name for name in BY_NAME if name.endswith("Color"))
# All that are drawn from samples: neither time nor what is there for shadow catchers or motion only
NAMES = tuple(
    each.name
    for each in PASSES
    if each.name
    not in ("Shadow Catcher", "Noisy Shadow Catcher", "Vector", "Render Time", "Debug Sample Count")
)
EVERYTHING = Layer(passes=NAMES, mattes=MATTES, light_groups=("lamp", "world"))
ADAPTIVE = {
    "use_adaptive_sampling": True,
    "adaptive_threshold": 0.005,
    "adaptive_min_samples": 16,
    "samples": 256,
}


def matte_stage():
    """Light takes no detours here: what blocks of other sizes do to it is rounding."""
    shape = s.quad((5, 0, 0), (0, 5, 0))
    corners = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], np.float32)
    shape = replace(shape, attributes={ACTIVE_UV: Attribute("CORNER", corners)})
    lamp = replace(s.area((1, -1, 3), radiance=5.0), light_group="lamp")
    return (
        s.camera((0, -4, 2), (0, 0, 0.5), size=12, width=20),
        s.put(shape, s.diffuse(0.7), name="Floor"),
        s.put(s.box(0.4), s.diffuse(0.8), to_world=s.affine(1.0, (0.7, 0, 0.5)), name="Box"),
        s.put(s.quad((0.5, 0, 0), (0, 0, 0.5), (-0.8, -1, 0.6)), half_clear(), name="Veil"),
        lamp,
        replace(s.world(0.2), light_group="world"),
    )


def compiled(view, *things, layer=EVERYTHING, film_transparent=False, **settings):
    described = s.scene(view, *things, layer=layer, film_transparent=film_transparent)
    return compile_plan(described, replace(s.DEFAULTS, **ADAPTIVE | settings))


def pictures(picture):
    return {
        "Combined": picture.combined(),
        **{each.name: pixels for each, pixels in picture.passes()},
        **dict(picture.mattes()),
    }


def assert_uniform_where(picture, counts):
    """Hold each pixel against the uniform picture of as many samples."""
    found = pictures(picture)
    assert len(found) == 1 + len(NAMES) + 2 + 3 * len(MATTES)
    held = picture.film.counts.reshape(picture.film.height, picture.film.width)
    assert set(np.unique(held)) == set(counts)
    for count in counts:
        settings = {"samples": int(count), "use_adaptive_sampling": False}
        expected = pictures(render(compiled(*matte_stage(), **settings), threads=1))
        some = held == count
        for name, pixels in expected.items():
            np.testing.assert_allclose(
                found[name][some], pixels[some], rtol=2e-5, atol=2e-6, err_msg=f"{name} at {count}"
            )


def test_pixels_have_the_passes_and_mattes_of_as_many_samples_whoever_else_stopped():
    # Small blocks: those of later rounds hold pixels from all over the picture.
    picture = render(replace(compiled(*matte_stage()), batch=80), threads=2)
    counts = np.unique(picture.film.counts)
    assert len(counts) > 2
    assert_uniform_where(picture, counts)


def test_those_that_had_stopped_catch_up_in_their_passes_as_well(monkeypatch):
    class Told(batches.Judge):
        def judge(self, count):
            everybody = np.arange(self.film.counts.size)
            return {16: everybody[::3], 32: everybody[::2]}.get(count, everybody[:0]), 1.0

    monkeypatch.setattr(batches, "Judge", Told)
    picture = render(compiled(*matte_stage()), threads=2)
    assert_uniform_where(picture, (16, 32, 64))


def test_the_light_passes_and_groups_add_up_to_the_picture_in_every_pixel():
    view, *things = every_kind_of_surface(12)
    names = (*LIGHT, "Emission", "Environment")
    things = [replace(thing, light_group="all") for thing in things]
    layer = Layer(passes=names, light_groups=("all",))
    settings = {"adaptive_threshold": 0.03, "film_exposure": 1.7}
    picture = render(compiled(view, *things, layer=layer, **settings), threads=2)
    assert len(np.unique(picture.film.counts)) > 2
    found = pictures(picture)
    total = found["Emission"] + found["Environment"]
    for lobe in ("Diffuse", "Glossy", "Transmission"):
        light = found[f"{lobe} Direct"] + found[f"{lobe} Indirect"]
        total = total + light * found[f"{lobe} Color"]
    np.testing.assert_allclose(total, found["Combined"][..., :3], rtol=4e-6, atol=2e-6)
    group = found["Combined_all"]
    np.testing.assert_allclose(group, found["Combined"][..., :3], rtol=4e-6, atol=2e-6)


def glow_over_a_shadow():
    """What glows evenly covers the left of the picture, noise the right."""
    return (
        s.orthographic((0, 0, 10), size=16, scale=2.0),
        s.put(s.quad((1, 0, 0), (0, 2, 0), (-1, 0, 2)), s.emission((0.5, 0.25, 0.7)), name="Glow"),
        s.put(s.quad((9, 0, 0), (0, 9, 0)), s.diffuse(0.8), name="Floor"),
        s.put(s.box(0.2), s.diffuse(0.5), to_world=s.affine(1.0, (0.5, 0, 0.4)), name="Box"),
        s.area((0.6, 0.2, 3), radiance=20.0),
    )


def test_flat_passes_are_exact_and_the_sample_count_is_the_true_one_where_pixels_stopped():
    layer = Layer(passes=("Emission", "Debug Sample Count", "Depth"), mattes=("CryptoObject",))
    picture = render(compiled(*glow_over_a_shadow(), layer=layer), threads=2)
    counts = picture.film.counts.reshape(16, 16)
    assert (counts[:, :4] == 16).all()
    assert counts.max() == 256
    found = pictures(picture)
    expected = np.zeros((16, 16, 3), np.float32)
    expected[:, :8] = (0.5, 0.25, 0.7)
    np.testing.assert_allclose(found["Emission"], expected, rtol=1e-6)
    np.testing.assert_array_equal(found["Debug Sample Count"][..., 0], np.float32(counts / 256))
    np.testing.assert_allclose(found["Depth"][:, :8], 8.0, rtol=1e-6)
    weights = sum(found[f"CryptoObject{place:02}"][..., 1::2].sum(axis=-1) for place in range(3))
    np.testing.assert_allclose(weights, 1.0, rtol=1e-6)


def test_passes_have_the_same_bits_on_any_number_of_threads():
    plan = replace(compiled(*matte_stage(), samples=64), batch=80)
    one, other = (render(plan, threads=threads) for threads in (1, 3))
    np.testing.assert_array_equal(one.film.sums, other.film.sums)
    for name, pixels in pictures(one).items():
        np.testing.assert_array_equal(pixels, pictures(other)[name], err_msg=name)


def test_shadows_in_a_pass_of_their_own_are_judged_as_those_in_the_picture():
    floor = s.put(s.quad((9, 0, 0), (0, 9, 0)), s.diffuse(0.8))
    floor = replace(floor, is_shadow_catcher=True)
    roof = s.put(s.quad((0.5, 0, 0), (0, 9, 0), (0.5, 0, 3)), s.diffuse(0.0))
    roof = replace(roof, seen_by=replace(roof.seen_by, camera=False))
    sun = Lamp("Sun", "SUN", s.affine(1, (0, 0, 5)), (1.0, 1.0, 1.0), angle=0.1)
    things = s.orthographic((0, 0, 10), size=16, scale=2.0), floor, roof, sun
    settings = {"film_transparent": True, "max_bounces": 0}
    layers = Layer(passes=("Shadow Catcher",)), Layer()
    apart, within = (render(compiled(*things, layer=each, **settings), 1) for each in layers)
    assert len(np.unique(within.film.counts)) > 2
    np.testing.assert_array_equal(apart.film.counts, within.film.counts)


@pytest.mark.parametrize(
    ("settings", "stops", "is_denoised"),
    (
        ({}, False, True),
        ({"samples": 1_000_000, "adaptive_threshold": 1e-6, "time_limit": 0.2}, False, True),
        ({"samples": 1_000_000, "adaptive_threshold": 1e-6}, True, False),
    ),
    ids=("all stopped", "time limit", "stopped by the user"),
)
def test_whole_pictures_are_denoised(monkeypatch, settings, stops, is_denoised):
    monkeypatch.setitem(render.__globals__, "denoise", lambda colour, *_: colour * 0 + 0.25)
    how = Denoising(has_albedo=False, has_normal=False, prefilter="NONE", quality="FAST")
    plan = replace(compiled(*glow_over_a_shadow(), layer=Layer(), **settings), denoising=how)
    picture = render(plan, 1, lambda progress: stops and progress.sample > 40)
    assert picture.complete == is_denoised
    assert (picture.film.denoised is not None) == is_denoised
