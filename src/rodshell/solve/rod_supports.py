"""Supports and loads of one rod, and the supports' way from a start to a goal: held nodes and angles, clamps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.frames import adapted, cross, dot, parallel_transport, signed_angle, unit
from rodshell.model import Freedom
from rodshell.model.elastic_rod import ElasticRod
from rodshell.model.rod_line import End
from rodshell.solve.problem import Supports
from rodshell.validation import direction, finite, vector

SPIN = (1.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class RodSupports:
    """Where a rod is held. Clamps that are not named stay as they are.

    Parameters
    ----------
    positions : node -> where it is held (3,) [m], or None: where it is. Nodes may count from the end (-1).
    along : node -> orthonormal directions along which alone it is free.
    tangents : clamped end -> tangent (3,) along the rod there.
    directors : clamped end -> first material director m1 (3,) there; its part across the tangent is used.
    turns : clamped end -> how far it turns about its tangent [rad], on top of that; more than once around if so given.
    spinning : clamped ends that hold position and direction but let the rod spin.
    angles : edge -> twist angle that it is held at [rad].
    """

    positions: Mapping[int, ArrayLike | None] = field(default_factory=dict)
    along: Mapping[int, Sequence[tuple[float, float, float]]] = field(default_factory=dict)
    tangents: Mapping[End, ArrayLike] = field(default_factory=dict)
    directors: Mapping[End, ArrayLike] = field(default_factory=dict)
    turns: Mapping[End, float] = field(default_factory=dict)
    spinning: Sequence[End] = ()
    angles: Mapping[int, float] = field(default_factory=dict)

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

    Parameters
    ----------
    forces : node -> force (3,) [N]; or (n, 3), one for each node.
    moments : edge, or clamped end that spins -> moment about the tangent [N m]. Conservative: its work is that of
        the twist angle, counted from frames carried from the last step's shape.
    gravity : acceleration (3,) [m/s2].
    """

    forces: Mapping[int, ArrayLike] | ArrayLike = field(default_factory=dict)
    moments: Mapping[int | End, float] = field(default_factory=dict)
    gravity: ArrayLike | None = None

    def on(self, rod: ElasticRod, spinning: Sequence[End]) -> Floats:
        """(N, 3) load on each block [N, at angles N m], the clamps `spinning` being free to spin.

        Raises
        ------
        InputError : a load that this rod cannot carry.
        """
        load = np.zeros((rod.block_count, 3)) if self.gravity is None else rod.weight(self.gravity)
        if isinstance(self.forces, Mapping):
            for node, force in self.forces.items():
                load[index_of(node, rod.node_count, "node")] += vector(f"the force on node {node}", force)
        else:
            load[rod.nodes] += finite("the forces on all nodes", self.forces, rod.node_count, 3)
        if self.moments and not rod.twists:
            raise InputError("this rod carries no twist angles: build it with twist=True")
        for place, given in self.moments.items():
            moment = finite(f"the moment at {place!r}", given)
            if isinstance(place, str):
                if place not in spinning:
                    raise InputError(f'the moment at "{place}" needs a clamp there that spins: spinning=("{place}",)')
                load[rod.ghost_angles[rod.clamps.index(place)], 0] += moment
            else:
                load[rod.node_count + index_of(place, rod.edge_count, "edge"), 0] += moment
        return load


@dataclass(frozen=True)
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
            block = index_of(node, rod.node_count, "node")
            goals[block] = state[block] if goal is None else vector(f"the position of node {node}", goal)
        for edge, angle in wanted.angles.items():
            goals[rod.node_count + index_of(edge, rod.edge_count, "edge")] = _about(f"the angle of edge {edge}", angle)
        clamps = tuple(_TurningClamp.of(rod, state, k, goals, wanted) for k in range(len(rod.clamps)))
        holds_spin = rod.twists and rod.free_spin and not any(block >= rod.node_count for block in goals)
        if holds_spin:
            goals[rod.angles.start] = state[rod.angles.start]
        moved = np.array(list(goals), dtype=np.intp)
        free = rod.freedom()
        for node, directions in wanted.along.items():
            block = index_of(node, rod.node_count, "node")
            free = free.with_directions(np.array([block]), *_orthonormal(node, directions))
        spins = [int(rod.ghost_angles[rod.clamps.index(end)]) for end in wanted.spinning]
        free = free.with_directions(np.array(spins, dtype=np.intp), SPIN).with_directions(moved)
        last = np.array([goals[block] for block in goals]).reshape(-1, 3)
        return SupportPath(free, moved, state[moved], last, clamps, holds_spin)

    def at(self, t: float) -> Supports:
        """The supports at t from 0 to 1."""
        moved = np.concatenate([self.moved, np.array([clamp.ghost for clamp in self.clamps], dtype=np.intp)])
        goals = (1 - t) * self.first + t * self.last
        ghosts = [clamp.at(t) for clamp in self.clamps]
        return Supports(self.free, moved, np.vstack([goals, *ghosts]))


@dataclass(frozen=True)
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
            turn = finite(f'the turn of the "{end}"', wanted.turns.get(end, 0.0))
            theta = float(state[block, 0] + turn)
            if end in wanted.directors:
                d1 = rod.reference_directors(state)[rod.edge_count + k]
                m1 = np.cos(state[block, 0]) * d1 + np.sin(state[block, 0]) * cross(now, d1)
                carried = parallel_transport(m1, now, then)
                given = direction(f'the director at the "{end}"', wanted.directors[end])
                theta += float(signed_angle(carried, adapted(given, then), then))
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


def index_of(given: int, count: int, what: str) -> int:
    """An index from 0 to `count` - 1 of one that may count from the end; InputError where there is no such `what`."""
    if not isinstance(given, int | np.integer):
        raise InputError(f"a {what} is a whole number, not {given!r}")
    if not -count <= given < count:
        raise InputError(f"the rod has no {what} {given}: they run from 0 to {count - 1}")
    return given % count
