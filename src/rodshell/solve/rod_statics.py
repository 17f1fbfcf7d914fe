"""Equilibrium of one rod: its supports and loads, and the steps by which they go from a start to the goal.

Natural strains are let go bit by bit along the way: of a state to start from, stress comes with the rod's own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats, Ints
from rodshell.errors import ConvergenceError, InputError
from rodshell.geometry.frames import adapted, cross, dot, parallel_transport, signed_angle, unit
from rodshell.model import Freedom
from rodshell.model.assembly import ANGLE
from rodshell.model.elastic_rod import ElasticRod, RodStrains
from rodshell.model.rod_line import End
from rodshell.rods.elements import is_bends
from rodshell.solve.equilibrium import SolveReport, Status
from rodshell.solve.path import follow
from rodshell.solve.problem import Problem, Supports
from rodshell.validation import array, direction, finite, flag, instance, mapping, number, short, texts, vector, whole


@dataclass(frozen=True, kw_only=True, eq=False)
class RodSupports:
    """Where a rod is held. Clamps that are not named stay as they are.

    Args:
        positions: node -> where it is held (3,) [m], or None: where it is. Nodes may count from the end (-1).
        along: node -> orthonormal directions along which alone it is free.
        tangents: clamped end -> tangent (3,) along the rod there.
        directors: clamped end -> first material director m1 (3,) there; its part across the tangent is used.
        turns: clamped end -> how far it is turned about its tangent in all [rad], more than once around if so given:
            from the director, if one is given, or from where it has no twist angle, as it was built; the same again
            turns no further.
        spinning: clamped ends that hold position and direction but let the rod spin.
        angles: edge -> twist angle that it is held at [rad].
    """

    positions: Mapping[int, ArrayLike | None] = field(default_factory=dict)
    along: Mapping[int, Sequence[tuple[float, float, float]]] = field(default_factory=dict)
    tangents: Mapping[End, ArrayLike] = field(default_factory=dict)
    directors: Mapping[End, ArrayLike] = field(default_factory=dict)
    turns: Mapping[End, float] = field(default_factory=dict)
    spinning: Sequence[End] = ()
    angles: Mapping[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("positions", "along", "tangents", "directors", "turns", "angles"):
            mapping(name, getattr(self, name), "a mapping from nodes, edges or ends")
        spinning = texts("spinning", self.spinning, 'a list of ends such as ("start",)')
        object.__setattr__(self, "spinning", spinning)

    def require(self, rod: ElasticRod) -> None:
        """Raise InputError where this rod cannot be held so."""
        for end in (*self.tangents, *self.directors, *self.turns, *self.spinning):
            if end not in rod.clamps:
                raise InputError(f'the rod is not clamped at "{end}": build it with clamped=("{end}",)')
        for end in self.spinning:
            if end in self.directors or end in self.turns:
                raise InputError(f'the clamp at "{end}" cannot both spin and be turned')
        if (self.directors or self.turns or self.spinning or self.angles) and not rod.twists:
            raise InputError("this rod carries no twist angles: build it with twist=True")


@dataclass(frozen=True, kw_only=True, eq=False)
class RodLoads:
    """Dead loads on a rod.

    Args:
        forces: node -> force (3,) [N]; or (n, 3), one for each node.
        moments: edge, or clamped end that spins -> moment about the tangent [N m]. Conservative: its work is that of
            the twist angle, counted from frames transported from the last step's shape.
        gravity: acceleration (3,) [m/s2].
    """

    forces: Mapping[int, ArrayLike] | ArrayLike = field(default_factory=dict)
    moments: Mapping[int | End, float] = field(default_factory=dict)
    gravity: ArrayLike | None = None

    def __post_init__(self) -> None:
        mapping("moments", self.moments, "a mapping from edges or ends to moments in N m")
        for place, moment in self.moments.items():
            number(f"the moment at {short(place)}", moment, "N m")
        if isinstance(self.forces, Mapping):
            for node, force in self.forces.items():
                vector(f"the force on node {short(node)}", force)
        else:
            given = array("the forces on all nodes", self.forces, np.float64, None, 3)
            finite("the forces on all nodes", given, *given.shape)
        if self.gravity is not None:
            vector("gravity", self.gravity)

    def on(self, rod: ElasticRod, spinning: Sequence[End]) -> Floats:
        """(N, 3) load on each block [N, at angles N m].

        Args:
            spinning: clamped ends that are free to spin.

        Raises:
            InputError: a load that this rod cannot carry.
        """
        load = np.zeros((rod.block_count, 3)) if self.gravity is None else rod.weight(self.gravity)
        if isinstance(self.forces, Mapping):
            for node, force in self.forces.items():
                load[_index_of(node, rod.node_count, "node")] += vector(f"the force on node {node}", force)
        else:
            load[rod.nodes] += finite("the forces on all nodes", self.forces, rod.node_count, 3)
        if self.moments and not rod.twists:
            raise InputError("this rod carries no twist angles: build it with twist=True")
        for place, given in self.moments.items():
            moment = finite(f"the moment at {short(place)}", given)
            if isinstance(place, str):
                if place not in spinning:
                    raise InputError(f'the moment at "{place}" needs a clamp there that spins: spinning=("{place}",)')
                load[rod.ghost_angles[rod.clamps.index(place)], 0] += moment
            else:
                load[rod.node_count + _index_of(place, rod.edge_count, "edge"), 0] += moment
        return load


@dataclass(frozen=True, eq=False)
class SupportPath:
    """Where the prescribed blocks are at t from 0 to 1; a clamp's tangent turns along the great circle."""

    free: Freedom
    moved: Ints
    first: Floats
    last: Floats
    clamps: tuple["_TurningClamp", ...]
    holds_spin: bool

    @staticmethod
    def of(rod: ElasticRod, state: Floats, wanted: RodSupports) -> "SupportPath":
        """From where the rod's blocks are in `state` (N, 3) to where the supports are wanted."""
        wanted.require(rod)
        goals = dict[int, Floats]()
        for k, node in enumerate(rod.clamped_nodes):
            goals[int(node)] = state[node]
            if rod.twists and rod.clamps[k] not in wanted.spinning:
                goals[int(rod.ghost_angles[k])] = state[rod.ghost_angles[k]]
        for node, goal in wanted.positions.items():
            block = _index_of(node, rod.node_count, "node")
            goals[block] = state[block] if goal is None else vector(f"the position of node {node}", goal)
        for edge, angle in wanted.angles.items():
            goals[rod.node_count + _index_of(edge, rod.edge_count, "edge")] = _about(f"the angle of edge {edge}", angle)
        clamps = tuple(_TurningClamp.of(rod, state, k, goals, wanted) for k in range(len(rod.clamps)))
        holds_spin = rod.twists and rod.free_spin and not any(block >= rod.node_count for block in goals)
        if holds_spin:
            goals[rod.angles.start] = state[rod.angles.start]
        moved = np.array(list(goals), dtype=np.intp)
        free = rod.freedom()
        for node, directions in wanted.along.items():
            block = _index_of(node, rod.node_count, "node")
            free = free.with_directions(np.array([block]), *_orthonormal(node, directions))
        spins = [int(rod.ghost_angles[rod.clamps.index(end)]) for end in wanted.spinning]
        free = free.with_directions(np.array(spins, dtype=np.intp), ANGLE).with_directions(moved)
        last = np.array([goals[block] for block in goals]).reshape(-1, 3)
        return SupportPath(free, moved, state[moved], last, clamps, holds_spin)

    def at(self, t: float) -> Supports:
        """The supports at t from 0 to 1."""
        moved = np.concatenate([self.moved, np.array([clamp.ghost for clamp in self.clamps], dtype=np.intp)])
        goals = (1 - t) * self.first + t * self.last
        ghosts = [clamp.at(t) for clamp in self.clamps]
        return Supports(self.free, moved, np.vstack([goals, *ghosts]))


