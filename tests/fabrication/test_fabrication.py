"""Layers, stock, splices and bracing, against what they must satisfy and against brute force."""

from dataclasses import replace
from itertools import combinations, pairwise
from math import ceil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

import rodshell as rs
from rodshell.arrays import Floats
from rodshell.fabrication.cutting import splices
from rodshell.fabrication.fabricate import Fabricated, fabricate
from rodshell.fabrication.nesting import nest
from rodshell.fabrication.settings import Fabrication
from rodshell.figures.fabrication import Piece
from rodshell.layout import FlatGrid, Profile, mesh_grid, straight_rods
from rodshell.layout.flatgrid import layers
from rodshell.layout.gridlayout import GridLayout
from rodshell.layout.rest_curve import RestCurve

ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))


@given(st.integers(2, 12).flatmap(lambda n: st.tuples(st.just(n), st.sets(st.tuples(*[st.integers(0, n - 1)] * 2)))))
def test_rods_of_one_layer_never_cross(graph: tuple[int, set[tuple[int, int]]]) -> None:
    rods, crossings = graph
    met = [(a, b) for a, b in crossings if a != b]
    layer = layers(rods, met)
    assert layer.min() >= 1
    assert all(layer[a] != layer[b] for a, b in met)


def test_two_families_take_two_layers_the_first_below() -> None:
    met = [(u, 5 + v) for u in range(5) for v in range(4)]
    assert layers(9, met).tolist() == [1] * 5 + [2] * 4
    assert layers(3, [(0, 1), (1, 2), (0, 2)]).tolist() == [1, 2, 3]  # a triangle needs three


def fewest_bars(lengths: list[float], stock: float) -> int:
    """The best there is, by trying every place for every piece."""
    best = len(lengths)

    def place(k: int, left: list[float]) -> None:
        nonlocal best
        if len(left) >= best:
            return
        if k == len(lengths):
            best = len(left)
            return
        for bar in range(len(left)):
            if left[bar] >= lengths[k] - 1e-9:
                place(k + 1, [*left[:bar], left[bar] - lengths[k], *left[bar + 1 :]])
        place(k + 1, [*left, stock - lengths[k]])

    place(0, [])
    return best


def named(lengths: list[float]) -> list[Piece]:
    """Pieces that are called by their number."""
    return [Piece(piece=str(k), length=length) for k, length in enumerate(lengths)]


def lengths_of(made: Fabricated, lath: str) -> list[float]:
    """Of the pieces of a lath."""
    return [piece.length for piece in made.pieces if piece.piece.partition(".")[0] == lath]


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(1, 12), min_size=1, max_size=9), st.sampled_from([0.0, 0.25]))
def test_every_piece_is_cut_once_and_no_bar_is_too_short(pieces: list[int], kerf: float) -> None:
    lengths, stock = [float(piece) for piece in pieces], 12.0
    plan = nest(named(lengths), stock, kerf=kerf)
    assert sorted(int(piece.piece) for bar in plan.bars for piece in bar.pieces) == list(range(len(lengths)))
    for bar in plan.bars:
        used = sum(piece.length for piece in bar.pieces) + kerf * (len(bar.pieces) - 1)
        assert used <= stock + 1e-9
        assert bar.left == pytest.approx(max(stock - used - kerf, 0.0), abs=1e-9)
    assert plan.waste == pytest.approx(1 - sum(lengths) / (stock * len(plan.bars)))
    if kerf == 0:
        best = fewest_bars(lengths, stock)
        assert plan.fewest <= best <= len(plan.bars) <= best + 1


