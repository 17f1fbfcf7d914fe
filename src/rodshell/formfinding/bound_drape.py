"""The bound drape: march the net, then bind the elastic grid to the target (docs/theory/drape.md, The bound drape).

Every node slides on the target without friction, rods do not stretch, and bending alone determines what the net
leaves open: the shape of each span between its joints. Out of the surface the rods follow its curvature; their
bending within it, about the normal, has EI2, and twist angles are left out as for a round rod. No load and no stretch
stiffness enter, so that the result does not depend on scale or material. The axes and the anchor are held, as the net
holds them, and so are the ends of rods across their lines: rods that cross no axis would slide, by a spacing. The solve
starts from the net's lines, close to the final rods.
"""

from collections.abc import Callable
from dataclasses import replace
from math import degrees

import numpy as np

from rodshell.arrays import Floats, Ints, NodePositions
from rodshell.contact.static import BoundToTarget
from rodshell.formfinding.finite_sections import strong_bending, thickness_warnings
from rodshell.formfinding.methods import Bound, Draped, DrapeFigures
from rodshell.geometry.frames import dot, unit
from rodshell.joints import Joint
from rodshell.kernels import njit
from rodshell.layout import GridLayout, GridMesh, mesh_grid
from rodshell.layout.flatgrid import sides
from rodshell.layout.mesh import spans_along
from rodshell.nets import chebyshev_net
from rodshell.nets.apron import with_apron
from rodshell.progress import Progress, silent
from rodshell.rods.elements import Stretch
from rodshell.rods.isotropic import IsotropicBend
from rodshell.rods.section import Rod
from rodshell.solve.equilibrium import MOST_ITERATIONS, STRAIN_TOLERANCE, Equilibrium, SolveReport, find_equilibrium
from rodshell.solve.path import going_on
from rodshell.solve.problem import Problem
from rodshell.targets import Target

CLEARANCE = 0.2  # edges between a rod's end and the next joint past it
HOLDS = (0.1, 0.5, np.inf)  # edges from a rod's end that is held to any node, at least: the first that converges
WARN_ANGLE = 25.0  # degrees
MOST_SOLVES = 3  # of a drape in layers; the second leaves strains of 1e-8
PENALTY, LEAST_PENALTY = 8e4, 4e5 / 0.15**3  # forces converge by a factor of 0.05 a step at 200 rods


