"""core.sampling.tables -> choices and positions with the probabilities they were made of."""

import numpy as np
import pytest

from penumbra.core.sampling.tables import compile_alias, compile_inverse, lookup

F32 = np.float32
LAST = F32(1 - 2.0**-24)
GENERATOR = np.random.default_rng(8)
WEIGHTS = {
    "one": np.ones(1),
    "two equal": np.full(2, 0.1),
    "one of three": np.array([0.0, 5, 0]),
    "seven equal": np.full(7, 0.1),
    "random": GENERATOR.random(100),
    "that fit exactly": np.tile([1.0, 3.0], 8),
    "half of them zero": GENERATOR.random(1000) * (np.arange(1000) % 2),
    "of every magnitude": 10.0 ** GENERATOR.uniform(-300, 300, 300),
    "one heavy, many light": np.r_[np.full(9999, 1e-3), 1e6],
    "many heavy, one light": np.r_[1e-9, np.full(9999, 1.0)],
    "sorted": np.arange(1000.0),
    "many": GENERATOR.exponential(size=200_000),
}


# --- Alias tables -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    ["one of three", "half of them zero", "of every magnitude", "one heavy, many light", "many"],
)
def test_the_pmf_is_the_share_of_all_numbers_that_choose_an_index(name):
    """Every number of 24 bits is tried: no statistics."""
    size = WEIGHTS[name].size
    table = compile_alias(WEIGHTS[name])
    counts, left = np.zeros(size), 0.0
    for block in np.arange(1 << 24, dtype=np.int32).reshape(16, -1):
        index, pmf, rest = table.sample((block * 2.0**-24).astype(F32))
        left += rest.mean(dtype=float) / 16
        counts += np.bincount(index, minlength=size)
    assert (counts / 2**24 == table.pmf(np.arange(size, dtype=np.int32))).all()
    assert (pmf == table.pmf(index)).all()
    assert abs(left - 0.5) < 1e-6


@pytest.mark.parametrize("name", WEIGHTS)
def test_the_pmf_is_in_proportion_to_the_weights(name):
    """To a step of 2^-24 for light entries, and the steps of those it fills for a heavy one."""
    weights = WEIGHTS[name] / WEIGHTS[name].max()
    weights /= weights.sum()
    pmf = compile_alias(WEIGHTS[name]).pmf(np.arange(weights.size, dtype=np.int32)).astype(float)
    assert ((pmf > 0) == (WEIGHTS[name] > 0)).all()
    assert pmf.sum() == 1
    error = np.abs(pmf - weights) * 2**24
    small = weights < 0.5 / weights.size
    assert error[small].max(initial=0) <= 1
    assert error[~small].max() <= 2 + small.sum()
    assert np.median(error) <= 2


@pytest.mark.parametrize("name", ["random", "half of them zero", "sorted"])
def test_indices_are_chosen_in_proportion_to_their_weights(name, chi2):
    """Significance: z < 4.5, of 3 in all; entries with few expected are counted together."""
    weights, count = WEIGHTS[name], 1_000_000
    index, pmf, _ = compile_alias(weights).sample(GENERATOR.random(count, F32))
    expected = weights / weights.sum() * count
    counts = np.bincount(index, minlength=weights.size)
    assert counts[weights == 0].sum() == 0
    many = expected >= 20
    rest = [expected[~many].sum()] if expected[~many].sum() >= 5 else []
    counts = np.r_[counts[many], [counts[~many].sum()] if rest else []]
    assert chi2(counts, np.r_[expected[many], rest]) < 4.5
    assert np.allclose(pmf, (weights / weights.sum())[index], rtol=1e-2, atol=1e-7)


@pytest.mark.parametrize("name", WEIGHTS)
def test_an_entry_of_weight_zero_is_never_chosen(name):
    weights = WEIGHTS[name]
    u = np.r_[np.arange(1 << 16) / F32(1 << 16), 0, 2.0**-24, LAST].astype(F32)
    index, pmf, rest = compile_alias(weights).sample(u)
    assert (index.dtype, pmf.dtype, rest.dtype) == (np.int32, F32, F32)
    assert (weights[index] > 0).all()
    assert np.isfinite(rest).all()
    assert rest.min() >= 0
    assert rest.max() < 1


@pytest.mark.parametrize("name", ["seven equal", "random", "half of them zero"])
def test_what_is_left_of_u_is_uniform_and_independent_of_the_index(name, chi2):
    """Significance: z < 4.5, of 6 in all."""
    weights, count = WEIGHTS[name], 1_000_000
    index, _, rest = compile_alias(weights).sample(GENERATOR.random(count, F32))
    bins = (rest * 32).astype(int)
    assert chi2(np.bincount(bins, minlength=32), [count / 32] * 32) < 4.5
    groups = index % 7
    share = np.bincount(groups, minlength=7)
    together = np.bincount(groups * 32 + bins, minlength=7 * 32).reshape(7, 32)
    assert chi2(together, np.repeat(share / 32, 32)) < 4.5


