"""Loads at which structures of known critical load lose their stability, and paths beyond.

More of them, on finer meshes, stand in the table of `tests/acceptance/loads.py`.
"""

from dataclasses import replace

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import InputError
from rodshell.model import Freedom
from rodshell.rods.elements import Stretch
from rodshell.rods.isotropic import IsotropicBend
from rodshell.solve.arc_length import ArcLength
from rodshell.solve.equilibrium import Equilibrium, SolveReport, Status
from rodshell.solve.load import Load
from rodshell.solve.load_path import CLOSE, load_path
from rodshell.solve.modes import linear_buckling
from rodshell.solve.problem import Problem, Supports
from tests.solve import stability_problems as known
from tests.solve.stability_problems import X, Y

GREENHILL = 7.8373  # q L^3 / EI of a column under its own weight [Timoshenko and Gere, section 2.12]
EDGES = 40
DISCRETE = 1e-3  # 40 edges leave 4e-4 of Greenhill's load (second order: 1.6e-3 at 20)


def at_rest(problem: Problem, state: np.ndarray, forces: np.ndarray) -> Equilibrium:
    """An equilibrium that is known without a solve."""
    report = SolveReport(Status.CONVERGED, 0, 0, 0, 0.0, 0.0, 0.0, 0)
    return Equilibrium(problem, state, forces, np.zeros_like(state), report)


def column(edges: int = EDGES) -> tuple[Problem, np.ndarray, np.ndarray]:
    """Of unit length and EI, clamped at its foot by a node below it; and its weight at factor 1, Greenhill's."""
    length = 1 / edges
    state = np.zeros((edges + 2, 3))
    state[:, 2] = length * np.arange(-1, edges + 1)
    row = np.arange(edges + 2)
    bends = np.column_stack([row[:-2], row[1:-1], row[2:]])
    stiffness = np.full(edges, 1 / length)
    stiffness[0] *= 2  # the clamp acts at the foot: half a Voronoi length
    pairs = np.column_stack([row[1:-1], row[2:]])
    stretch = Stretch.elastic(pairs, np.full(edges, length), np.full(edges, 1e6))
    free = Freedom.free(edges + 2).with_directions(np.array([0, 1]))
    load = np.zeros_like(state)
    load[2:, 2] = -GREENHILL * length
    load[-1] /= 2
    return Problem((IsotropicBend(bends, stiffness),), stretch, Supports(free), 1.0), state, load


def test_a_column_bears_greenhills_weight():
    problem, state, load = column()
    found = load_path(at_rest(problem, state, np.zeros(EDGES)), load)
    assert found.limit == "bifurcation"
    assert 1 - CLOSE - DISCRETE < found.factor < 1 + DISCRETE


def test_a_load_that_stays_takes_its_share():
    problem, state, load = column()
    here = replace(problem, load=0.4 * load)
    forces = 0.4 * np.cumsum(load[:1:-1, 2])[::-1]
    squeezed = state.copy()
    squeezed[2:, 2] += np.cumsum(forces / 1e6 / EDGES)
    found = load_path(at_rest(here, squeezed, forces), load)
    assert 0.6 - CLOSE - DISCRETE < found.factor < 0.6 + DISCRETE


def test_a_column_that_has_buckled_already_bears_nothing():
    problem, state, load = column()
    forces = 1.1 * np.cumsum(load[:1:-1, 2])[::-1]
    squeezed = state.copy()
    squeezed[2:, 2] += np.cumsum(forces / 1e6 / EDGES)
    found = load_path(at_rest(replace(problem, load=1.1 * load), squeezed, forces), load)
    assert found.factor == 0
    assert found.limit == "unstable unloaded"


def test_a_column_that_hangs_bears_any_weight():
    problem, state, load = column(10)
    found = load_path(at_rest(problem, state, np.zeros(10)), -load)
    assert found.limit == "none"
    assert found.factor >= 100


