"""The bound drape: march the net, then bind the elastic grid to the target (docs/theory.md, The bound drape).

Every node slides on the target without friction, rods do not stretch, and bending alone determines what the net
leaves open: the shape of each span between its joints. No load and no stretch stiffness enter, so that the
result does not depend on scale or material. The axes and the anchor are held, as the net holds them. The solve starts
from the net's lines with their ends corrected, close to the final rods.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import degrees

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.contact.static import BoundToTarget
from rodshell.formfinding.finite_sections import strong_bending, thickness_warnings
from rodshell.formfinding.methods import Bound, Draped, DrapeFigures
from rodshell.geometry.frames import dot, unit
from rodshell.joints import Joint
from rodshell.kernels import njit
from rodshell.layout import FlatRod, GridLayout, GridMesh, mesh_grid
from rodshell.layout.flatgrid import whole_rods
from rodshell.layout.mesh import entries_along
from rodshell.model import Shell
from rodshell.nets import ChebyshevNet, chebyshev_net
from rodshell.nets.apron import with_apron
from rodshell.progress import Progress, silent
from rodshell.rods.elements import Stretch
from rodshell.rods.section import GivenSection, Rod
from rodshell.solve.equilibrium import MOST_ITERATIONS, STRAIN_TOLERANCE, Equilibrium, SolveReport, find_equilibrium
from rodshell.solve.path import going_on
from rodshell.solve.problem import Problem
from rodshell.targets import Target

CLEARANCE = 0.2  # edges between a rod's end and the next joint past it
WARN_ANGLE = 25.0  # degrees
MOST_SOLVES = 3  # of a drape in layers; the second leaves strains of 1e-8
PENALTY, LEAST_PENALTY = 8e4, 4e5 / 0.15**3  # forces converge by a factor of 0.05 a step at 200 rods
STEEP = 0.5  # rad: where a line turns by more in its last span, beam theory does not hold and its rod stays on it


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

    Parameters
    ----------
    anchor : x, y of the point of the target under the layout's middle [m]; default: the target's highest point.
    warm_start : a grid draped before, whose net is the first guess of the new net.
    joint : its eccentricity places the rods in two layers, and it may hold rods against rolling.

    Raises
    ------
    NetLimitError : no net covers the target from this anchor and heading.
    """
    progress("net", "marching", 0.0)
    eccentricity = joint.eccentricity if joint else 0.0
    near = warm_start.net if warm_start else None
    net = chebyshev_net(target, layout, anchor=anchor, warm_start=near, eccentricity=eccentricity)
    grid = with_apron(net.rods, net.net, net.lines, CLEARANCE * layout.edge)
    whole = whole_rods(grid.rods, net.rods)
    marks: list[list[float]] = [[] for _ in grid.rods]
    for rod_of, piece in zip(whole.tolist(), net.rods, strict=True):
        marks[rod_of] += (piece.start, piece.end)
    mesh = mesh_grid(grid, layout.edge, marks=marks)
    on_rods = entries_along(mesh, net.rods, whole)
    start = net.node_positions(mesh)
    rod_within = _within_surface(rod)
    shell, corrected = Shell.of(mesh, rod_within), corrected_ends(target, mesh, start)
    problem = Problem(
        elements=shell.elements,
        stretch=_penalty(shell.stretch, rod_within, target),
        constraint=_bind(target, mesh, start),
        length=target.size,
        inextensible=True,
        flat_coordinates=shell.flat_coordinates,
    )
    found = _in_layers(
        problem, target, mesh, corrected, eccentricity,
        progress=lambda k, step: progress("drape", f"bound, iteration {k} of at most {MOST_ITERATIONS}", step),
    )  # fmt: skip
    touching = np.zeros(mesh.node_count, dtype=bool)
    touching[mesh.rod_nodes[on_rods[1]]] = True
    on_target = np.flatnonzero(touching)
    value, gradient = target.level(found.state)
    steep = np.sqrt(dot(gradient, gradient))
    normal = gradient / steep[:, None]
    pull = dot(normal, found.gradient)[on_target]  # force of the target along the outward normal [N]
    warnings = [*target.warnings, *net.warnings]
    strong = None
    if joint and joint.holds_normals:
        bends = np.asarray(touching[mesh.bends].all(axis=1))
        strong = strong_bending(target, mesh, found.state, bends, rod)
    if strong is not None:
        warnings += strong.warnings
    if not eccentricity:
        edges = np.asarray(touching[mesh.edges].all(axis=1))
        warnings += thickness_warnings(normal, mesh, found.state, edges, rod, min(layout.spacing))
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
    figures = DrapeFigures(
        max_gap=float(np.abs(value / steep)[on_target].max()),  # to first order
        contact_pulls=int(np.count_nonzero(pull < -1e-6 * np.abs(pull).max(initial=0.0))),
        min_angle=net.min_angle,
        min_angle_at=net.min_angle_at,
        net_deviation=_net_deviation(target, mesh, net.rods, whole, on_rods, found.state),
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
        levels=(found.report,),
        figures=figures,
        net=net,
        warnings=tuple(warnings),
    )


