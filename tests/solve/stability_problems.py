"""Structures whose loss of stability is known: closed forms and published benchmarks.

Each function builds one and returns its unloaded equilibrium, its load at factor 1, and the exact figures. The tests in
`test_load_path.py` and `test_modes.py` and the table of `tests/acceptance/loads.py` read them.
"""

from dataclasses import dataclass, field
from math import cos, pi, radians, sin, sqrt

import numpy as np

import rodshell as rs
from rodshell.model import Freedom
from rodshell.rods.elements import NO_HESSIANS, Stretch
from rodshell.solve.equilibrium import Equilibrium, find_equilibrium
from rodshell.solve.load import Load
from rodshell.solve.problem import Problem, Supports

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Loaded:
    """A structure at rest and what is to be put on it.

    Parameters
    ----------
    load : at factor 1.
    exact : figures by name.
    node : block whose displacement is looked at, if any.
    """

    unloaded: Equilibrium
    load: Load
    exact: dict[str, float] = field(default_factory=dict)
    node: int = 0


def at_rest(problem: Problem, state: np.ndarray, forces: np.ndarray | None = None) -> Equilibrium:
    found = find_equilibrium(problem, state, np.zeros(len(problem.stretch.blocks)) if forces is None else forces)
    assert found.report.stable
    return found


def dead(state: np.ndarray, forces: dict[int, tuple[float, float, float]]) -> Load:
    load = np.zeros_like(state)
    for block, force in forces.items():
        load[block] = force
    return Load(forces=load)


def truss(nodes: np.ndarray, bars: np.ndarray, stiffness: float, free: Freedom) -> tuple[Problem, np.ndarray]:
    """Of bars free of stress, engineering strain."""
    rest = np.linalg.norm(nodes[bars[:, 1]] - nodes[bars[:, 0]], axis=1)
    stretch = Stretch.elastic(bars, rest, np.full(len(bars), stiffness))
    return Problem((), stretch, Supports(free), float(np.ptp(nodes, axis=0).max()) / 2), nodes


def of_rod(rod: rs.ElasticRod, free: Freedom, length: float) -> tuple[Problem, np.ndarray]:
    return Problem(rod.elements, rod.stretch, Supports(free), length), rod.state()


def in_plane(rod: rs.ElasticRod) -> Freedom:
    """The rod's freedom less all motion along z and all twist."""
    free = rod.freedom()
    moving = np.setdiff1d(np.arange(rod.node_count), rod.clamped_nodes)
    return free.with_directions(moving, X, Y).with_directions(np.arange(rod.block_count)[rod.angles])


# Trusses


def von_mises() -> Loaded:
    """Two bars, half span 10, rise 1, EA 1e6: P = 2 EA y (1/l - 1/l0), whose limits are +-381.087 at l^3 = a^2 l0."""
    nodes = np.array([[-10.0, 0, 0], [10.0, 0, 0], [0.0, 1.0, 0]])
    free = Freedom.free(3).with_directions(np.array([0, 1])).with_directions(np.array([2]), X, Y)
    problem, state = truss(nodes, np.array([[0, 2], [1, 2]]), 1e6, free)
    rest = sqrt(101.0)
    length = (100.0 * rest) ** (1 / 3)
    limit = 2e6 * sqrt(length**2 - 100.0) * (1 / length - 1 / rest)
    return Loaded(at_rest(problem, state), dead(state, {2: (0.0, -1.0, 0.0)}), {"limit": limit}, 2)


def star_dome() -> Loaded:
    """24 members, apex load; rings of the radii 25 and 50 at 6.216 and 0, apex at 8.216; load and answer in EA."""
    inner = [(25 * cos(k * pi / 3), 25 * sin(k * pi / 3), 6.216) for k in range(6)]
    outer = [(50 * cos(k * pi / 3 + pi / 6), 50 * sin(k * pi / 3 + pi / 6), 0.0) for k in range(6)]
    nodes = np.array([(0.0, 0.0, 8.216), *inner, *outer])
    bars = [(0, 1 + k) for k in range(6)] + [(1 + k, 1 + (k + 1) % 6) for k in range(6)]
    bars += [(1 + k, 7 + k) for k in range(6)] + [(1 + k, 7 + (k - 1) % 6) for k in range(6)]
    free = Freedom.free(13).with_directions(np.arange(7, 13))
    problem, state = truss(nodes, np.array(bars), 1.0, free)
    return Loaded(at_rest(problem, state), dead(state, {0: (0.0, 0.0, -1.0)}), {"limit": 3.157e-4})


