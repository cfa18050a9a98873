"""planted differences -> verdict.  The parity suite's own test: it finds what is there only."""

import numpy as np
import pytest

from penumbra.parity.scenes import ALL, KNOWN, KNOWN_BEFORE, SCENES, known
from penumbra.parity.statistics import BLOCK, SEEDS, Estimate, compare, samples_for

SIZE = 4 * BLOCK


def scene():
    """Return a picture (H, W, 4): a gradient, one black block, one that is only red."""
    picture = np.ones((SIZE, SIZE, 4))
    picture[..., :3] *= np.linspace(0.1, 1.0, SIZE)[:, None, None]
    picture[:BLOCK, :BLOCK, :3] = 0.0
    picture[:BLOCK, BLOCK : 2 * BLOCK, 1:3] = 0.0
    return picture


def estimate(truth, noise=0.02, seed=0, seeds=SEEDS):
    """Return an estimate of a picture with relative noise of each pixel [of 1, per seed]."""
    random = np.random.default_rng(seed)
    result = Estimate(16)
    for _ in range(seeds):
        factor = 1 + noise * random.standard_normal((SIZE, SIZE, 1))
        result.add((truth * factor).astype(np.float32), 1.0)
    return result


def change(rows, columns, factor=1.0, plus=0.0, channels=slice(0, 3)):
    """Return the picture with one block changed."""
    picture = scene()
    at = slice(rows * BLOCK, (rows + 1) * BLOCK), slice(columns * BLOCK, (columns + 1) * BLOCK)
    picture[(*at, channels)] = picture[(*at, channels)] * factor + plus
    return picture


def test_equal_pictures_are_the_same():
    result = compare(estimate(scene(), 0.0), estimate(scene(), 0.0))
    assert result.same
    assert result.certain
    assert result.block.deviation == 0
    assert result.failed_blocks == 0


def test_noise_alone_never_makes_a_difference():
    # 100 pairs at the largest noise that is let through: 8,000 deviations.
    noise = 0.002 * BLOCK * SEEDS**0.5
    pairs = [(estimate(scene(), noise, 2 * k), estimate(scene(), noise, 2 * k + 1)) for k in
             range(100)]  # fmt: skip
    assert all(compare(*pair).same for pair in pairs)


@pytest.mark.parametrize("factor", [1.02, 0.98])
def test_a_difference_of_two_percent_in_one_block_is_found(factor):
    ours = estimate(change(2, 1, factor), 0.02, 1)
    result = compare(ours, estimate(scene(), 0.02, 2))
    assert result.certain
    assert not result.same
    assert (result.block.row, result.block.column, result.failed_blocks) == (2, 1, 1)
    assert result.block.deviation == pytest.approx(factor - 1, abs=5 * result.block.se)


def test_a_difference_of_two_percent_is_found_nine_times_in_ten_at_the_largest_noise():
    noise = 0.0021 * BLOCK * SEEDS**0.5
    found = 0
    for k in range(100):
        ours = estimate(change(2, 1, 1.02), noise, 2 * k + 1)
        found += not compare(ours, estimate(scene(), noise, 2 * k)).same
    assert found >= 85


def test_a_difference_of_half_a_percent_in_one_block_is_within_the_margin():
    assert compare(estimate(change(2, 1, 1.005), 0.02, 1), estimate(scene(), 0.02, 2)).same


def test_a_difference_just_within_the_margin_does_not_fail_by_noise():
    noise = 0.0021 * BLOCK * SEEDS**0.5
    for k in range(50):
        ours = estimate(change(2, 1, 1.008), noise, 2 * k + 1)
        assert compare(ours, estimate(scene(), noise, 2 * k)).same


def test_a_difference_of_one_channel_is_found():
    ours = estimate(change(3, 3, 1.03, channels=slice(2, 3)), 0.02, 1)
    result = compare(ours, estimate(scene(), 0.02, 2))
    assert not result.same
    assert result.block.channel == "blue"


def test_colour_that_leaks_into_a_block_without_it_is_found():
    ours = estimate(change(0, 1, plus=0.0004, channels=slice(2, 3)), 0.0, 1)
    assert not compare(ours, estimate(scene(), 0.0, 2)).same


def test_light_in_a_black_block_is_found():
    assert not compare(estimate(change(0, 0, plus=1e-3), 0.02, 1), estimate(scene(), 0.02, 2)).same
    assert compare(estimate(change(0, 0, plus=1e-6), 0.02, 1), estimate(scene(), 0.02, 2)).same


