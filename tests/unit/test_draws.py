"""core.sampling.draws -> random pairs that are a pure function, uniform and independent."""

import pickle

import numpy as np
import pytest

from penumbra.core.sampling.dimensions import (
    CHOICE,
    LIGHT,
    LIGHT_CHOICE,
    PIXEL,
    ROULETTE,
    SCATTER,
    STRATIFIED_BOUNCES,
    dimension,
    is_stratified,
)
from penumbra.core.sampling.draws import Draws, Numbers, pixel_keys
from penumbra.core.sampling.patterns import PATTERNS
from tests.support.statistics import SIGNIFICANCE, chi2_probability, sidak

TOTAL = 64
DIMENSIONS = [PIXEL] + [
    dimension(purpose, bounce, item)
    for purpose, item in ((LIGHT, 0), (LIGHT, 3), (LIGHT_CHOICE, 0), (SCATTER, 0), (CHOICE, 0),
                          (ROULETTE, 0))
    for bounce in (0, 1, STRATIFIED_BOUNCES, STRATIFIED_BOUNCES + 3)
]  # fmt: skip
DEEP = dimension(SCATTER, STRATIFIED_BOUNCES + 1)
PROGRESSIVE = [name for name in PATTERNS if PATTERNS[name].progressive]
every_dimension = pytest.mark.parametrize("where", DIMENSIONS)


def draws(pixels, row=0, first=0, count=16, seed=7, pattern="SOBOL", sequences=1024):
    numbers = Numbers(pattern, seed, first, count, TOTAL, sequences, {})
    return Draws(numbers, pixel_keys(seed, np.asarray(pixels, np.int64)), row)


def chi2_in_the_square(u, v, side=8):
    cell = (u * side).astype(int) * side + (v * side).astype(int)
    counts = np.bincount(cell, minlength=side * side)
    return chi2_probability(counts, np.full(side * side, u.size / side**2))


def test_dimensions_do_not_collide():
    assert len(set(DIMENSIONS)) == len(DIMENSIONS)
    assert is_stratified(dimension(ROULETTE, STRATIFIED_BOUNCES - 1, 63))
    assert not is_stratified(dimension(PIXEL, STRATIFIED_BOUNCES))


@every_dimension
@pytest.mark.parametrize("pattern", PROGRESSIVE)
def test_numbers_do_not_depend_on_how_samples_are_cut_into_chunks(pattern, where):
    pixels = np.arange(100)
    for split, item in ((1, 0), (3, 2)):
        whole = draws(pixels, 11, pattern=pattern).pair(where, None, item, split)
        for first, count in ((8, 8), (11, 1), (10, 6)):
            part = draws(pixels, 11 - first, first, count, pattern=pattern)
            np.testing.assert_array_equal(part.pair(where, None, item, split), whole)


@every_dimension
def test_numbers_do_not_depend_on_which_slots_are_alive(where):
    pixels, slot = np.arange(100), np.array([3, 50, 7, 99])
    whole = draws(pixels, 4)
    np.testing.assert_array_equal(
        whole.pair(where, slot), np.take(whole.pair(where, None), slot, axis=1)
    )
    rows = np.arange(100, dtype=np.int32) % 16
    several = draws(pixels, rows)
    for number in slot:
        alone = draws(pixels[number : number + 1], int(rows[number]))
        np.testing.assert_array_equal(
            several.pair(where, np.array([number])), alone.pair(where, None)
        )


@every_dimension
def test_waves_of_the_same_pixels_may_share_their_sequences(where):
    pixels, slot, sequences = np.arange(100), np.arange(0, 100, 3), {}
    for row in (2, 5):
        alone = draws(pixels, row)
        shared = Draws(alone.numbers, alone.key, row, sequences)
        np.testing.assert_array_equal(shared.pair(where, slot), alone.pair(where, slot))
        np.testing.assert_array_equal(shared.pair(where, None), alone.pair(where, None))
    assert list(sequences) == ([where] if is_stratified(where) else [])


@every_dimension
def test_a_warp_maps_the_numbers_one_by_one(where):
    def bent(u):
        return u * u - 3

    one = draws(np.arange(100), 4)
    plain, slot = one.pair(where, None), np.array([3, 50])
    np.testing.assert_array_equal(one.pair(where, None, warp=bent), [bent(u) for u in plain])
    np.testing.assert_array_equal(
        one.pair(where, slot, warp=bent), [bent(u.take(slot)) for u in plain]
    )
    np.testing.assert_array_equal(one.pair(where, None), plain)


