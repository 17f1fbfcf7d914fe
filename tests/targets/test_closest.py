"""The kernels of closest points and shape operators against plain linear algebra."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.targets.target import NO_FORCES, newton_to_closest, shape_operators
from tests.targets.meshes import PARTS, Floats

COUNT = 200


def states(seed: int = 0) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Points x and y, F, its gradient and Hessian at y, and damping: anything at all."""
    rng = np.random.default_rng(seed)
    x, y, gradient = rng.normal(size=(3, COUNT, 3))
    hessian = 6 * rng.normal(size=(COUNT, 3, 3))
    return x, y, rng.normal(size=COUNT), gradient, hessian + hessian.transpose(0, 2, 1), rng.uniform(0, 2, COUNT)


def test_a_newton_step_solves_the_bordered_system():
    """(1 + damping) s + t F'' s + dt F' = x - y - t F', F' s = -F, with t the best for y alone."""
    x, y, value, gradient, hessian, damping = states()
    moved, slope, length = y.copy(), np.empty_like(x), np.empty(COUNT)
    newton_to_closest(x, moved, np.arange(COUNT), value, gradient, hessian, damping, np.inf, slope, length)
    step, convex, kinds = moved - y, np.isfinite(length), set()
    assert np.array_equal(slope, gradient)
    assert length[convex] == pytest.approx(np.linalg.norm(step[convex], axis=1))
    for k in range(COUNT):
        g, t = gradient[k], (x[k] - y[k]) @ gradient[k] / (gradient[k] @ gradient[k])
        bent = (1 + damping[k]) * np.eye(3) + t * hessian[k]
        system = np.block([[bent, g[:, None]], [g[None], np.zeros((1, 1))]])
        exact = np.linalg.solve(system, np.append(x[k] - y[k] - t * g, -value[k]))
        assert step[k] == pytest.approx(exact[:3], rel=1e-8, abs=1e-8)
        tangents = np.linalg.svd(g[None])[2][1:]
        bends = np.linalg.eigvalsh(tangents @ bent @ tangents.T)
        assert convex[k] == (bends > 0).all()
        kinds.add(int((bends > 0).sum()))
    assert kinds == {0, 1, 2}


def test_only_the_rows_that_are_asked_for_move_and_no_further_than_they_may():
    x, y, value, gradient, hessian, damping = states()
    whole, slope, length = y.copy(), np.empty_like(x), np.empty(COUNT)
    newton_to_closest(x, whole, np.arange(COUNT), value, gradient, hessian, damping, np.inf, slope, length)
    rows = np.arange(COUNT)[::-3].copy()
    given = [np.ascontiguousarray(array[rows]) for array in (value, gradient, hessian, damping)]
    moved, slope, length = y.copy(), np.zeros_like(x), np.empty(len(rows))
    newton_to_closest(x, moved, rows, *given, 0.5, slope, length)
    others = np.setdiff1d(np.arange(COUNT), rows)
    assert np.array_equal(moved[others], y[others])
    assert not slope[others].any()
    full, step = (whole - y)[rows], (moved - y)[rows]
    size = np.linalg.norm(full, axis=1)
    assert size.min() < 0.5 < size.max()
    assert step == pytest.approx(np.minimum(1.0, 0.5 / size)[:, None] * full)


def test_at_a_centre_of_curvature_the_step_keeps_to_the_normal():
    """On the sphere's centre every point is closest, and none is preferred."""
    y, x = np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3))
    gradient, slope, length = 2 * y, np.empty_like(x), np.empty(1)
    newton_to_closest(
        x, y, np.arange(1), np.array([0.02]), gradient, 2 * np.eye(3)[None], np.zeros(1), np.inf, slope, length
    )
    assert y[0] == pytest.approx([0.0, 0.0, 0.99])
    assert np.isinf(length[0])


def test_shape_operators_are_projected_hessians():
    _, _, _, gradient, hessian, _ = states()
    normal, shape = np.empty_like(gradient), np.empty_like(hessian)
    shape_operators(gradient, hessian, NO_FORCES, normal, shape)
    steep = np.linalg.norm(gradient, axis=1)
    n = gradient / steep[:, None]
    tangential = np.eye(3) - n[:, :, None] * n[:, None]
    assert normal == pytest.approx(n)
    assert shape == pytest.approx(tangential @ (hessian / steep[:, None, None]) @ tangential)
    forces, times = np.random.default_rng(1).normal(size=gradient.shape), np.empty_like(shape)
    shape_operators(gradient, hessian, forces, normal, times)
    assert times == pytest.approx((n * forces).sum(axis=1)[:, None, None] * shape)


def test_distances_are_those_of_gaps_on_both_sides():
    target = rs.Freeform.of(*PARTS["saddle"]())
    x = target.surface.vertices[::7] + np.random.default_rng(2).normal(0, 0.01, (len(target.surface.vertices[::7]), 3))
    gap = target.gap(x)
    assert np.sign(gap.distance).tolist().count(-1.0) > 20
    assert target.distance(x) == pytest.approx(gap.distance, abs=1e-14)
    y = target.closest(x)
    assert np.abs(target.implicit(y).value).max() < 1e-15
    assert np.cross(x - y, gap.normal) == pytest.approx(0, abs=1e-14)
