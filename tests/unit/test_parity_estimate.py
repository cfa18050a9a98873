"""an engine that only makes noise -> how the parity suite spends its time on it."""

import numpy as np
import pytest

from penumbra.parity import estimate as module
from penumbra.parity.estimate import FIRST_SEED, MANY, References, estimate
from penumbra.parity.statistics import BLOCK, SEEDS, Estimate


class Noise:
    """A worker whose pictures cost time of a clock of their own: a start, and every sample."""

    def __init__(self, noise, start, each=0.0):
        self.noise, self.start, self.each = noise, start, each
        self.now, self.asked = 0.0, []

    def open(self, name):
        return name

    def render(self, engine, samples, seed, threads):
        seconds = self.start + self.each * samples
        self.now += seconds
        self.asked.append((samples, seed))
        random = np.random.default_rng(seed)
        light = 1 + self.noise / samples**0.5 * random.standard_normal((2, 2, 4))
        picture = light.repeat(BLOCK, 0).repeat(BLOCK, 1).astype(np.float32)
        return {"seconds": seconds, "notes": []}, picture


def begun_by(worker, seeds, first=0):
    """Return a pilot of that worker, of 16 samples, as the seeds from `first` on give it."""
    result = Estimate(16, seeds=first)
    for seed in range(first, first + seeds):
        result.add(worker.render("CYCLES", 16, FIRST_SEED["CYCLES"] + seed, 1)[1], worker.start)
    return result


def spend(monkeypatch, worker, error, seconds, begun=None):
    """Return the estimate that a time of the worker's clock is enough for."""
    monkeypatch.setattr(module, "monotonic", lambda: worker.now)
    return estimate(worker, "CYCLES", error, seconds, 1, begun)[0]


def test_what_costs_to_start_gets_more_samples_and_not_ever_more_seeds(monkeypatch):
    """A map of the world that each render makes anew: 2 s of start, next to nothing for samples."""
    worker = Noise(0.5, start=2.0, each=0.0005)
    result = spend(monkeypatch, worker, 0.002, 240.0)
    assert result.error() <= 0.002
    assert worker.now < 250
    assert result.samples >= 256


def test_a_pilot_that_saw_too_little_does_not_hold_back_what_follows(monkeypatch):
    """Rare light: a pilot without it has no noise to speak of."""
    worker = Noise(0.5, start=0.1, each=0.0005)
    begun = begun_by(worker, MANY)
    assert begun.error() > 0.002
    result = spend(monkeypatch, worker, 0.002, 240.0, begun)
    assert result.error() <= 0.002
    assert len(result.chunks) >= SEEDS


def test_no_seed_is_rendered_twice_after_a_merge(monkeypatch):
    worker = Noise(0.5, start=2.0, each=0.0005)
    result = spend(monkeypatch, worker, 0.002, 100.0, begun_by(worker, SEEDS))
    seeds = [seed for _, seed in worker.asked]
    assert len(set(seeds)) == len(seeds) == result.seeds
    assert len(result.chunks) < result.seeds


def test_a_kept_reference_goes_on_with_new_seeds(monkeypatch, tmp_path):
    worker = Noise(0.5, start=2.0, each=0.0005)
    references = References(tmp_path, "5.2")
    monkeypatch.setattr(module, "monotonic", lambda: worker.now)
    first = references.make("scene", "print", worker, 100.0, 1)
    assert first.error() > 0.002
    first_seeds = {seed for _, seed in worker.asked}
    assert references.load("scene", "print").seeds == first.seeds
    worker.asked.clear()
    second = references.make("scene", "print", worker, 200.0, 1)
    assert second.error() < first.error()
    assert not first_seeds.intersection(seed for _, seed in worker.asked)


def test_seeds_of_merged_pictures_are_kept(tmp_path):
    references = References(tmp_path, "5.2")
    merged = begun_by(Noise(0.5, start=2.0), SEEDS)
    merged.merge()
    references.save("scene", "print", merged)
    kept = references.load("scene", "print")
    assert (len(kept.chunks), kept.seeds) == (SEEDS // 2, SEEDS)


def test_a_mean_of_merged_pictures_is_as_near_as_its_error_says(monkeypatch):
    """z-test over 40 estimates: the means of their blocks, chi square of 40 within five sigma."""
    scores = []
    for k in range(40):
        worker = Noise(0.5, start=2.0, each=0.0005)
        begun = begun_by(worker, SEEDS, first=10_000 * k)
        result = spend(monkeypatch, worker, 0.002, 150.0, begun)
        mean, se = result.regions()
        scores.append((mean[0, 0] - 1) / se[0, 0])
    total = float(np.square(scores).sum())
    assert total == pytest.approx(40, abs=5 * 80**0.5)
