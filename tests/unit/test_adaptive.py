"""core.film.adaptive -> how well the error is told, and who goes on for whom."""

import numpy as np
import pytest

from penumbra.core.film.adaptive import Adaptive, Judge
from penumbra.core.film.film import new_film

WIDTH, HEIGHT = 40, 40
MIDDLE = WIDTH * HEIGHT // 2 + WIDTH // 2


def judge_of(threshold=0.02, first=64, passes=("combined",), exposure=1.0):
    film = new_film(WIDTH, HEIGHT, passes)
    return Judge(film, Adaptive(threshold, first), exposure)


def give(judge, samples, pixels=slice(None)):
    """Add samples (n, C, pixels); what is there at powers of two is kept, as in a render."""
    n = len(samples)
    judge.film.add(pixels, samples[: n // 4].sum(axis=0), n // 4)
    judge.keep(pixels)
    judge.film.add(pixels, samples[n // 4 : n // 2].sum(axis=0), n // 4)
    judge.keep(pixels)
    judge.film.add(pixels, samples[n // 2 :].sum(axis=0), n // 2)


def judged(judge, count):
    """Measure the errors, and decide who goes on."""
    for _ in judge.measure(count):
        pass
    return judge.judge(count)


def play(judge, draw, most):
    """Sample until nobody goes on, as a render does; draw(pixels, n) are sums (C, pixels)."""
    film, count = judge.film, judge.adaptive.first
    everybody = np.arange(WIDTH * HEIGHT)
    for part in (count // 4, count // 4, count // 2):
        if film.counts[0]:
            judge.keep(everybody)
        film.add(everybody, draw(everybody, part), part)
    while count < most:
        going, _ = judged(judge, count)
        while (late := going[film.counts[going] < count]).size:
            behind = film.counts[late].min()
            late = late[film.counts[late] == behind]
            judge.keep(late)
            film.add(late, draw(late, behind), behind)
        if not going.size:
            return
        judge.keep(going)
        film.add(going, draw(going, count), count)
        count *= 2


def flat(value=0.3, rows=3, n=64):
    return np.full((n, rows, WIDTH * HEIGHT), float(value))


@pytest.mark.parametrize("brightness", (0.02, 0.5, 3.0))
def test_the_estimate_is_the_true_error_of_independent_samples(brightness):
    # Grey exponential samples: the error of the mean is brightness / sqrt(n) in each channel.
    random = np.random.default_rng(1)
    n = 64
    noise = random.exponential(brightness, (n, 1, WIDTH * HEIGHT)).repeat(3, axis=1)
    judge = judge_of(threshold=1.0)
    give(judge, noise)
    judged(judge, n)
    scale = np.sqrt(3 * brightness) if 3 * brightness < 1 else 3 * brightness
    truth = (3 * brightness / np.sqrt(n) / scale) ** 2
    # The larger of two squared normal numbers, |now| and |before| of equal variance: 1 + 2 / pi.
    expected = truth * (1 + 2 / np.pi)
    mean, error = judge.error.mean(), judge.error.std() / np.sqrt(judge.error.size)
    assert error < 0.05 * expected
    assert abs(mean - expected) < 4 * error + 0.06 * expected  # the brightness is an estimate, too


def test_exposure_is_part_of_the_picture_that_is_judged():
    random = np.random.default_rng(2)
    noise = random.random((64, 3, WIDTH * HEIGHT))
    errors = []
    for exposure, samples in ((4.0, noise / 4), (1.0, noise)):
        judge = judge_of(exposure=exposure)
        give(judge, samples)
        judged(judge, 64)
        errors.append(judge.error)
    np.testing.assert_allclose(*errors, rtol=1e-3)


@pytest.mark.parametrize(("factor", "reach"), ((1.2, None), (1.5, 1), (3.0, 4)))
def test_a_noisy_pixel_takes_its_neighbours_along_and_others_stop(factor, reach):
    # Above 5 thresholds it counts for 3 x 3 pixels; above 15, means of 5 x 5 exceed 3.
    samples = flat()
    samples[32:, :, MIDDLE] *= factor  # the halves differ
    judge = judge_of()
    give(judge, samples)
    going, expected = judged(judge, 64)
    error = np.sqrt(judge.error[MIDDLE])
    assert {None: error < 5, 1: 5 < error < 15, 4: error > 15}[reach]
    steps = range(-reach, reach + 1) if reach else ()
    assert sorted(going) == [MIDDLE + dy * WIDTH + dx for dy in steps for dx in steps]
    assert expected >= 2 * 64 * len(going)


def test_halves_that_agree_by_chance_are_held_back_by_the_quarters():
    samples = flat()
    samples[:16] *= 3
    samples[32:48] *= 3  # so the halves have the same mean
    judge = judge_of()
    give(judge, samples)
    assert judged(judge, 64)[0].size == WIDTH * HEIGHT


def test_pixels_that_had_stopped_go_on_when_a_neighbour_finds_a_bright_path():
    judge = judge_of()
    samples = flat()
    samples[32:, :, MIDDLE] *= 2.0
    give(judge, samples)
    first, _ = judged(judge, 64)
    judge.keep(first)
    corner = first.max()  # those beyond it have stopped
    more = flat()[..., first]
    more[:, :, first == corner] = 50.0
    judge.film.add(first, more.sum(axis=0), 64)
    second, expected = judged(judge, 128)
    assert {corner + 1, corner + WIDTH, corner + WIDTH + 1} <= set(second) - set(first)
    assert expected > 2 * 128 * len(second)


def test_a_faint_difference_in_the_dark_counts_more_than_in_the_light():
    def error(value):
        samples = flat(value)
        samples[32:] += 0.01
        judge = judge_of()
        give(judge, samples)
        judged(judge, 64)
        return judge.error.mean()

    assert error(0.01) > 5 * error(0.3) > 25 * error(3.0)


def test_alpha_is_judged_as_well():
    samples = flat(0.0, rows=4)
    samples[::2, 3] = 1.0
    judge = judge_of(passes=("combined", "alpha"))
    give(judge, samples)
    assert not judged(judge, 64)[0].size  # half covered, in both halves
    samples[:32, 3] = 0.2
    judge = judge_of(passes=("combined", "alpha"))
    give(judge, samples)
    assert judged(judge, 64)[0].size == WIDTH * HEIGHT


def test_the_shadow_of_a_catcher_is_judged_as_alpha():
    passes = ("combined", "alpha", "caught", "opacity", "alone")
    samples = flat(0.0, rows=11)
    samples[:, 4:7], samples[:, 7], samples[:, 8:11] = 0.5, 1.0, 0.5  # no shadow
    judge = judge_of(passes=passes)
    give(judge, samples)
    assert not judged(judge, 64)[0].size
    samples[32:, 4:7] = 0.1
    judge = judge_of(passes=passes)
    give(judge, samples)
    assert judged(judge, 64)[0].size == WIDTH * HEIGHT


def test_black_pixels_stop():
    judge = judge_of()
    give(judge, flat(0.0))
    assert not judged(judge, 64)[0].size


def rare(random, pixels, n):
    """Light of mean 0.5 that one path in twenty finds."""
    return random.binomial(n, 0.05, pixels) * 10.0


def soft(random, pixels, n):
    """Exponential samples of mean 0.5: n of them add up to a gamma distribution."""
    return random.gamma(n, 0.5, pixels)


@pytest.mark.parametrize(("light", "threshold"), ((rare, 0.06), (soft, 0.03)))
def test_stopping_changes_the_mean_of_a_picture_by_less_than_half_a_percent(light, threshold):
    # z-test over seeds: the bias and 4 of its standard errors together stay below the bound.
    means, counts, patches = [], [], []
    for seed in range(24):
        random = np.random.default_rng(seed)
        judge = judge_of(threshold)
        play(judge, lambda pixels, n, r=random: light(r, pixels.size, n)[None].repeat(3, 0), 4096)
        picture = judge.film.combined(1.0)[..., 0] / 0.5 - 1
        means.append(picture.mean())
        patches.append(picture.reshape(5, 8, 5, 8).mean(axis=(1, 3)))
        counts.append(judge.film.counts.mean())
    error = np.std(means) / np.sqrt(len(means))
    assert 64 < np.mean(counts) < 4096  # some stop, some go on
    assert abs(np.mean(means)) + 4 * error < 0.005
    # No patch is off by more than 5 of its own standard errors and the bound.
    mean, spread = np.mean(patches, axis=0), np.std(patches, axis=0) / np.sqrt(len(patches))
    assert (np.abs(mean) < 0.005 + 5 * spread).all()


def cycles(light, random, threshold, most):
    """Sample as Cycles does: looks each 16 samples; noisy pixels and those next to them go on."""
    sums, half, counts = np.zeros((3, WIDTH * HEIGHT))
    going, count = np.ones(WIDTH * HEIGHT, bool), 0
    while count < most and going.any():
        some = np.flatnonzero(going)
        first, second = light(random, some.size, 8), light(random, some.size, 8)
        sums[some] += first + second
        half[some] += 2 * first
        counts[some] += 16
        count += 16
        if count > 16 / threshold**0.3:
            brightness = 3 * sums / counts
            scale = 1e-4 + np.where(brightness < 1, np.sqrt(brightness), brightness)
            noisy = going & (3 * np.abs(sums - half) / counts / scale >= 5 * threshold)
            padded = np.pad(noisy.reshape(HEIGHT, WIDTH), 1)
            shifted = [padded[y : y + HEIGHT, x : x + WIDTH] for y in range(3) for x in range(3)]
            going = np.any(shifted, axis=0).reshape(-1)
    return sums / counts


def very_rare(random, pixels, n):
    """Light of mean 0.5 that one path in two thousand finds."""
    return random.binomial(n, 0.0005, pixels) * 1000.0


@pytest.mark.parametrize("light", (soft, rare, very_rare))
def test_the_same_threshold_leaves_less_noise_and_bias_than_the_rule_of_cycles(light):
    threshold, theirs, ours = 0.1, [], []
    for seed in range(8):
        random = np.random.default_rng(seed)
        theirs.append(cycles(light, random, threshold, 4096) / 0.5 - 1)
        judge = judge_of(threshold)
        play(judge, lambda pixels, n, r=random: light(r, pixels.size, n)[None].repeat(3, 0), 4096)
        ours.append(judge.film.combined(1.0)[..., 0] / 0.5 - 1)
    assert np.square(ours).mean() < np.square(theirs).mean()
    assert abs(np.mean(ours)) < abs(np.mean(theirs))
