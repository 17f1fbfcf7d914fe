"""Starting from what was found before: the same answers as from nothing, and never a worse one."""

from dataclasses import replace

import numpy as np
import pytest

import rodshell as rs
from rodshell.layout.mesh import side_by_side
from rodshell.layout.transfer import corresponding_rods, transferred_edges, transferred_nodes
from rodshell.nets import net_refinement
from rodshell.nets.chebyshev import chebyshev_net
from rodshell.nets.compass import axes
from rodshell.nets.net_refinement import march_near
from tests.formfinding.altered import at_positions
from tests.nets.whole_march import march

SIZE = 0.2
ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
HEMISPHERE = rs.Hemisphere(SIZE)
BUMPS = rs.HeightField(
    formula="0.08*(exp(-((x-.09)^2/.06^2 + y^2/.07^2)/2) + exp(-((x+.09)^2/.06^2 + y^2/.07^2)/2))",
    domain=rs.Disc(SIZE),
)
OVAL = rs.Ellipsoid(SIZE, 0.15, 0.12)
EXACT = 1e-12  # m: the net's equations are solved to 1e-12 of the size and better; 1e-14 measured
SETTLED = 1e-9 * SIZE  # Newton's last step is shorter than 1e-6 of the size, the error left its square


def layout_of(**options):
    return rs.GridLayout.orthogonal(**{"spacing": 0.05, "edge": 0.0125} | options)


def lines(reach, step):
    half = np.arange(0.0, reach + 1e-9, step)
    return np.append(-half[:0:-1], half)


def largest(difference):
    return float(np.nanmax(np.abs(difference)))


# The net


@pytest.mark.parametrize("target", [HEMISPHERE, OVAL, BUMPS, rs.Paraboloid(SIZE, 0.12)], ids=lambda t: t.name)
@pytest.mark.parametrize("step", [0.02, 0.04], ids=["from a near one", "from a rough one"])
def test_all_nodes_together_are_the_net_that_the_march_finds_one_by_one(target, step):
    """Past the hemisphere's equator there is no net: the same nodes are missing."""
    anchor = target.lift(np.array([[0.02, 0.01]]))[0]
    heading = np.array([0.9, 0.3, 0.1])
    u, v = lines(0.35, 0.01), lines(0.3, 0.0125)
    rough = march(target, lines(0.4, step), lines(0.36, step), anchor, heading)
    expected = march(target, u, v, anchor, heading).points
    found = march_near(target, u, v, axes(target, anchor, heading), rough).points
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(expected))
    assert largest(found - expected) < EXACT


@pytest.mark.parametrize("worse", ["of another target", "of noise", "of nothing", "a part", "folded over"])
def test_a_bad_guess_of_the_net_does_no_harm(worse):
    anchor, heading = np.array([0.0, 0.0, SIZE]), np.array([1.0, 0.0, 0.0])
    u = lines(0.36, 0.01)
    expected = march(HEMISPHERE, u, u, anchor, heading)
    points = expected.points.copy()
    match worse:
        case "of another target":
            points = march(rs.Paraboloid(0.15, 0.3), u, u, np.array([0.0, 0.0, 0.3]), heading).points
        case "of noise":
            points += 0.05 * np.sin(1e5 * np.arange(points.size)).reshape(points.shape)
        case "of nothing":
            points[:] = np.nan
        case "a part":
            points[:30] = np.nan
        case "folded over":  # a solution of the same equations, but for the side on which P lies
            points[51:] = points[49:27:-1]
    found = march_near(HEMISPHERE, u, u, axes(HEMISPHERE, anchor, heading), replace(expected, points=points)).points
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(expected.points))
    assert largest(found - expected.points) < EXACT


def test_what_has_not_settled_is_marched(monkeypatch):
    """After one round from a rough net no node has."""
    monkeypatch.setattr(net_refinement, "ROUNDS", 1)
    anchor, heading = np.array([0.0, 0.0, SIZE]), np.array([1.0, 0.0, 0.0])
    u, rough = lines(0.3, 0.01), lines(0.32, 0.04)
    found = march_near(
        HEMISPHERE, u, u, axes(HEMISPHERE, anchor, heading), march(HEMISPHERE, rough, rough, anchor, heading)
    ).points
    assert largest(found - march(HEMISPHERE, u, u, anchor, heading).points) < EXACT


