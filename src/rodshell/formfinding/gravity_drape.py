"""The gravity drape: static equilibrium of the user's rods under their weight, in unilateral contact.

From the flat grid, on nested meshes. One joint, the anchor, is held in x and y, and a neighbour keeps its heading:
otherwise the draped grid would at once slide or turn away without friction. Even so the state may be a saddle; the
negative modes of its exact Hessian show it. As the rods stretch, the footprint is smaller than that of the inextensible
net: a physical effect, which grows with the weight over the stretch stiffness (docs/theory/drape.md).

The fall drape uses the initial placement, the flat grid over the target, and the test whether it stays there, too.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rodshell.arrays import Floats
from rodshell.contact.static import UnilateralContact
from rodshell.errors import InputError
from rodshell.formfinding.finite_sections import middle_surface, node_normals, place_in_layers
from rodshell.formfinding.methods import Draped, DrapeFigures, Gravity, smallest_joint_angle
from rodshell.joints import Joint
from rodshell.layout import FlatGrid, GridLayout, GridMesh, mesh_grid
from rodshell.model import Freedom, Shell
from rodshell.nets import chebyshev_net
from rodshell.progress import Progress, silent
from rodshell.rods.section import Rod
from rodshell.solve.equilibrium import Equilibrium, SolveReport, Status, find_equilibrium
from rodshell.solve.problem import Problem, Supports
from rodshell.targets import Freeform, Target

DEPTH = 1e-5  # of the size: deepest node inside the target
CONTACT_UPDATES = 12
REFINE = 3.0  # edge length from level to level
MOST_COLD, MOST_WARM = 300, 80  # iterations from the flat grid, and from the coarser level
OVERHANG = 4.0  # spacings by which a rod of automatic length extends past the target's end
SLIPPED = 0.2  # of the size: distance of the heading's axis from its vertical plane at which the grid has lost contact


def gravity_drape(
    target: Target,
    layout: GridLayout,
    rod: Rod,
    method: Gravity,
    *,
    anchor: tuple[float, float] | None = None,
    joint: Joint | None = None,
    progress: Progress = silent,
) -> Draped:
    """Drape a layout over a target in static equilibrium under its weight; see `drape`.

    Args:
        anchor: x, y of the point of the target under the layout's middle [m]; default: the target's highest point.

    Raises:
        InputError: the anchor lies outside the target.
    """
    top = anchor_point(target, anchor)
    grid = initial_grid(target, layout, anchor)
    mesh: GridMesh | None = None
    state: Floats | None = None
    levels, eccentricity = list[SolveReport](), joint.eccentricity if joint else 0.0
    edges = _edges(layout)
    for edge in edges:
        coarse, mesh = mesh, mesh_grid(grid, edge, marks=middle_marks(grid))
        start = placed_over(mesh, layout, top) if coarse is None or state is None else coarse.prolong(state, mesh)
        name = f"level {len(levels) + 1} of {len(edges)}"
        shell = Shell.of(mesh, rod, joint=joint)
        normals = node_normals(mesh, start) if shell.angles else None
        if eccentricity and normals is not None:
            _, start, normals = place_in_layers(mesh, start, normals, eccentricity)
        found, contact = _equilibrium(
            target, layout, rod, shell, start, normals, top,
            gravity=method.acceleration, cold=not levels, level=name, progress=progress,
        )  # fmt: skip
        levels.append(found.report)
        state = middle_surface(mesh, shell.mesh, shell.positions(found.state))
        if not found.report.converged:
            break
    assert mesh is not None
    assert state is not None
    inside = target.margin(state) > 0
    angle, where = smallest_joint_angle(mesh, state, inside)
    warnings = []
    if isinstance(target, Freeform):
        warnings.append(
            "a drape under gravity on a surface from a file is for study: rods sag, and leave the surface over its "
            'hollows; method "bound" follows it everywhere'
        )
    if levels[-1].status is Status.CONVERGED and levels[-1].negative_modes:
        warnings.append(
            f"the draped state is a saddle or near one ({levels[-1].negative_modes} negative modes): without friction "
            'the grid would slide away; the drape by method "bound" does not depend on this'
        )
    figures = DrapeFigures(
        max_gap=float(max(0.0, -target.contact(state).distance.min())),
        contact_pulls=int(np.count_nonzero(contact.multipliers < 0)),
        min_angle=angle,
        min_angle_at=where,
    )
    return Draped(
        method=method,
        target=target,
        layout=layout,
        rod=rod,
        anchor=anchor,
        eccentricity=eccentricity,
        mesh=mesh,
        positions=state,
        rods=grid.rods,
        levels=tuple(levels),
        figures=figures,
        warnings=tuple(warnings),
    )


def _edges(layout: GridLayout) -> list[float]:
    """Edge lengths of the levels, coarse to fine: the spacing, then finer by thirds down to the layout's edge."""
    edges = [min(layout.spacing)]
    while edges[-1] / REFINE > 1.5 * layout.edge:
        edges.append(edges[-1] / REFINE)
    return [*edges, layout.edge] if edges[-1] > 1.01 * layout.edge else [layout.edge]