@pytest.mark.parametrize("height", [0.1, 0.5])
def test_a_pyramid_of_bars_snaps_through_at_its_limit_point(height):
    state = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, height]])
    rest = np.hypot(1.0, height)
    pairs = np.column_stack([np.arange(4), np.full(4, 4)])
    stretch = Stretch.elastic(pairs, np.full(4, rest), np.ones(4))
    free = Freedom.free(5).with_directions(np.arange(4))
    load = np.zeros((5, 3))
    load[4, 2] = -1e-3
    found = load_path(at_rest(Problem((), stretch, Supports(free), 1.0), state, np.zeros(4)), load, most=1e4)
    length = rest ** (1 / 3)  # where P = 4 EA z (1/l - 1/l0) is largest: l^3 = a^2 l0
    exact = 4 * np.sqrt(length**2 - 1) * (1 / length - 1 / rest) / 1e-3
    assert found.limit == "limit point"
    assert (1 - CLOSE) * exact < found.factor <= exact * (1 + 1e-9)


def test_the_path_of_von_mises_truss_passes_both_limits() -> None:
    truss = known.von_mises()
    path = load_path(truss.unloaded, truss.load, most=600.0, past_limit=True)
    assert path.limit == "limit point"
    assert path.place == 2
    upper, lower = (turn.factor for turn in path.turns)
    assert upper == pytest.approx(truss.exact["limit"], rel=1e-6)
    assert lower == pytest.approx(-truss.exact["limit"], rel=1e-6)
    height = [point.state[2, 1] for point in path.points]
    assert height[0] == 1.0
    assert height[-1] < -1.0
    assert height == sorted(height, reverse=True)
    assert [point.negative_modes for point in path.points if abs(point.state[2, 1]) > 0.6] == [
        0 for point in path.points if abs(point.state[2, 1]) > 0.6
    ]
    for point in path.points:  # each is an equilibrium under its own load
        out = point.equilibrium.problem.refreshed(point.state)
        gradient = np.zeros_like(point.state)
        out.stretch.evaluate(point.state, gradient)
        assert np.abs((gradient - out.load)[2]).max() < 1e-6 * 381


def test_a_dome_is_not_left_by_a_jump_to_its_inverted_shape() -> None:
    """Its first step could be so long that it lands on the far side of the snap, where the dome is stable again."""
    dome = known.star_dome()
    path = load_path(dome.unloaded, dome.load, most=1.0)
    assert path.limit == "limit point"
    assert path.factor == pytest.approx(dome.exact["limit"], rel=5e-3)
    assert path.place == 0


@pytest.mark.parametrize("thinner", [1, 1e2, 1e4])
def test_thin_rods_hide_no_loss_of_stability(thinner: float) -> None:
    """Their EA, times the square of a step, outweighs the modes that give way, and must not be taken for a change of
    stiffness along the path: steps would be so short that all factorisations are used up before the limit point."""
    frame = known.lees_frame(stretch=thinner * 6 * 720.0)
    path = load_path(frame.unloaded, frame.load, most=3.0)
    assert path.limit == "limit point"
    assert path.factor == pytest.approx(frame.exact["upper"], rel=5e-3)  # 40 edges a rod: 1e-3; and CLOSE
    assert path.factorizations <= 40  # 25 to 34; 120 where the path is lost


@pytest.mark.parametrize("thinner", [3e7, 1e8, 1e9])
@pytest.mark.parametrize("edge", [3.0, 12.0])
def test_nothing_is_said_where_round_off_hides_the_stiffness(thinner: float, edge: float) -> None:
    """The signs of modes are those of round-off there: the path would end at 0.001 to 0.05 times the load."""
    frame = known.lees_frame(edge, stretch=thinner * 6 * 720.0)
    path = load_path(frame.unloaded, frame.load, most=3.0)
    assert path.limit == "lost"
    assert path.factor == 0.0
    assert path.mode is None