@dataclass(frozen=True, eq=False)
class _TurningClamp:
    """A clamp whose end goes straight from `start` to `goal` [m] while its tangent turns by `angle` [rad] to `side`."""

    ghost: int
    start: Floats
    goal: Floats
    reach: float
    tangent: Floats
    side: Floats
    angle: float

    @staticmethod
    def of(rod: ElasticRod, state: Floats, k: int, goals: dict[int, Floats], wanted: RodSupports) -> "_TurningClamp":
        """The k-th clamp; puts the angle that its ghost edge is to reach into `goals`."""
        end, node, ghost = rod.clamps[k], int(rod.clamped_nodes[k]), int(rod.ghosts[k])
        outward = -1.0 if end == "start" else 1.0
        arm = outward * (state[ghost] - state[node])
        reach, now = float(np.linalg.norm(arm)), unit(arm)
        then = direction(f'the tangent at the "{end}"', wanted.tangents.get(end, now))
        angle = float(np.arctan2(np.linalg.norm(cross(now, then)), dot(now, then)))
        if angle > np.pi - 1e-6:
            raise InputError(f'the clamp at "{end}" turns back on itself: give its way in two solves')
        side = unit(then - dot(now, then) * now) if angle > 1e-12 else np.zeros(3)
        if end in wanted.directors or end in wanted.turns:
            block = int(rod.ghost_angles[k])
            before = 0.0 if end in wanted.turns else state[block, 0]  # turns in all, or on from there
            theta = float(before + finite(f'the turn of the "{end}"', wanted.turns.get(end, 0.0)))
            if end in wanted.directors:
                d1 = rod.reference_directors(state)[rod.edge_count + k]
                m1 = np.cos(before) * d1 + np.sin(before) * cross(now, d1)
                transported = parallel_transport(m1, now, then)
                given = direction(f'the director at the "{end}"', wanted.directors[end])
                theta += float(signed_angle(transported, adapted(given, then), then))
            goals[block] = np.array([theta, 0.0, 0.0])
        return _TurningClamp(ghost, state[node], goals[node], outward * reach, now, side, angle)

    def at(self, t: float) -> Floats:
        """(3,) position of the ghost at t from 0 to 1 [m]."""
        turned = np.cos(t * self.angle) * self.tangent + np.sin(t * self.angle) * self.side
        return np.asarray((1 - t) * self.start + t * self.goal + self.reach * turned)


