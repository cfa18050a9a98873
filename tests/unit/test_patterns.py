"""core.sampling.patterns -> uniform, pure, stratified, independent points."""

import numpy as np
import pytest

from penumbra.core.sampling import patterns, poisson
from penumbra.core.sampling.patterns import PATTERNS, points
from penumbra.core.settings import PATTERNS as OFFERED

NAMES = tuple(PATTERNS)
SETS = tuple(name for name in NAMES if not PATTERNS[name].progressive)
PROGRESSIVE = tuple(name for name in NAMES if PATTERNS[name].progressive)
SIZES = (1, 2, 3, 7, 12, 16, 61, 64)


def toroidal(a, b):
    """Distances (n, m) on the unit torus between points (2, n) and (2, m)."""
    gap = a[:, :, None].astype(float) - b[:, None].astype(float)
    gap -= np.rint(gap)
    return np.hypot(gap[0], gap[1])


def closest(p):
    """Smallest toroidal distance between two of the points (2, n)."""
    distance = toroidal(p, p)
    np.fill_diagonal(distance, np.inf)
    return distance.min()


# --- What all patterns promise ------------------------------------------------------------------


def test_the_settings_offer_exactly_the_patterns_there_are():
    assert set(NAMES) == {name for name, _, _ in OFFERED}


@pytest.mark.parametrize("total", SIZES)
@pytest.mark.parametrize("name", NAMES)
def test_points_are_contiguous_float32_in_the_unit_square(name, total):
    p = points(name, 1, 2, 0, total, total)
    assert p.dtype == np.float32
    assert p.shape == (2, total, patterns.SEQUENCES)
    assert p.flags.c_contiguous
    assert p.min() >= 0
    assert p.max() < 1


@pytest.mark.parametrize("total", SIZES)
@pytest.mark.parametrize("name", NAMES)
def test_chunks_and_fewer_sequences_give_the_same_numbers(name, total):
    whole = points(name, 7, 3, 0, total, total)
    for step in (1, 5, 16):
        chunks = [
            points(name, 7, 3, s, min(step, total - s), total, 100) for s in range(0, total, step)
        ]
        assert (np.concatenate(chunks, axis=1) == whole[:, :, :100]).all()


def test_a_call_too_large_for_one_block_gives_the_same_numbers():
    count = 3 * patterns._BLOCK // 1000
    whole = points("SOBOL", 0, 0, 0, count, count, 1000)
    last = points("SOBOL", 0, 0, count - 1, 1, count, 1000)
    assert (whole[:, -1] == last[:, 0]).all()


@pytest.mark.parametrize("name", PROGRESSIVE)
def test_progressive_patterns_do_not_depend_on_the_total(name):
    assert (points(name, 1, 1, 3, 9, 12) == points(name, 1, 1, 3, 9, 4096)).all()


@pytest.mark.parametrize("name", PROGRESSIVE)
def test_samples_far_along_a_sequence_differ_from_the_first(name):
    far = points(name, 1, 1, 1 << 24, 16, 1 << 25)
    assert (far == points(name, 1, 1, 0, 16, 16)).mean() < 1e-3


@pytest.mark.parametrize("name", NAMES)
def test_seed_pair_and_sequence_each_give_other_numbers(name):
    p = points(name, 1, 2, 0, 16, 16)
    for other in (points(name, 2, 2, 0, 16, 16), points(name, 1, 3, 0, 16, 16)):
        assert (p == other).mean() < 1e-3
    assert (p[:, :, 1:] == p[:, :, :-1]).mean() < 1e-3


@pytest.mark.parametrize("name", NAMES)
def test_each_sample_is_uniform_over_the_sequences(name, chi2):
    """Significance: z < 4.5 for 1-D and 2-D histograms, of 48 in all."""
    count = 1 << 16
    for total, sample in ((16, 0), (16, 11), (61, 60), (256, 100)):
        u, v = points(name, 11, 4, sample, 1, total, count)[:, 0]
        for axis in (u, v):
            assert chi2(np.bincount((axis * 64).astype(int), minlength=64), [count / 64] * 64) < 4.5
        cells = (u * 16).astype(int) * 16 + (v * 16).astype(int)
        assert chi2(np.bincount(cells, minlength=256), [count / 256] * 256) < 4.5


@pytest.mark.parametrize("total", [1, 4, 13, 64])
@pytest.mark.parametrize("name", NAMES)
def test_estimates_are_unbiased(name, total):
    """Significance: |z| < 4.5 of the mean over 8192 sequences, of 20 in all."""
    u, v = points(name, 5, 1, 0, total, total, 8192).astype(float)
    estimate = (np.exp(u) * np.sin(2 * v)).mean(axis=0)
    exact = (np.e - 1) * (1 - np.cos(2)) / 2
    error = estimate.std() / np.sqrt(estimate.size)
    assert abs(estimate.mean() - exact) < 4.5 * error + 1e-7


