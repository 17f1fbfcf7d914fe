"""The place of a largest value."""

import numpy as np

from rodshell.arrays import largest_at


def test_of_mirror_images_the_first_is_named_whatever_round_off_makes_of_them() -> None:
    values = np.array([1.0, 3.0, 2.0, 3.0 * (1 + 1e-9), np.nan, 3.0])
    assert largest_at(values) == 1
    assert largest_at(-values) == 0
    assert largest_at(np.array([1.0, 3.0, 3.001])) == 2
    assert largest_at(np.array([-3.0, -3.0, -5.0])) == 0
    assert largest_at(np.zeros(3)) == 0
