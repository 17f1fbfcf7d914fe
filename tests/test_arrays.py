"""Memory of arrays: what a solve frees serves the next; the median and distinct values."""

import platform
import subprocess
import sys

import numpy as np
import pytest

from rodshell.arrays import distinct, median

MEASURED = """
import resource
import numpy as np
import rodshell.arrays

def pages():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt

for _ in range(4):
    before = pages()
    blocks = [np.ones(1 << 18) for _ in range(12)]
    blocks.clear()
    print(pages() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="about the heap of glibc")
def test_memory_that_was_freed_is_not_cleared_again_by_the_system():
    """24 MB are 6000 pages; without `rodshell.arrays` each round asks for all of them."""
    said = subprocess.run([sys.executable, "-c", MEASURED], check=True, capture_output=True, text=True).stdout
    first, *later = map(int, said.split())
    assert first > 5000
    assert max(later) < 500


@pytest.mark.parametrize("shape", [1, 2, 3, 10, 11, (4, 3), (5, 3)])
def test_the_median_is_numpys(shape: int | tuple[int, int]) -> None:
    values = np.random.default_rng(3).normal(size=shape)
    assert median(values) == np.median(values)
    assert median(values.tolist()) == np.median(values)


@pytest.mark.parametrize("shape", [0, 1, 2, 30, (4, 3)])
def test_distinct_values_are_numpys(shape: int | tuple[int, int]) -> None:
    whole = np.random.default_rng(5).integers(-4, 4, size=shape)
    for values in (whole, whole / 3.0):
        found = distinct(values)
        assert found.dtype == values.dtype
        assert found.tolist() == np.unique(values).tolist()
