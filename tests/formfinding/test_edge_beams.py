"""Beams along the edge: rings and arches against closed forms, shells against other code, what is refused."""

from functools import cache

import numpy as np
import pytest
from scipy.linalg import eigh, eigvals

import rodshell as rs
from rodshell.checks.reactions import reactions
from rodshell.errors import InputError
from rodshell.geometry.chains import along_curve
from rodshell.model.edge_beam import FittedBeam
from rodshell.results.judged.supports import in_the_air
from rodshell.rods.supports import BeamAlong
from rodshell.solve.modes import frequencies
from tests.checks.loaded_twin import LathBends, _coordinates
from tests.formfinding.test_support_groups import SprungTwin
from tests.loads.shells import TUBE, grid, shell

STEEL = rs.Material.preset("steel")
BEAM = rs.Rod(rs.Tube(0.04, 0.004), STEEL)
R = 3.0
OPEN = "y > 6 m"
COLUMN = rs.HeldEnds(at="x > -1 m and x < 1 m and y > 6 m")


def groups(*each: object) -> rs.SupportGroups:
    return rs.SupportGroups(groups=tuple(each))


def bare(points: np.ndarray, *, closed: bool, rod: rs.Rod = BEAM) -> FittedBeam:
    """A beam through points (n, 3), with these as its nodes and nothing else."""
    n = len(points)
    along = BeamAlong("E1", "ring", np.arange(n), np.arange(0), rod, closed)
    up = np.tile([0.0, 0.0, 1.0], (n, 1))
    return FittedBeam.fitted(along, nodes=np.arange(n), state=points, normals=up, first=n)


def arc(n: int, half_angle: float) -> np.ndarray:
    t = np.linspace(-half_angle, half_angle, n)
    return R * np.column_stack([np.sin(t), np.cos(t), 0.0 * t])


def ring(n: int) -> np.ndarray:
    t = 2 * np.pi * np.arange(n) / n
    return R * np.column_stack([np.cos(t), np.sin(t), 0.0 * t])


def stiffness(beam: FittedBeam, points: np.ndarray, axial: float = 0.0) -> np.ndarray:
    """Of nodes (3 each) and twist angles (one each), free of stress but for an axial force [N]."""
    size = len(points) + len(beam.angles)
    state = np.vstack([points, np.zeros((len(beam.angles), 3))])
    result = np.zeros((3 * size, 3 * size))
    for energy in beam.elements:
        count, k = energy.blocks.shape
        hessians = np.zeros((count, 3 * k, 3 * k))
        energy.evaluate(state, np.zeros_like(state), hessians)
        if energy is beam.stretch and axial:
            more = np.zeros_like(hessians)
            beam.stretch.axial_stiffness(state, np.full(count, axial), more)
            hessians += more
        for blocks, local in zip(energy.blocks, hessians, strict=True):
            rows = (3 * blocks[:, None] + np.arange(3)).ravel()
            result[np.ix_(rows, rows)] += local
    angles = 3 * (len(points) + np.arange(len(beam.angles)))
    kept = np.append(np.arange(3 * len(points)), angles)
    return result[np.ix_(kept, kept)]


def deflections(points: np.ndarray, forces: np.ndarray, held: list[int]) -> np.ndarray:
    beam = bare(points, closed=True)
    matrix = stiffness(beam, points)
    load = np.append(forces.ravel(), np.zeros(len(beam.angles)))
    free = np.setdiff1d(np.arange(len(load)), held)
    found = np.zeros(len(load))
    found[free] = np.linalg.lstsq(matrix[np.ix_(free, free)], load[free], rcond=1e-12)[0]
    return found[: points.size].reshape(-1, 3)