@pytest.mark.parametrize("name", NAMES)
def test_neighbouring_sequences_are_independent(name):
    """Significance: |z| < 4.5 of the correlation of the errors of 8192 sequences."""
    u, v = points(name, 5, 1, 0, 16, 16, 8193).astype(float)
    estimate = (np.exp(u) * np.sin(2 * v)).mean(axis=0)
    r = np.corrcoef(estimate[1:], estimate[:-1])[0, 1]
    assert abs(r) * np.sqrt(8192) < 4.5


CROSS = {
    "disk of both pairs": lambda a, b: (a[0] + b[0] - 1) ** 2 + (a[1] - b[1]) ** 2 < 0.25,
    "checkers": lambda a, b: ((a[0] > 0.5) ^ (b[0] > 0.5)) * 1.0,
    "waves": lambda a, b: np.abs(np.sin(3 * a[0] + 5 * b[0]) * np.cos(4 * a[1] * b[1])),
}


@pytest.mark.parametrize("function", CROSS.values(), ids=CROSS)
@pytest.mark.parametrize("name", NAMES)
def test_the_pairs_of_a_pixel_are_independent(name, function):
    """A function of two pairs has at most 1.6 times the error of independent points, at any size.

    sqrt(2) is what a nested order costs at worst (checkers: both pairs change sides from sample to
    sample).  An index shuffled by XOR keeps the pairs in step: 256 samples then err like a few.
    """
    truth = function(*np.random.default_rng(1).random((2, 2, 1 << 20))).astype(float)
    errors = []
    for total in (4, 16, 64, 256):
        a, b = points(name, 3, 1, 0, total, total), points(name, 3, 2, 0, total, total)
        estimate = function(a.astype(float), b.astype(float)).mean(axis=0)
        errors.append(np.sqrt(((estimate - truth.mean()) ** 2).mean() * total) / truth.std())
    assert max(errors) < 1.6


GAIN = {"SOBOL": 0.08, "POISSON": 0.35, "JITTERED": 0.3, "REGULAR": 0.5}


@pytest.mark.parametrize("name", GAIN)
def test_stratified_patterns_have_a_fraction_of_the_error_of_random_points(name):
    u, v = points(name, 3, 1, 0, 64, 64).astype(float)
    error = np.exp(-3 * ((u - 0.4) ** 2 + (v - 0.45) ** 2)).mean(axis=0).std()
    u, v = points("RANDOM", 3, 1, 0, 64, 64).astype(float)
    yardstick = np.exp(-3 * ((u - 0.4) ** 2 + (v - 0.45) ** 2)).mean(axis=0).std()
    assert error < GAIN[name] * yardstick


@pytest.mark.parametrize("name", NAMES)
def test_samples_that_a_pattern_does_not_have_are_refused(name):
    limit = 1 << 32 if PATTERNS[name].progressive else 16
    points(name, 0, 0, limit - 1, 1, 16, 8)
    with pytest.raises(ValueError, match=name):
        points(name, 0, 0, limit - 1, 2, 16, 8)
    with pytest.raises(ValueError, match=name):
        points(name, 0, 0, -1, 2, 16, 8)


def test_an_unknown_pattern_is_refused_by_name():
    with pytest.raises(ValueError, match="'HALTON' is not one of SOBOL"):
        points("HALTON", 0, 0, 0, 1, 1)


# --- What each promises -------------------------------------------------------------------------


@pytest.mark.parametrize("first", [0, 256, 3 * 256, (1 << 24) + 512])
def test_sobol_blocks_have_one_point_in_each_elementary_interval(first):
    for bits in range(1, 9):
        u, v = points("SOBOL", 9, 4, first, 1 << bits, 1 << 25, 32).astype(float)
        for across in range(bits + 1):
            columns, rows = 1 << across, 1 << (bits - across)
            cell = (u * columns).astype(int) * rows + (v * rows).astype(int)
            assert (np.sort(cell, axis=0) == np.arange(1 << bits)[:, None]).all()


def test_sobol_blocks_of_many_points_have_one_in_each_elementary_interval():
    for bits in (10, 17):
        u, v = points("SOBOL", 9, 4, 0, 1 << bits, 1 << 25, 2).astype(float)
        for across in range(bits + 1):
            cell = (u * 2**across).astype(int) * 2 ** (bits - across)
            cell += (v * 2 ** (bits - across)).astype(int)
            for c in range(2):
                assert np.bincount(cell[:, c], minlength=1 << bits).max() == 1


def test_sobol_points_are_scrambled_below_their_intervals(chi2):
    """The bits below those that the net fixes are uniform.  Significance: z < 4.5."""
    p = points("SOBOL", 9, 4, 0, 16, 16, 4096)
    inside = (p * 16) % 1
    for axis in inside:
        cells = np.bincount((axis.ravel() * 64).astype(int), minlength=64)
        assert chi2(cells, [axis.size / 64] * 64) < 4.5


def test_random_points_do_not_repeat():
    p = points("RANDOM", 1, 2, 0, 256, 256, 1024).reshape(2, -1)
    keys = (p.astype(float) * 2.0**24).astype(np.int64)
    assert np.unique(keys[0] << 24 | keys[1]).size == p.shape[1]


