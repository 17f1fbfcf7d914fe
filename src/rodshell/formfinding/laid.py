"""Rods laid on a target along its curves, and the flat state in which their arc lengths fit.

No solve is needed to lay them: each rod lies on its curve. In the plane they find the state of least bending that keeps
all arc lengths. There laths that lie flat bend about their strong axes; the strain of that says whether the grid can be
assembled flat, or only in place.
"""

from dataclasses import replace

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.formfinding.finite_sections import rod_breadth
from rodshell.formfinding.methods import Bound, Draped, DrapeFigures, FlatState, smallest_joint_angle
from rodshell.formfinding.trim import FEWEST_JOINTS
from rodshell.geometry.frames import unit
from rodshell.joints import Joint
from rodshell.layout import FlatGrid, FlatRod, GridMesh, mesh_grid
from rodshell.layout.gridlayout import piece_names
from rodshell.layout.lattices import Asymptotic, Curves, Geodesic, SurfaceLattice
from rodshell.layout.mesh import cut_mesh
from rodshell.layout.rest_curve import RestCurve
from rodshell.model.assembly import Freedom
from rodshell.model.shell import Shell
from rodshell.nets.surface_lattice import SurfaceNet, surface_net
from rodshell.progress import Progress, silent
from rodshell.rods.elements import Stretch
from rodshell.rods.section import Rod
from rodshell.solve.equilibrium import SolveReport, Status, find_stable
from rodshell.solve.problem import Problem, Supports
from rodshell.targets import Target
from rodshell.units import length_text, shown

MOST_ITERATIONS = 24  # of the flat state: a grid that lies flat takes less than ten, another may take hundreds
PENALTY = 8e4  # stiffness of the edges against that of bending over the size, as of a bound drape


def lay(
    target: Target,
    lattice: Geodesic | Asymptotic | Curves,
    rod: Rod,
    *,
    anchor: tuple[float, float] | None = None,
    joint: Joint | None = None,
    progress: Progress = silent,
) -> Draped:
    """Lay the rods of a lattice on a target along its curves; see `drape`.

    Args:
        anchor: x, y of the point of the target from which the rods are set out [m]; default: its highest point.

    Raises:
        NetLimitError: a curve does not reach the end of the target, or there is none; names the place.
        InputError: no two rods cross; the joints are eccentric.
    """
    if joint is not None and joint.eccentricity:
        raise InputError(
            f'joints with an eccentricity need two layers of rods, which a lattice "{lattice.kind}" does not have: set '
            'the eccentricity to 0, or use lattice "chebyshev"'
        )
    lattice = lattice.build(target)
    progress("net", f"following {lattice.kind} curves", 0.0)
    net = surface_net(target, lattice, anchor=anchor)
    if not len(net.crossings):
        raise InputError(
            f"no two rods cross on the target, on which {len(net.names)} lie: set them closer, or draw others"
        )
    mesh, positions = _meshed(net)
    flat = flat_state(mesh, positions, rod, progress=progress)
    mesh = replace(mesh, flat=np.column_stack([flat.positions, np.zeros(mesh.node_count)]))
    angle, place = smallest_joint_angle(mesh, positions, np.ones(mesh.node_count, dtype=bool))
    value, gradient = target.level(positions)
    figures = DrapeFigures(
        max_gap=float(np.abs(value / np.linalg.norm(gradient, axis=1)).max()),
        contact_pulls=0,
        min_angle=angle,
        min_angle_at=place,
    )
    report = SolveReport(Status.CONVERGED, 0, 0, 0, 0.0, 0.0, 0.0, 0)
    return Draped(
        method=Bound(), target=target, layout=lattice, rod=rod, anchor=anchor, eccentricity=0.0, mesh=mesh,
        positions=positions, rods=_built(mesh.grid.rods, lattice), levels=(report,), figures=figures, flat_state=flat,
        warnings=(*target.warnings, *net.warnings, *_near_joints(mesh.grid, rod)),
    )  # fmt: skip


def _middle_joint(mesh: GridMesh, positions: Floats) -> tuple[int, ...]:
    """The joint nearest to the middle, and the node next to it on either rod."""
    joint = int(np.argmin(np.linalg.norm(positions[mesh.joint_nodes] - positions.mean(axis=0), axis=1)))
    rows = [mesh.nodes_of(rod) for rod in mesh.grid.crossings.rods[joint]]
    at = [row.tolist().index(mesh.joint_nodes[joint]) for row in rows]
    return mesh.joint_nodes[joint], *(
        int(row[k + 1 if k + 1 < len(row) else k - 1]) for row, k in zip(rows, at, strict=True)
    )


def _near_joints(grid: FlatGrid, rod: Rod) -> tuple[str, ...]:
    """A warning where joints of a rod are so near to each other that its laths lie on one another and holes meet."""
    rods, at = grid.crossings.rods.ravel(), grid.crossings.at.ravel()
    order = np.lexsort((at, rods))
    rods, at = rods[order], at[order]
    apart = np.where(rods[1:] == rods[:-1], np.diff(at), np.inf)
    breadth = rod_breadth(rod)
    near = int(np.count_nonzero(apart < breadth))
    if not near:
        return ()
    k = int(np.argmin(apart))
    line, place = grid.rods[rods[k]], length_text(at[k] - grid.rods[rods[k]].start)
    return (
        f"{near} pairs of neighbouring joints on a rod are nearer than its breadth of {length_text(breadth)}, down to "
        f"{length_text(apart[k])} on {line.name}, {place} from its start, where their holes have no room: use another "
        "spacing, anchor or heading, leave a rod out (layout.left_out), or use narrower laths",
    )


