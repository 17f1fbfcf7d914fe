"""Compiled kernels: the same bits as Numba's on one level, without Numba; other arrays are copied or refused."""

import json
import os
import subprocess
import sys
from importlib import import_module

import numpy as np
import pytest

from rodshell.kernels import COMPILED, KERNELS, LEVEL, PACKAGE, modules
from rodshell.rods.elements import _strains
from rodshell.targets.target import newton_to_closest

pytestmark = pytest.mark.skipif(COMPILED is None, reason="compiled kernels: RODSHELL_KERNELS=compiled pip install .")

BITS = """
import dataclasses, hashlib, json, sys
import numpy as np
from rodshell.kernels import description
from tests.kernels.jobs import JOBS

def arrays(found, seen):
    if isinstance(found, np.ndarray):
        yield found
    elif dataclasses.is_dataclass(found) and id(found) not in seen:
        seen[id(found)] = found
        for field in dataclasses.fields(found):
            yield from arrays(getattr(found, field.name), seen)
    elif isinstance(found, (list, tuple, dict)):
        for part in found.values() if isinstance(found, dict) else found:
            yield from arrays(part, seen)

bits = {}
for name, job in JOBS.items():
    floats = [array for array in arrays(list(job()), {}) if array.dtype == np.float64]
    bits[name] = sum(map(np.size, floats)), hashlib.sha256(b"".join(map(np.ndarray.tobytes, floats))).hexdigest()
print(json.dumps([description(), "numba" in sys.modules, bits]))
"""


@pytest.mark.slow
def test_all_jobs_find_the_same_bits_with_compiled_kernels_and_with_numba() -> None:
    by_numba = {"RODSHELL_KERNELS": "jit", "NUMBA_CPU_NAME": LEVEL, "NUMBA_CPU_FEATURES": ""}
    (compiled, loaded, ours), (jit, _, theirs) = found_with({}), found_with(by_numba)
    assert compiled == f"compiled for {LEVEL}"
    assert jit.startswith("numba ")
    assert not loaded
    assert all(count > 500 for count, _ in ours.values())
    assert ours == theirs


def found_with(variables: dict[str, str]) -> list[object]:
    """How kernels are compiled, whether Numba is loaded, and for each job the number of floats and their hash."""
    environment = os.environ | variables
    command = [sys.executable, "-c", BITS]
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True, timeout=600)
    result: list[object] = json.loads(done.stdout)
    return result


def test_each_kernel_that_is_declared_with_types_is_compiled() -> None:
    assert COMPILED is not None
    for module in modules():
        import_module(PACKAGE + module)
    assert set(COMPILED) == {f"{module}.{name}" for module, rows in KERNELS.items() for name in rows}


X = np.zeros((4, 3))
EDGES = np.array([[0, 1], [2, 3]])
REST = np.ones(2)


@pytest.mark.parametrize(
    ("x", "edges", "rest"),
    [
        (X.view(np.int64), EDGES, REST),
        (X, EDGES, REST[:, None]),
        (X[None, None, None], EDGES, REST),
        (X, EDGES, [1.0, 1.0]),
        (None, EDGES, REST),
    ],
    ids=["bits", "more", "five", "list", "none"],
)
def test_an_array_of_another_kind_is_refused(x: object, edges: object, rest: object) -> None:
    with pytest.raises(TypeError, match="a kernel needs an array of"):
        _strains(x, edges, rest)


PLACES = np.arange(12.0).reshape(4, 3) ** 2


@pytest.mark.parametrize(
    ("x", "edges"),
    [
        (PLACES.astype(np.float32), EDGES),
        (PLACES.astype(">f8"), EDGES),
        (np.asfortranarray(PLACES), EDGES),
        (np.repeat(PLACES, 2, axis=1)[:, ::2], EDGES),
        (PLACES, EDGES.astype(np.int32)),
        (PLACES, EDGES.view(np.uint64)),
    ],
    ids=["single", "order of bytes", "columns", "strided", "int32", "unsigned"],
)
def test_arrays_that_lie_otherwise_are_copied(x: np.ndarray, edges: np.ndarray) -> None:
    np.testing.assert_array_equal(_strains(x, edges, REST), _strains(PLACES, EDGES, REST))


def test_what_a_kernel_writes_reaches_an_array_that_lies_otherwise() -> None:
    random = np.random.default_rng(0)
    at, values = random.standard_normal((4, 3)), [random.standard_normal(shape) for shape in ((4,), (4, 3), (4, 3, 3))]
    plain, turned = (np.empty((4, 3)), np.empty(4)), (np.empty((3, 4)).T, np.empty(8)[::2])
    for slope, length in (plain, turned):
        newton_to_closest(at, at + 0.1, np.arange(4), *values, np.zeros(4), np.inf, slope, length)
    np.testing.assert_array_equal(turned[0], plain[0])
    np.testing.assert_array_equal(turned[1], plain[1])


def test_what_is_refused_is_not_kept_in_memory() -> None:
    before = [sys.getrefcount(array) for array in (X, EDGES, REST)]
    for _ in range(100):
        with pytest.raises(TypeError):
            _strains(X, EDGES, REST[:, None])
        _strains(X, EDGES, REST)
    assert [sys.getrefcount(array) for array in (X, EDGES, REST)] == before
