"""Outlines of flat grids: rod ends in the order of the boundary that cut the rods, whatever its shape."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rodshell.layout import FlatGrid, FlatRod
from rodshell.output.grid import opens, outlines

Floats = NDArray[np.float64]

U_SHAPE = np.array([[0, 0], [10, 0], [10, 9], [7, 9], [7, 3], [3, 3], [3, 9], [0, 9]], dtype=float)
SQUARE = np.array([[0, 0], [10, 0], [10, 10], [0, 10]], dtype=float)
HOLE = np.array([[4, 3], [4, 7], [8, 7], [8, 3]], dtype=float)  # clockwise: the grid on its left


def rods_within(loops: list[Floats], spacing: float, angle: float) -> Floats:
    """(m, 2, 2) pieces of two orthogonal families of lines inside polygons, by the even-odd rule; none is alone."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned = [loop @ turn for loop in loops]
    rods = []
    for axis in (0, 1):
        for offset in np.arange(-20 + 0.123, 20, spacing):
            at = []
            for loop in turned:
                a, b = loop, np.roll(loop, -1, axis=0)
                hit = (a[:, axis] > offset) != (b[:, axis] > offset)
                share = (offset - a[hit, axis]) / (b[hit, axis] - a[hit, axis])
                at += (a[hit] + share[:, None] * (b[hit] - a[hit]))[:, 1 - axis].tolist()
            for low, high in np.sort(at).reshape(-1, 2):
                ends = np.full((2, 2), offset)
                ends[:, 1 - axis] = low, high
                rods.append(ends @ turn.T)
    crossed = FlatGrid.of(straight_lines(rods)).without(lambda grid: grid.joint_counts() < 2)[0]
    return np.array([rod.point([0.0, rod.length]) for rod in crossed.rods])


def straight_lines(rods: list[Floats]) -> list[FlatRod]:
    along = [(b - a, np.hypot(*(b - a))) for a, b in rods]
    return [
        FlatRod(str(k), "free", 0.0, 0.0, size, tuple(ends[0]), tuple(way / size))
        for k, (ends, (way, size)) in enumerate(zip(rods, along, strict=True))
    ]


def place_along(loop: Floats, points: Floats) -> tuple[Floats, Floats]:
    """How far along a closed polygon its points nearest to (n, 2) lie, and how far off these are."""
    a, edge = loop, np.roll(loop, -1, axis=0) - loop
    length = np.linalg.norm(edge, axis=1)
    share = np.clip(np.einsum("nki,ki->nk", points[:, None] - a, edge) / length**2, 0, 1)
    off = np.linalg.norm(points[:, None] - a - share[..., None] * edge, axis=2)
    k = np.argmin(off, axis=1)
    row = np.arange(len(points))
    return np.cumsum(np.append(0, length))[k] + share[row, k] * length[k], off[row, k]


def turns_once(along: Floats) -> bool:
    """Whether numbers ascend but for one step, round a closed curve."""
    return int(np.count_nonzero(np.diff(np.append(along, along[0])) < 0)) == 1


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4])
def test_ends_follow_a_boundary_that_no_point_sees_whole(angle: float) -> None:
    rods = rods_within([U_SHAPE], 0.7, angle)
    (outline,) = outlines(rods)
    along, _ = place_along(U_SHAPE, rods.reshape(-1, 2)[outline])
    assert len(outline) == 2 * len(rods)
    assert len(set(outline.tolist())) == len(outline)
    assert turns_once(along)
    assert not opens(rods.reshape(-1, 2)[outline])


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_an_opening_has_an_outline_of_its_own(angle: float) -> None:
    rods = rods_within([SQUARE, HOLE], 0.7, angle)
    ends = rods.reshape(-1, 2)
    outer, inner = outlines(rods)
    assert len(outer) + len(inner) == len(ends)
    for loop, outline in ((SQUARE, outer), (HOLE, inner)):
        along, off = place_along(loop, ends[outline])
        assert off.max() < 1e-9
        assert turns_once(along)
    assert [opens(ends[outline]) for outline in (outer, inner)] == [False, True]


def test_grids_apart_have_an_outline_each() -> None:
    rods = rods_within([SQUARE], 0.7, 0.3)
    both = np.concatenate([rods, rods + [30.0, 0.0]])
    first, second = outlines(both)
    assert {set(one.tolist()) == set(range(2 * len(rods))) for one in (first, second)} == {True, False}
    assert len(first) == len(second) == 2 * len(rods)


def test_rods_that_end_on_each_other_count_once() -> None:
    """A frame: the outer rods run through the ends of all others."""
    lines = np.arange(5.0)
    rods = np.array([[[0, y], [4, y]] for y in lines] + [[[x, 0], [x, 4]] for x in lines])
    (outline,) = outlines(rods)
    assert len(outline) == len(set(outline.tolist())) == 20
    along, off = place_along(0.4 * SQUARE, rods.reshape(-1, 2)[outline])
    assert off.max() < 1e-9
    assert np.count_nonzero(np.diff(along) < 0) <= 1


def test_fewer_than_three_ends_make_no_outline() -> None:
    assert outlines(np.empty((0, 2, 2))) == []
    assert outlines(np.array([[[0.0, 0.0], [1.0, 0.0]]])) == []