def _about(name: str, angle: float) -> Floats:
    """(3,) block of a twist angle."""
    return np.array([float(finite(name, angle)), 0.0, 0.0])


def _orthonormal(node: int, directions: Sequence[tuple[float, float, float]]) -> Sequence[tuple[float, float, float]]:
    rows = np.array([vector(f"a free direction of node {node}", along) for along in directions]).reshape(-1, 3)
    if np.abs(rows @ rows.T - np.eye(len(rows))).max(initial=0.0) > 1e-9:
        raise InputError(f"the free directions of node {node} must be unit vectors at right angles to each other")
    return directions


def _index_of(given: int, count: int, what: str) -> int:
    """An index from 0 to `count` - 1 of one that may count from the end; InputError where there is no such `what`, a
    "node" or an "edge"."""
    if not isinstance(given, int | np.integer):
        raise InputError(f"a {what} is a whole number, not {short(given)}")
    if not -count <= given < count:
        raise InputError(f"the rod has no {what} {given}: they run from 0 to {count - 1}")
    return given % count


EASY = 6  # a step of no more iterations may be followed by a longer one
MOST = 40  # iterations of a step
NEUTRAL = 1e-6  # a mode of less than this of EI/L, the rod moving by its length, is one that nothing resists, such as
# the turn of a round rod's bow about the line of its clamps: round-off chooses its sign


@dataclass(frozen=True, eq=False)
class RodShape:
    """A rod in equilibrium.

    Args:
        rod: with its source frames at `state`, so that a further solve can start here.
        state: (N, 3) blocks.
        axial_forces: (edges,) [N].
        load: (N, 3) what it carries [N, at angles N m].
        reactions: (N, 3) of the supports [N, at angles N m]; zero where nothing is held.
        report: iterations, residual, and whether the equilibrium is stable.
    """

    rod: ElasticRod
    state: Floats
    axial_forces: Floats
    load: Floats
    reactions: Floats
    report: SolveReport

    @property
    def positions(self) -> Floats:
        """(n, 3) of the nodes [m]."""
        return self.state[self.rod.nodes]

    @property
    def angles(self) -> Floats:
        """(edges,) twist angles [rad]."""
        return self.state[self.rod.angles, 0]

    @property
    def frames(self) -> Floats:
        """(edges, 3, 3) rows m1, m2, t of each edge."""
        return self.rod.material_frames(self.state)

    @property
    def strains(self) -> RodStrains:
        return self.rod.strains(self.state)

    @property
    def energy(self) -> float:
        """Elastic energy [J]."""
        return self.rod.energy(self.state)

    def support(self, end: End) -> tuple[Floats, Floats]:
        """Force (3,) [N], and moment (3,) [N m] about the end, that a clamp puts on the rod."""
        k = self.rod.clamps.index(end)
        node, ghost = self.rod.clamped_nodes[k], self.rod.ghosts[k]
        lever, pull = self.state[ghost] - self.state[node], self.reactions[ghost]
        moment = cross(lever, pull)
        if self.rod.twists:
            along = unit(lever) * (-1.0 if end == "start" else 1.0)
            moment = moment + self.reactions[self.rod.ghost_angles[k], 0] * along
        return self.reactions[node] + pull, moment


