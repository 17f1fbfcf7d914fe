"""Designs of sizes of stock: which sizes they have, and how near they come to the best there are."""

from itertools import product

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import InputError
from rodshell.refining.refine import refine
from rodshell.refining.stiffness_families import RENARD
from rodshell.refining.stock import nearest, repaired
from tests.refining.test_refine import ROD, form

SIZES = [2e-3 * number for number in RENARD]


def test_repair_finds_the_best_of_all_neighbours_of_a_linear_problem() -> None:
    """Against trying all of them: 3 sizes each of 6 variables, 20 problems; greedy steps gain most of it."""
    random, stock = np.random.default_rng(5), np.array([-1.0, 0.0, 1.0])
    for _ in range(20):
        jacobian, r = random.standard_normal((30, 6)), 3.0 * random.standard_normal(30)
        values = repaired([stock] * 6, np.zeros(6), r, jacobian)
        best = min(float(np.sum((r + jacobian @ np.array(choice)) ** 2)) for choice in product(stock, repeat=6))
        assert float(np.sum((r + jacobian @ values) ** 2)) < r @ r
        assert float(r @ r) - float(np.sum((r + jacobian @ values) ** 2)) > 0.75 * (float(r @ r) - best)


def test_variables_without_stock_keep_their_values() -> None:
    stock = [np.array([0.0, 1.0]), None]
    np.testing.assert_array_equal(nearest(stock, np.array([0.6, 0.6])), [1.0, 0.6])
    moved = repaired(stock, np.array([0.0, 0.6]), np.array([-1.0, -1.0]), np.eye(2))
    np.testing.assert_array_equal(moved, [1.0, 0.6])


def test_each_rod_has_a_size_of_the_list_and_the_shell_is_nearer() -> None:
    found = refine(form().stages, "sections")  # type: ignore[arg-type]
    assert found.gap_after.rms < 0.92 * found.gap_before.rms
    sizes = []
    for rod in found.after.footprint.rods:
        factors = (1.0, 1.0) if rod.profile is None else rod.profile.factors
        assert factors[0] == factors[1]
        sizes.append(2e-3 * factors[0] ** 0.25)
    assert len(set(np.round(sizes, 9))) > 1
    assert all(min(abs(size - known) for known in SIZES) < 1e-6 * size for size in sizes)
    assert found.gap_after.rms < 1.2 * found.steps[-1].rms * found.after.target.size  # type: ignore[operator]


def test_what_is_no_stock_is_refused() -> None:
    with pytest.raises(InputError, match="both decide the sections"):
        refine(form().stages, ("taper", "sections"))  # type: ignore[arg-type]
    given = rs.Rod(rs.GivenSection(EA=1.0, EI1=ROD.bend_stiffness, EI2=ROD.bend_stiffness, GJ=1e-3))
    stages = rs.find_form(rs.Paraboloid(0.2, 0.12), form().layout, given, ends="pinned").stages
    with pytest.raises(InputError, match="this rod has none"):
        refine(stages, "sections")  # type: ignore[arg-type]