def _built(rods: tuple[FlatRod, ...], lattice: SurfaceLattice) -> tuple[FlatRod, ...]:
    """The rods but those that the lattice leaves out."""
    if unknown := set(lattice.left_out) - {rod.name for rod in rods}:
        raise InputError(
            f"layout left_out has {shown(min(unknown))}, which is not the name of a rod on the target: these are "
            f"{rods[0].name} to {rods[-1].name}"
        )
    return tuple(rod for rod in rods if rod.name not in lattice.left_out)


def _meshed(net: SurfaceNet) -> tuple[GridMesh, Floats]:
    """The mesh of the rods of a net, side by side in the flat state, and its nodes (n, 3) on the target [m].

    Curves are meshed past the ends of the target, and across its openings, and cut there.
    """
    curves, lattice, reach = net.curves, net.lattice, net.curves.reach
    of, ends = curves.pieces
    lines, rods = list[FlatRod](), list[FlatRod]()
    for k, (name, (start, stop)) in enumerate(zip(net.names, reach.tolist(), strict=True)):
        line = FlatRod(name, net.families[k], None, start, stop, (0.0, lattice.least_spacing * k), (1.0, 0.0))
        lines.append(line._replace(curve=_at_rest(net, k)))
        pieces = ends[of == k].tolist()
        named = zip(piece_names(name, len(pieces)), pieces, strict=True)
        rods += [lines[k].cut(*piece)._replace(name=label) for label, piece in named]
    marks = [ends[of == k].ravel().tolist() for k in range(len(lines))]
    low, high = reach[net.crossings.rods].transpose(2, 0, 1)
    on_both = ((low <= net.crossings.at) & (net.crossings.at <= high)).all(axis=1)
    grid = FlatGrid(tuple(lines), net.crossings.select(on_both), net.crossings.select(~on_both))
    whole = mesh_grid(grid, lattice.longest_edge, marks=marks)
    mesh, nodes = cut_mesh(whole, rods)
    positions = np.empty((whole.node_count, 3))
    positions[whole.rod_nodes] = curves.at(whole.rod_of, whole.stations)[0]
    return mesh, positions[nodes]


def _at_rest(net: SurfaceNet, k: int) -> RestCurve | None:
    """How the k-th rod of a net is curved at rest, seen from above."""
    if not net.curved_at_rest:
        return None
    (curve, s), curves = net.curves.knots, net.curves
    up = curves.target.on_surface(curves.points).normal[:, 2].sum()
    here = slice(*np.searchsorted(curve, [k, k + 1]))
    return RestCurve(tuple(s[here].tolist()), tuple((np.copysign(1.0, up) * net.bends[1][here]).tolist()))


def flat_state(mesh: GridMesh, positions: Floats, rod: Rod, *, progress: Progress = silent) -> FlatState:
    """The state of least bending in the plane that keeps the rods' lengths and joints.

    Args:
        positions: (n, 3) of the mesh's nodes on the target [m], from whose plan the search starts.
    """
    standing, _ = mesh.grid.without(lambda grid: grid.joint_counts() < FEWEST_JOINTS)  # nothing resists a swinging rod
    if standing.rods and len(standing.rods) < len(mesh.grid.rods):
        inner, nodes = cut_mesh(mesh, standing.rods)
        without, lying = flat_state(inner, positions[nodes], rod, progress=progress), positions[:, :2].copy()
        lying[nodes] = without.positions
        return replace(without, positions=lying)
    start = positions * [1.0, 1.0, 0.0]
    chords = np.linalg.norm(np.diff(start[mesh.edges], axis=1)[:, 0], axis=1)
    start *= mesh.edge_lengths.sum() / chords.sum()
    size, plane = float(np.abs(start - start.mean(axis=0)).max()), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    middle, *next_to = _middle_joint(mesh, start)
    if all(line.curve is None for line in mesh.grid.rods):
        del next_to[1]  # straight rods decide the angle
    shell = Shell.of(replace(mesh, flat=start), rod, isotropic=False, twist=True)
    free = Freedom.free(len(shell.like)).with_directions(np.arange(len(shell.like)))  # frames stay upright
    free = free.with_directions(np.arange(mesh.node_count), *plane)
    free = free.with_directions(np.array([middle]))
    for node in next_to:
        free = free.with_directions(np.array([node]), tuple(unit(start[node] - start[middle]).tolist()))
    weight = PENALTY * (size / float(mesh.edge_lengths.mean())) ** 2 / size**2
    frames = shell.frames
    assert frames is not None
    bends = frames.with_stiffness(np.repeat(1.0 / mesh.voronoi_lengths[:, None], 3, axis=1))
    problem = Problem(
        elements=(bends,),
        stretch=Stretch.elastic(mesh.edges, mesh.edge_lengths, np.full(len(mesh.edges), weight)),
        constraint=Supports(free),
        length=size,
        inextensible=True,
        flat_coordinates=shell.flat_coordinates,
    )
    found = find_stable(
        problem, shell.state(start), np.zeros(len(mesh.edges)), limit_steps=True, most_iterations=MOST_ITERATIONS,
        progress=lambda k, step: progress("drape", f"flat state, iteration {k} of at most {MOST_ITERATIONS}", step),
    )  # fmt: skip
    if not found.report.converged:
        return FlatState(start[:, :2], None, found.report)
    turned = np.abs(bends.strains(found.state)[:, 1] - bends.natural_curvature[:, 1]) / mesh.voronoi_lengths
    strain = 0.5 * rod_breadth(rod) * float(turned.max(initial=0.0))
    return FlatState(found.state[: mesh.node_count, :2], strain, found.report)
