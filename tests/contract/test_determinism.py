"""render -> the same picture on any number of threads, stopped in time, empty without complaint."""

import sys
import threading
from dataclasses import replace
from itertools import count
from time import perf_counter

import numpy as np
import pytest

from penumbra.core import Cancelled, Settings, compile_plan, render
from penumbra.core.batches import CHUNK
from penumbra.core.splits import splits_of
from penumbra.core.statistics import STATISTICS
from tests.support import scenes as s

VIEW = s.camera((0, -4, 2), (0, 0, 0.5), size=24, width=40)
STAGE = (
    s.put(s.quad((5, 0, 0), (0, 5, 0)), s.diffuse(0.7)),
    s.put(s.sphere(0.5), s.glass(), to_world=s.affine(1.0, (-0.6, 0, 0.6))),
    s.put(s.box(0.4), s.mirror(0.8), to_world=s.affine(1.0, (0.7, 0, 0.5))),
    s.area((1, -1, 3), radiance=5.0),
    s.point((-2, -1, 2), 2.0, radius=0.2),
    s.world(0.2),
)


def plan(view=VIEW, *things, **settings):
    return compile_plan(s.scene(view, *things), s.replace(s.DEFAULTS, **settings))


@pytest.mark.parametrize("pattern", ("SOBOL", "RANDOM", "JITTERED"))
def test_the_picture_has_the_same_bits_on_any_number_of_threads(pattern):
    described = plan(VIEW, *STAGE, pattern=pattern, samples=40, light_samples=2, scatter_samples=3)
    one, *others = (render(described, threads=threads) for threads in (1, 1, 2, 3, 7))
    for other in others:
        np.testing.assert_array_equal(one.film.sums, other.film.sums)  # doubles
        for key in ("rays_camera", "rays_shadow", "rays_reflection", "rays_transmission"):
            assert one.statistics[key] == other.statistics[key]


def test_a_picture_of_many_batches_has_the_same_bits_on_any_number_of_threads():
    view = s.camera((0, -4, 2), (0, 0, 0.5), size=100, width=1307)
    described = plan(view, *STAGE, samples=3, max_bounces=1)
    assert described.batch < 100 * 1307
    one, three = (render(described, threads=threads) for threads in (1, 3))
    np.testing.assert_array_equal(one.film.sums, three.film.sums)


def test_the_picture_does_not_depend_on_how_samples_are_cut_into_chunks():
    samples = 3 * CHUNK + 5
    whole = s.pixels(VIEW, *STAGE, samples=samples).astype(float)
    cuts = [0, 1, CHUNK - 1, CHUNK + 2, samples]
    total = np.zeros_like(whole)
    for first, end in zip(cuts, cuts[1:], strict=False):
        part = s.pixels(
            VIEW, *STAGE, samples=samples, use_sample_subset=True, sample_offset=first,
            sample_subset_length=end - first,
        )  # fmt: skip
        total += part.astype(float) * (end - first)
    np.testing.assert_allclose(total / samples, whole, rtol=1e-6, atol=1e-6)


def test_what_pays_is_measured_alike_on_any_threads_and_for_any_part_of_the_picture():
    view = s.camera((0, -4, 2), (0, 0, 0.5), size=160, width=160)
    glowing = *STAGE, s.area((0, 2, 2), (0, 0, 0.5), radiance=4.0, size=(1.5, 1.5))
    described = plan(view, *glowing, samples=60, max_bounces=2, sample_subset_length=2)
    described = replace(described, samples=(0, 2))
    one, three = (render(described, threads=threads) for threads in (1, 3))
    np.testing.assert_array_equal(one.film.sums, three.film.sums)
    later = replace(described, samples=(40, 41))
    part = replace(described, samples=(0, 1), rectangle=(10, 10, 40, 30))
    chosen = splits_of(one.plan)
    assert max(chosen.values()) > 1  # it was measured
    assert [splits_of(render(each, threads=2).plan) for each in (later, part)] == 2 * [chosen]


def test_another_seed_is_another_picture_and_the_frame_counts_only_if_asked():
    def picture(frame=0, **settings):
        described = s.scene(VIEW, *STAGE, frame=frame)
        return render(compile_plan(described, s.replace(s.DEFAULTS, **settings)), 1).combined()

    first = picture()
    assert (picture(seed=1) != first).any()
    np.testing.assert_array_equal(picture(frame=5), first)
    moving = [picture(frame=frame, use_animated_seed=True) for frame in (5, 6)]
    assert (moving[0] != moving[1]).any()


def test_stopping_keeps_what_is_there_and_answers_soon():
    described = plan(VIEW, *STAGE, samples=1_000_000)
    ticks = []

    def on_tick(progress):
        assert threading.current_thread() is threading.main_thread()
        ticks.append(perf_counter())
        return progress.sample >= 2

    picture = render(described, threads=2, on_tick=on_tick)
    assert perf_counter() - ticks[-1] < 1.0  # 100 ms are promised; a busy machine is slower
    assert not picture.complete
    assert 0 < picture.samples < 1_000_000
    image = picture.combined()
    assert np.isfinite(image).all()
    assert (image[..., :3].max(axis=2) > 0).all()
    assert (image[..., 3] == 1).all()
    assert list(picture.statistics) == [row.key for row in STATISTICS]