def test_a_ring_that_is_pulled_apart_at_two_points_gives_way_as_its_closed_form() -> None:
    """P R^3 / EI (pi/4 - 2/pi) in all, and P R / EA pi/4 of the axial force [Timoshenko, Strength of Materials]."""
    n, pull = 96, 1000.0
    forces = np.zeros((n, 3))
    forces[0, 0], forces[n // 2, 0] = pull, -pull
    out = [3 * k + 2 for k in range(n)]
    moved = deflections(ring(n), forces, [*out, 1, 3 * (n // 2) + 1, 3 * (n // 4)])
    ei, ea = BEAM.bend_stiffness, BEAM.stretch_stiffness
    expected = pull * R**3 / ei * (np.pi / 4 - 2 / np.pi) + pull * R / ea * np.pi / 4
    assert moved[0, 0] - moved[n // 2, 0] == pytest.approx(expected, rel=5e-3)


def test_a_ring_on_two_supports_bends_and_twists_out_of_its_plane() -> None:
    """Two loads P between two supports, a quarter apart: by Castigliano P R^3/2 ((pi/2 - 1)/EI + (pi - 3)/GJ)."""
    n, load = 96, 100.0
    forces = np.zeros((n, 3))
    forces[[0, n // 2], 2] = -load
    held = [3 * (n // 4) + 2, 3 * (3 * n // 4) + 2, 0, 1, 3 * (n // 2) + 1]
    moved = deflections(ring(n), forces, held)
    expected = load * R**3 / 2 * ((np.pi / 2 - 1) / BEAM.bend_stiffness + (np.pi - 3) / BEAM.twist_stiffness)
    assert -moved[0, 2] == pytest.approx(expected, rel=5e-3)
    assert moved[n // 2, 2] == pytest.approx(moved[0, 2], rel=1e-6)


def test_a_ring_under_loads_all_round_is_pressed_together() -> None:
    n, pressure = 96, 2000.0
    points = ring(n)
    forces = -pressure * 2 * np.pi / n * points
    moved = deflections(points, forces, [2, 3 * (n // 3) + 2, 3 * (2 * n // 3) + 2, 1, 3 * (n // 2) + 1, 3 * (n // 4)])
    inwards = -np.sum(moved * points, axis=1).mean() / R
    assert inwards == pytest.approx(pressure * R**2 / BEAM.stretch_stiffness, rel=5e-3)


def critical_pressure(points: np.ndarray, closed: bool) -> float:
    """The least pressure at right angles to the beam [N/m] at which its stiffness in its plane is singular."""
    n = len(points)
    beam = bare(points, closed=closed)
    following = np.zeros((3 * n, 3 * n))  # dF/dx of F_i = q/2 J (x_before - x_after), which is linear
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    side = np.sign(np.cross(points[1] - points[0], points[0])[2]) * -1.0
    for i in range(n) if closed else range(1, n - 1):
        for j, sign in (((i + 1) % n, 1.0), ((i - 1) % n, -1.0)):
            following[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += 0.5 * side * sign * turn
    plain = stiffness(beam, points)[: 3 * n, : 3 * n]
    geometric = (stiffness(beam, points, axial=-R) - stiffness(beam, points))[: 3 * n, : 3 * n]
    plane = [3 * k + axis for k in range(n) for axis in (0, 1)]
    held = [0, 1, 3 * (n // 2) + 1] if closed else [0, 1, 3 * n - 3, 3 * n - 2]  # of a ring its rigid motions
    free = [k for k in plane if k not in held]
    change = (geometric - following)[np.ix_(free, free)]
    values = eigvals(plain[np.ix_(free, free)], -change)
    real = values.real[(np.abs(values.imag) < 1e-6 * np.abs(values.real)) & (values.real > 1.0)]
    return float(real.min())


def test_a_ring_under_pressure_buckles_as_levy_found() -> None:
    assert critical_pressure(ring(96), closed=True) == pytest.approx(3 * BEAM.bend_stiffness / R**3, rel=5e-3)


@pytest.mark.parametrize("half_angle", [np.pi / 4, np.pi / 3, np.pi / 2])
def test_an_arch_on_two_hinges_buckles_sideways_under_pressure(half_angle: float) -> None:
    """(pi^2/alpha^2 - 1) EI/R^3 [Timoshenko and Gere, Theory of Elastic Stability]."""
    found = critical_pressure(arc(61, half_angle), closed=False)
    expected = (np.pi**2 / half_angle**2 - 1) * BEAM.bend_stiffness / R**3
    assert found == pytest.approx(expected, rel=5e-3)


def test_a_straight_beam_bends_as_a_beam_on_two_supports() -> None:
    n, load, length = 41, 100.0, 4.0
    points = np.column_stack([np.linspace(0, length, n), np.zeros(n), np.zeros(n)])
    beam = bare(points, closed=False, rod=rs.Rod(rs.RectangularSection(width=0.04, height=0.10), STEEL))
    assert len(beam.loose) == 1  # which keeps it from turning about itself
    for axis, stiff in ((2, beam.rod.bend_stiffnesses[0]), (1, beam.rod.bend_stiffnesses[1])):
        matrix = stiffness(beam, points)
        force = np.zeros(len(matrix))
        force[3 * (n // 2) + axis] = load
        ends = [0, 1, 2, 3 * n - 2, 3 * n - 1]
        free = np.setdiff1d(np.arange(len(matrix)), [*ends, 3 * n + n // 2])
        moved = np.linalg.solve(matrix[np.ix_(free, free)], force[free])
        there = moved[free.tolist().index(3 * (n // 2) + axis)]
        assert there == pytest.approx(load * length**3 / (48 * stiff), rel=2e-3)


def test_points_are_put_in_their_order_however_they_are_numbered() -> None:
    rng = np.random.default_rng(7)
    t = np.sort(rng.uniform(0.0, 5.5, 60))
    points = np.column_stack([3 * np.cos(t), 2 * np.sin(t), 0.3 * np.sin(2 * t)])
    mixed = rng.permutation(60)
    order = along_curve(points[mixed])
    assert order is not None
    found = mixed[order]
    assert np.array_equal(found, np.arange(60)) or np.array_equal(found, np.arange(60)[::-1])
    assert along_curve(np.array([[0.0, 0, 0], [1, 0, 0], [-1, 0.1, 0], [0, 1, 0]])) is None  # a fork


class BeamBends(LathBends):
    """Of a beam that is at rest where it is."""

    def __init__(self, x, bends, pairs, voronoi, rod):
        super().__init__(x, bends, pairs, voronoi, rod, [0.0] * len(bends))
        self.rest = np.zeros(3)
        values = np.hstack([x[bends].reshape(-1, 9), np.zeros((len(bends), 2))]).astype(complex)
        self.rest = [part.real for part in self.strains(values)]

    def energies(self, values):
        strains = (now - rest for now, rest in zip(self.strains(values), self.rest, strict=True))
        return sum(k * s**2 for k, s in zip((self.one, self.two, self.twist), strains, strict=True)) / (
            2 * self.voronoi
        )


class BeamTwin(SprungTwin):
    """With a beam along rod ends that are free on it; others are on stiff springs or held."""

    def __init__(self, pinned, rod, beam, row, hinged):
        free = [end for end in row if end not in hinged]
        super().__init__(pinned, rod, 0.0, free)  # on springs without stiffness
        nodes = self.ends[row]
        points = self.x[nodes]
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        count, first = len(nodes) - 1, len(self.state)
        pairs = np.array([(k, k + 1) for k in range(count - 1)])
        bends = np.column_stack([nodes[:-2], nodes[1:-1], nodes[2:]])
        own = BeamBends(self.x, bends, pairs, 0.5 * (lengths[1:] + lengths[:-1]), beam)
        self.terms.append((own.energies, np.hstack([_coordinates(bends), first + pairs]), 1))

        def stretch(x):
            apart = x[:, 1] - x[:, 0]
            now = np.sqrt((apart * apart).sum(axis=1))
            return 0.5 * beam.stretch_stiffness * lengths * (now / lengths - 1) ** 2

        self.terms.append((stretch, _coordinates(np.column_stack([nodes[:-1], nodes[1:]])), 3))
        for side in (nodes[:-1], nodes[1:]):
            np.add.at(self.load, 3 * side + 2, -0.5 * lengths * beam.mass_per_length * 9.81)
        self.state, self.load = (np.append(each, np.zeros(count)) for each in (self.state, self.load))
        self.angles = np.arange(first, first + count)
        self.free = np.append(self.free, self.angles)


@cache
def on(*each: object) -> rs.Form:
    return rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends=groups(*each))


@cache
def twin_of_arch() -> BeamTwin:
    form = on(rs.Arch(at=OPEN, rod=BEAM))
    (beam,) = form.popped["given"].shell.beams
    row = beam.along.ends.tolist()
    twin = BeamTwin(shell("tubes").popped["pinned"], TUBE, BEAM, row, [row[0], row[-1]])
    settled = twin.settled(twin.state, 0.0, most=20)
    assert settled is not None
    assert settled[1] == 0
    twin.state = settled[0]
    return twin


def test_a_shell_on_an_arch_is_that_of_other_code_and_carries_as_much() -> None:
    form, twin = on(rs.Arch(at=OPEN, rod=BEAM)), twin_of_arch()
    found = form.popped["given"].positions
    assert found == pytest.approx(twin.state[: found.size].reshape(-1, 3), abs=1e-6 * form.target.size)
    factor, _ = twin.load_factor(2e-3)
    own = form.checks.self_weight["given"].load_factor
    assert own == pytest.approx(factor, rel=0.02)
    assert own < 0.9 * shell("tubes").checks.self_weight["pinned"].load_factor


def first_frequencies() -> tuple[float, float]:
    """Of a shell on an arch [Hz], and by other code."""
    form, twin = on(rs.Arch(at=OPEN, rod=BEAM)), twin_of_arch()
    popped = form.popped["given"]
    n = form.footprint.mesh.node_count
    mass = np.maximum(-twin.load[2 : 3 * n : 3] / 9.81, 1e-12)
    lumped = np.zeros_like(popped.equilibrium.state)
    lumped[:n] = mass[:, None]
    assert popped.shell.mass[:n, 2] == pytest.approx(mass, rel=1e-6)
    stiff = twin.hessian(twin.state)[twin.free][:, twin.free].toarray()
    inertia = np.append(np.repeat(mass, 3), np.full(len(twin.state) - 3 * n, 1e-9))
    square = eigh(stiff, np.diag(inertia[twin.free]), eigvals_only=True, subset_by_index=[0, 0])[0]
    found = frequencies(popped.equilibrium, lumped, 1).frequencies[0]
    return float(found), float(np.sqrt(square) / (2 * np.pi))


def test_the_first_frequency_of_a_shell_on_an_arch_is_that_of_other_code() -> None:
    found, expected = first_frequencies()
    assert found == pytest.approx(expected, rel=0.01)


def test_supports_carry_shell_and_beam() -> None:
    form = on(rs.Arch(at=OPEN, rod=BEAM))
    popped = form.popped["given"]
    forces = reactions(popped.shell, popped.equilibrium).forces
    (beam,) = popped.shell.beams
    assert np.abs(forces[beam.along.ends[1:-1]]).max() < 1e-6 * np.abs(forces).max()  # only its hinges hold it
    assert np.abs(forces.sum(axis=0)).max() < 1e-6 * np.abs(forces).max()
    length = np.linalg.norm(np.diff(form.boundary.points[beam.along.ends], axis=0), axis=1).sum()
    alone = shell("tubes").popped["pinned"].shell.mass[:, 2].sum()
    assert popped.shell.mass[: popped.shell.node_count, 2].sum() == pytest.approx(
        alone + length * BEAM.mass_per_length, rel=1e-6
    )


def test_a_very_stiff_arch_is_as_good_as_rigid_supports() -> None:
    """Which swings about the line of its hinges, until a column holds it."""
    rigid = rs.Arch(at=OPEN, rod=rs.Rod(rs.Tube(0.5, 0.1), rs.Material(210e9, 1.0)))
    stiff, swinging = on(rigid, COLUMN), on(rigid)
    assert swinging.checks.self_weight["given"].load_factor < 0.99 * stiff.checks.self_weight["given"].load_factor
    assert stiff.checks.self_weight["given"].load_factor == pytest.approx(
        shell("tubes").checks.self_weight["pinned"].load_factor, rel=2e-3
    )


def test_a_ring_takes_the_thrust_that_posts_cannot() -> None:
    """Posts that hold the shell up, and hardly aside: alone they let it spread; a ring ties it together."""
    posts = rs.SprungEnds(stiffness=(2e3, 2e3, 1e8))
    alone, tied = on(posts), on(posts, rs.Ring(rod=BEAM))
    (beam,) = tied.popped["given"].shell.beams
    assert len(beam.stretch.blocks) == len(beam.along.ends) == 2 * len(tied.footprint.rods)
    assert beam.forces(tied.popped["given"].state).min() > 0  # all of it in tension
    assert tied.checks.self_weight["given"].load_factor > 1.1 * alone.checks.self_weight["given"].load_factor


def test_rod_ends_on_a_beam_are_held_as_another_group_says_wherever_that_stands() -> None:
    arch = rs.Arch(at=OPEN, rod=BEAM)
    first, last = on(COLUMN, arch), on(arch, COLUMN)
    assert np.array_equal(first.popped["given"].positions, last.popped["given"].positions)
    bare_arch = on(rs.Arch(at=OPEN, rod=BEAM))
    more, less = (form.checks.self_weight["given"].load_factor for form in (first, bare_arch))
    assert more > 1.05 * less


def layered() -> rs.Form:
    ends = groups(rs.Ring(rod=BEAM), rs.SprungEnds(stiffness=1e6))
    return rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends=ends, joint=rs.Pin(eccentricity=0.05))


def patched() -> rs.Form:
    ring = {"kind": "ring", "section": "tube 60x3", "material": {"preset": "steel"}}
    supports = [{"kind": "sprung", "stiffness": "1000 kN/m"}, ring]
    target = {"kind": "paraboloid", "radius": 4.0, "height": 1.5}
    return rs.Job.load({"target": target, "seams.lines": "-5,0.1; 5,0.1", "supports": supports}).run()


def test_twist_angles_of_a_beam_have_the_rotary_inertia_of_their_edges() -> None:
    beam = bare(ring(24), closed=True)
    mass = np.zeros((24 + 24, 3))
    beam.add_mass(mass)
    around = 7850 * np.pi / 2 * (0.04**4 - 0.036**4) * 2 * R * np.sin(np.pi / 24)
    assert mass[24:, 0] == pytest.approx(np.full(24, around))
    assert mass[:24, 2].sum() == pytest.approx(24 * 2 * R * np.sin(np.pi / 24) * BEAM.mass_per_length)


def test_of_rod_ends_in_the_air_those_on_a_beam_ask_for_nothing() -> None:
    """A saddle in a ring that stands on its lowest ends; the pinned shell is for comparison alone."""
    saddle = rs.HeightField(formula="(x^2 - y^2)/16", domain=rs.Disc(5.0))
    stands = groups(rs.Ring(rod=rs.Rod(rs.Tube(0.1, 0.006), STEEL)), rs.HeldEnds(at="z < -1.4 m"))
    rod, layout = rs.Rod(rs.Circle(0.006), rs.Material.preset("gfrp")), rs.GridLayout.orthogonal(spacing=1.0, edge=0.34)
    form = rs.find_form(saddle, layout, rod, ends=("pinned", stands))
    found = in_the_air(form.archive().results)
    assert found is not None
    assert found.highest < 0.17 < 3.0 < np.ptp(form.boundary.points[:, 2])


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: rs.EdgeBeam(rod="steel"), "edge beam"),
        (lambda: rs.EdgeBeam(rod=BEAM, creep=-0.1), "creep of an edge beam"),
        (lambda: on(rs.EdgeBeam(at="U01.0, U02.0", rod=BEAM)), "three rod ends or more"),
        (lambda: on(rs.EdgeBeam(rod=BEAM)), "let the shell move as a whole"),
        (lambda: layered(), "joins rods in one layer"),
        (lambda: patched(), "not on given: leave out the seams"),
    ],
)
def test_what_cannot_be_is_refused(build, words: str) -> None:
    with pytest.raises(InputError, match=words):
        build()
