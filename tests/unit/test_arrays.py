"""core.arrays -> the operations on arrays of vectors do what their plain formulas do."""

import numpy as np
import pytest

from penumbra.core.arrays import F32, add_scaled, dot, gather_rows, repeated


def vectors(count, seed=0):
    return np.random.default_rng(seed).standard_normal((3, count)).astype(F32)


@pytest.mark.parametrize("count", [0, 1, 5, 4096, 4097, 20000])
@pytest.mark.parametrize("columns", [None, 6])
def test_rows_are_gathered_as_columns(count, columns):
    rng = np.random.default_rng(1)
    table = rng.standard_normal((300, 8)).astype(F32)
    index = rng.integers(0, 300, count, dtype=np.int32)
    found = gather_rows(table, index, columns)
    assert found.flags.c_contiguous
    np.testing.assert_array_equal(found, table[index].T[:columns])


@pytest.mark.parametrize("count", [1, 7, 30001])
def test_dots_are_added_in_order_whatever_the_shapes(count):
    one, many = vectors(1), vectors(count, 1)
    for a, b in ((one, many), (many, one), (many, many)):
        expected = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
        np.testing.assert_array_equal(dot(a, b), expected)


@pytest.mark.parametrize("count", [1, 7, 5000])
def test_scaled_vectors_are_added_in_place(count):
    scale = vectors(count, 2)[0]
    for a in (vectors(1), vectors(count)):
        out = vectors(count, 1)
        expected = out + a * scale
        assert add_scaled(out, a, scale) is out
        np.testing.assert_array_equal(out, expected)


def test_one_vector_is_repeated_without_a_copy():
    row = np.arange(12, dtype=F32).reshape(3, 4)
    for one in (vectors(1), row[:, 2:3]):
        many = repeated(one, 5)
        np.testing.assert_array_equal(many, np.broadcast_to(one, (3, 5)))
        assert many.strides[1] == 0
    each = vectors(5)
    assert repeated(each, 5) is each
