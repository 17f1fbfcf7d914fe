"""Rows of integers, as meshes have them, told apart."""

import numpy as np
import pytest

from rodshell.targets.trianglemesh import unique_rows


@pytest.mark.parametrize("largest", [3, 1000, 5_000_000, 2**40])
def test_equal_rows_are_of_one_kind_however_large_their_numbers(largest):
    """The product of all ranges may exceed 64 bits."""
    rng = np.random.default_rng(0)
    rows = rng.integers(0, largest, (40, 4))[rng.integers(0, 40, 300)]
    rows[0] = largest
    first, kind = unique_rows(rows)
    expected, number = np.unique(rows, axis=0, return_inverse=True)
    assert len(first) == len(expected)
    assert np.array_equal(rows[first][kind], rows)
    assert len(set(zip(kind.tolist(), number.reshape(-1).tolist(), strict=True))) == len(expected)
    for one in range(len(first)):
        assert first[one] == np.flatnonzero(kind == one)[0]


def test_rows_that_a_key_of_64_bits_would_take_for_one_are_two():
    most = 2**32 - 1
    rows = np.array([[0, most, most], [1, 5, 7], [2, 5, 7], [1, 5, 7]])
    first, kind = unique_rows(rows)
    assert sorted(first.tolist()) == [0, 1, 2]
    assert kind[1] == kind[3] != kind[2]