def shares_of_bars(lengths: Floats, wanted: Floats, room: float) -> float:
    """The fewest bars where shares of bars are allowed, by the linear program of all patterns."""
    patterns = [()]
    for length in lengths:
        patterns = [
            (*some, n) for some in patterns for n in range(1 + int((room - lengths[: len(some)] @ some) // length))
        ]
    columns = np.array(patterns, dtype=float)
    return float(linprog(np.ones(len(columns)), A_ub=-columns.T, b_ub=-wanted).fun)


@pytest.mark.parametrize("seed", range(30))
def test_a_plan_takes_at_most_one_bar_more_than_the_linear_program_of_all_patterns(seed: int) -> None:
    """Of these lists first fit decreasing takes up to 5 bars more than the best."""
    random = np.random.default_rng(seed)
    kinds, stock, kerf = np.unique(random.integers(1200, 3000, size=9)) / 1000, 6.0, 0.004
    wanted = random.integers(1, 12, size=len(kinds))
    plan = nest(named(np.repeat(kinds, wanted).tolist()), stock, kerf=kerf)
    bound = ceil(shares_of_bars(kinds + kerf, wanted, stock + kerf + 1e-9) - 1e-6)
    assert plan.fewest <= bound <= len(plan.bars) <= bound + 1


def test_pieces_of_a_third_and_more_are_mated_as_first_fit_decreasing_fails_to() -> None:
    """Ten bars of 0.51, 0.27, 0.22 and five of 0.26, 0.26, 0.48: the longest first, they take more."""
    lengths = [0.51] * 10 + [0.27] * 10 + [0.22] * 10 + [0.26] * 10 + [0.48] * 5
    plan = nest(named(lengths), 1.0)
    assert len(plan.bars) == plan.fewest == 15


def test_of_hundreds_of_pieces_the_plan_is_within_one_bar_of_its_bound() -> None:
    random = np.random.default_rng(4)
    lengths = np.repeat(random.uniform(0.2, 0.5, 50), 3).round(4).tolist()
    plan = nest(named(lengths), 1.0, kerf=0.0005)
    assert plan.fewest <= len(plan.bars) <= plan.fewest + 1
    assert plan.fewest >= sum(lengths)


def test_pieces_that_fill_a_bar_to_the_last_leave_nothing() -> None:
    plan = nest(named([0.1, 0.2, 0.3, 0.4]), 0.5)
    assert [[piece.piece for piece in bar.pieces] for bar in plan.bars] == [["3", "0"], ["2", "1"]]
    assert plan.waste == pytest.approx(0.0, abs=1e-12)
    assert plan.fewest == 2


def choices(length: float, joints: list[float], stock: float) -> list[tuple[float, ...]]:
    """All ways to splice halfway between joints into pieces that stock can give."""
    middles = [(a + b) / 2 for a, b in pairwise(joints)]
    ways = []
    for count in range(len(middles) + 1):
        for some in combinations(middles, count):
            stops = [0.0, *some, length]
            if all(b - a <= stock for a, b in pairwise(stops)):
                ways.append(some)
    return ways


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(1, 30), min_size=2, max_size=7, unique=True), st.integers(8, 40), st.randoms())
def test_splices_are_the_fewest_and_then_the_least_bent(at: list[int], stock: int, random: object) -> None:
    joints, length = sorted(float(one) for one in at), 32.0
    places = np.linspace(0, length, 33)
    curvature = np.array([random.random() for _ in places])  # type: ignore[attr-defined]
    made = splices(length, joints, float(stock), stations=places, curvature=curvature)
    ways = choices(length, joints, float(stock))
    if not ways:
        assert made is None
        return
    assert made is not None
    fewest = min(map(len, ways))
    worst = [max(np.interp(way, places, curvature), default=0.0) for way in ways if len(way) == fewest]
    assert len(made) == fewest
    assert tuple(made) in ways
    assert max(np.interp(made, places, curvature), default=0.0) == pytest.approx(min(worst))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(1, 30), min_size=2, max_size=7, unique=True), st.integers(8, 40), st.randoms())