def bound_drape(
    target: Target,
    layout: GridLayout,
    rod: Rod,
    *,
    anchor: tuple[float, float] | None = None,
    warm_start: Draped | None = None,
    joint: Joint | None = None,
    progress: Progress = silent,
) -> Draped:
    """Drape a layout over a target by its net; see `drape`.

    Args:
        anchor: x, y of the point of the target under the layout's middle [m]; default: the target's highest point.
        warm_start: a grid draped before, whose net is the first guess of the new net.
        joint: its eccentricity places the rods in two layers, and it may hold rods against rolling.

    Raises:
        NetLimitError: no net covers the target from this anchor and heading.
    """
    eccentricity = joint.eccentricity if joint else 0.0
    near = warm_start.net if warm_start else None
    net = chebyshev_net(target, layout, anchor=anchor, warm_start=near, eccentricity=eccentricity, progress=progress)
    grid, whole = with_apron(net.rods, net.net, net.lines, CLEARANCE * layout.edge)
    marks: list[list[float]] = [[] for _ in grid.rods]
    for rod_of, piece in zip(whole.tolist(), net.rods, strict=True):
        marks[rod_of] += (piece.start, piece.end)
    mesh = mesh_grid(grid, layout.edge, marks=marks)
    ends = np.array([(piece.start, piece.end) for piece in net.rods])
    spans = spans_along(mesh, ends, whole)
    start = net.node_positions(mesh)
    normal = unit(target.level(start)[1])
    within = rod.bend_stiffnesses[1]
    tried = list[SolveReport]()
    for hold in HOLDS:
        problem = Problem(
            elements=(IsotropicBend(mesh.bends, within / mesh.voronoi_lengths),),
            stretch=_penalty(mesh, within, target),
            constraint=_bind(target, mesh, start, normal, spans, hold),
            length=target.size,
            inextensible=True,
            flat_coordinates=mesh.flat[:, :2],
        )
        found = _in_layers(
            problem, target, mesh, start, eccentricity,
            progress=lambda k, step: progress("drape", f"bound, iteration {k} of at most {MOST_ITERATIONS}", step),
        )  # fmt: skip
        tried.append(found.report)
        if found.report.converged or found.report.reason:  # or out of time
            break
    touching = np.zeros(mesh.node_count, dtype=bool)
    _mark(spans, mesh.rod_nodes, touching)
    on_target = np.flatnonzero(touching)
    value, gradient = target.level(found.state)
    steep = np.sqrt(dot(gradient, gradient))
    normal = unit(gradient)
    pull = dot(normal, found.gradient)[on_target]  # force of the target along the outward normal [N]
    warnings = [*target.warnings, *net.warnings]
    strong = None
    if joint and joint.holds_normals:
        strong = strong_bending(target, mesh, found.state, touching, rod)
    if strong is not None:
        warnings += strong.warnings
    if not eccentricity:
        warnings += thickness_warnings(normal, mesh, found.state, touching, rod, min(layout.spacing))
    if found.report.negative_modes:
        warnings.append(
            f"the drape is not a minimum of the bound grid's energy ({found.report.negative_modes} negative modes): "
            "use a smaller spacing"
        )
    if not (found.report.stable or found.report.reason):
        warnings += _tightest_bend(target, layout, found.state[on_target])
    if degrees(net.min_angle) < WARN_ANGLE:
        x, y, z = net.min_angle_at
        warnings.append(
            f"the families meet at only {degrees(net.min_angle):.1f} degrees near ({x:.4g}, {y:.4g}, {z:.4g}) m: "
            "the joints there nearly close; another anchor or heading, a smaller part or a seam may open them"
        )
    built = np.flatnonzero([not piece.virtual for piece in net.rods])
    figures = DrapeFigures(
        max_gap=float(np.abs(value / steep)[on_target].max()),  # to first order
        contact_pulls=int(np.count_nonzero(pull < -1e-6 * np.abs(pull).max(initial=0.0))),
        min_angle=net.min_angle,
        min_angle_at=net.min_angle_at,
        net_deviation=_net_deviation(target, mesh, ends[built], whole[built], spans[built], found.state),
        strong_bending=strong,
    )
    return Draped(
        method=Bound(),
        target=target,
        layout=layout,
        rod=rod,
        anchor=anchor,
        eccentricity=eccentricity,
        mesh=mesh,
        positions=found.state,
        rods=tuple(line for line in net.rods if not line.virtual),
        levels=(found.report.after(*tried[:-1]),),
        figures=figures,
        net=net,
        warnings=tuple(warnings),
    )


@njit("i2 i1 b1")
def _mark(spans, rod_nodes, marked):  # type: ignore[no-untyped-def]
    """Mark the nodes of the pieces of rods whose first and last entry of `rod_nodes` are `spans` (m, 2)."""
    for piece in range(len(spans)):
        for k in range(spans[piece, 0], spans[piece, 1] + 1):
            marked[rod_nodes[k]] = True


def _penalty(mesh: GridMesh, bend_stiffness: float, target: Target) -> Stretch:
    """Edges as a penalty: stiff enough to outweigh bending, which grows with the square of the size over the edge."""
    weight = max(LEAST_PENALTY, PENALTY * (target.size / float(mesh.edge_lengths.mean())) ** 2)
    stiffness = weight * bend_stiffness / target.size**2
    return Stretch.elastic(mesh.edges, mesh.edge_lengths, np.full(len(mesh.edges), stiffness))


def _in_layers(
    problem: Problem,
    target: Target,
    mesh: GridMesh,
    start: Floats,
    eccentricity: float,
    progress: Callable[[int, float], None],
) -> Equilibrium:
    """Equilibrium on the target of rods that keep their lengths in their own layers.

    It is solved again where edges moved sideways to places of another curvature, which changes their lengths.
    """
    state, forces, reports = start, np.zeros(len(mesh.edges)), list[SolveReport]()
    while True:
        if eccentricity:
            lengths = _between_layers(target, mesh, state, eccentricity)
            problem = replace(problem, stretch=replace(problem.stretch, rest_lengths=lengths))
        found = find_equilibrium(problem, state, forces, progress=progress)
        state, forces = found.state, found.forces
        reports.append(found.report)
        strain = 0.0
        if eccentricity:
            strain = float(np.abs(_between_layers(target, mesh, state, eccentricity) / lengths - 1.0).max())
        if strain < STRAIN_TOLERANCE or not found.report.converged or len(reports) == MOST_SOLVES:
            return replace(found, report=found.report.after(*reports[:-1]))
        problem = going_on(problem, found)


