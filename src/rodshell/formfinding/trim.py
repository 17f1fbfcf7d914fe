"""Trim what extends past the target's end, and map the cuts back to the flat grid [HQK section 3.2]."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from rodshell.arrays import Floats, NodePositions
from rodshell.errors import InputError, RodshellError
from rodshell.formfinding.finite_sections import node_normals, place_in_layers
from rodshell.formfinding.methods import Bound, Draped
from rodshell.geometry.frames import unit
from rodshell.layout import FlatGrid, FlatRod, GridLayout, GridMesh, mesh_grid
from rodshell.layout.mesh import cut_mesh
from rodshell.nets import chebyshev_net
from rodshell.targets import Target
from rodshell.validation import array, finite, instance, whole

NEAREST_JOINT = 0.15  # spacings: a joint closer to a rod's end cannot be made
FEWEST_JOINTS = 3  # a rod with fewer swings about the line through its joints


@dataclass(frozen=True, eq=False)
class Boundary:
    """The final boundary G: where the rod ends go.

    Args:
        points: (2m, 3), start and end of each rod's own line in turn [m].
        tangents: (2m, 3) outward unit tangents of the draped rods there: the directions of clamps.
        draped: (n, 3) the state of the whole trimmed shell that has these ends, or None [m].
        normals: (n, 3) of the surface at the draped nodes, where rods lie in layers or along its curves; else None.
    """

    points: Floats
    tangents: Floats
    draped: Floats | None = None
    normals: Floats | None = None

    def __post_init__(self) -> None:
        for name in ("points", "tangents", "draped", "normals"):
            given = getattr(self, name)
            if given is not None or name in ("points", "tangents"):
                rows = len(self.points) if name == "tangents" else None
                found = array(f"the boundary's {name}", given, np.float64, rows, 3)
                object.__setattr__(self, name, finite(f"the boundary's {name}", found, *found.shape))

    def __repr__(self) -> str:
        return f"<Boundary: ends of {len(self.points) // 2} rods>"

    @staticmethod
    def of_grids(parts: Sequence["Boundary"]) -> "Boundary":
        """Of grids that lie side by side."""
        rows = {field.name: [getattr(part, field.name) for part in parts] for field in fields(Boundary)}
        known = {name: of for name, of in rows.items() if all(row is not None for row in of)}
        return Boundary(**{name: np.concatenate(of) for name, of in known.items()})

    def of_grid(self, mesh: GridMesh, k: int) -> "Boundary":
        """Of the k-th of the grids of a `mesh` that lie side by side."""
        ends, nodes = np.repeat(mesh.grid_of_rods == k, 2), mesh.grid_of_nodes == k
        draped, normals = (None if rows is None else rows[nodes] for rows in (self.draped, self.normals))
        return Boundary(self.points[ends], self.tangents[ends], draped, normals)


@dataclass(frozen=True, eq=False)
class Footprint:
    """The trimmed grid, flat: its rods end on the footprint G0.

    Args:
        mesh: of the m trimmed rods.
    """

    mesh: GridMesh

    def __post_init__(self) -> None:
        instance("mesh", self.mesh, GridMesh)

    def __repr__(self) -> str:
        return f"<Footprint: {len(self.rods)} rods, {self.mesh.node_count} nodes>"

    @property
    def rods(self) -> tuple[FlatRod, ...]:
        """The m rods, each with its start and end in the flat grid."""
        return self.mesh.grid.rods

    @property
    def points(self) -> Floats:
        """(2m, 2) start and end of each rod in turn: the curve G0 [m]."""
        return self.mesh.flat[self.mesh.ends.ravel(), :2]


@dataclass(frozen=True, eq=False)
class Trimmed:
    """The draped grid without its overhangs.

    Args:
        mesh: of the trimmed rods; rods in layers have separate nodes in it, each on its own line.
        positions: (n, 3) of its nodes [m].
        dropped: names of the rods that are left out, each with the reason.
    """

    draped: Draped
    mesh: GridMesh
    positions: Floats
    boundary: Boundary
    dropped: tuple[tuple[str, str], ...]

    def __repr__(self) -> str:
        return f"<Trimmed: {len(self.mesh.grid.rods)} rods, {len(self.dropped)} left out>"


def trim(draped: Draped, *, fewest: int = FEWEST_JOINTS) -> Trimmed:
    """Cut every rod at the target's end and drop the rods that cannot be built or would swing [HQK 3.2].

    Args:
        draped: a grid lying on its target.
        fewest: number of joints from which a rod does not swing.

    Raises:
        InputError: `draped` is of another kind; no rod is left, or a hanging rod is too short to reach the target's
            end.
    """
    instance("draped", draped, Draped, "what rodshell.drape returned")
    whole("fewest", fewest, 0)
    margin = NEAREST_JOINT * draped.layout.least_spacing
    rods, positions, dropped = draped.rods, draped.positions, list(draped.dropped)
    if isinstance(draped.method, Bound):
        source = draped.mesh
    else:
        rods, lost = _cut_rods(draped)
        dropped += lost
        source, positions = _recut(draped, rods)
    grid, _ = source.grid.cut(rods, margin=margin)
    kept, swinging = grid.without(lambda grid: grid.joint_counts() < fewest)
    dropped += [(name, f"it has fewer than {fewest} joints and would swing") for name in swinging]
    if not kept.rods:
        raise InputError(
            f"no rod of the grid has {fewest} joints on the target: use {draped.layout.closer} or a larger target"
        )
    mesh, nodes = cut_mesh(source, kept.rods, margin=margin)
    positions = positions.take(nodes, axis=0)
    normals = None if isinstance(draped.layout, GridLayout) else draped.target.on_surface(positions).normal
    if draped.eccentricity:
        bound = isinstance(draped.method, Bound)
        normals = draped.target.on_surface(positions).normal if bound else node_normals(mesh, positions)
        mesh, positions, normals = place_in_layers(mesh, positions, normals, draped.eccentricity)
    boundary = Boundary(positions[mesh.ends.ravel()], end_tangents(mesh, positions), positions, normals)
    return Trimmed(draped, mesh, positions, boundary, tuple(dropped))


def in_layers(footprint: Footprint, boundary: Boundary, eccentricity: float) -> tuple[Footprint, Boundary]:
    """Footprint and boundary of rods that lie in two layers, from those of a grid whose rods share nodes.

    Without a draped state the boundary's points are already the ends of the rods' own lines.

    Args:
        eccentricity: distance of the layers [m].
    """
    mesh, draped = footprint.mesh, boundary.draped
    if draped is None:
        return Footprint(mesh.in_layers(eccentricity)), boundary
    layered, positions, normals = place_in_layers(mesh, draped, node_normals(mesh, draped), eccentricity)
    ends = layered.ends.ravel()
    return Footprint(layered), Boundary(positions[ends], boundary.tangents, positions, normals)


def untrimmed(draped: Draped) -> Trimmed:
    """A draped grid with nothing cut off, to keep the partial result of a drape that did not converge."""
    mesh, x = draped.mesh, draped.positions
    return Trimmed(draped, mesh, x, Boundary(x[mesh.ends.ravel()], end_tangents(mesh, x), x), draped.dropped)


def map_back(trimmed: Trimmed) -> Footprint:
    """The same cuts on the flat grid: the footprint G0 [HQK 3.2]."""
    instance("trimmed", trimmed, Trimmed, "what rodshell.trim returned")
    return Footprint(trimmed.mesh)


def ends_past_net(trimmed: Trimmed) -> Floats | None:
    """(m, 2) how far the trimmed rods run past the ends of the exact net's, at start and end [m].

    Of a bound drape, whose G0 is that of the net: how far the draped rods would. None where there is no such net.
    """
    draped, rods = trimmed.draped, trimmed.mesh.grid.rods
    if not isinstance(draped.layout, GridLayout):
        return None
    if draped.figures.net_deviation is not None:
        past = dict(zip([rod.name for rod in draped.rods], draped.figures.net_deviation, strict=True))
        return np.array([past[rod.name] for rod in rods])
    try:
        net = chebyshev_net(draped.target, draped.layout, anchor=draped.anchor, eccentricity=draped.eccentricity)
    except RodshellError:
        return None
    exact = {rod.name: rod for rod in net.rods}
    if not exact.keys() >= {rod.name for rod in rods}:
        return None
    return np.array([[exact[rod.name].start - rod.start, rod.end - exact[rod.name].end] for rod in rods])


def end_tangents(mesh: GridMesh, positions: NodePositions) -> Floats:
    """(2m, 3) outward unit tangents at start and end of each rod in turn, to second order from the last two edges."""
    first, last = mesh.rod_start, mesh.rod_stop - 1
    end, inwards = np.column_stack([first, last]).ravel(), np.tile([1, -1], len(first))
    next_to, long = end + inwards, np.repeat(last - first > 1, 2)
    third = np.where(long, next_to + inwards, end)  # of a rod with two nodes there is no edge before its last
    a, b, c = (positions[mesh.rod_nodes[entries]] for entries in (end, next_to, third))
    s, edge = mesh.stations, unit(a - b)
    turn = np.divide(s[end] - s[next_to], s[end] - s[third], out=np.zeros(len(end)), where=long)
    before = np.where(long[:, None], unit(b - c), edge)
    return unit(edge + turn[:, None] * (edge - before))  # turned further as from the edge before to the last


def _cut_rods(draped: Draped) -> tuple[tuple[FlatRod, ...], list[tuple[str, str]]]:
    """Cut hanging rods by interpolation between nodes (a cubic along each rod, not the nearest node)."""
    kept, dropped = list[FlatRod](), list[tuple[str, str]]()
    for k, rod in enumerate(draped.rods):
        s = draped.mesh.stations[draped.mesh.rod_slice(k)]
        inside = _margin(draped.target, draped.positions[draped.mesh.nodes_of(k)]) > 0
        if not inside.any():
            dropped.append((rod.name, "it never touches the target"))
            continue
        first, last = np.flatnonzero(inside)[[0, -1]]
        if first == 0 or last == len(s) - 1:
            raise InputError(f"rod {rod.name} is too short to reach the end of the target: use a longer layout length")
        ends = [_crossing(draped, k, first - 1), _crossing(draped, k, last)]
        kept.append(rod.cut(ends[0], ends[1]))
    return tuple(kept), dropped


def _margin(target: Target, x: Floats) -> Floats:
    """As `Target.margin`, but negative on the wall below a rim, whose distance to the rim in plan is 0."""
    margin = target.margin(x)
    if target.base is not None:
        return margin
    level, gradient = target.level(x)
    below: Floats = np.minimum(level / np.linalg.norm(gradient, axis=1), 0.0)
    return margin + below


def _crossing(draped: Draped, rod: int, before: int) -> float:
    """Material coordinate where a rod crosses the target's end, between its nodes `before` and the next."""
    nodes, s = draped.mesh.nodes_of(rod), draped.mesh.stations[draped.mesh.rod_slice(rod)]
    first = int(np.clip(before - 1, 0, len(s) - 4))
    window = slice(first, first + 4)
    margin = _margin(draped.target, draped.positions[nodes[window]])
    fit = np.polyfit(s[window] - s[before], margin, 3)
    low, high = 0.0, s[before + 1] - s[before]
    rising = np.polyval(fit, low) < 0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (np.polyval(fit, middle) < 0) == rising else (low, middle)
    return float(s[before] + 0.5 * (low + high))


def _recut(draped: Draped, rods: tuple[FlatRod, ...]) -> tuple[GridMesh, Floats]:
    """A mesh of the cut rods with their draped positions, its end nodes put on the target."""
    mesh = mesh_grid(FlatGrid.of(rods), draped.layout.longest_edge)
    names = {rod.name: k for k, rod in enumerate(draped.mesh.grid.rods)}
    positions = draped.mesh.prolong(draped.positions, mesh, rods=[names[rod.name] for rod in rods])
    ends = np.unique(mesh.ends)
    positions[ends] = draped.target.retract(positions[ends])
    return mesh, positions
