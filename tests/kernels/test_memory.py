"""Kernels without memory."""

import numpy as np
import pytest

from rodshell.errors import RodshellError
from rodshell.kernels import _taking_any_array


def test_a_compiled_kernel_without_memory_says_so():
    def kernel(x):
        raise TypeError("exceptions must derive from BaseException")  # as Numba's machine code does

    with pytest.raises(MemoryError, match="out of memory: give fewer rods") as caught:
        _taking_any_array(kernel)(np.zeros(3))
    assert isinstance(caught.value, RodshellError)