def solve_rod(
    rod: ElasticRod,
    supports: RodSupports | None = None,
    loads: RodLoads | None = None,
    *,
    start: ArrayLike | RodShape | None = None,
    steps: int = 1,
    stable: bool = True,
) -> RodShape:
    """Equilibrium of a rod, followed from `start` while supports and loads go to the goals given here.

    Args:
        supports, loads: where the rod is held, and what it carries; None: as its clamps are, and nothing. A rod that
            nothing keeps from spinning about itself is held at its first edge's angle.
        start: a state (N, 3), or a shape found before (then `rod` is shape.rod); by default the rest shape. What held
            it is let go bit by bit, unless it is given again: the loads and supports of a shape; of a state, natural
            strains go from what they are there to the rod's own, and forces that hold what is left fade.
        steps: equal steps to begin with; they halve where the solver fails and grow back.
            Where ends travel far in a step, the solver can land on another branch than the one that a rod would
            follow, with loops or twist in it: an equilibrium, but another. Give ten steps or more then, and see whether
            twice as many end with the same energy.
        stable: leave a saddle for a stable equilibrium, and refuse what is not stable. If False, the path continues
            over saddles, and the report counts the negative modes at its end.

    Raises:
        InputError: a support or a load that this rod does not have.
        ConvergenceError: the goal was not reached, or not in a stable equilibrium; `report` holds the figures.
    """
    instance("rod", rod, ElasticRod)
    whole("steps", steps, 1)
    flag("stable", stable)
    if supports is not None:
        instance("supports", supports, RodSupports)
    if loads is not None:
        instance("loads", loads, RodLoads)
    supports, loads = supports or RodSupports(), loads or RodLoads()
    state = _start_state(rod, start)
    path, load = SupportPath.of(rod, state, supports), loads.on(rod, supports.spinning)
    if path.holds_spin and load[rod.angles.start :, 0].any():
        raise InputError("nothing keeps this rod from spinning under its moments: hold an angle, or clamp an end")
    held = rod.elements
    if isinstance(start, RodShape):
        axial = start.axial_forces
    else:
        axial = rod.stretch.stiffness * rod.stretch.strains(state)
        held = tuple(element.relaxed(state) for element in rod.elements)
    # this load makes the start an equilibrium
    before = Problem(held, rod.stretch, path.at(0.0), rod.length).gradient(state, axial)

    def problem_at(t: float) -> Problem:
        pulls = (1 - t) * before + t * load
        elements = tuple(last.between(first, t) for first, last in zip(held, rod.elements, strict=True))
        return Problem(elements, rod.stretch, path.at(t), rod.length, load=pulls)

    way = follow(
        problem_at, state, axial, first_step=1.0 / steps, slide=stable, neutral=NEUTRAL * rod.bend_energy, easy=EASY,
        most=MOST, most_of_all=None,
    )  # fmt: skip
    *earlier, last = way.reports
    report = last.after(*earlier)
    if way.t < 1.0:
        raise ConvergenceError(
            f"the rod's equilibrium was lost {100 * way.t:.1f} % of the way from the start to the goal: "
            "give more steps, a finer mesh, or a start nearer to the goal; or hold what is free to move",
            replace(report, status=Status.STALLED),
        )
    if stable and not report.stable:
        raise ConvergenceError(
            f"the rod's equilibrium is not stable: {report.negative_modes} negative modes. Start from a shape bent "
            "to the side that it is to take; or pass stable=False to have it as it is",
            report,
        )
    found, solved = way.found, replace(rod, elements=tuple(filter(is_bends, way.found.elements)))
    reactions = found.gradient - path.free.within(found.gradient)
    residual = float(np.abs(found.gradient[rod.nodes] - reactions[rod.nodes]).max())
    return RodShape(solved, found.state, found.forces, load, reactions, replace(report, force_residual=residual))


def _start_state(rod: ElasticRod, start: ArrayLike | RodShape | None) -> Floats:
    """(N, 3) the state to start from."""
    if isinstance(start, RodShape):
        if start.rod is not rod:
            raise InputError("twist angles belong to their frames: continue from a shape with its own rod, shape.rod")
        return start.state
    state = rod.state() if start is None else array("start", start, np.float64, None, 3)
    if state.shape != (rod.block_count, 3):
        raise InputError(f"a state of this rod has the shape {(rod.block_count, 3)}, not {state.shape}")
    return finite("the state to start from", state, *state.shape).copy()
