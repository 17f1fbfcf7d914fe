"""Rows of integers, as meshes have them, told apart."""

import numpy as np
import pytest

from gridshell.targets.trianglemesh import unique_rows


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