def test_of_the_fewest_pieces_the_fewest_are_short_and_then_the_bend_counts(
    at: list[int], stock: int, random: object
) -> None:
    joints, length, short = sorted(float(one) for one in at), 32.0, 6.0
    places = np.linspace(0, length, 33)
    curvature = np.array([random.random() for _ in places])  # type: ignore[attr-defined]

    def cost(way: tuple[float, ...]) -> tuple[int, int, float]:
        pieces = np.diff([0.0, *way, length])
        return len(way), int((pieces < short).sum()), max(np.interp(way, places, curvature), default=0.0)

    made = splices(length, joints, float(stock), stations=places, curvature=curvature, short=short)
    ways = choices(length, joints, float(stock))
    assert (made is None) == (not ways)
    if made is not None:
        assert cost(tuple(made)) == pytest.approx(min(map(cost, ways)))


@pytest.mark.parametrize(("rods", "pieces"), [(1, [2.0, 4.0, 5.0]), (3, [1.0, 5.0, 5.0])])
def test_short_pieces_are_avoided_where_that_takes_no_more_bars(rods: int, pieces: list[float]) -> None:
    """Rods of 11 m from bars of 5 m: the least bend splices at 5 and 6 m, the next at 4 and 6 m.

    Of one rod both ways take three bars. Of three the pieces of 1 m share a bar, and those of 2 m do not: 7 and not 8.
    """
    long = [[[0.0, 0.02 * k], [11.0, 0.02 * k]] for k in range(rods)]
    mesh = mesh_grid(straight_rods([*long, *([[x + 0.5, -0.01], [x + 0.5, 0.05]] for x in range(11))]), 0.5)
    bend = np.ones(len(mesh.rod_nodes))
    for k, rod in enumerate(mesh.grid.rods[:rods]):
        at = mesh.stations[mesh.rod_slice(k)] - rod.start
        bend[mesh.rod_slice(k)] = [
            next((b for b, s in ((0, (5, 6)), (0.5, (4,))) if np.isclose(x, s).any()), 1) for x in at
        ]
    made = fabricate(mesh, ROD, Fabrication(stock_length=5.0), curvature=bend)
    for k in range(rods):
        assert sorted(lengths_of(made, mesh.grid.rods[k].name)) == pytest.approx(pieces)
    assert made.stock is not None
    assert len(made.stock.bars) == (3 if rods == 1 else 7)


def test_a_rod_within_its_stock_is_not_spliced() -> None:
    assert splices(1.0, [0.2, 0.4], 1.0, stations=[0.0, 1.0], curvature=[0.0, 0.0]) == []


def lattice() -> FlatGrid:
    return GridLayout.orthogonal(rods=(4, 5), spacing=0.1, length=0.6, edge=0.05).flat_grid((4, 5), 0.6)


def test_lengths_of_the_workshop_add_up() -> None:
    mesh = mesh_grid(lattice(), 0.05)
    made = fabricate(mesh, ROD, Fabrication(end_allowance=0.02, stock_length=0.4, kerf=0.003))
    np.testing.assert_allclose(made.cut_length, 0.64)
    np.testing.assert_allclose(made.mass, 0.64 * ROD.mass_per_length)
    for k, at in enumerate(made.splices):
        pieces = lengths_of(made, mesh.grid.rods[k].name)
        assert len(pieces) == len(at) + 1 == 2
        assert sum(pieces) == pytest.approx(0.64)
        assert pieces[0] == pytest.approx(0.02 + at[0])  # splices are measured from the rod's start, not its cut end
        mine = mesh.grid.crossings.at[mesh.grid.crossings.rods == k] - mesh.grid.rods[k].start
        assert np.abs(mine - at[0]).min() == pytest.approx(0.05)
    assert made.stock is not None
    assert made.warnings == ()


def test_second_laths_are_cut_from_stock_too_and_spliced_elsewhere_than_the_first() -> None:
    mesh = mesh_grid(lattice(), 0.05).with_profiles(Profile.double(0.75))
    made = fabricate(mesh, ROD, Fabrication(end_allowance=0.02, stock_length=0.4, kerf=0.003))
    assert made.warnings == ()
    assert made.mass.sum() == pytest.approx(ROD.mass_per_length * sum(piece.length for piece in made.pieces))
    for k, rod in enumerate(mesh.grid.rods):
        first, second = (lath for lath in made.laths if lath.rod == k)
        assert (second.start, second.stop) == pytest.approx((0.075, 0.525))
        assert sum(lengths_of(made, f"{rod.name}-2")) == pytest.approx(0.45)
        joints = mesh.grid.crossings.at[mesh.grid.crossings.rods == k] - rod.start
        (place,) = second.splices
        assert np.abs(joints - place).min() == pytest.approx(0.05)  # halfway between two joints
        assert abs(place - first.splices[0]) > 0.09
    assert made.stock is not None
    assert sorted(piece.piece for bar in made.stock.bars for piece in bar.pieces) == sorted(
        piece.piece for piece in made.pieces
    )


