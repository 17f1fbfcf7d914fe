"""Cells of a flat grid and the lines that brace them."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.layout import FlatGrid, GridLayout, straight_rods
from rodshell.layout.cells import Pattern, diagonals, flat_joints, grid_cells, lines, rim_diagonals


def lattice(u: int = 4, v: int = 5) -> FlatGrid:
    return GridLayout.orthogonal(rods=(u, v), spacing=0.1, length=1.0, edge=0.05).flat_grid((u, v), 1.0)


@pytest.mark.parametrize("turned", [False, True])
def test_every_cell_has_two_diagonals(turned: bool) -> None:
    """A 3 x 4 lattice of 2 by 1 m cells; also where every second rod runs the other way."""
    ends = [[[0, y], [8, y]] for y in (1.0, 2.0, 3.0)] + [[[x, 0], [x, 4]] for x in (1.0, 3.0, 5.0, 7.0)]
    if turned:
        ends = [pair[::-1] if k % 2 else pair for k, pair in enumerate(ends)]
    grid = straight_rods(ends)
    found, places = diagonals(grid), flat_joints(grid)
    assert len(found) == 2 * 2 * 3
    assert len({frozenset(pair) for pair in found.tolist()}) == len(found)
    np.testing.assert_allclose(np.linalg.norm(places[found[:, 0]] - places[found[:, 1]], axis=1), np.hypot(2, 1))
    middles = places[found].mean(axis=1).reshape(-1, 2, 2)
    np.testing.assert_allclose(middles[:, 0], middles[:, 1])  # both of a cell follow each other


def test_a_cell_with_a_missing_joint_has_none() -> None:
    ends = [[[0, y], [8, y]] for y in (1.0, 2.0)] + [[[1.0, 0], [1.0, 4]], [[3.0, 0], [3.0, 1.5]], [[5.0, 0], [5.0, 4]]]
    assert len(diagonals(straight_rods(ends))) == 0


def test_one_diagonal_a_cell_goes_the_same_way_in_all_cells() -> None:
    grid = lattice()
    found, places = diagonals(grid, Pattern.of("one")), flat_joints(grid)
    assert len(found) == len(grid_cells(grid)) == 12
    assert ((places[found[:, 1]] - places[found[:, 0]]).prod(axis=1) > 0).all()


def test_every_second_pattern_has_continuous_lines_through_every_second_joint() -> None:
    """On a lattice with a joint at the middle: of the diagonals of every cell, the half on even lines."""
    grid = lattice(5, 5)
    places = flat_joints(grid)
    found = diagonals(grid, Pattern.of("every = 2"))
    assert 2 * len(found) == len(diagonals(grid))
    steps = np.rint(places[found] / 0.1).astype(int)
    assert (steps.sum(axis=2) % 2 == 0).all()  # joints of one colour of a chessboard alone
    for row in lines(found, places):
        turns = np.diff(places[row], axis=0)
        np.testing.assert_allclose(turns, np.broadcast_to(turns[0], turns.shape), atol=1e-12)
    assert len(lines(found, places)) == 6  # three each way


def rim_points(grid: FlatGrid, pairs: Ints) -> Floats:
    """(d, 2, 2) where the diagonals at the rim begin and end."""
    ends = np.array([rod.point(s) for rod in grid.rods for s in (rod.start, rod.end)])
    return np.stack([flat_joints(grid)[pairs[:, 0]], ends[pairs[:, 1]]], axis=1)


def test_fields_between_rods_that_end_side_by_side_have_both_diagonals_or_one() -> None:
    """4 x 5 rods have 2 (3 + 4) such fields, the corners have none; lines through every second joint cut one each."""
    grid = lattice()
    both = rim_points(grid, rim_diagonals(grid))
    assert len(both) == 2 * 14
    assert len(np.unique(both.round(6), axis=0)) == len(both)
    one = rim_points(grid, rim_diagonals(grid, Pattern.of("one")))
    assert len(one) == 14
    assert ((one[:, 1] - one[:, 0]).prod(axis=1) > 0).all()
    grid = lattice(5, 5)
    second = rim_diagonals(grid, Pattern.of("every = 2"))
    assert 2 * len(second) == len(rim_diagonals(grid))
    inner = {joint for pair in diagonals(grid, Pattern.of("every = 2")).tolist() for joint in pair}
    assert {start for start, _ in second.tolist()} <= inner  # each goes on with a line


def test_a_stepped_rim_is_divided_into_triangles() -> None:
    """Rods of a disc: no diagonal crosses a rod, and each rod's end has a diagonal unless its joint is at a corner."""
    ticks = np.arange(-4, 5) + 0.3
    reach = np.sqrt(4.8**2 - ticks**2)
    grid = straight_rods(
        [[[-r, y], [r, y]] for y, r in zip(ticks, reach, strict=True)]
        + [[[x, -r], [x, r]] for x, r in zip(ticks, reach, strict=True)]
    )
    pairs = rim_diagonals(grid)
    lines_at_rim = rim_points(grid, pairs)
    for (ax, ay), (bx, by) in lines_at_rim:
        for k, tick in enumerate(ticks):
            for low, high, at in (
                (ax, bx, ay + (tick - ax) / (bx - ax) * (by - ay)),
                (ay, by, ax + (tick - ay) / (by - ay) * (bx - ax)),
            ):
                if min(low, high) + 1e-9 < tick < max(low, high) - 1e-9:
                    assert abs(at) > reach[k]
    fans = Counter(pairs[:, 0].tolist())
    assert max(fans.values()) == 2
    ends = rim_points(grid, pairs)[:, 1]
    assert (np.abs(np.hypot(*ends.T) - 4.8) < 1e-9).all()
    one = rim_diagonals(grid, Pattern.of("one"))
    crossed = len(pairs) - len(one)  # a field with both diagonals has lost one
    assert 0 < crossed < len(one)


def test_a_diagonal_along_a_rod_is_left_out() -> None:
    """Where a rod ends just beyond its last joint."""
    for stub, count in ((0.1, 7), (0.5, 8)):
        ends = [[[0, y], [3, y]] for y in (1.0, 2.0)] + [[[1.0, 0], [1.0, 2 + stub]], [[2.0, 0], [2.0, 3]]]
        assert len(rim_diagonals(straight_rods(ends))) == count


def test_lines_use_each_diagonal_once() -> None:
    grid = lattice()
    found, places = diagonals(grid), flat_joints(grid)
    rows = lines(found, places)
    used = [frozenset(pair) for row in rows for pair in pairwise(row)]
    assert sorted(map(sorted, used)) == sorted(map(sorted, found.tolist()))
    assert len(rows) == 2 * (3 + 4 - 1)


@pytest.mark.parametrize("words", ["", "all", "every", "every = 0", "every = x", "every 1.5"])
def test_another_pattern_is_refused(words: str) -> None:
    with pytest.raises(InputError, match="a pattern of diagonals must be"):
        Pattern.of(words)


def test_rods_of_a_table_are_on_no_lattice() -> None:
    ends = [[[0, y], [4, y]] for y in (1.0, 2.0)] + [[[x, 0], [x, 3]] for x in (1.0, 2.0)]
    with pytest.raises(InputError, match="on no lattice"):
        diagonals(straight_rods(ends), Pattern.of("every 2"))
