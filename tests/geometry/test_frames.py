import numpy as np
import pytest

from rodshell.geometry.frames import dot, unit

A, B = np.random.default_rng(5).normal(size=(2, 7, 4, 3))


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (A[0, 0], B[0, 0]),
        (A[0], B[0]),
        (A[:, 1], B[:, 2]),  # not contiguous
        (A[0], B[0, 0]),
        (A[0, 0], B[0]),
        (A, B[:, :1]),
        (A[0], np.array([[1, 2, 3]] * 4)),
    ],
)
def test_inner_products_and_unit_vectors_of_all_shapes(a, b):
    assert np.allclose(dot(a, b), np.sum(a * b, axis=-1), rtol=1e-14, atol=1e-14)
    assert np.allclose(unit(a), a / np.linalg.norm(a, axis=-1, keepdims=True), rtol=1e-14)


def test_vectors_in_the_plane_are_scaled_too():
    assert np.allclose(unit(np.array([[3.0, 4.0], [0.0, -2.0]])), [[0.6, 0.8], [0.0, -1.0]])