# Frames


def lees_frame(edge: float = 3.0, stretch: float = 6 * 720.0) -> Loaded:
    """Two rods of 120 at right angles, hinged at the far ends; a load at 24 from the corner [Lee et al. 1968].

    stretch : EA; thinner rods of the same EI hardly change the limits, since the frame gives way by bending.
    """
    grid = rs.straight_rods([[[0, 0], [0, 120]], [[0, 120], [120, 120]]])
    kind = rs.Rod(rs.GivenSection(EA=stretch, EI1=2 * 720.0, EI2=2 * 720.0, GJ=720.0))
    shell = rs.Shell.of(rs.mesh_grid(grid, edge), kind, joint=rs.Rigid())
    free = shell.freedom().with_directions(np.arange(shell.node_count), X, Y)
    free = free.with_directions(np.arange(shell.first_angle, len(shell.like)))
    free = free.with_directions(shell.ends[[0, 3]])
    state = shell.state(shell.mesh.flat)
    problem = Problem(shell.elements, shell.stretch, Supports(free), 120.0)
    node = int(np.argmin(np.linalg.norm(shell.mesh.flat[:, :2] - [24.0, 120.0], axis=1)))
    exact = {"upper": 1.856, "lower": -0.942}
    return Loaded(at_rest(problem, state), dead(state, {node: (0.0, -1.0, 0.0)}), exact, node)


def williams_toggle(edges: int = 40) -> Loaded:
    """Two rods from clamps to a rigid apex, half span 12.943, rise 0.386, EI 9270, EA 1.885e6 [Williams 1964]."""
    half, rise, direction = 12.943, 0.386, np.array([12.943, 0.386, 0.0]) / sqrt(12.943**2 + 0.386**2)
    across = np.linspace(-half, half, 2 * edges + 1)
    nodes = np.column_stack([across, rise * (1 - np.abs(across) / half), 0 * across])
    kind = rs.Rod(rs.GivenSection(EA=1.885e6, EI1=9270.0, EI2=9270.0, GJ=9270.0))
    clamps = {"start": direction, "end": direction * (1, -1, 1)}
    rod = rs.ElasticRod.of(nodes, kind, natural="rest", clamped=clamps)
    problem, state = of_rod(rod, in_plane(rod), half)
    return Loaded(
        at_rest(problem, state), dead(state, {edges: (0.0, -1.0, 0.0)}), {"upper": 33.86, "lower": 31.26}, edges
    )


def bend_of_45_degrees(edges: int = 32) -> Loaded:
    """A cantilever bent to an eighth of a circle of radius 100, 1 x 1, E 1e7, nu 0, load 600 across its plane
    [Bathe and Bolourchi 1979; Simo and Vu-Quoc 1986]."""
    angle = np.linspace(0, radians(45), edges + 1)
    nodes = 100 * np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle])
    stiffness = 1e7 / 12
    kind = rs.Rod(rs.GivenSection(EA=1e7, EI1=stiffness, EI2=stiffness, GJ=stiffness))
    rod = rs.ElasticRod.of(nodes, kind, natural="rest", clamped={"start": X})
    problem, state = of_rod(rod, rod.freedom(), 50.0)
    # along the rod at its root, towards the centre, and along the load
    exact = {"x": -23.48, "y": -13.50, "z": 53.37}
    return Loaded(at_rest(problem, state), dead(state, {edges: (0.0, 0.0, 600.0)}), exact, edges)


# Columns, strips, rings and arches