@every_dimension
def test_seed_pixel_sample_and_item_all_matter(where):
    pixels = np.arange(100)
    one = draws(pixels).pair(where, None, 0, 2)
    others = (
        draws(pixels, seed=8).pair(where, None, 0, 2),
        draws(pixels + 1000).pair(where, None, 0, 2),
        draws(pixels, row=1).pair(where, None, 0, 2),
        draws(pixels).pair(where, None, 1, 2),
    )
    for other in others:
        assert np.isclose(one, other, atol=1e-7).mean() < 0.1


@every_dimension
def test_one_sample_is_uniform_over_pixels_and_seeds(where):
    # Pixels share 1,024 sequences: few of them, so that each is as good as alone.
    u, v = np.hstack(
        [draws(np.arange(80), 5, count=8, seed=seed).pair(where, None) for seed in range(25)]
    )
    for x in (u, v):
        assert x.dtype == np.float32
        assert x.min() >= 0
        assert x.max() < 1
    assert chi2_in_the_square(u, v, 4) > sidak(SIGNIFICANCE, len(DIMENSIONS))


def test_deep_bounces_are_uniform_over_pixels_and_samples():
    pixels = np.repeat(np.arange(2000), 16)
    rows = np.tile(np.arange(16, dtype=np.int32), 2000)
    u, v = draws(pixels, rows).pair(DEEP, None)
    assert chi2_in_the_square(u, v, 16) > SIGNIFICANCE
    assert np.unique(u).size > 0.99 * u.size


def test_dimensions_are_independent_of_each_other():
    pixels = np.arange(3000)
    columns = [x for where in DIMENSIONS for x in draws(pixels, 3).pair(where, None)]
    count = len(columns)
    correlation = np.corrcoef(np.array(columns, float)) - np.eye(count)
    # Shared sequences make it as if there were a third as many pixels.
    worst = np.abs(correlation).max() * np.sqrt(1000)
    assert worst < 5


def test_the_samples_of_a_pixel_are_stratified_up_to_the_last_tabulated_bounce():
    for bounce in range(STRATIFIED_BOUNCES):
        where = dimension(SCATTER, bounce)
        u = np.array([draws(np.arange(64), row).pair(where, None)[0] for row in range(16)])
        assert (np.sort((u * 16).astype(int), axis=0) == np.arange(16)[:, None]).all()


def test_a_branch_has_new_numbers_and_its_parent_keeps_its_own():
    pixels = np.arange(2000)
    before = draws(pixels, 2)
    slot = np.arange(0, 2000, 2)
    after = before.branch(slot, 1).branch(slot, 2)
    assert after.key.size == 4000
    for where in (dimension(SCATTER, 1), DEEP):
        parent = np.array(before.pair(where, None))
        u, v = after.pair(where, None)
        np.testing.assert_array_equal((u[:2000], v[:2000]), parent)
        first, second = u[2000:3000], u[3000:]
        for one, other in ((u[slot], first), (u[slot], second), (first, second)):
            assert np.isclose(one, other, atol=1e-6).mean() < 0.01
            assert abs(np.corrcoef(one, other)[0, 1]) < 5 / np.sqrt(300)


def test_branches_of_paths_with_rows_of_their_own_keep_the_row():
    rows = np.array([3, 1, 2], np.int32)
    after = draws(np.arange(3), rows).branch(np.array([2, 0]), 1)
    assert after.row.tolist() == [3, 1, 2, 2, 3]


def test_pixels_have_keys_of_their_own_in_every_seed():
    for seed in (0, 1, 2**31 - 1):
        keys = pixel_keys(seed, np.arange(1 << 16, dtype=np.int64))
        assert keys.dtype == np.uint32
        assert np.unique(keys).size > (1 << 16) - 8  # birthdays: 0.5 expected
        counts = np.bincount(keys >> np.uint32(26), minlength=64)
        assert chi2_probability(counts, np.full(64, 1024.0)) > SIGNIFICANCE
    far = pixel_keys(0, np.array([1, 1 + (1 << 32), 1 + (1 << 33)], np.int64))
    assert np.unique(far).size == 3


def test_tables_of_numbers_stay_in_the_process_that_made_them():
    numbers = Numbers("SOBOL", 3, 0, 4, 16, 32, {})
    made = numbers.table(0)
    there = pickle.loads(pickle.dumps(numbers))
    assert there.tables == {}
    np.testing.assert_array_equal(there.table(0), made)
