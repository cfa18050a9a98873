"""Denoising where the library fails, or where there is nothing whole to denoise."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import compile_plan, render
from penumbra.core.film.denoise import DenoiseError, Denoising
from tests.support.passes import every_kind_of_surface
from tests.support.scenes import DEFAULTS, scene

ALONE = Denoising(has_albedo=False, has_normal=False, prefilter="NONE", quality="FAST")


@pytest.fixture
def plan():
    view, *things = every_kind_of_surface()
    return compile_plan(scene(view, *things), replace(DEFAULTS, samples=4))


def test_a_library_that_fails_leaves_the_noise_and_its_message(plan, monkeypatch):
    def refuse(*_):
        raise DenoiseError("out of memory")

    monkeypatch.setitem(render.__globals__, "denoise", refuse)
    picture = render(replace(plan, denoising=ALONE))
    assert [note.what for note in picture.notes] == [
        "Use Denoising: out of memory: the picture keeps its noise"
    ]
    np.testing.assert_array_equal(picture.combined(), render(plan).combined())


def test_what_the_library_returns_is_shown_brightened_and_with_the_alpha_of_the_samples(
    plan, monkeypatch
):
    monkeypatch.setitem(render.__globals__, "denoise", lambda colour, *_: colour * 0 + 0.25)
    picture = render(replace(plan, denoising=ALONE, exposure=2.0))
    assert not picture.notes
    assert (picture.combined()[..., :3] == 0.5).all()
    np.testing.assert_array_equal(
        picture.film.noisy(2.0), render(replace(plan, exposure=2.0)).combined()
    )


def test_a_render_that_was_stopped_keeps_its_noise(plan, monkeypatch):
    monkeypatch.setitem(render.__globals__, "denoise", lambda colour, *_: colour * 0)
    plan = replace(plan, denoising=ALONE, samples=(0, 100000))
    stopped = render(plan, on_tick=lambda progress: progress.sample >= 1)
    assert not stopped.complete
    assert stopped.combined()[..., :3].any()
    assert stopped.film.denoised is None
