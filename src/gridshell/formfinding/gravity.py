"""The gravity drape: static equilibrium of the user's rods under their weight, in unilateral contact.

From the flat grid, on nested meshes. One joint, the anchor, is held in x and y, and a neighbour keeps its
heading: without friction the draped grid would else slide or turn off at once. Even so the state may be a
saddle; the negative modes of its exact Hessian say so (numerics.md, section 4). Stretch makes its footprint
fall short of the inextensible net: that is physics, and grows with the weight over the stretch stiffness.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gridshell.contact.unilateral import UnilateralContact
from gridshell.errors import InputError
from gridshell.formfinding.draped import Draped, node_normals, smallest_joint_angle
from gridshell.formfinding.progress import Progress, silent
from gridshell.joints import Joint
from gridshell.layout import FlatGrid, GridLayout, GridMesh, mesh_grid
from gridshell.model import Freedom, Shell
from gridshell.nets import chebyshev_net
from gridshell.rods.section import Rod
from gridshell.solve.constraint import Supports
from gridshell.solve.mixed_newton import Equilibrium, Problem, find_equilibrium
from gridshell.solve.report import SolveReport, Status
from gridshell.targets import Target

Floats = NDArray[np.float64]

DEPTH = 1e-5  # of the size: deepest node inside the target
CONTACT_UPDATES = 12
OVERHANG = 4.0  # spacings that a rod of automatic length hangs over the target's end
REFINE = 3.0  # edge length from level to level
MOST_COLD, MOST_WARM = 300, 80
SLIPPED = 0.2  # of the size: a joint of the axes that has moved so far from its vertical plane has slid off


def gravity_drape(
    target: Target,
    layout: GridLayout,
    rod: Rod,
    *,
    anchor: tuple[float, float] | None = None,
    gravity: float = 9.81,
    joint: Joint | None = None,
    progress: Progress = silent,
) -> Draped:
    """Let `layout` fall on `target`; see `drape`."""
    if not gravity > 0:
        raise InputError(f"gravity must be positive, not {gravity} m/s2")
    x, y = anchor if anchor is not None else target.summit
    top = target.lift(np.array([[x, y]]))[0]
    if target.margin(top[None])[0] <= 0:
        raise InputError(f"the anchor ({x:g}, {y:g}) m lies outside the target: choose a point inside its rim")
    grid = _grid(target, layout, anchor)
    mesh: GridMesh | None = None
    state: Floats | None = None
    levels = list[SolveReport]()
    for edge in _edges(layout):
        coarse, mesh = mesh, mesh_grid(grid, edge, marks=_middle_marks(grid, layout))
        start = _over(mesh, layout, top) if coarse is None or state is None else coarse.prolong(state, mesh)
        name = f"level {len(levels) + 1}"
        shell = Shell.of(mesh, rod, joint=joint)
        found, contact = _settle(target, layout, rod, shell, start, top, gravity, len(levels) == 0, name, progress)
        levels.append(found.report)
        state = shell.positions(found.state)
        if not found.report.converged:
            break
    assert mesh is not None
    assert state is not None
    inside = target.margin(state) > 0
    angle, where = smallest_joint_angle(mesh, state, inside)
    warnings = []
    if levels[-1].negative_modes:
        warnings.append(
            f"the draped state is a saddle or near one ({levels[-1].negative_modes} negative modes): without friction "
            'the grid would slide off; method "bound" does not depend on this'
        )
    return Draped(
        method="gravity",
        target=target,
        layout=layout,
        rod=rod,
        mesh=mesh,
        positions=state,
        rods=grid.rods,
        levels=tuple(levels),
        max_gap=float(max(0.0, -target.contact(state).distance.min())),
        pulls=int(np.count_nonzero(contact.multipliers < 0)),
        min_angle=angle,
        min_angle_at=where,
        own_ends=None,
        anchor=anchor,
        gravity=gravity,
        net=None,
        warnings=tuple(warnings),
    )


def _grid(target: Target, layout: GridLayout, anchor: tuple[float, float] | None) -> FlatGrid:
    """The layout's grid; "auto" takes the lines that the net finds on the target, and lengths that hang over."""
    if layout.rods != "auto" and layout.length != "auto":
        return layout.flat_grid(layout.rods, layout.length)
    net = chebyshev_net(target, layout, anchor=anchor)
    rods = [rod for rod in net.rods if not rod.virtual]
    if layout.length != "auto":
        half = layout.length / 2
        return FlatGrid.of([rod.cut(*(layout.middle(rod.family) + end for end in (-half, half))) for rod in rods])
    over = OVERHANG * max(layout.spacing)
    return FlatGrid.of([rod.cut(rod.start - over, rod.end + over) for rod in rods])