def test_alpha_counts():
    ours = estimate(change(1, 1, 0.97, channels=slice(3, 4)), 0.02, 1)
    assert compare(ours, estimate(scene(), 0.02, 2)).block.channel == "alpha"


def test_a_small_difference_everywhere_fails_the_picture_only():
    ours = estimate(scene() * [1.008, 1.008, 1.008, 1.0], 0.02, 1)
    result = compare(ours, estimate(scene(), 0.02, 2))
    assert not result.same
    assert result.failed_blocks == 0


def test_too_much_noise_is_not_certain():
    noise = 0.004 * BLOCK * SEEDS**0.5
    assert not compare(estimate(scene(), noise, 1), estimate(scene(), noise, 2)).certain


def test_pictures_that_are_black_all_over_are_the_same():
    black = scene() * 0.0
    assert compare(estimate(black, 0.0), estimate(black, 0.0)).same
    assert not compare(estimate(black + 1e-4, 0.0), estimate(black, 0.0)).same


def test_standard_errors_are_those_of_the_mean():
    # 200 estimates: the spread of their means is what each of them says of itself, within 10 %.
    estimates = [estimate(scene(), 0.1, seed) for seed in range(200)]
    means = np.stack([each.regions()[0] for each in estimates])
    said = np.sqrt(np.mean([each.regions()[1] ** 2 for each in estimates], axis=0))
    found = means.std(axis=0, ddof=1)
    lit = said > 0
    assert np.allclose(said[lit] / found[lit], 1, atol=0.25)
    assert np.mean(said[lit] / found[lit]) == pytest.approx(1, abs=0.05)


def test_merged_pictures_keep_the_mean_and_have_a_like_error():
    result = estimate(scene(), noise=0.5, seeds=400)
    picture, (mean, se) = result.picture, result.regions()
    result.merge()
    merged, merged_se = result.regions()
    assert (result.samples, len(result.chunks), result.seeds) == (32, 200, 400)
    assert np.allclose(result.picture, picture, rtol=1e-6)
    assert np.allclose(merged, mean, rtol=1e-12)
    # The spread of 200 and of 400 normal numbers: 5 % and 3.5 % of it
    assert np.allclose(merged_se, se, rtol=5 * 0.06)


def test_light_below_zero_is_judged_as_light_above_it_is():
    above, below = scene(), scene()
    below[..., 1] *= -1.0
    assert estimate(below).error() == pytest.approx(estimate(above).error())
    planted = below.copy()
    planted[2 * BLOCK : 3 * BLOCK, :BLOCK, 1] *= 1.03
    assert not compare(estimate(planted, seed=1), estimate(below, seed=2)).same
    assert compare(estimate(below, seed=1), estimate(below, seed=2)).same


def test_half_the_error_takes_four_times_the_samples():
    begun = estimate(scene(), 0.1)
    assert samples_for(begun, begun.error()) == begun.samples
    assert samples_for(begun, begun.error() * 0.501) == 4 * begun.samples


def test_a_picture_with_a_nan_is_refused():
    picture = scene().astype(np.float32)
    picture[3, 3, 0] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        Estimate(1).add(picture, 0.0)


def test_scenes_have_names_of_their_own_and_say_what_they_show():
    assert len(SCENES) == len(ALL) >= 60
    for scene_of in ALL:
        assert scene_of.name.replace("_", "").isalnum()
        assert scene_of.shows.endswith(".")
        assert scene_of.width % BLOCK == scene_of.height % BLOCK == 0


def test_known_differences_are_few_exist_and_have_a_cause():
    assert len(KNOWN) <= 0.05 * len(ALL)
    assert set(KNOWN) <= set(SCENES)
    assert all(KNOWN.values())


def test_what_older_versions_did_otherwise_is_known_of_them_alone():
    assert set(KNOWN_BEFORE) <= set(SCENES)
    first, cause = KNOWN_BEFORE["diffuse_rough"]
    assert first == (4, 3)
    assert known("diffuse_rough", "4.2.14 LTS") == cause
    assert known("diffuse_rough", "4.3.0") is known("diffuse_rough", "5.2.3 LTS") is None
    assert known("sky_hosek_wilkie", "4.2.0") == KNOWN["sky_hosek_wilkie"]
    assert known("diffuse", "4.2.0") is None