def test_a_net_found_near_another_asks_the_target_less_often(monkeypatch):
    layout, asked = layout_of(), []
    last = chebyshev_net(BUMPS, layout_of(spacing=0.051))
    for name in ("level", "implicit"):
        answer = getattr(rs.HeightField, name)
        monkeypatch.setattr(rs.HeightField, name, lambda self, x, say=answer: asked.append(len(x)) or say(self, x))
    chebyshev_net(BUMPS, layout)
    cold, asked[:] = len(asked), []
    chebyshev_net(BUMPS, layout, warm_start=last)
    assert len(asked) < 0.15 * cold  # 19 against 152


# The whole form

CHANGES = {
    "spacing": (OVAL, {"spacing": 0.051}, {}),
    "unequal spacing": (OVAL, {"spacing": (0.049, 0.052)}, {}),
    "heading": (OVAL, {"rotate": 0.03}, {}),
    "anchor": (OVAL, {}, {"anchor": (0.023, 0.008)}),
    "size": (rs.Ellipsoid(0.204, 0.15, 0.122), {}, {}),
    "edge": (OVAL, {"edge": 0.008}, {}),
    "rods left out": (OVAL, {"rods": (5, 4)}, {}),
    "another target": (rs.Paraboloid(SIZE, 0.15), {}, {}),
    "another joint": (OVAL, {}, {"joint": rs.Pin()}),
}


@pytest.fixture(scope="module")
def last():
    return rs.find_form(OVAL, layout_of(), ROD, anchor=(0.02, 0.01))


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
def test_a_form_found_from_the_last_one_is_the_form_found_from_nothing(change, last):
    target, layout, options = CHANGES[change]
    options = {"anchor": (0.02, 0.01)} | options
    cold = rs.find_form(target, layout_of(**layout), ROD, **options)
    warm = rs.find_form(target, layout_of(**layout), ROD, warm_start=last, **options)
    assert cold.status == warm.status == "converged"
    assert [rod.name for rod in warm.footprint.rods] == [rod.name for rod in cold.footprint.rods]
    assert largest(warm.footprint.points - cold.footprint.points) < EXACT
    assert largest(warm.draped.positions - cold.draped.positions) < SETTLED
    for ends, popped in cold.popped.items():
        assert warm.popped[ends].report.stable == popped.report.stable
        assert largest(warm.popped[ends].positions - popped.positions) < SETTLED


def test_stiffer_rods_start_with_the_forces_that_they_need(last):
    """The shape does not change: from the last form there is nothing left to do but to see it."""
    stiff = rs.Rod(section=ROD.section, material=rs.Material(youngs_modulus=1e9, density=1e3))
    warm = rs.find_form(OVAL, layout_of(), stiff, anchor=(0.02, 0.01), warm_start=last)
    for popped in warm.popped.values():
        assert popped.report.iterations == 1
        assert popped.report.stable


def test_a_shell_that_springs_off_takes_fewer_steps_from_the_last_one():
    last = rs.find_form(BUMPS, layout_of(), ROD)
    again = layout_of(spacing=0.0505)
    cold, warm = (rs.find_form(BUMPS, again, ROD, warm_start=start) for start in (None, last))
    for ends in cold.popped:
        assert warm.popped[ends].report.factorizations <= 0.75 * cold.popped[ends].report.factorizations
        assert largest(warm.popped[ends].positions - cold.popped[ends].positions) < SETTLED


def test_a_pop_up_that_was_somewhere_else_is_started_from_the_draped_state(last):
    """Half inside out: from there Newton's method finds the shell that is popped down, stable too, or nothing."""
    for form in (last, rs.find_form(HEMISPHERE, layout_of(), ROD, ends=("pinned",))):
        popped, trimmed = form.popped["pinned"], form.trimmed
        down = at_positions(popped, popped.positions * [1.0, 1.0, -0.85])
        again = rs.pop_up(form.footprint, trimmed.boundary, ROD, ends="pinned", warm_start=down)
        assert again.report.stable
        assert largest(again.positions - popped.positions) < SETTLED