def test_laths_that_reach_the_rods_ends_have_their_allowances() -> None:
    profile = Profile((0.0, 0.25, 0.25, 0.5, 0.5, 1.0), (2, 2, 1, 1, 3, 3), "laths")
    assert profile.laths(8.0, 0.1) == ((-0.1, 2.0), (4.0, 8.1), (4.0, 8.1))


def test_a_second_lath_that_cannot_be_spliced_is_named() -> None:
    mesh = mesh_grid(
        straight_rods([[[0.0, 0.0], [1.0, 0.0]], [[0.4, -0.1], [0.4, 0.1]], [[0.6, -0.1], [0.6, 0.1]]]), 0.05
    )
    made = fabricate(mesh.with_profiles((Profile.double(0.7), None, None)), ROD, Fabrication(stock_length=0.55))
    assert made.stock is None
    assert "(lath 2) cannot be spliced between joints from stock of 550 mm" in made.warnings[0]


def test_stock_that_is_too_short_is_said() -> None:
    made = fabricate(mesh_grid(lattice(), 0.05), ROD, Fabrication(stock_length=0.08))
    assert made.stock is None
    assert made.warnings[0].startswith("9 rods (the first: U01) cannot be spliced between joints from stock of 80 mm")


def test_one_rod_that_cannot_be_spliced_is_named_alone() -> None:
    long = [[-0.3, 0.0], [0.3, 0.0]]
    grid = rs.straight_rods([long, *([[x, -0.03], [x, 0.03]] for x in np.linspace(-0.3, 0.3, 5))])
    made = fabricate(mesh_grid(grid, 0.02), ROD, Fabrication(stock_length=0.08))
    assert made.warnings == ("rod R01 cannot be spliced between joints from stock of 80 mm: give longer stock",)


@pytest.mark.parametrize(
    ("options", "reason"),
    [({"end_allowance": -0.01}, "end allowance"), ({"kerf": float("nan")}, "kerf"),
     ({"kerf": 0.003}, "kerf of 0.003 m is lost where stock is cut: give its stock_length"),
     ({"stock_length": 0.0}, "stock length must be positive"), ({"stock_length": 0.002, "kerf": 0.003}, "longer bars")],
)  # fmt: skip
def test_lengths_that_cannot_be_are_refused(options: dict[str, float], reason: str) -> None:
    with pytest.raises(rs.InputError, match=reason):
        Fabrication(**options)


# Upright strips, and laths cut from boards

HYPAR = rs.HeightField(formula="x*y/2", domain=rs.Disc(1.0))  # its rulings are its asymptotic lines
STRIP = rs.Rod(rs.RectangularSection(width=0.03, height=0.002), rs.Material.preset("gfrp"))


@pytest.mark.parametrize("angle", [0.3, 1.0, 1.4, np.pi / 2])
def test_a_slot_takes_a_strip_from_face_to_face(angle: float) -> None:
    """The rhombus in which two strips of 2 mm overlap, along the one that is cut."""
    along = np.array([[np.sin(angle), -np.cos(angle)], [0.0, 1.0]])
    corners = [np.linalg.solve(along, [0.001 * a, 0.001 * b]) for a in (-1, 1) for b in (-1, 1)]
    mesh = mesh_grid(
        straight_rods([[(-1.0, 0.0), (1.0, 0.0)], [(-np.cos(angle), -np.sin(angle)), (np.cos(angle), np.sin(angle))]]),
        0.1,
    )
    made = fabricate(mesh, STRIP, Fabrication(slot_clearance=0.0004), slotted=[mesh.flat])
    assert made.slots[0] == pytest.approx(np.ptp(corners, axis=0)[0] + 0.0004, rel=1e-9)
    assert made.slot_depth == pytest.approx(0.0154)