def _within_surface(rod: Rod) -> Rod:
    """The rod with EI2 in all directions.

    Out of the surface the rods follow its curvature; only their bending within it is free, towards m2, the first
    director being the normal. So the twist angles are left out, as for a round rod.
    """
    within = rod.bend_stiffnesses[1]
    return Rod(GivenSection(rod.stretch_stiffness, within, within, rod.twist_stiffness))


def _penalty(stretch: Stretch, rod: Rod, target: Target) -> Stretch:
    """Edges as a penalty: stiff enough to outweigh bending, which grows with the square of the size over the edge."""
    weight = max(LEAST_PENALTY, PENALTY * (target.size / float(np.median(stretch.rest_lengths))) ** 2)
    stiffness = weight * rod.bend_stiffness / target.size**2
    return Stretch.elastic(stretch.blocks, stretch.rest_lengths, np.full(len(stretch.blocks), stiffness))


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
    above = 0.5 * eccentricity * np.array([1.0 if rod.family == "v" else -1.0 for rod in mesh.grid.rods])
    normal, (a, b) = target.on_surface(positions).normal, mesh.edges.T
    chord = positions[b] - positions[a]
    in_layer = chord + above[mesh.edge_rods, None] * (normal[b] - normal[a])
    return np.asarray(mesh.edge_lengths * np.sqrt(dot(chord, chord) / dot(in_layer, in_layer)))


def _bind(target: Target, mesh: GridMesh, start: Floats) -> BoundToTarget:
    """All nodes on the target; those of the two axes are held on their lines, and the anchor at its point."""
    count = np.full(mesh.node_count, 2, dtype=np.intp)
    guides = np.tile([1.0, 0.0, 0.0], (mesh.node_count, 1))
    guides[np.abs(unit(target.level(start)[1])[:, 0]) > 0.7] = [0.0, 1.0, 0.0]
    for k, line in enumerate(mesh.grid.rods):
        if line.offset == 0.0:
            nodes = mesh.nodes_of(k)
            count[nodes] -= 1
            guides[nodes] = np.gradient(start[nodes], axis=0)
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
    target: Target,
    mesh: GridMesh,
    rods: Sequence[FlatRod],
    whole: Ints,
    on_rods: tuple[Ints, Ints],
    positions: Floats,
) -> Floats:
    """(k, 2) how far past both ends of each rod that is built this state crosses the target's end, along the rod [m].

    Parameters
    ----------
    rods, whole : as cut by the net, and the rod of the mesh that each belongs to.
    on_rods : see `entries_along`.
    positions : (n, 3) of the mesh's nodes [m].
    """
    rod, entry = on_rods
    starts = np.searchsorted(rod, np.arange(len(rods) + 1))
    nodes = entry[np.column_stack([starts[:-1], starts[1:] - 1])]  # those at both ends
    ends = np.array([(piece.start, piece.end) for piece in rods])
    built = np.flatnonzero([not piece.virtual for piece in rods])
    nodes, ends, whole = nodes[built].ravel(), ends[built].ravel(), np.repeat(whole[built], 2)
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


def shape_of_net(net: ChebyshevNet) -> dict[str, object]:
    """Key figures of a net for the result file: its error [m], and its smallest angle and where that is [m].

    Parameters
    ----------
    net : a marched net.
    """
    return {
        "error_estimate": net.error_estimate,
        "min_angle_deg": degrees(net.min_angle),
        "min_angle_at": list(net.min_angle_at),
    }


def corrected_ends(target: Target, mesh: GridMesh, points: Floats) -> Floats:
    """(n, 3) the nodes, moved sideways on the target to where rods would lie, to first order [m].

    A line of the net is curved up to its end, while a rod's bending moment vanishes there (the natural boundary
    condition). This hardly moves the joints: between them each rod differs from its line by a cubic spline that
    vanishes at the joints, and whose end moments cancel the line's geodesic curvature. By beam theory, to first order;
    the correction decays by the factor 2 - sqrt(3) = 0.27 from joint to joint, as cubic splines do (docs/theory.md, The
    bound drape). The axes stay: they are geodesics, and the drape holds them on their lines.

    Parameters
    ----------
    target : the surface.
    mesh : of the net's lines.
    points : (n, 3) its nodes on the net's lines [m].
    """
    joint = np.zeros(mesh.node_count, dtype=bool)
    joint[mesh.joint_nodes] = True
    normal = unit(target.level(points)[1])
    result = points.copy()
    rods = np.flatnonzero([rod.offset != 0.0 for rod in mesh.grid.rods])
    _correct(points, normal, mesh.rod_nodes, mesh.rod_start[rods], mesh.rod_stop[rods], mesh.stations, joint, result)
    return target.retract(result)