def _edges(layout: GridLayout) -> list[float]:
    """Edge lengths of the levels, coarse to fine: the spacing, then finer by thirds down to the layout's edge."""
    edges = [min(layout.spacing)]
    while edges[-1] / REFINE > 1.5 * layout.edge:
        edges.append(edges[-1] / REFINE)
    return [*edges, layout.edge] if edges[-1] > 1.01 * layout.edge else [layout.edge]


def _middle_marks(grid: FlatGrid, layout: GridLayout) -> list[tuple[float, ...]]:
    """A node where the axes cross, if a rod lies there, on every level."""
    return [(0.0,) if rod.offset == 0.0 and rod.start < 0.0 < rod.end else () for rod in grid.rods]


def _over(mesh: GridMesh, layout: GridLayout, top: Floats) -> Floats:
    """The flat grid turned to its heading, touching the target at the anchor from above."""
    c, s = np.cos(layout.rotate), np.sin(layout.rotate)
    return mesh.flat @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + top


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


def _settle(
    target: Target,
    layout: GridLayout,
    rod: Rod,
    shell: Shell,
    start: Floats,
    top: Floats,
    gravity: float,
    cold: bool,
    name: str,
    progress: Progress,
) -> tuple[Equilibrium, UnilateralContact]:
    """Equilibrium on one mesh: Newton's method for given contact multipliers, which are then updated."""
    mesh = shell.mesh
    nodes = np.arange(shell.node_count)
    load = np.zeros((len(shell.like), 3))
    load[nodes, 2] = -gravity * shell.mass[nodes, 2]
    weight = rod.mass_per_length * gravity
    longest = max(line.length for line in mesh.grid.rods)
    stiffness = np.full(len(nodes), weight * longest / (5e-3 * target.size))
    contact = UnilateralContact(target, nodes[:, None], stiffness, np.zeros(len(nodes)))
    supports = Supports(_held(shell, layout))
    normals = node_normals(mesh, start) if shell.angles else None
    state, forces, reports = shell.state(start, normals=normals), np.zeros(len(mesh.edges)), list[SolveReport]()
    for update in range(CONTACT_UPDATES):
        problem = Problem(
            (*shell.elements, contact), shell.stretch, supports, target.size, load=load, places=shell.places
        )
        found = find_equilibrium(
            problem,
            state,
            forces,
            descend=update == 0,
            most_iterations=MOST_COLD if cold and update == 0 else MOST_WARM,
            progress=_telling(progress, f"gravity, {name}, contact {update + 1}"),
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
    if _slid_off(mesh, shell.positions(state), layout, top, target):
        status = Status.SLID_OFF
    report = replace(found.report.after(*reports[:-1]), status=status)
    return replace(found, report=report), contact


def _telling(progress: Progress, where: str) -> Callable[[int, float], None]:
    return lambda iteration, step: progress("drape", f"{where}, iteration {iteration}", step)


def _slid_off(mesh: GridMesh, state: Floats, layout: GridLayout, top: Floats, target: Target) -> bool:
    """Whether the rod nearest the heading's axis has left the vertical plane that symmetry would keep it in."""
    rods = [k for k, rod in enumerate(mesh.grid.rods) if rod.family == "u"]
    axis = min(rods, key=lambda k: abs(mesh.grid.rods[k].offset))
    across = np.array([-np.sin(layout.rotate), np.cos(layout.rotate), 0.0])
    x = state[mesh.nodes_of(axis)]
    inside = target.margin(x) > 0
    sideways = (x - top) @ across - mesh.grid.rods[axis].offset
    return bool(np.abs(sideways[inside]).max(initial=0.0) > SLIPPED * target.size)
