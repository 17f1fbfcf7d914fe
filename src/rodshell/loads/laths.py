"""A third layer of laths along the diagonals of an erected shell's cells: rods that bend, not struts.

Each lath is laid over the joints of a continuous line of diagonals, from end to end straight when it was cut. It is
bent to the shell, and springs back against it: its own stiffness pulls the shell, until both are in equilibrium. It is
laid without axial force, its ends are free, and at each joint it is held over the crossing at its distance from the
outer layer, free to turn there as on a bolt. Between joints it can buckle: it has nodes there.
"""

from dataclasses import replace
from math import ceil

import numpy as np
from scipy.interpolate import CubicSpline

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.formfinding.finite_sections import joint_normals
from rodshell.joints.standoff import Standoffs
from rodshell.layout import FlatGrid, FlatRod, GridMesh, mesh_grid
from rodshell.layout.cells import flat_joints, lines
from rodshell.layout.flatgrid import Crossings
from rodshell.loads.bracing import braced_diagonals, outer_nodes
from rodshell.loads.settings import Laths
from rodshell.loads.structure import LathLayer, Structure
from rodshell.model import Freedom, Shell
from rodshell.model.shell import OFFSET_STIFFNESS
from rodshell.rods.elements import Elements, Stretch
from rodshell.solve.equilibrium import find_stable
from rodshell.solve.problem import Supports
from rodshell.targets import Target

FINEST = 8  # edges from joint to joint, at most as many as the grid's rods have
SAMPLES = 32  # of a lath's curve from joint to joint, for its length


def laid(laths: Laths, structure: Structure, target: Target) -> Structure:
    """The structure with its laths laid, in the equilibrium that both find.

    Raises:
        InputError: a lath crosses an opening of the target; no stable equilibrium of both is found; the laths have no
            rod.
    """
    mesh, before = structure.mesh, structure.equilibrium
    if laths.rod is None:
        raise InputError("these laths have no rod of their own: give one, such as that of the grid")
    pairs = braced_diagonals(laths, structure, target)
    rows = lines(pairs, flat_joints(mesh.grid))
    normals = joint_normals(mesh, structure.positions(before))
    over = before.state[outer_nodes(mesh)] + laths.eccentricity * normals
    of_laths, positions, tilts, entries, crossings = _laid_over(rows, over, normals, np.median(mesh.edge_lengths))
    shell = Shell.of(of_laths, laths.rod)
    blocks = structure.size + np.arange(len(shell.like))
    if not laths.eccentricity:
        joints = of_laths.rod_nodes[entries]
        blocks[joints] = outer_nodes(mesh)[crossings]
        kept = np.setdiff1d(np.arange(len(blocks)), joints)
        blocks[kept] = structure.size + np.arange(len(kept))
    layer = LathLayer(shell, blocks, laths.rod, entries, crossings)
    ties = _ties(structure, layer, laths.eccentricity) if laths.eccentricity else ()
    return _joined(structure, layer, shell.state(positions, normals=tilts), ties)


def _laid_over(
    rows: list[list[int]], joints: Floats, normals: Floats, edge: float
) -> tuple[GridMesh, Floats, Floats, Ints, Ints]:
    """Laths over the crossings `rows` at `joints` (c, 3) [m] with `normals` (c, 3), of edges about as long as `edge`.

    Returns:
        The mesh, each lath straight and free of stress; (n, 3) positions and normals of its nodes, bent over the
        joints; entries of its `rod_nodes` at joints, and which crossing each of them is at.
    """
    rods, marks, curves = list[FlatRod](), list[Floats](), []
    digits = len(str(len(rows)))
    for k, row in enumerate(rows):
        points = joints[row]
        chord = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        curve = CubicSpline(chord, points, bc_type="natural")  # its ends are free
        fine = np.interp(np.arange(SAMPLES * (len(row) - 1) + 1) / SAMPLES, np.arange(len(row)), chord)
        along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curve(fine), axis=0), axis=1)))
        at = np.interp(chord, fine, along)
        rods.append(FlatRod(f"B{k + 1:0{digits}d}", "free", None, 0.0, float(at[-1]), (0.0, float(k)), (1.0, 0.0)))
        marks.append(at)
        curves.append((curve, fine, along, chord, normals[row]))
    spans = np.concatenate([np.diff(at) for at in marks])
    longest = max(edge, float(spans.max()) / FINEST)
    spans_edge = float(spans.max()) / ceil(float(spans.max()) / longest)
    grid = FlatGrid(tuple(rods), Crossings(np.empty((0, 2), dtype=np.intp), np.empty((0, 2))))
    mesh = mesh_grid(grid, spans_edge, marks=[at[1:-1].tolist() for at in marks])
    positions, bent = np.empty((mesh.node_count, 3)), np.empty((mesh.node_count, 3))
    entries, crossings = list[int](), list[int]()
    for k, ((curve, fine, along, chord, tilts), row) in enumerate(zip(curves, rows, strict=True)):
        here = mesh.rod_slice(k)
        t = np.interp(mesh.stations[here], along, fine)
        positions[mesh.rod_nodes[here]] = curve(t)
        bent[mesh.rod_nodes[here]] = np.column_stack([np.interp(t, chord, tilts[:, axis]) for axis in range(3)])
        for crossing, at in zip(row, marks[k].tolist(), strict=True):
            entries.append(here.start + int(np.argmin(np.abs(mesh.stations[here] - at))))
            crossings.append(crossing)
    return mesh, positions, bent, np.array(entries), np.array(crossings)