def test_what_round_off_hides_does_not_depend_on_the_scale() -> None:
    """Twist angles are among the lowest mode's unknowns: what counts is their motion of an edge, not radians."""
    hidden = []
    for size in (1.0, 1e-4):
        rod = rs.Rod(
            rs.RectangularSection(width=2e-3 * size, height=1e-3 * size), rs.Material(youngs_modulus=1e6, density=1e3)
        )
        layout = rs.GridLayout.orthogonal(spacing=0.06 * size, edge=0.03 * size)
        form = rs.find_form(rs.Hemisphere(radius=0.2 * size), layout, rod, joint=rs.Pin())
        path = ArcLength(form.popped["pinned"].equilibrium, Load(forces=np.ones_like(form.popped["pinned"].state)))
        path.begin()
        hidden.append(path.round_off)
    assert hidden[0] < 1e-6
    assert hidden[1] == pytest.approx(hidden[0], rel=0.05)


def test_a_ring_leaves_its_circle_under_pressure() -> None:
    ring = known.ring_under_pressure(48)
    path = load_path(ring.unloaded, ring.load, most=3.0)
    assert path.limit == "bifurcation"
    assert path.factor == pytest.approx(1.0, rel=5e-3)  # 48 edges: 2.9e-3 above, and at most 2e-3 before it
    assert path.mode is not None
    angle = 2 * np.pi * np.arange(48) / 48
    outwards = np.einsum("ij,ij->i", path.mode[:48, :2], np.column_stack([np.cos(angle), np.sin(angle)]))
    waves = np.abs(np.fft.rfft(outwards))
    assert np.argmax(waves) == 2  # an ellipse; the first harmonic is its motion as a whole


def test_michells_ring_leaves_its_plane_by_a_bifurcation() -> None:
    """A fine ring, to a tenth of the usual distance: round-off hides the last digits of Newton's steps, which are not
    solved for again and again. Two modes, a right angle apart, vanish together."""
    ring = known.michells_ring(192)
    path = load_path(ring.unloaded, ring.load, most=3.0, close=2e-4)
    assert path.limit == "bifurcation"
    assert path.factor == pytest.approx(1.0, abs=1e-3)  # of second order in the edges: 8e-4
    assert path.factorizations <= 12  # 9; 68 if round-off is not told from steps


def test_the_mode_of_a_column_is_greenhills_and_its_tip_moves_most() -> None:
    problem, state, load = column()
    here = at_rest(problem, state, np.zeros(EDGES))
    path = load_path(here, load)
    assert path.place == EDGES + 1
    assert path.mode is not None
    shape = linear_buckling(here, load).shapes[0]
    sway, other = (np.linalg.norm(mode[:, :2], axis=1) for mode in (path.mode, shape))
    np.testing.assert_allclose(sway / sway.max(), other / other.max(), atol=1e-4)


def test_the_state_at_a_factor_that_is_asked_for() -> None:
    truss = known.von_mises()
    path = load_path(truss.unloaded, truss.load, most=600.0, stations=(100.0, 300.0, 500.0))
    for factor in (100.0, 300.0):
        found = path.at(factor)
        assert found is not None
        gradient = np.zeros_like(found.state)
        found.problem.stretch.evaluate(found.state, gradient)
        assert gradient[2, 1] == pytest.approx(-factor, rel=1e-9)
        assert gradient[:2, 1].sum() == pytest.approx(factor, rel=1e-9)
    assert path.at(500.0) is None
    assert path.last_stable is not None
    assert path.last_stable.factor == path.factor