GRIDS = ((1, 1), (2, 1), (2, 2), (4, 3), (4, 4), (8, 8), (10, 6))


@pytest.mark.parametrize(("columns", "rows"), GRIDS)
def test_jittered_points_lie_one_in_each_cell_of_a_grid(columns, rows):
    total = columns * rows
    u, v = points("JITTERED", 1, 0, 0, total, total)
    cell = (u * columns).astype(int) + columns * (v * rows).astype(int)
    assert (np.sort(cell, axis=0) == np.arange(total)[:, None]).all()


@pytest.mark.parametrize(
    ("total", "lengths"), [(5, (3, 2)), (7, (3, 2, 2)), (11, (4, 4, 3)), (61, (8,) * 5 + (7,) * 3)]
)
def test_jittered_cells_have_equal_areas_for_any_total(total, lengths):
    u, v = points("JITTERED", 1, 0, 0, total, total)
    below = 0
    for length in lengths:
        inside = (v >= below / total) & (v < (below + length) / total)
        assert (inside.sum(axis=0) == length).all()
        cell = np.where(inside, (u * length).astype(int), length)
        assert (np.sort(cell, axis=0)[:length] == np.arange(length)[:, None]).all()
        below += length


@pytest.mark.parametrize(("columns", "rows"), GRIDS)
def test_a_regular_pixel_is_a_grid_of_cell_centres(columns, rows):
    total = columns * rows
    u, v = points("REGULAR", 1, 0, 0, total, total)
    cell = (u * columns).astype(int) + columns * (v * rows).astype(int)
    assert (np.sort(cell, axis=0) == np.arange(total)[:, None]).all()
    assert np.abs((u * columns) % 1 - 0.5).max() < 1e-5
    assert np.abs((v * rows) % 1 - 0.5).max() < 1e-5


def test_regular_grids_of_other_pairs_are_shifted_as_a_whole():
    p = points("REGULAR", 1, 3, 0, 16, 16).astype(float)
    phase = p * 4 % 1
    away = np.abs(phase - phase[:, :1])
    assert np.minimum(away, 1 - away).max() < 1e-5
    assert np.unique(phase[0, 0].round(4)).size > 900
    assert np.isclose(closest(p[:, :, 0]), 0.25)


def test_all_orders_of_a_set_are_equally_likely(chi2):
    """Significance: z < 4.5."""
    u, v = points("REGULAR", 1, 0, 0, 4, 4, 24000)
    cell = (u * 2).astype(int) + 2 * (v * 2).astype(int)
    order = cell[0] * 16 + cell[1] * 4 + cell[2]
    counts = np.unique(order, return_counts=True)[1]
    assert counts.size == 24
    assert chi2(counts, [1000] * 24) < 4.5


@pytest.mark.parametrize("total", [*range(2, 33), 61, 64, 100, 256, 1000, 1024, 2048])
def test_poisson_points_keep_their_distance_on_the_torus(total):
    p = points("POISSON", 1, 2, 0, total, total, 4)
    for c in range(4):
        assert closest(p[:, :, c]) >= 0.5 / np.sqrt(total)


@pytest.mark.parametrize("total", [2, 3, 7, 64, 256, 1000])
def test_poisson_sets_too_large_to_store_keep_their_distance(total):
    corners = np.random.default_rng(1).integers(0, 2, (2, total)).astype(np.float32)
    p = poisson.bounded_points(np.arange(total, dtype=np.int32), corners, total)
    assert closest(p) >= 0.5 / np.sqrt(total)


def test_poisson_patterns_of_any_size_can_be_had():
    total = poisson.LARGEST_SET + 1
    p = points("POISSON", 1, 2, 0, total, total, 2)
    for c in range(2):
        cell = (p[0, :, c] * 64).astype(int) * 64 + (p[1, :, c] * 64).astype(int)
        counts = np.bincount(cell, minlength=4096)
        assert counts.min() >= 8
        assert counts.max() <= 24


@pytest.mark.parametrize("total", [64, 1024, poisson.LARGEST_SET + 1])
def test_poisson_points_are_no_lattice(total):
    p = points("POISSON", 1, 2, 0, total, total, 1)[:, :, 0]
    distance = toroidal(p[:, :200], p)
    distance[np.arange(min(total, 200)), np.arange(min(total, 200))] = np.inf
    assert distance.min(axis=1).std() * np.sqrt(total) > 0.03


@pytest.mark.parametrize("total", [1, 5, 16, 64, 256, 1000])
def test_poisson_points_leave_no_large_hole(total):
    p = points("POISSON", 1, 2, 0, total, total, 4)
    anywhere = np.stack(np.meshgrid(*[np.arange(64) / 64] * 2)).reshape(2, -1)
    for c in range(4):
        assert toroidal(anywhere, p[:, :, c]).min(axis=1).max() < 1.25 / np.sqrt(total)