def _held(shell: Shell, layout: GridLayout) -> Freedom:
    """The node nearest the middle held in x and y; the next joint along its rod held across the heading."""
    mesh = shell.mesh
    flat = mesh.flat[:, :2]
    joints = mesh.joint_nodes
    anchor = joints[np.argmin(np.linalg.norm(flat[joints], axis=1))]
    along = np.array([np.cos(layout.rotate), np.sin(layout.rotate), 0.0])
    apart = flat[joints] - flat[anchor]
    same = np.abs(apart[:, 1]) < 1e-9 * layout.spacing[0]
    ahead = np.where(same & (apart[:, 0] > 0), apart[:, 0], np.inf)
    neighbour = joints[np.argmin(ahead)]
    free = shell.freedom().with_directions(np.array([anchor]), (0.0, 0.0, 1.0))
    return free.with_directions(np.array([neighbour]), (along[0], along[1], 0.0), (0.0, 0.0, 1.0))


def _equilibrium(
    target: Target,
    layout: GridLayout,
    rod: Rod,
    shell: Shell,
    start: Floats,
    normals: Floats | None,
    top: Floats,
    *,
    gravity: float,
    cold: bool,
    level: str,
    progress: Progress,
) -> tuple[Equilibrium, UnilateralContact]:
    """Equilibrium on one mesh: Newton's method for given contact multipliers, which are then updated.

    start, normals : (n, 3) positions of the shell's nodes [m], and normals there where rods have directors.
    top : (3,) the point under the layout's middle [m].
    cold : whether the start is the flat grid.
    """
    mesh = shell.mesh
    nodes = np.arange(shell.node_count)
    load = np.zeros((len(shell.like), 3))
    load[nodes, 2] = -gravity * shell.mass[nodes, 2]
    weight = rod.mass_per_length * gravity
    longest = max(line.length for line in mesh.grid.rods)
    stiffness = np.full(len(nodes), weight * longest / (5e-3 * target.size))
    contact = UnilateralContact(target, nodes[:, None], stiffness, np.zeros(len(nodes)))
    supports = Supports(_held(shell, layout))
    state, forces, reports = shell.state(start, normals=normals), np.zeros(len(mesh.edges)), list[SolveReport]()
    for update in range(CONTACT_UPDATES):
        problem = Problem(
            (*shell.elements, contact),
            shell.stretch,
            supports,
            target.size,
            load=load,
            flat_coordinates=shell.flat_coordinates,
        )
        most = MOST_COLD if cold and update == 0 else MOST_WARM
        found = find_equilibrium(
            problem,
            state,
            forces,
            most_iterations=most,
            progress=_reporting(progress, f"gravity, {level}, contact {update + 1} of at most {CONTACT_UPDATES}", most),
        )
        state, forces = found.state, found.forces
        reports.append(found.report)
        depth = -float(target.contact(state[nodes]).distance.min())
        if not found.report.converged or depth < DEPTH * target.size:
            break
        contact = contact.updated(state)
    status = found.report.status
    if found.report.converged and depth >= DEPTH * target.size:
        status = Status.STALLED
    if not found.report.reason and lost_contact(mesh, shell.positions(state), layout, top, target):
        status = Status.LOST_CONTACT
    report = replace(found.report.after(*reports[:-1]), status=status)
    return replace(found, report=report), contact