def test_who_does_not_linger_has_the_picture_while_batches_still_end(monkeypatch):
    module, goes_on, number = sys.modules["penumbra.core.render"], threading.Event(), count()
    sample = module._sample

    def held_up(*batch):
        if next(number):
            goes_on.wait(60)
        return sample(*batch)

    monkeypatch.setattr(module, "_sample", held_up)
    described = plan(
        VIEW, *STAGE, samples=1000, light_samples=1, scatter_samples=1, path_reuse="OFF"
    )
    picture = render(
        described, threads=2, on_tick=lambda progress: progress.sample >= 1, lingers=False
    )
    left = [t for t in threading.enumerate() if t.name.startswith("penumbra")]
    assert left
    before = picture.film.sums.copy()
    goes_on.set()
    for thread in left:
        thread.join(timeout=20)
        assert not thread.is_alive()
    np.testing.assert_array_equal(picture.film.sums, before)
    assert not picture.complete
    assert picture.samples >= 1


def test_stopping_at_the_first_tick_gives_a_picture_of_the_right_size():
    picture = render(plan(VIEW, *STAGE, samples=100_000), threads=1, on_tick=lambda progress: True)
    assert not picture.complete
    assert picture.combined().shape == (24, 40, 4)
    assert np.isfinite(picture.combined()).all()


def test_an_error_in_the_caller_stops_the_render_and_passes_through():
    def on_tick(progress):
        raise RuntimeError("from above")

    with pytest.raises(RuntimeError, match="from above"):
        render(plan(VIEW, *STAGE, samples=1_000_000), threads=2, on_tick=on_tick)
    assert not [t for t in threading.enumerate() if t.name.startswith("penumbra")]


def test_progress_grows_to_the_end_and_its_pictures_are_whole():
    seen = []

    def on_tick(progress):
        seen.append((progress.fraction, progress.picture().combined()))

    picture = render(plan(VIEW, *STAGE, samples=64), threads=1, on_tick=on_tick)
    fractions = [fraction for fraction, _ in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert picture.complete
    assert picture.samples == 64
    np.testing.assert_array_equal(seen[-1][1], picture.combined())


def test_a_time_limit_ends_a_render_that_then_counts_as_complete():
    picture = render(plan(VIEW, *STAGE, samples=1_000_000, time_limit=0.2), threads=1)
    assert picture.complete
    assert 0 < picture.samples < 1_000_000


def test_compiling_stops_when_asked():
    with pytest.raises(Cancelled):
        compile_plan(s.scene(VIEW, *STAGE), Settings(), should_stop=lambda: True)


# --- Small and empty scenes ---------------------------------------------------------------------

EMPTY = {
    "nothing": (),
    "no lamp": (STAGE[0],),
    "no geometry": STAGE[3:5],
    "black world": (s.world(0.0),),
    "black lamp": (STAGE[0], s.point((0, 0, 1), 0.0)),
    "black surface": (s.put(s.quad(), s.BLACK), STAGE[3]),
    "empty mesh": (s.put(s.mesh(np.zeros((0, 3)), np.zeros((0, 3), int)), s.diffuse()), STAGE[4]),
    "flat object": (s.put(s.box(), s.diffuse(), to_world=s.affine((0, 0, 1))),),
    "vanished object": (s.put(s.box(), s.diffuse(), to_world=s.affine(0.0)), STAGE[3]),
}


@pytest.mark.parametrize("splitting", (True, False))
@pytest.mark.parametrize("name", EMPTY)
def test_a_scene_without_light_is_black_and_no_error(name, splitting):
    image = s.pixels(VIEW, *EMPTY[name], splitting=splitting)
    assert (image[..., :3] == 0).all()
    assert (image[..., 3] == 1).all()
    clear = s.pixels(VIEW, *EMPTY[name], splitting=splitting, film_transparent=True)
    assert (clear[..., :3] == 0).all()


@pytest.mark.parametrize("samples", (1, 2, 17))
@pytest.mark.parametrize("size", ((1, 1), (1, 7), (7, 1)))
def test_the_smallest_pictures_are_rendered(size, samples):
    view = s.camera((0, -4, 2), (0, 0, 0.5), size=size[0], width=size[1])
    image = s.pixels(view, *STAGE, samples=samples)
    assert image.shape == (*size, 4)
    assert np.isfinite(image).all()
    assert (image[..., 1] > 0).all()


def test_a_sample_subset_past_the_end_is_an_empty_picture():
    picture = s.picture(
        VIEW, *STAGE, samples=4, use_sample_subset=True, sample_offset=9, sample_subset_length=2
    )
    assert picture.samples == 0
    assert (picture.combined() == 0).all()


def test_a_picture_of_broken_normals_has_no_nan():
    ball = s.sphere(levels=1)
    for bad in (np.nan, 0.0):
        normals = ball.normals.copy()
        normals[3] = bad
        broken = s.mesh(ball.positions, ball.triangles, normals)
        for material in (s.diffuse(), s.mirror(), s.glass()):
            image = s.pixels(s.camera((0, -3, 0)), s.put(broken, material), *STAGE[3:])
            assert np.isfinite(image).all()


def test_objects_of_any_size_and_place_give_no_nan():
    for scale in (1e-30, 1e-10, 1e10, 1e18):
        for shift in ((0, 0, 0), (1e12, 0, 0)):
            ball = s.put(s.sphere(levels=1), s.glass(), to_world=s.affine(scale, shift))
            image = s.pixels(s.camera((0, -3, 0)), ball, STAGE[0], *STAGE[3:])
            assert np.isfinite(image).all()