def _between_layers(target: Target, mesh: GridMesh, positions: Floats, eccentricity: float) -> Floats:
    """(e,) rest lengths on the target of edges whose rods lie in two layers, near `positions` (n, 3) [m].

    The difference in length between the layers' chords depends on the target's curvature along them.
    """
    above = 0.5 * eccentricity * sides(mesh.grid)
    normal, (a, b) = target.on_surface(positions).normal, mesh.edges.T
    chord = positions[b] - positions[a]
    in_layer = chord + above[mesh.edge_rods, None] * (normal[b] - normal[a])
    return np.asarray(mesh.edge_lengths * np.sqrt(dot(chord, chord) / dot(in_layer, in_layer)))


def _bind(target: Target, mesh: GridMesh, start: Floats, normal: Floats, spans: Ints, hold: float) -> BoundToTarget:
    """All nodes on the target; those of the two axes, and the ends of rods, move only along the net's lines, and the
    anchor does not move. An end closer than `hold` edges to another node is left to that, since it would be a lever.

    Args:
        start, normal: (n, 3) nodes of the net [m], and the target's normals there.
        spans: (m, 2) see `spans_along`.
    """
    count, guides = np.full(mesh.node_count, 2, dtype=np.intp), np.zeros((mesh.node_count, 3))
    guides[:, 1] = np.abs(normal[:, 0]) > 0.7
    guides[:, 0] = 1.0 - guides[:, 1]
    held = np.array([rod.offset == 0.0 for rod in mesh.grid.rods])[mesh.rod_of]
    apart = np.abs(np.diff(mesh.stations))
    nearest = np.minimum(np.append(np.inf, apart), np.append(apart, np.inf))
    held[spans] |= nearest[spans] > hold * np.median(mesh.edge_lengths)
    entries, rods = np.flatnonzero(held), mesh.rod_of[held]
    before, after = np.maximum(entries - 1, mesh.rod_start[rods]), np.minimum(entries + 1, mesh.rod_stop[rods] - 1)
    nodes = mesh.rod_nodes[entries]
    guides[nodes] = start[mesh.rod_nodes[after]] - start[mesh.rod_nodes[before]]
    np.subtract.at(count, nodes, 1)
    return BoundToTarget(target, count, guides)


def _tightest_bend(target: Target, layout: GridLayout, points: Floats) -> list[str]:
    """A warning where the target curves too sharply for the spacing, which stops a bound drape that has a net."""
    curvature = np.abs(np.linalg.eigvalsh(target.on_surface(points).hessian)).max(axis=1)
    k = int(np.argmax(curvature))
    radius, (x, y, z) = 1.0 / curvature[k], np.where(np.abs(points[k]) < 1e-6 * target.size, 0.0, points[k])
    if radius > 2 * max(layout.spacing):
        return []
    return [
        f"near ({x:.4g}, {y:.4g}, {z:.4g}) m the target's radius of curvature is {radius:.3g} m, the spacing "
        f"{max(layout.spacing):.3g} m: use a spacing below half of that radius"
    ]


def _net_deviation(
    target: Target, mesh: GridMesh, ends: Floats, whole: Ints, spans: Ints, positions: NodePositions
) -> Floats:
    """(k, 2) how far past both ends of each rod that is built this state crosses the target's end, along the rod [m].

    Args:
        ends, whole: (k, 2), (k,) of rods as cut by the net [m], and the rod of the mesh that each belongs to.
        spans: (k, 2) see `spans_along`.
    """
    nodes, ends, whole = spans.ravel(), ends.ravel(), np.repeat(whole, 2)
    first, last = mesh.rod_start[whole], mesh.rod_stop[whole] - 1
    window = np.maximum(np.minimum(nodes - (mesh.stations[nodes] >= ends), last - 2), first)
    three = np.minimum(window + np.arange(3)[:, None], last)
    x = mesh.stations[three] - ends
    f = target.margin(positions[mesh.rod_nodes[three.ravel()]]).reshape(3, -1)
    slope = (f[1] - f[0]) / (x[1] - x[0])  # Newton's parabola through three nodes
    bend = np.zeros_like(slope)
    bent = x[2] > x[1]
    bend[bent] = ((f[2] - f[1])[bent] / (x[2] - x[1])[bent] - slope[bent]) / (x[2] - x[0])[bent]
    ahead = (f[0] - x[0] * slope + x[0] * x[1] * bend) / ((x[0] + x[1]) * bend - slope)
    return np.asarray(ahead.reshape(-1, 2) * [-1.0, 1.0])
