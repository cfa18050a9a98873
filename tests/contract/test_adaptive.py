"""adaptive sampling -> the same bits on any threads, whole pictures, no cost where it is no use."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Settings, batches, compile_plan, render
from penumbra.core.film.adaptive import Adaptive
from tests.support import scenes as s

VIEW = s.camera((0, -4, 2), (0, 0, 0.5), size=24, width=40)
STAGE = (
    s.put(s.quad((5, 0, 0), (0, 5, 0)), s.diffuse(0.7)),
    s.put(s.sphere(0.5), s.glass(), to_world=s.affine(1.0, (-0.6, 0, 0.6))),
    s.put(s.box(0.4), s.mirror(0.8), to_world=s.affine(1.0, (0.7, 0, 0.5))),
    s.area((1, -1, 3), radiance=5.0),
    s.world(0.2),
)
MATTE = (  # light takes no detours: what threads or blocks do to it is rounding
    *STAGE[:1],
    s.put(s.box(0.4), s.diffuse(0.8), to_world=s.affine(1.0, (0.7, 0, 0.5))),
    *STAGE[3:],
)
ADAPTIVE = {"use_adaptive_sampling": True, "adaptive_threshold": 0.015, "adaptive_min_samples": 32}


def plan(*things, view=VIEW, **settings):
    return compile_plan(s.scene(view, *things), s.replace(s.DEFAULTS, **ADAPTIVE | settings))


def test_the_picture_has_the_same_bits_on_any_number_of_threads():
    described = plan(*STAGE, samples=300)
    one, *others = (render(described, threads=threads) for threads in (1, 2, 5))
    counts = one.film.counts
    assert len(np.unique(counts)) > 2
    assert counts.min() == 32
    assert one.complete
    assert one.statistics["samples_per_pixel"] == pytest.approx(counts.mean())
    for other in others:
        np.testing.assert_array_equal(one.film.counts, other.film.counts)
        np.testing.assert_array_equal(one.film.sums, other.film.sums)


def test_it_does_not_depend_on_how_pixels_are_cut_into_blocks():
    described = plan(*MATTE, samples=200, adaptive_threshold=0.002)
    whole = render(described, threads=1)
    cut = render(replace(described, batch=100), threads=2)
    np.testing.assert_array_equal(whole.film.counts, cut.film.counts)
    np.testing.assert_allclose(whole.film.sums, cut.film.sums, rtol=1e-5, atol=1e-4)


def test_a_pixel_has_the_samples_that_it_would_have_without():
    adaptive = render(plan(*MATTE, samples=256, adaptive_threshold=0.002), threads=1).film
    assert len(np.unique(adaptive.counts)) > 2
    for count in np.unique(adaptive.counts):
        some = adaptive.counts == count
        settings = {"samples": int(count), "use_adaptive_sampling": False}
        uniform = render(plan(*MATTE, **settings), threads=1).film
        np.testing.assert_allclose(adaptive.sums[:, some], uniform.sums[:, some], rtol=1e-5)


def test_those_that_had_stopped_catch_up_with_all_that_they_missed(monkeypatch):
    everybody = np.arange(VIEW.width * VIEW.height)
    turns = {32: everybody[::3], 64: everybody[::6], 128: everybody, 256: everybody[:0]}
    uniform = {
        count: render(plan(*MATTE, samples=count, use_adaptive_sampling=False), 1).film.sums
        for count in (64, 128, 256)
    }

    class Told(batches.Judge):
        def judge(self, count):
            if count == 256:
                np.testing.assert_allclose(self.half, uniform[128], rtol=1e-5)
                np.testing.assert_allclose(self.quarter, uniform[64], rtol=1e-5)
            return turns[count], 1.0

    monkeypatch.setattr(batches, "Judge", Told)
    film = render(plan(*MATTE, samples=512), threads=2).film
    assert (film.counts == 256).all()
    np.testing.assert_allclose(film.sums, uniform[256], rtol=1e-5)


def test_a_picture_without_noise_stops_at_the_minimum():
    picture = render(plan(s.world(0.5), samples=1000, adaptive_min_samples=50), threads=2)
    assert (picture.film.counts == 64).all()
    assert picture.complete
    np.testing.assert_allclose(picture.combined()[..., :3], 0.5, rtol=1e-6)


def test_a_threshold_that_is_never_reached_gives_the_uniform_picture():
    never = render(plan(*MATTE, samples=100, adaptive_threshold=1e-6), threads=2)
    noisy = never.film.counts == 100
    assert noisy.mean() > 0.7  # what sees nothing but the world has no noise
    always = render(plan(*MATTE, samples=100, use_adaptive_sampling=False), threads=2)
    np.testing.assert_allclose(never.combined(), always.combined(), rtol=1e-5)
    np.testing.assert_allclose(never.film.sums[:, noisy], always.film.sums[:, noisy], rtol=1e-5)


def test_progress_knows_that_pixels_stop():
    seen = []

    def on_tick(progress):
        seen.append((progress.fraction, progress.sample, progress.remaining))

    picture = render(plan(*STAGE, samples=100_000, adaptive_threshold=0.05), 1, on_tick)
    fractions = [fraction for fraction, _, _ in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert seen[-1][2] == 0
    assert seen[-1][1] == pytest.approx(picture.film.counts.mean())


def test_a_time_limit_leaves_a_whole_picture():
    picture = render(plan(*STAGE, samples=1_000_000, adaptive_threshold=1e-5, time_limit=0.3), 2)
    assert picture.complete
    assert 0 < picture.film.counts.min() <= picture.film.counts.max() < 1_000_000  # an hour
    assert np.isfinite(picture.combined()).all()


def test_a_stopped_render_is_not_complete():
    picture = render(plan(*STAGE, samples=1_000_000), 1, lambda progress: progress.sample > 40)
    assert not picture.complete


@pytest.mark.parametrize("pattern", ("POISSON", "JITTERED", "REGULAR"))
def test_patterns_of_a_fixed_size_get_all_their_samples_and_say_so(pattern):
    described = plan(*STAGE, samples=100, pattern=pattern)
    assert described.adaptive is None
    assert [note for note in described.notes if pattern in note.what]


def test_sample_subsets_get_all_their_samples_and_say_so():
    settings = {"use_sample_subset": True, "sample_offset": 8, "sample_subset_length": 80}
    described = plan(*STAGE, samples=100, **settings)
    assert described.adaptive is None
    assert [note for note in described.notes if "subset" in note.what]


def test_few_samples_are_not_judged_and_cost_nothing(monkeypatch):
    def fail(*arguments):
        raise AssertionError("not asked for")

    monkeypatch.setattr(batches, "Judge", fail)
    for settings in ({"use_adaptive_sampling": False}, {"samples": 32}):
        described = plan(*STAGE, **{"samples": 64} | settings)
        assert described.adaptive is None
        assert not described.notes
        render(described, threads=1)


def test_automatic_values_are_those_of_cycles():
    def compiled(**settings):
        return compile_plan(s.scene(VIEW, *STAGE), Settings(use_denoising=False, **settings))

    assert compiled().adaptive == Adaptive(0.01, 64)
    assert compiled(adaptive_threshold=0.1).adaptive == Adaptive(0.1, 64)
    assert compiled(adaptive_threshold=0.0, samples=500).adaptive == Adaptive(0.002, 128)
    assert compiled(adaptive_threshold=0.0).adaptive == Adaptive(0.001, 128)
    assert compiled(adaptive_min_samples=129).adaptive == Adaptive(0.01, 256)
    assert compiled(adaptive_min_samples=1).adaptive == Adaptive(0.01, 16)
    assert not compiled().notes