@njit(error_model="numpy")
def _correct(points, normal, rod_nodes, rod_start, rod_stop, stations, joint, result):  # type: ignore[no-untyped-def]
    for rod in range(len(rod_start)):
        nodes, s = rod_nodes[rod_start[rod] : rod_stop[rod]], stations[rod_start[rod] : rod_stop[rod]]
        at = np.flatnonzero(joint[nodes])
        if len(at) < 2 or len(nodes) < 5:
            continue
        side = _sideways(points, normal, nodes)
        curvature = _curvature(points, nodes, s, side)
        first, last = curvature[at[0]], curvature[at[-1]]
        if max(abs(first) * (s[at[1]] - s[at[0]]), abs(last) * (s[at[-1]] - s[at[-2]])) > STEEP:
            continue
        moments = _moments(s[at], -first, -last)
        for span in range(len(at) - 1):
            a, b = at[span], at[span + 1]
            h = s[b] - s[a]
            for k in range(a + 1, b):
                x, y = (s[b] - s[k]) / h, (s[k] - s[a]) / h
                shift = h * h / 6.0 * (moments[span] * (x**3 - x) + moments[span + 1] * (y**3 - y))
                _shift(result, nodes[k], shift, side, k)
        for end, inner, stop, step in ((0, 1, -1, -1), (len(at) - 1, len(at) - 2, len(nodes), 1)):
            begin, h = at[end], abs(s[at[end]] - s[at[inner]])
            slope = h / 6.0 * (2.0 * moments[end] + moments[inner])
            for k in range(begin + step, stop, step):  # past the last joint the rod is straight
                far = abs(s[k] - s[begin])
                _shift(result, nodes[k], far * (slope + 0.5 * far * moments[end]), side, k)


@njit()
def _shift(result, node, shift, side, k):  # type: ignore[no-untyped-def]
    for i in range(3):
        result[node, i] += shift * side[k, i]


@njit(error_model="numpy")
def _sideways(points, normal, nodes):  # type: ignore[no-untyped-def]
    """(n, 3) unit vectors in the surface across a rod."""
    side, last = np.empty((len(nodes), 3)), len(nodes) - 1
    for k in range(len(nodes)):
        a, b, n, square = points[nodes[max(k - 1, 0)]], points[nodes[min(k + 1, last)]], normal[nodes[k]], 0.0
        for i in range(3):
            m, p = (i + 1) % 3, (i + 2) % 3
            side[k, i] = n[m] * (b[p] - a[p]) - n[p] * (b[m] - a[m])
            square += side[k, i] ** 2
        for i in range(3):
            side[k, i] /= np.sqrt(square)
    return side


@njit(error_model="numpy")
def _curvature(points, nodes, s, side):  # type: ignore[no-untyped-def]
    """(n,) geodesic curvature towards `side` by three nodes [1/m], extrapolated to the ends."""
    curvature = np.empty(len(nodes))
    for k in range(1, len(nodes) - 1):
        before, after, curvature[k] = s[k] - s[k - 1], s[k + 1] - s[k], 0.0
        for i in range(3):
            turn = (points[nodes[k + 1], i] - points[nodes[k], i]) / after
            turn -= (points[nodes[k], i] - points[nodes[k - 1], i]) / before
            curvature[k] += 2.0 * turn / (before + after) * side[k, i]
    for end, k, step in ((0, 1, 1), (len(nodes) - 1, len(nodes) - 2, -1)):
        rate = (curvature[k + step] - curvature[k]) / (s[k + step] - s[k])
        curvature[end] = curvature[k] + rate * (s[end] - s[k])
    return curvature


@njit(error_model="numpy")
def _moments(s, first, last):  # type: ignore[no-untyped-def]
    """(n,) second derivatives of the cubic spline that vanishes at `s` (n,), given those at its ends."""
    moments, share = np.zeros(len(s)), np.zeros(len(s))
    moments[0], moments[-1] = first, last
    for k in range(1, len(s) - 1):
        before, after = s[k] - s[k - 1], s[k + 1] - s[k]
        pivot = 2.0 * (before + after) - before * share[k - 1]
        share[k] = after / pivot
        moments[k] = -before * moments[k - 1] / pivot
    for k in range(len(s) - 2, 0, -1):
        moments[k] -= share[k] * moments[k + 1]
    return moments
