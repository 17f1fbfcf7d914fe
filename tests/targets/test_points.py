"""Targets take points as arrays or nested sequences, and refuse what is neither."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import InputError
from rodshell.targets.target import OF_PLAN, OF_SPACE

X, Y = (axis.ravel() for axis in np.meshgrid(np.linspace(-0.2, 0.2, 6), np.linspace(-0.2, 0.2, 6)))
DOME = 0.1 - X**2 - Y**2
CORNERS = np.array([[k, k + 1, k + 7, k, k + 7, k + 6] for k in range(30) if k % 6 < 5]).reshape(-1, 3)
TARGETS: dict[str, Callable[[], rs.Target]] = {
    "hemisphere": lambda: rs.Hemisphere(radius=0.2),
    "formula": lambda: rs.HeightField(formula="0.1 - x**2 - y**2", domain=rs.Rectangle((0.4, 0.3))),
    "mesh": lambda: rs.Freeform.of(np.column_stack([X, Y, DOME]), CORNERS),
}
POINTS = [[0.01, 0.02, 0.1], [0.03, -0.05, 0.08]]


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("method", sorted(OF_PLAN | OF_SPACE))
def test_lists_are_points_as_arrays_are(name: str, method: str) -> None:
    evaluate, columns = getattr(TARGETS[name](), method), 2 if method in OF_PLAN else 3
    points = np.array(POINTS)[:, :columns]
    expected = evaluate(points)
    for given in (points.tolist(), np.asfortranarray(points)):
        for ours, theirs in zip(_arrays(evaluate(given)), _arrays(expected), strict=True):
            np.testing.assert_array_equal(ours, theirs)


def test_other_kinds_of_numbers_are_converted() -> None:
    sphere = TARGETS["hemisphere"]()
    np.testing.assert_array_equal(sphere.closest(np.array([[0, 0, 1]])), sphere.closest(np.array([[0.0, 0.0, 1.0]])))
    single = np.array(POINTS, dtype=np.float32)
    np.testing.assert_array_equal(sphere.distance(single), sphere.distance(single.astype(float)))


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("method", sorted(OF_PLAN | OF_SPACE))
@pytest.mark.parametrize("shape", [(4,), (4, 4), (2, 2, 3), ()])
def test_other_shapes_are_refused(name: str, method: str, shape: tuple[int, ...]) -> None:
    evaluate, columns = getattr(TARGETS[name](), method), 2 if method in OF_PLAN else 3
    for given in (np.zeros(shape), np.zeros((4, 5 - columns))):
        with pytest.raises(InputError, match=rf"must have the shape \(n, {columns}\), not "):
            evaluate(given)


@pytest.mark.parametrize("given", ["0 0 0", None, [[0.0, 0.0], [1.0]], [["x", "y", "z"]]])
def test_what_is_no_numbers_is_refused(given: Any) -> None:
    with pytest.raises(InputError, match=r"^x must be numbers of the shape \(n, 3\), not "):
        TARGETS["hemisphere"]().level(given)
    with pytest.raises(InputError, match=r"^xy must be numbers of the shape \(n, 2\), not "):
        TARGETS["hemisphere"]().height_at(xy=given)


def _arrays(found: object) -> list[Any]:
    return list(found) if isinstance(found, tuple) else [found]