def test_a_warm_start_that_would_be_ignored_is_refused(last):
    """An earlier pop-up serves the same ends, and no start from flat."""
    popped, boundary = last.popped["pinned"], last.trimmed.boundary
    with pytest.raises(rs.InputError, match="has pinned ends, not clamped"):
        rs.pop_up(last.footprint, boundary, ROD, ends="clamped", warm_start=popped)
    with pytest.raises(rs.InputError, match='can only be used with start="draped"'):
        rs.pop_up(last.footprint, boundary, ROD, ends="pinned", start="flat", warm_start=popped)


# What is carried


def test_fields_are_carried_unchanged_to_the_same_mesh_and_linear_ones_to_any(last):
    mesh = last.footprint.mesh
    field = np.column_stack([mesh.flat[:, 0], np.sin(30 * mesh.flat[:, 1])])
    np.testing.assert_allclose(transferred_nodes(field, mesh, mesh), field, atol=1e-12)
    forces = np.cos(np.arange(len(mesh.edges)))
    np.testing.assert_allclose(transferred_edges(forces, mesh, mesh), forces, atol=1e-12)
    fine = rs.find_form(OVAL, layout_of(edge=0.005), ROD, anchor=(0.02, 0.01), ends=()).footprint.mesh
    straight = mesh.flat[:, :1]
    carried = transferred_nodes(straight, mesh, fine)
    np.testing.assert_allclose(carried, fine.flat[:, :1], atol=1e-6)  # rods differ by 3e-7 m in length


def test_rods_without_a_counterpart_get_nothing(last):
    mesh = last.footprint.mesh
    few = rs.find_form(OVAL, layout_of(rods=(5, 4)), ROD, anchor=(0.02, 0.01), ends=()).footprint.mesh
    pairs = dict(corresponding_rods(few, mesh))
    offsets = {mesh.grid.rods[new].offset: few.grid.rods[old].offset for new, old in pairs.items()}
    assert all(abs(new - old) < 1e-12 for new, old in offsets.items())
    assert 0 < len(pairs) < len(mesh.grid.rods)
    carried = transferred_nodes(np.ones((few.node_count, 1)), few, mesh)
    only = np.setdiff1d(np.arange(len(mesh.grid.rods)), list(pairs))
    alone = np.setdiff1d(
        np.concatenate([mesh.nodes_of(k) for k in only]), np.concatenate([mesh.nodes_of(k) for k in pairs])
    )
    assert len(alone)
    assert (carried[alone] == 0.0).all()


def test_rods_of_grids_side_by_side_have_their_counterparts_in_the_same_grid(last):
    """However the row lies, in which grids of other sizes move the others."""
    mesh = last.footprint.mesh
    few = rs.find_form(OVAL, layout_of(rods=(5, 4)), ROD, anchor=(0.02, 0.01), ends=()).footprint.mesh
    before, now = (side_by_side({"A": a, "B": b}, 0.1) for a, b in ((few, mesh), (mesh, few)))
    first = corresponding_rods(few, mesh)
    second = [(k + len(mesh.grid.rods), j + len(few.grid.rods)) for k, j in corresponding_rods(mesh, few)]
    assert corresponding_rods(before, now) == [*first, *second]


def test_a_net_searched_for_in_its_own_steps_needs_no_other_guess():
    """Narrow, so that the search takes four steps to a spacing, as the coarse march does: no difference to go by."""
    peak = rs.HeightField(function=lambda x, y: 0.15 * np.exp(-(x * x + y * y) / (2 * 0.04**2)), domain=rs.Disc(0.2))
    with np.errstate(all="raise"):
        net = chebyshev_net(peak, rs.GridLayout.orthogonal(spacing=0.08, edge=0.01))
    assert net.error_estimate < 0.01 * 0.08