def strut(warm: float | None = None, push: float | None = None) -> tuple[Equilibrium, Load, float]:
    """A column of length and EI 1, pinned and held at both ends; its load at factor 1, and the factor at which it
    buckles: of a rise in temperature, or of a motion of one end."""
    edges, axial = 40, 1e4
    euler = (2 * edges * np.sin(np.pi / (2 * edges))) ** 2  # of hinges with springs between rigid edges
    state = np.zeros((edges + 1, 3))
    state[:, 0] = np.linspace(0, 1, edges + 1)
    row = np.arange(edges + 1)
    bends = IsotropicBend(np.column_stack([row[:-2], row[1:-1], row[2:]]), np.full(edges - 1, float(edges)))
    pairs = np.column_stack([row[:-1], row[1:]])
    stretch = Stretch.elastic(pairs, np.full(edges, 1 / edges), np.full(edges, axial))
    free = Freedom.free(edges + 1).with_directions(row[1:-1], X, Y).with_directions(np.array([0, edges]))
    problem = Problem((bends,), stretch, Supports(free), 1.0)
    here = at_rest(problem, state, np.zeros(edges))
    if warm is not None:
        strain = euler / axial / (1 - euler / axial)  # EA (1 - 1/(1 + e)) = P
        return here, Load(strains=np.full(edges, warm)), strain / warm
    assert push is not None
    motions = np.zeros_like(state)
    motions[edges, 0] = -push
    # edges of the length l = (1 - u)/n bend by EI n / l^2: Euler's load grows as they shorten
    low = euler / axial
    for _ in range(20):
        low = euler / axial / (1 - low)
    return here, Load(motions=motions), low / push


@pytest.mark.parametrize("kind", [{"warm": 1e-4}, {"push": 1e-4}])
def test_a_strut_between_fixed_ends_buckles_by_heat_or_by_their_approach(kind: dict[str, float]) -> None:
    here, load, exact = strut(**kind)
    path = load_path(here, load)
    assert path.limit == "bifurcation"
    assert (1 - CLOSE) * exact < path.factor < exact * (1 + 1e-5)
    assert linear_buckling(here, load).factors[0] == pytest.approx(exact, rel=3e-3)  # it shortens by 1e-3 first
    state = path.points[-1].equilibrium
    strain = state.problem.stretch.strains(state.state)
    np.testing.assert_allclose(state.forces, 1e4 * strain, rtol=1e-9)
    np.testing.assert_allclose(state.forces, -(np.pi**2), rtol=5e-3)


class TensionOnly:
    """Cables: they pull with k times their elongation, and never push."""

    def __init__(self, blocks: np.ndarray, rest: np.ndarray, stiffness: np.ndarray) -> None:
        self.blocks, self._rest, self._stiffness = blocks, rest, stiffness

    def evaluate(self, state: np.ndarray, gradient: np.ndarray, hessians: np.ndarray = np.empty((0, 0, 0))) -> float:
        energy = 0.0
        for row, (a, b) in enumerate(self.blocks):
            apart = state[b] - state[a]
            length = np.linalg.norm(apart)
            t, longer = apart / length, max(length - self._rest[row], 0.0)
            pull = self._stiffness[row] * longer
            energy += 0.5 * pull * longer
            gradient[a] -= pull * t
            gradient[b] += pull * t
            if len(hessians):
                block = pull / length * (np.eye(3) - np.outer(t, t))
                if pull:
                    block += self._stiffness[row] * np.outer(t, t)
                hessians[row] = np.kron([[1.0, -1.0], [-1.0, 1.0]], block)
        return energy

    def refreshed(self, state: np.ndarray) -> "TensionOnly":
        return self


def mast(
    prestrain: tuple[float, float], stiffness: tuple[float, float, float], aside: tuple[float, float]
) -> tuple[Equilibrium, np.ndarray]:
    """Of length 1 between level cables along x and along y, and its load: 1 down and parts of it aside.

    prestrain : of the cables along x and of those along y.
    stiffness : of the cables behind and ahead along x, and of those along y.
    """
    state = np.array([[0.0, 0, 0], [0, 0, 1.0], [-1.0, 0, 1.0], [1.0, 0, 1.0], [0.0, -1.0, 1.0], [0.0, 1.0, 1.0]])
    behind, ahead, across = stiffness
    rest = 1.0 - np.repeat(prestrain, 2)
    pairs = np.column_stack([np.ones(4, dtype=np.intp), np.arange(2, 6)])
    cables = TensionOnly(pairs, rest, np.array([behind, ahead, across, across]))
    post = Stretch.elastic(np.array([[0, 1]]), np.ones(1), np.full(1, 1e4))
    free = Freedom.free(6).with_directions(np.array([0, 2, 3, 4, 5]))
    load = np.zeros_like(state)
    load[1] = (*aside, -1.0)
    return at_rest(Problem((cables,), post, Supports(free), 1.0), state, np.zeros(1)), load