@pytest.mark.parametrize("dtype", [F32, np.float64])
def test_a_million_entries_are_chosen_as_often_as_their_pmf_says(dtype, chi2):
    """Significance: z < 4.5.  With float64 numbers, what is left of them is uniform as well."""
    size, count = 1_000_003, 4_000_000
    table = compile_alias(np.arange(size) % 5)
    index, _, rest = table.sample(GENERATOR.random(count, dtype))
    counts = np.bincount(index % 1000, minlength=1000)
    pmf = table.pmf(np.arange(size, dtype=np.int32)).astype(float)
    expected = np.bincount(np.arange(size) % 1000, pmf) * count
    assert (counts[expected == 0] == 0).all()
    assert chi2(counts[expected > 0], expected[expected > 0]) < 4.5
    if dtype == np.float64:
        assert chi2(np.bincount((rest * 64).astype(int), minlength=64), [count / 64] * 64) < 4.5


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        ([], "shape"),
        ([[1.0]], "shape"),
        ([0.0, 0.0, 0.0], "All 3 weights are 0"),
        ([1.0, -2.0], "Weight 1 of 2 is -2"),
        ([np.nan, 1.0], "Weight 0 of 2 is nan"),
        ([1.0, 1.0, np.inf], "Weight 2 of 3 is inf"),
    ],
)
def test_weights_that_cannot_be_chosen_by_are_refused_by_name(weights, message):
    with pytest.raises(ValueError, match=message):
        compile_alias(weights)


# --- Inverse tables -----------------------------------------------------------------------------


def test_a_constant_density_gives_straight_lines():
    table = compile_inverse(np.ones(2), -3.0, 5.0, 64)
    u = np.r_[0, np.linspace(0, 1, 1001)[:-1], LAST].astype(F32)
    x = lookup(table, u)
    assert x.dtype == F32
    assert np.allclose(x, 8 * u - 3, atol=1e-5)


def test_a_triangle_gives_square_roots():
    table = compile_inverse(lambda x: 1 - np.abs(x), -1.0, 1.0, 4096)
    u = np.linspace(0.01, 0.99, 1001).astype(F32)
    exact = np.where(u < 0.5, np.sqrt(2 * u) - 1, 1 - np.sqrt(2 - 2 * u))
    assert np.abs(lookup(table, u) - exact).max() < 1e-5


def test_values_at_nodes_mean_straight_lines_between_them():
    nodes = np.array([0.0, 1, 3, 0.5])
    exact = compile_inverse(lambda x: np.interp(x, [0, 1, 2, 3], nodes), 0.0, 3.0, 1024)
    table = compile_inverse(nodes, 0.0, 3.0, 1024)
    u = np.linspace(0, 0.999, 5000).astype(F32)
    assert np.abs(lookup(table, u) - lookup(exact, u)).max() < 1e-4


def bell(x):
    """Blackman-Harris window on [-1, 1]."""
    a = np.pi * (x + 1)
    return 0.35875 - 0.48829 * np.cos(a) + 0.14128 * np.cos(2 * a) - 0.01168 * np.cos(3 * a)


def test_positions_follow_the_density(chi2):
    """Significance: z < 4.5 of 40 bins, those with too few expected counted together."""
    count, edge = 1_000_000, np.linspace(-1, 1, 41)
    x = lookup(compile_inverse(bell, -1.0, 1.0, 4096), GENERATOR.random(count, F32))
    fine = (np.arange(40 * 500) + 0.5) / (20 * 500) - 1
    expected = bell(fine).reshape(40, 500).sum(axis=1)
    expected *= count / expected.sum()
    counts = np.histogram(x, edge)[0]
    many = expected > 500
    counts = np.r_[counts[many], counts[~many].sum()]
    assert chi2(counts, np.r_[expected[many], expected[~many].sum()]) < 4.5


def test_a_symmetrical_filter_has_its_mean_in_the_middle():
    table = compile_inverse(bell, -1.5, 1.5, 4096)
    u = (np.arange(1 << 20) + 0.5).astype(float) / (1 << 20)
    assert abs(lookup(table, u.astype(F32)).astype(float).mean()) < 1e-6


def test_positions_rise_with_u_and_span_where_the_density_is():
    table = compile_inverse(np.array([0.0, 0, 1, 0, 0, 2, 0, 0]), 0.0, 7.0, 512)
    x = lookup(table, np.r_[np.arange(1 << 14) / F32(1 << 14), LAST].astype(F32))
    assert (np.diff(x) >= 0).all()
    assert x[0] == 1
    assert abs(x[-1] - 6) < 1e-3
    assert ((x > 3.01) & (x < 3.99)).mean() < 2 / 512


@pytest.mark.parametrize("values", [[0.0, 0.0], [1.0, -1.0], [1.0, np.nan], [np.inf, 1.0]])
def test_densities_that_are_none_are_refused(values):
    with pytest.raises(ValueError, match="Density"):
        compile_inverse(np.array(values), 0.0, 1.0, 16)