def _reporting(progress: Progress, where: str, most: int) -> Callable[[int, float], None]:
    return lambda iteration, step: progress("drape", f"{where}, iteration {iteration} of at most {most}", step)


def anchor_point(target: Target, anchor: tuple[float, float] | None) -> Floats:
    """(3,) the point of the target under the layout's middle [m].

    Args:
        anchor: x, y [m]; default: the target's highest point.

    Raises:
        InputError: the anchor lies outside the target.
    """
    x, y = anchor if anchor is not None else target.summit
    top = target.lift(np.array([[x, y]]))[0]
    if target.margin(top[None])[0] <= 0:
        raise InputError(f"the anchor ({x:g}, {y:g}) m lies outside the target: choose a point inside its rim")
    return np.asarray(top)


def initial_grid(target: Target, layout: GridLayout, anchor: tuple[float, float] | None) -> FlatGrid:
    """The layout's flat grid; rods "auto" are the lines that the net finds on the target, lengths "auto" extend past
    the target's end.

    Args:
        anchor: x, y of the point under the layout's middle [m]; default: the target's highest point.

    Raises:
        NetLimitError: no net covers the target from this anchor and heading.
    """
    if layout.rods != "auto" and layout.length != "auto":
        return layout.flat_grid(layout.rods, layout.length)
    net = chebyshev_net(target, layout, anchor=anchor)
    rods = [rod for rod in net.rods if not rod.virtual]
    if layout.length != "auto":
        half = layout.length / 2
        return FlatGrid.of([rod.cut(*(layout.middle(rod) + end for end in (-half, half))) for rod in rods])
    overhang = OVERHANG * max(layout.spacing)
    return FlatGrid.of([rod.cut(rod.start - overhang, rod.end + overhang) for rod in rods])


def middle_marks(grid: FlatGrid) -> list[tuple[float, ...]]:
    """Stations [m] on each rod where every mesh has a node: where the axes cross, if the rod lies there."""
    return [(0.0,) if rod.offset == 0.0 and rod.start < 0.0 < rod.end else () for rod in grid.rods]


def placed_over(mesh: GridMesh, layout: GridLayout, top: Floats) -> Floats:
    """(n, 3) nodes of the flat grid turned to its heading, its middle at a point [m].

    Args:
        top: (3,) that point [m].
    """
    c, s = np.cos(layout.rotate), np.sin(layout.rotate)
    return np.asarray(mesh.flat @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + top)


def lost_contact(mesh: GridMesh, state: Floats, layout: GridLayout, top: Floats, target: Target) -> bool:
    """Whether the grid slid from its place on the target: the rod nearest the middle left its vertical plane.

    Args:
        state: (n, 3) of the mesh's nodes [m].
        top: (3,) the point under the layout's middle [m].
    """
    offsets = [float(np.dot(rod.across, rod.origin)) for rod in mesh.grid.rods]
    axis = int(np.argmin(np.abs(offsets)))
    c, s = np.cos(layout.rotate), np.sin(layout.rotate)
    (dx, dy), x = mesh.grid.rods[axis].across, state[mesh.nodes_of(axis)]
    inside = target.margin(x) > 0
    sideways = (x - top) @ np.array([c * dx - s * dy, s * dx + c * dy, 0.0]) - offsets[axis]
    return bool(np.abs(sideways[inside]).max(initial=0.0) > SLIPPED * target.size)