def _joined(structure: Structure, layer: LathLayer, placed: Floats, ties: tuple[Elements, ...]) -> Structure:
    """Grid and laths as one structure, in equilibrium; the state of the laths is first the one `placed`."""
    before, shell, blocks = structure.equilibrium, layer.shell, layer.blocks
    problem, count = before.problem, int(blocks.max()) + 1
    state = np.zeros((count, 3))
    state[blocks] = placed
    state[: structure.size] = before.state
    edges, free = shell.mesh.edges, shell.freedom()
    rest = np.linalg.norm(placed[edges[:, 1]] - placed[edges[:, 0]], axis=1)  # laid without axial force
    laths = replace(shell.stretch, blocks=blocks[shell.stretch.blocks], rest_lengths=rest)
    stretch = _both(problem.stretch, laths)
    freedom = Freedom.free(count)
    directions, dofs = freedom.directions.copy(), freedom.count.copy()
    directions[blocks], dofs[blocks] = free.directions, free.count
    dofs[blocks[_held_angles(shell)]] = 0
    main = problem.constraint.freedom(before.state)
    directions[: structure.size], dofs[: structure.size] = main.directions, main.count
    elements = [replace(element, blocks=blocks[element.blocks]) for element in shell.elements]  # type: ignore[type-var]
    flat = _flat(structure, layer)
    joined = replace(
        problem,
        elements=(*before.elements, *elements, *ties),
        stretch=stretch,
        constraint=Supports(Freedom(directions, dofs)),
        flat_coordinates=_placed(problem.flat_coordinates, flat, blocks, count),
        pattern=None,
    )
    forces = np.append(before.forces, np.zeros(len(edges)))
    found = find_stable(joined.refreshed(state), state, forces, limit_steps=True)
    if not found.report.stable:
        raise InputError(
            "no stable equilibrium of the shell and its bracing was found: the laths push it out of its shape; give "
            "thinner ones (bracing.section), or another pattern"
        )
    mass = np.zeros(structure.shell.node_count)
    half = np.where(layer.same_lath, np.diff(shell.mesh.stations[layer.entries]), 0.0) / 2
    reach = np.append(half, 0.0) + np.append(0.0, half)  # the load of a lath goes to its nearest joint
    np.add.at(mass, outer_nodes(structure.mesh)[layer.crossings], layer.rod.mass_per_length * reach)
    grid = structure.shell_at(found)
    return replace(structure, shell=grid, equilibrium=found, braced=layer.pairs, bracing_mass=mass, laths=layer)


def _both(first: Stretch, second: Stretch) -> Stretch:
    columns = ("blocks", "rest_lengths", "stiffness", "multipliers")
    return Stretch(*(np.concatenate([getattr(first, name), getattr(second, name)]) for name in columns))


def _held_angles(shell: Shell) -> Ints:
    """One twist angle of each lath, by which it is kept from spinning about itself; none where rods bend alike."""
    if not shell.angles:
        return np.empty(0, dtype=np.intp)
    rods = shell.mesh.edge_rods
    count = np.bincount(rods)
    return np.asarray(shell.first_angle + np.cumsum(count) - count + count // 2)


def _flat(structure: Structure, layer: LathLayer) -> Floats:
    """(N, 2) where the laths' blocks lie in the flat grid [m], by the joints on either side."""
    joints, mesh = flat_joints(structure.mesh.grid), layer.shell.mesh
    nodes = np.empty((mesh.node_count, 2))
    rods = mesh.rod_of[layer.entries]
    for k in range(len(mesh.grid.rods)):
        here, on = mesh.rod_slice(k), rods == k
        at, flat = mesh.stations[layer.entries[on]], joints[layer.crossings[on]]
        nodes[mesh.rod_nodes[here]] = np.column_stack([np.interp(mesh.stations[here], at, flat[:, a]) for a in (0, 1)])
    middles = nodes[mesh.edges].mean(axis=1)[: layer.shell.angles]
    return np.vstack([nodes, middles])


def _placed(before: Floats | None, flat: Floats, blocks: Ints, count: int) -> Floats | None:
    if before is None:
        return None
    result = np.zeros((count, 2))
    result[blocks] = flat
    result[: len(before)] = before
    return result


def _neighbours(mesh: GridMesh) -> Ints:
    """(c, 4) nodes after each crossing on both rods, then before it, in the order in which their normal points up."""
    before, after = np.moveaxis(mesh.rod_nodes[mesh.beside_crossings], 2, 0)
    found = np.column_stack([after, before])
    flat = mesh.flat[found, :2]
    a, b = flat[:, 0] - flat[:, 2], flat[:, 1] - flat[:, 3]
    down = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] < 0
    found[down] = found[down][:, [1, 0, 3, 2]]
    return np.asarray(found)


def _ties(structure: Structure, layer: LathLayer, eccentricity: float) -> tuple[Elements, ...]:
    mesh, crossings = structure.mesh, layer.crossings
    held = layer.blocks[layer.shell.mesh.rod_nodes[layer.entries]]
    blocks = np.column_stack([held, outer_nodes(mesh)[crossings], _neighbours(mesh)[crossings]])
    edge = np.median(mesh.edge_lengths)
    stiffness = OFFSET_STIFFNESS * layer.rod.stretch_stiffness / edge
    return (Standoffs(blocks, np.full(len(blocks), eccentricity), np.full(len(blocks), stiffness)),)
