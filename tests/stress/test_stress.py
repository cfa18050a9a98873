"""The short form of the stress tests: what shows most, with few samples.  See suite.py."""

from dataclasses import replace

import numpy as np
import pytest

from tests.stress import fuzz, suite, transforms
from tests.stress.scenes import SCENES
from tests.stress.sweeps import LONG, SWEEPS

SEEDS = 4
SOME = ("scale 1e-6", "scale 1e6", "shift 1e6", "mirrored", "stretched", "slivers")


@pytest.fixture(autouse=True)
def few_samples(monkeypatch):
    monkeypatch.setattr(suite, "SETTINGS", replace(suite.SETTINGS, samples=4))


@pytest.mark.parametrize("transform", SOME)
@pytest.mark.parametrize("scene", SCENES)
def test_the_picture_stays_the_same(scene, transform):
    row = suite.compare(scene, transform, SEEDS)
    assert row.is_good, suite.described(row)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        pytest.param(name, value, id=f"{name} {value:g}")
        for name, sweep in SWEEPS.items()
        for value in sweep.values
        if value < LONG.get(name, np.inf)
    ],
)
def test_extremes_give_pictures_with_the_light_they_should_have(name, value):
    row = suite.extreme(name, value, SEEDS)
    assert row.is_good, suite.described(row)


def test_a_transformation_that_changes_the_picture_is_found(monkeypatch):
    def darker(scene):
        return replace(scene, lamps=tuple(replace(x, strength=(7.8,) * 3) for x in scene.lamps))

    monkeypatch.setitem(transforms.TRANSFORMS, "darker", darker)
    row = suite.compare("matte", "darker", SEEDS)
    assert row.wrong > 0


def test_scenes_that_nobody_meant_are_drawn_or_refused():
    outcomes = [fuzz.outcome(seed) for seed in range(150)]
    assert not [text for text in outcomes if text.startswith("wrong")]
    assert sum(text == "drawn" for text in outcomes) > 30


def test_a_defect_behind_such_a_scene_is_found(monkeypatch):
    def broken(plan, threads):
        raise IndexError("planted")

    monkeypatch.setattr(fuzz, "render", broken)
    assert any("IndexError: planted" in fuzz.outcome(seed) for seed in range(10))