@pytest.mark.parametrize(("aside", "across"), [(1e-3, 0.0), (5e-3, 0.0), (1e-3, 0.2)])
def test_a_mast_falls_when_its_first_cable_goes_slack(aside: float, across: float) -> None:
    """Along x k = 1, prestrained by e, and c = 1 by the tension along y: under P down and a P aside it stands at
    u = a P / (2 k + c - P). One cable is slack at u = e; then k + c cannot hold P. The stiffness jumps there from
    positive to negative, which no rate of change foresees. Pushed along y, too, the mast goes back that way as the load
    falls: the path has a cusp."""
    prestrain = 0.02
    path = load_path(*mast((prestrain, 0.1), (1.0, 1.0, 5.0), (aside, across)))
    slack = 3 * prestrain / (prestrain + aside)  # u = e, to first order
    assert slack > 2.0
    assert path.limit in ("limit point", "bifurcation")
    # cables along x are longer by y^2 / 2 = 0.003 where it stands aside along y
    assert path.factor == pytest.approx(slack, rel=5e-3 if across == 0 else 3e-2)
    assert path.place == 1
    assert path.factorizations < 60


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_mast_with_slack_cables_goes_where_its_start_does_not_foresee(side: float) -> None:
    """Without prestress along x the cable ahead, ten times as stiff, is slack from the start: x = a P / (k + c - P),
    and not a P / (11 k + c - P). Every step, however short, leads elsewhere than the stiffness at the start says."""
    aside, across, prestrain = 1e-3, 0.3e-3, 0.02
    here, load = mast((1e-12, prestrain), (1.0, 10.0, 1.0), (aside, side * across))
    found = load_path(here, load, stations=(0.25, 0.5), most=0.6)
    for factor in (0.25, 0.5):
        there = found.at(factor)
        assert there is not None
        assert there.state[1, 0] == pytest.approx(aside * factor / (1 + 2 * prestrain - factor), rel=2e-3)
        assert there.state[1, 1] == pytest.approx(side * across * factor / (2 - factor), rel=2e-3)


def test_the_work_of_the_load_is_the_energy_gained() -> None:
    """By the trapezoidal rule over the path."""
    frame = known.lees_frame(10.0)
    stations = np.linspace(0.02, 1.0, 50)
    path = load_path(frame.unloaded, frame.load, most=1.0, stations=stations)
    points = [path.at(float(factor)) for factor in stations]
    sunk = [0.0, *(frame.unloaded.state[frame.node, 1] - point.state[frame.node, 1] for point in points if point)]
    work = np.trapezoid([0.0, *stations], sunk)
    last = points[-1]
    assert last is not None
    assert frame.load.forces is not None
    elastic = last.energy + float(np.sum(frame.load.forces * last.state))
    assert elastic == pytest.approx(work, rel=1e-3)


def test_what_is_no_load_is_refused() -> None:
    truss = known.von_mises()
    with pytest.raises(InputError, match=r"forces have the shape \(2, 3\)"):
        load_path(truss.unloaded, np.zeros((2, 3)))
    with pytest.raises(InputError, match="moves nothing"):
        load_path(truss.unloaded, np.zeros((3, 3)))
    free = np.zeros((3, 3))
    free[2, 1] = 1.0
    with pytest.raises(InputError, match="what is free"):
        load_path(truss.unloaded, Load(motions=free))