def test_slots_on_a_saddle_of_rulings_are_as_wide_as_their_angle_asks() -> None:
    """Rulings (1, 0, y/2) and (0, 1, x/2) meet at the angle whose cosine is their scalar product."""
    draped = rs.drape(rs.Asymptotic(spacing=0.2), STRIP, HYPAR, anchor=(0.0, 0.0), joint=rs.Pin())
    made = fabricate(draped.mesh, STRIP, Fabrication(), slotted=[draped.positions])
    x, y, _ = draped.positions[draped.mesh.joint_nodes].T
    cosine = 0.25 * np.abs(x * y) / np.sqrt((1 + 0.25 * x**2) * (1 + 0.25 * y**2))
    np.testing.assert_allclose(made.slots, 0.002 * (1 + cosine) / np.sqrt(1 - cosine**2), rtol=1e-5)
    flat = draped.mesh.flat
    both = fabricate(draped.mesh, STRIP, Fabrication(), slotted=[draped.positions, flat])
    np.testing.assert_array_equal(
        both.slots, np.maximum(made.slots, fabricate(draped.mesh, STRIP, Fabrication(), slotted=[flat]).slots)
    )
    assert not len(fabricate(draped.mesh, STRIP, Fabrication()).slots)


def test_a_finding_says_where_little_remains_next_to_a_slot() -> None:
    """Slots of 2 t at 53 degrees, 30 mm apart: with t = 8 mm there remain 14 mm, less than their depth of 15."""
    sine, cosine = 0.8, 0.6
    lines = [[(-0.3, 0.0), (0.3, 0.0)]]
    lines += [[(x - 0.2 * cosine, -0.2 * sine), (x + 0.2 * cosine, 0.2 * sine)] for x in (-0.015, 0.015)]
    mesh = mesh_grid(straight_rods(lines), 0.05)

    def said(thickness: float) -> list[str]:
        rod = rs.Rod(rs.RectangularSection(width=0.03, height=thickness), rs.Material.preset("gfrp"))
        return [str(word) for word in fabricate(mesh, rod, Fabrication(), slotted=[mesh.flat]).warnings]

    (always,) = said(0.0074)
    assert "keep half of their height" in always
    word, again = said(0.008)
    assert again == always
    assert "meet at 53 degrees, slots are 16 mm wide, and on R01 only 14 mm remain next to one" in word
    assert "its depth of 15 mm" in word
    assert "only 0 mm remain" in said(0.02)[0]


def test_curved_laths_are_spliced_so_that_no_board_is_longer_than_the_stock_and_are_not_nested() -> None:
    lines = [[(0.0, y), (2.0, y)] for y in (0.0, 0.1)] + [[(x, -0.2), (x, 0.3)] for x in np.linspace(0.1, 1.9, 10)]
    grid = straight_rods(lines)
    bent = [rod._replace(curve=RestCurve((0.0, 2.0), (0.5, 0.5))) if rod.length > 1 else rod for rod in grid.rods]
    mesh = mesh_grid(replace(grid, rods=tuple(bent)), 0.05)
    rod = rs.Rod(rs.RectangularSection(width=0.002, height=0.06), rs.Material.preset("gfrp"))
    made = fabricate(mesh, rod, Fabrication(stock_length=1.04))
    assert made.stock is None
    assert [word.finding.code for word in made.warnings] == ["not_nested"]
    assert [len(splices) for splices in made.splices[:2]] == [2, 2]  # one would do of straight bars
    assert max(piece.length for piece in made.pieces) <= 1.04 - 0.06
    assert fabricate(mesh_grid(grid, 0.05), rod, Fabrication(stock_length=1.04)).stock is not None
