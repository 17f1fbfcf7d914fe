"""Each family of variables: its derivatives against solving again, and what it builds against what it changes."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import rodshell as rs
from rodshell.figures.records import Ends
from rodshell.refining.end_families import Clamps, Supports
from rodshell.refining.length_families import Holes, Offsets, Tails
from rodshell.refining.objectives import Gap, LowestEigenvalue, Objective, Prestress
from rodshell.refining.refine import LENGTHS, first_point, structure_of
from rodshell.refining.stiffness_families import DoubleLaths, Sections, Taper
from rodshell.refining.structure import Point, Structure
from rodshell.refining.symmetry import symmetries, ties
from rodshell.refining.variables import Design, Family, Grid, Tied, design_of

MATERIAL = rs.Material(youngs_modulus=1e6, density=1e3)
ROD = rs.Rod(rs.Circle(radius=1e-3), MATERIAL)
LATH = rs.Rod(rs.RectangularSection(width=1e-3, height=2e-3), MATERIAL)
GEODESIC = rs.Geodesic(spacing=0.06, edge=0.02, rotate=0.3)
STEP = 3e-4  # of the scale of the variables: central differences, extrapolated, agree to 1e-6

EVERY: list[tuple[str, Family]] = [
    ("taper", Taper(stations=3)), ("taper a rod", Taper(stations=3, per="rod")), ("double", DoubleLaths()),
    ("sections", Sections()),
    ("tails", Tails()), ("holes", Holes()), ("offsets", Offsets()), ("clamps", Clamps()),
    ("supports", Supports()),
]  # fmt: skip
ALONG_CURVES = [family for _, family in EVERY if family.name not in LENGTHS]
CASES = [
    pytest.param(
        family, laths, id=f"{name}{', laths with pins' * laths}", marks=[pytest.mark.slow] * (laths and name != "tails")
    )
    for name, family in EVERY
    for laths in (False, True)
]


@cache
def structure(
    ends: Ends, laths: bool = False, symmetric: bool = False, weighs: bool = False, lattice: rs.Geodesic | None = None
) -> Structure:
    layout = lattice or rs.GridLayout.orthogonal(
        rods=(5, 5) if symmetric else (6, 5), spacing=0.06, edge=0.02, rotate=0.0 if symmetric else 0.3
    )
    target = rs.Ellipsoid(0.2, 0.18, 0.12)
    rod, joint = (LATH, rs.Pin()) if laths else (ROD, None)
    if weighs:
        rod = rs.Rod(rod.section, rs.Material(youngs_modulus=1e6, density=7.0))
    found = structure_of(rs.find_form(target, layout, rod, ends=(ends,), joint=joint).stages, ends)  # type: ignore[arg-type]
    return replace(found, weight=float(weighs))


def free_design(shell: Structure, family: Family) -> Design:
    """The variables of a family without ties between them."""
    part = family.on(shell)
    return Design([Tied(part, ties(len(part.box.start), []))])


def start(
    family: Family, laths: bool, weighs: bool = False, lattice: rs.Geodesic | None = None
) -> tuple[Design, Point, np.ndarray]:
    """A design, its equilibrium, and a direction at random in it."""
    shell = structure("clamped" if family.name == "clamps" else "pinned", laths, weighs=weighs, lattice=lattice)
    variables = free_design(shell, family)
    here, _ = first_point(shell, variables)
    return variables, here, variables.box.scale * np.random.default_rng(3).uniform(-1.0, 1.0, len(variables.box.scale))


def solved(variables: Design, here: Point, values: np.ndarray) -> Point:
    point, _ = here.tried(values, variables.change(values))
    assert point is not None
    return point


def errors(family: Family, laths: bool, weighs: bool = False, lattice: rs.Geodesic | None = None) -> dict[str, float]:
    """Of the derivatives of the state, and of the objectives' squares, over the largest of each.

    Differences of Hessians leave 1e-7 of a mode's value, see `solve.sensitivity`: its error may be related to that.
    """
    variables, here, direction = start(family, laths, weighs, lattice)
    nodes = here.structure.mesh.node_count
    floor = LowestEigenvalue(least=2.0, before=float(here.modes.values[0]))  # counts here
    goals: dict[str, Objective] = {
        "gap": Gap(), "compression": Prestress(most=-1.0), "modes": floor,
    }  # fmt: skip

    def difference(step: float) -> list[np.ndarray]:
        ends = [solved(variables, here, here.values + sign * step * direction) for sign in (1.0, -1.0)]
        squares = [[goal.residuals(end) @ goal.residuals(end) for goal in goals.values()] for end in ends]
        return [
            (a - b) / (2 * step)
            for a, b in zip(*([e.state[:nodes], *s] for e, s in zip(ends, squares, strict=True)), strict=True)
        ]

    found = [np.einsum("p,pnx->nx", direction, here.response.motions)[:nodes]]
    found += [2.0 * goal.residuals(here) @ goal.slopes(here) @ direction for goal in goals.values()]
    result = {}
    for name, slope, coarse, fine in zip(["state", *goals], found, difference(2 * STEP), difference(STEP), strict=True):
        exact = (4 * fine - coarse) / 3
        scale = max(float(np.abs(exact).max()), 1e-9)  # a square is known to 1e-16
        if name == "modes":
            scale = max(scale, 0.2 * float(floor.residuals(here) @ floor.residuals(here)))
        result[name] = float(np.abs(slope - exact).max()) / scale
    return result


@pytest.mark.parametrize(("family", "laths"), CASES)
def test_states_and_objectives_change_as_their_derivatives_say(family: Family, laths: bool) -> None:
    assert {name: error for name, error in errors(family, laths).items() if error > 1e-6} == {}


@pytest.mark.slow
@pytest.mark.parametrize("family", ALONG_CURVES, ids=lambda family: family.name)
def test_shells_of_laths_along_geodesics_change_as_their_derivatives_say(family: Family) -> None:
    assert {name: error for name, error in errors(family, True, lattice=GEODESIC).items() if error > 1e-6} == {}


@pytest.mark.slow
@pytest.mark.parametrize("family", [Taper(stations=3), Tails(), Clamps()], ids=lambda family: family.name)
def test_under_its_weight_a_shell_changes_as_its_derivatives_say(family: Family) -> None:
    """The weight follows the design: its sections and its lengths."""
    here = start(family, True, True)[1]
    sag = here.state - here.structure.popped.state
    assert -sag[:, 2].min() > 2e-3 * here.structure.target.size
    assert {name: error for name, error in errors(family, True, True).items() if error > 1e-6} == {}


@pytest.mark.parametrize("family", [family for _, family in EVERY[2:]], ids=[name for name, _ in EVERY[2:]])
def test_what_is_built_has_the_lengths_stiffnesses_and_directions_of_the_design(family: Family) -> None:
    variables, here, direction = start(family, False)
    shell, values = here.structure, here.values + direction
    change = variables.change(values)
    built = variables.applied(Grid(shell.mesh, shell.popped.boundary), values)
    np.testing.assert_allclose(built.mesh.edge_lengths, shell.mesh.edge_lengths + change.lengths, rtol=1e-12)
    np.testing.assert_allclose(
        np.log(shell.stiffness(built.mesh) / shell.edges.table[:, :4]), change.stiffness, atol=1e-12
    )
    turned = built.boundary.tangents - shell.popped.boundary.tangents
    assert np.allclose(turned, 0.0) == (family.name != "clamps")
    moved = built.boundary.points - shell.popped.boundary.points
    np.testing.assert_allclose(moved, change.held[: len(moved)], atol=1e-15)
    assert np.allclose(moved, 0.0) == (family.name != "supports")
    still = shell.target.margin(built.boundary.points) - shell.target.margin(shell.popped.boundary.points)
    assert np.abs(still).max() < 1e-9
    assert np.abs(shell.target.distance(built.boundary.points)).max() < 1e-9


def test_rods_moved_across_stay_straight_and_their_joints_stay_together() -> None:
    """In the flat grid all rods have the same point at a joint, at the stations of the crossings."""
    variables, here, direction = start(Offsets(), False)
    shell = here.structure
    built = variables.applied(Grid(shell.mesh, shell.popped.boundary), direction).mesh
    assert np.abs(direction).max() > 1e-4
    for side in range(2):
        rods = [built.grid.rods[k] for k in built.grid.crossings.rods[:, side]]
        there = np.array([rod.point(s) for rod, s in zip(rods, built.grid.crossings.at[:, side], strict=True)])
        np.testing.assert_allclose(there, built.flat[built.joint_nodes, :2], atol=1e-14)


def test_offsets_of_a_turned_table_of_rods_are_those_of_the_lattice_and_rods_that_cross_askew_are_refused() -> None:
    shell = structure("pinned")
    turn = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    change = 1e-3 * np.random.default_rng(4).uniform(-1.0, 1.0, len(shell.mesh.grid.rods))

    def built(turns: list[np.ndarray]) -> np.ndarray:
        """Flat nodes (n, 2) of a table of the same rods, the first and the second family turned."""
        rods = [(rod, turns[rod.family == "v"]) for rod in shell.mesh.grid.rods]
        lines = [(tuple((by @ rod.origin).tolist()), tuple((by @ rod.direction).tolist())) for rod, by in rods]
        table = tuple(
            rod._replace(family="free", offset=None, origin=origin, direction=direction)
            for (rod, _), (origin, direction) in zip(rods, lines, strict=True)
        )
        mesh = replace(shell.mesh, grid=replace(shell.mesh.grid, rods=table))
        variables = Offsets().on(SimpleNamespace(mesh=mesh))  # type: ignore[arg-type]  # all that it looks at
        return variables.applied(Grid(mesh, shell.popped.boundary), change).mesh.flat[:, :2]

    lattice = Offsets().on(shell).applied(Grid(shell.mesh, shell.popped.boundary), change).mesh.flat[:, :2]
    np.testing.assert_allclose(built([turn, turn]), lattice @ turn.T, atol=1e-15)
    with pytest.raises(rs.InputError, match="cross at right angles"):
        built([np.eye(2), turn])


def test_an_ellipsoid_has_its_three_symmetries_and_a_hemisphere_seven() -> None:
    shell = structure("pinned", symmetric=True)
    found = symmetries(shell.mesh, shell.popped.positions)
    assert sorted(operation.handed for operation in found) == [-1.0, -1.0, 1.0]
    assert not symmetries(structure("pinned").mesh, structure("pinned").popped.positions)
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06, edge=0.02)
    form = rs.find_form(rs.Hemisphere(0.2), layout, ROD, ends="pinned")
    assert len(symmetries(form.footprint.mesh, form.popped["pinned"].positions)) == 7


@pytest.mark.parametrize(
    "family", [Taper(per="rod"), Tails(), Holes(), Offsets(), Clamps(), Supports()], ids=lambda family: family.name
)
def test_the_free_steepest_descent_of_a_symmetric_shell_is_symmetric(family: Family) -> None:
    """So ties leave nothing out: the gradient of the gap by all variables lies in the space of the tied ones."""
    shell = structure("clamped" if family.name == "clamps" else "pinned", symmetric=True)
    free, tied = free_design(shell, family), design_of(shell, [family])
    assert len(tied.box.start) < 0.65 * len(free.box.start)
    here = Point(shell, free.box.start, free.change(free.box.start), shell.edges, shell.popped.equilibrium)
    gradient = Gap().slopes(here).T @ Gap().residuals(here)
    common = tied.parts[0].ties.toarray()
    inside = common @ np.linalg.lstsq(common, gradient)[0]
    assert np.abs(gradient - inside).max() < 1e-6 * np.abs(gradient).max()


def test_tied_variables_act_as_the_whole_does() -> None:
    shell = structure("pinned", symmetric=True)
    tied = design_of(shell, [Taper(per="rod"), Tails()])
    values = tied.box.start + 0.3 * tied.box.scale
    change, step = tied.change(values), 1e-5
    for k in range(len(values)):
        moved = values + step * np.eye(len(values))[k]
        there = tied.change(moved)
        stiffer, longer = (there.stiffness - change.stiffness) / step, (there.lengths - change.lengths) / step
        np.testing.assert_allclose(change.stiffness_slopes[:, [k]].toarray()[:, 0], stiffer.ravel(), atol=1e-4)
        np.testing.assert_allclose(change.length_slopes[:, [k]].toarray()[:, 0], longer, atol=1e-9)