def eulers_column(edges: int = 40) -> Loaded:
    """Pinned, of length and EI 1; factor 1 is Euler's load, pi^2."""
    nodes = np.zeros((edges + 1, 3))
    nodes[:, 0] = np.linspace(0, 1, edges + 1)
    kind = rs.Rod(rs.GivenSection(EA=1e6, EI1=1.0, EI2=1.0, GJ=1.0))
    rod = rs.ElasticRod.of(nodes, kind, twist=False)
    free = rod.freedom().with_directions(np.array([0])).with_directions(np.array([edges]), X)
    problem, state = of_rod(rod, free, 1.0)
    return Loaded(at_rest(problem, state), dead(state, {edges: (-(pi**2), 0.0, 0.0)}), {"factor": 1.0}, edges // 2)


def prandtls_cantilever(edges: int = 80) -> Loaded:
    """A strip of length 1 with a tip load on its axis, EI1 = 1e4 EI2; factor 1 is 4.0126 sqrt(EI2 GJ)
    [Prandtl 1899; Timoshenko and Gere 1961, section 6.3]."""
    gj = 0.6
    nodes = np.zeros((edges + 1, 3))
    nodes[:, 0] = np.linspace(0, 1, edges + 1)
    kind = rs.Rod(rs.GivenSection(EA=1e7, EI1=1e4, EI2=1.0, GJ=gj))
    rod = rs.ElasticRod.of(nodes, kind, director=Z, clamped={"start": X})
    problem, state = of_rod(rod, rod.freedom(), 1.0)
    return Loaded(at_rest(problem, state), dead(state, {edges: (0.0, 0.0, -4.0126 * sqrt(gj))}), {"factor": 1.0}, edges)


def michells_ring(edges: int = 96) -> Loaded:
    """A straight rod bent to a ring, its ends clamped to each other; factor 1 turns one end by 2 pi sqrt(3) EI/GJ, at
    which the ring leaves its plane [Michell 1889; Goriely 2006].

    The first edge and the last are the same one, which is held: each free node then lies between two equal edges, and
    the twist has no force across the plane. Clamps at a node would have one, of first order in the edge, which makes of
    the bifurcation a limit point next to it.
    """
    gj = 0.7
    angle = 2 * pi * (np.arange(edges + 2) - 0.5) / edges
    nodes = np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle]) / (2 * edges * np.sin(pi / edges))
    kind = rs.Rod(rs.GivenSection(EA=1e6, EI1=1.0, EI2=1.0, GJ=gj))
    rod = rs.ElasticRod.of(nodes, kind, twist=True)
    angles = np.arange(rod.block_count)[rod.angles]
    free = rod.freedom().with_directions(np.array([0, 1, edges, edges + 1])).with_directions(angles[[0, -1]])
    free = free.with_directions(np.array([edges // 2]), X, Y)  # it would turn freely about the line of its clamps
    problem, state = of_rod(rod, free, 0.16)
    turn = np.zeros_like(state)
    turn[angles[-1], 0] = 2 * pi * sqrt(3) / gj
    return Loaded(at_rest(problem, state), Load(motions=turn), {"factor": 1.0})


@dataclass(frozen=True, eq=False)
class Pressure:
    """Pressure 1 from outside on a closed plane polygon, across its edges: its potential is the area that it encloses.

    Of an open polygon it would have none, unless its ends are held.
    """

    blocks: np.ndarray

    def evaluate(self, state: np.ndarray, gradient: np.ndarray, hessians: np.ndarray = NO_HESSIANS) -> float:
        a, b = (state[self.blocks[:, side], :2] for side in (0, 1))
        np.add.at(gradient, self.blocks[:, 0], 0.5 * np.column_stack([b[:, 1], -b[:, 0], 0 * a[:, 0]]))
        np.add.at(gradient, self.blocks[:, 1], 0.5 * np.column_stack([-a[:, 1], a[:, 0], 0 * a[:, 0]]))
        if len(hessians):
            hessians[:] = 0.0
            hessians[:, 0, 4] = hessians[:, 4, 0] = 0.5
            hessians[:, 1, 3] = hessians[:, 3, 1] = -0.5
        return 0.5 * float(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]))

    def refreshed(self, state: np.ndarray) -> "Pressure":
        return self


def ring_under_pressure(edges: int = 96) -> Loaded:
    """Of radius and EI 1, in its plane, free of stress; factor 1 is 3 EI/R^3, of a pressure that stays normal [Levy
    1884; Timoshenko and Gere 1961, section 7.3]."""
    angle = 2 * pi * np.arange(edges) / edges
    nodes = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) * (2 * pi / edges) / (2 * np.sin(pi / edges))
    kind = rs.Rod(rs.GivenSection(EA=1e5, EI1=1.0, EI2=1.0, GJ=1.0))
    rod = rs.ElasticRod.of(nodes, kind, closed=True, natural="rest")
    free = in_plane(rod).with_directions(np.array([0])).with_directions(np.array([edges // 2]), X)
    problem, state = of_rod(rod, free, 1.0)

    class Three(Pressure):
        def evaluate(self, state, gradient, hessians=NO_HESSIANS):  # type: ignore[no-untyped-def]
            alone = np.zeros_like(gradient)
            area = super().evaluate(state, alone, hessians)
            gradient += 3.0 * alone
            hessians *= 3.0
            return 3.0 * area

    return Loaded(at_rest(problem, state), Load(potentials=(Three(rod.stretch.blocks),)), {"factor": 1.0}, edges // 4)


def shallow_arch(rise: float, edges: int = 96) -> Loaded:
    """A half sine of length 1 and of `rise` radii of gyration, under a half sine of load q sin(pi x), pinned.

    With H the thrust, k = pi and the shape a sin(k x): q = EI k^4 (a0 - a) + H k^2 a, H = EA k^2 (a0^2 - a^2) / 4. It
    snaps through at a limit point, or leaves the path sideways where H = 4 EI k^2 [Timoshenko and Gere 1961, 7.8].
    """
    k, a0 = pi, 0.005
    radius = a0 / rise
    ei, ea = 1.0, 1.0 / radius**2
    across = np.linspace(0, 1, edges + 1)
    nodes = np.column_stack([across, a0 * np.sin(k * across), 0 * across])
    rod = rs.ElasticRod.of(nodes, rs.Rod(rs.GivenSection(EA=ea, EI1=ei, EI2=ei, GJ=ei)), natural="rest")
    free = in_plane(rod).with_directions(np.array([0, edges]))
    problem, state = of_rod(rod, free, 0.5)

    def load(a: float) -> float:
        return ei * k**4 * (a0 - a) + ea * k**4 * (a0**2 - a**2) / 4 * a

    sideways = a0**2 - 16 * radius**2
    top = (a0**2 - 4 * radius**2) / 3
    first = load(sqrt(sideways)) if sideways > top else load(sqrt(top))
    linear = 8 * ei / (ea * a0) * k**4 * (ei + ea * a0**2 / 2)  # H = 4 EI k^2 with H proportional to q
    pull = np.zeros_like(state)
    pull[: edges + 1, 1] = -first * np.sin(k * across) / edges
    exact = {"factor": 1.0, "linear": linear / first, "sideways": float(sideways > top)}
    return Loaded(at_rest(problem, state), Load(forces=pull), exact, edges // 2)


def tube(edges: int) -> tuple[Equilibrium, np.ndarray, np.ndarray, np.ndarray]:
    """A pinned GFRP tube of 5 m, 41.7 x 3.5: its equilibrium, lumped mass, mass along its edges, first frequencies."""
    kind = rs.Rod(rs.Tube(radius=0.0417 / 2, thickness=0.0035), rs.Material(25e9, 1750))
    nodes = np.zeros((edges + 1, 3))
    nodes[:, 0] = np.linspace(0, 5, edges + 1)
    rod = rs.ElasticRod.of(nodes, kind, twist=False)
    free = rod.freedom().with_directions(np.array([0])).with_directions(np.array([edges]), X)
    free = free.with_directions(np.arange(1, edges), X, Z)  # in a plane: of its pairs of modes, one each
    problem, state = of_rod(rod, free, 5.0)
    number = np.arange(1, 6)
    exact = number**2 * (pi / 2 / 25) * sqrt(kind.bend_stiffness / kind.mass_per_length)
    return at_rest(problem, state), rod.mass, rod.stretch.rest_lengths * kind.mass_per_length, exact
