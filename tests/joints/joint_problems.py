"""Problems of rods with joints that have exact answers: each solves one on a given mesh and returns its errors.

The tests in `test_joint_structures.py` and the table of `tests/acceptance/joints.py` both read them. Small
displacements are the response of the tangent stiffness at the flat state, so that nothing but the mesh is in error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from math import cos, pi, sin, sqrt

import numpy as np
from scipy.sparse import csc_matrix, diags, triu
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

import rodshell as rs
from rodshell.model import Assembly
from rodshell.solve.equilibrium import find_equilibrium
from rodshell.solve.problem import Problem, Supports
from rodshell.solve.sparse_ldl import Multifrontal
from tests.solve.rod_problems import threshold

X, Y, Z = np.eye(3)
EI, FLAT_EI, GJ = 2.0, 3.0, 1.3  # out of the grid's plane, in it, and in torsion [N m2]
STRIP = rs.Rod(rs.GivenSection(EA=1e7, EI1=EI, EI2=FLAT_EI, GJ=GJ, mass=1.0, rotary_inertia=0.1))


def tangent_stiffness(shell, state, free):
    """Hessian of the energy in the free directions, stretch included, as a sparse matrix."""
    parts = (*shell.elements, shell.stretch)
    blocks = [part.blocks for part in parts]
    hessians = [np.zeros((len(b), 3 * b.shape[1], 3 * b.shape[1])) for b in blocks]
    for part, values in zip(parts, hessians, strict=True):
        part.evaluate(state, np.zeros_like(state), values)
    assembly = Assembly.of(blocks, free)
    data = assembly.assemble(hessians, blocks, free)
    upper = csc_matrix((data, assembly.indices, assembly.indptr), shape=(free.size, free.size))
    return csc_matrix(upper + upper.T - diags(upper.diagonal()))


def gradient(shell, state):
    """(N, 3) of the energy, stretch included."""
    total = np.zeros_like(state)
    for part in (*shell.elements, shell.stretch):
        part.evaluate(state, total)
    return total


def response(shell, free, load):
    """(N, 3) small displacements of the flat grid under `load` (N, 3) [m, rad]."""
    return free.expand(spsolve(tangent_stiffness(shell, flat_state(shell), free), free.reduce(load)))


def flat_state(shell):
    """(N, 3) the flat grid, clamps straight on."""
    along = np.array([(*rod.direction, 0.0) for rod in shell.mesh.grid.rods])
    outwards = np.stack([-along, along], axis=1).reshape(-1, 3)
    return shell.state(shell.mesh.flat, outwards if len(shell.ghosts) else None, np.tile(Z, (len(shell.mesh.flat), 1)))


def node_at(shell, *place):
    """The node of the mesh nearest to (x, y)."""
    return int(np.argmin(np.linalg.norm(shell.mesh.flat[:, :2] - place, axis=1)))


def without_clamps(shell, ends):
    """The shell with some rod ends let go: a clamped shell clamps them all, those at joints too."""
    gone = shell.ghosts[ends]

    def let_go(element):
        kept = ~np.isin(element.blocks, gone).any(axis=1)
        rows = {f.name: getattr(element, f.name) for f in fields(element)}
        return replace(element, **{name: row[kept] for name, row in rows.items() if len(row) == len(kept)})

    return replace(shell, within=tuple(let_go(element) for element in shell.within))


# A portal frame with hinged feet, in its plane: columns of the height H, a beam of the length L


def portal_sway(edge, joint, *, height=0.8, span=1.0):
    """Sway under a force at one corner, over that of beam theory."""
    force, k = 1.0, joint.shear
    grid = rs.straight_rods([[[0, 0], [0, height]], [[0, height], [span, height]], [[span, height], [span, 0]]])
    shell = rs.Shell.of(rs.mesh_grid(grid, edge), STRIP, joint=joint)
    free = shell.freedom().with_directions(np.arange(shell.node_count), X, Y)
    free = free.with_directions(np.arange(shell.first_angle, len(shell.like)))
    free = free.with_directions(shell.ends[[0, 5]])
    corner, load = shell.ends[1], np.zeros((len(shell.like), 3))
    load[corner] = force * X
    moment = 0.5 * force * height  # at either corner, which turns by what the beam and the joint give
    turn = moment * (span / (6 * FLAT_EI) + 1 / k)
    exact = 0.5 * force * height**3 / (3 * FLAT_EI) + height * turn
    return float(response(shell, free, load)[corner, 0] / exact)


# Rods that meet in one point, their far ends clamped against bending and torsion; a force in the middle of one arm


@dataclass(frozen=True)
class Star:
    """Straight rods through the origin.

    Parameters
    ----------
    rods : of each its angle from x [rad], and the lengths of its arms behind and ahead of the origin, 0 for none.
    joint : one for every two of them.
    force : (3,) in the middle of the first rod's arm ahead [N].
    """

    rods: Sequence[tuple[float, float, float]]
    joint: rs.Spring | rs.Pin | rs.Rigid | rs.Ball
    force: tuple[float, float, float] = (0.3, 0.8, 1.0)

    def compliance(self, edge, *, turned=0.0):
        """Displacement along the force, over the force [m/N], by the mesh.

        turned : the grid is built with its last rod so far from its place [rad], which is then turned there.
        """
        built = [*self.rods[:-1], (self.rods[-1][0] - turned, *self.rods[-1][1:])]
        ends = [[[-behind * cos(a), -behind * sin(a)], [ahead * cos(a), ahead * sin(a)]] for a, behind, ahead in built]
        shell = rs.Shell.of(rs.mesh_grid(rs.straight_rods(ends), edge), STRIP, clamped=True, joint=self.joint)
        at_joint = np.flatnonzero(np.array([[behind == 0, ahead == 0] for _, behind, ahead in self.rods]).ravel())
        shell = without_clamps(shell, at_joint)
        state = flat_state(shell)
        last = np.unique([*shell.mesh.nodes_of(len(built) - 1), *shell.ghosts[-2:]])
        state[last] = Rotation.from_rotvec(turned * Z).apply(state[last])
        ghost_angles = np.arange(shell.first_angle, len(shell.like))[-len(shell.ghosts) :]
        held = np.delete(shell.ends, at_joint)
        free = shell.freedom().with_directions(np.concatenate([held, ghost_angles]))
        angle, _, ahead = self.rods[0]
        node, load = node_at(shell, 0.5 * ahead * cos(angle), 0.5 * ahead * sin(angle)), np.zeros_like(state)
        load[node] = self.force
        moved = free.expand(spsolve(tangent_stiffness(shell, state, free), free.reduce(load)))
        return float(moved[node] @ self.force)

    def exact(self):
        """The same by beam theory: the joint's deflection w, a rotation of every rod's section, and one of its middle.

        Half of the joint is each rod's: between two rods that is the joint, between more a star.
        """
        count = len(self.rods)
        unknowns = np.eye(1 + 3 * (count + 1))
        w, turns = unknowns[0], unknowns[1:].reshape(count + 1, 3, -1)
        stiffness, pull, own = np.zeros_like(unknowns), np.zeros(len(unknowns)), 0.0
        for number, (angle, behind, ahead) in enumerate(self.rods):
            for sign, length in ((-1, behind), (1, ahead)):
                if length == 0:
                    continue
                d = sign * np.array([cos(angle), sin(angle), 0.0])
                slope, sideways, twist = (axis @ turns[number] for axis in (np.cross(d, Z), Z, d))
                bend = np.outer(12 * w / length + 6 * slope, w / length) + np.outer(6 * w / length + 4 * slope, slope)
                stiffness += EI / length * bend + GJ / length * np.outer(twist, twist)
                stiffness += 4 * FLAT_EI / length * np.outer(sideways, sideways)
                if number == 0 and sign == 1:  # a cubic's middle moves by half of w and an eighth of length * slope
                    up, side = self.force[2], np.cross(Z, d) @ self.force
                    pull += up * (w / 2 + length * slope / 8) + side * length * sideways / 8
                    own = length**3 / 192 * (up**2 / EI + side**2 / FLAT_EI)
            for k, axis in self._springs():
                apart = axis @ (turns[number] - turns[-1])
                stiffness += 2 * k * np.outer(apart, apart)
        return float(pull @ np.linalg.lstsq(stiffness, pull, rcond=1e-15)[0] + own)

    def _springs(self):
        """Stiffness [N m/rad] and axis of the joint's springs; 1e8 for what is rigid."""
        shear, out, twist = (min(k, 1e8) for k in (self.joint.shear, self.joint.out_of_plane, self.joint.twist))
        yield shear, Z
        path = sum((1 if behind else -1) * np.array([cos(a), sin(a), 0.0]) for a, behind, ahead in self.rods[:1])
        path = path + sum((1 if ahead else -1) * np.array([cos(a), sin(a), 0.0]) for a, behind, ahead in self.rods[1:2])
        corner = all(behind == 0 or ahead == 0 for _, behind, ahead in self.rods)
        along = path / np.linalg.norm(path)
        yield (twist if corner else 0.5 * (out + twist)), along
        yield (out if corner else 0.5 * (out + twist)), np.cross(Z, along)

    def error(self, edge):
        """Relative."""
        return self.compliance(edge) / self.exact() - 1


STARS = {
    "two crossing rods": ((0.0, 0.8, 1.2), (pi / 2, 1.0, 0.6)),
    "askew": ((0.2, 0.8, 1.2), (1.4, 1.0, 0.6)),
    "T": ((0.0, 0.8, 1.2), (1.4, 0.0, 0.6)),
    "L": ((0.0, 0.0, 1.2), (1.9, 0.0, 0.6)),
    "three crossing rods": ((0.0, 0.8, 1.2), (pi / 3, 1.0, 0.6), (2 * pi / 3, 0.6, 0.8)),
    "two rods and the end of a third": ((0.0, 0.8, 1.2), (pi / 3, 1.0, 0.6), (2 * pi / 3, 0.6, 0.0)),
}
JOINTS = {
    "rigid": rs.Rigid(),
    "pin": rs.Pin(),
    "ball": rs.Ball(),
    "spring": rs.Spring(3.0, 4.0, 0.5),
}
MESHES = (0.1, 0.05, 0.025)


# Michell's ring, of several rods that continue each other


def michell_twist(edges, rods, joint=None):
    """As `rod_problems.michell_twist`, over 2 pi sqrt(3) EI/GJ: a ring of rods that rigid joints make one.

    The grid is a polygon; its joints, at rest where one rod goes straight on in the next, want it to be straight.
    """
    gj, side = 0.7, edges // rods
    kind = rs.Rod(rs.GivenSection(EA=1e7, EI1=1.0, EI2=1.0, GJ=gj))
    corner = 2 * pi * np.arange(rods + 1) / rods
    polygon = np.column_stack([np.cos(corner), np.sin(corner)]) / (2 * rods * sin(pi / rods))
    grid = rs.straight_rods(np.stack([polygon[:-1], polygon[1:]], axis=1))
    mesh = rs.mesh_grid(grid, 1.0 / edges)
    ring = rs.Shell.of(mesh, kind, joint=joint or rs.Rigid(rest_angle=0.0))
    around = np.zeros(mesh.node_count)
    around[mesh.rod_nodes] = 2 * pi * np.concatenate([(k * side + np.arange(side + 1)) / edges for k in range(rods)])
    circle = np.column_stack([np.cos(around), np.sin(around), 0 * around]) / (2 * edges * sin(pi / edges))
    at = [int(np.argmin(np.abs(around - share * 2 * pi))) for share in (0.0, 0.25, 0.5)]
    free = ring.freedom().with_directions(np.array([mesh.rod_nodes[0], ring.first_angle]))
    free = free.with_directions(np.array([at[1]]), X, Y).with_directions(np.array([at[2]]), X)
    bend, twist = ring.within

    def lost(share):
        turns = share * 2 * pi * sqrt(3) / gj
        natural = np.full(len(twist.blocks), turns / len(twist.blocks))
        shell = replace(ring, within=(bend, replace(twist, natural_twist=natural)))
        state = shell.state(circle)
        for _ in range(12):
            step = -spsolve(tangent_stiffness(shell, state, free), free.reduce(gradient(shell, state)))
            state = state + free.expand(step)
            if np.abs(step).max() < 1e-12:
                break
        michell_twist.off = np.abs(state[: mesh.node_count, 2]).max()
        upper = triu(tangent_stiffness(shell, state, free), format="csc")
        return Multifrontal(upper.indptr, upper.indices).factor(upper.data).negative > 0

    return threshold(lost)


# A lattice of three by three rods that folds by its joints alone

PITCH = 0.3


def lattice(joint, *, edge=0.1, rod=STRIP, count=3, pitch=PITCH):
    lines = pitch * (np.arange(count) - 0.5 * (count - 1))
    reach = lines[-1] + pitch
    ends = [[[-reach, y], [reach, y]] for y in lines] + [[[x, -reach], [x, reach]] for x in lines]
    return rs.Shell.of(rs.mesh_grid(rs.straight_rods(ends), edge), rod, joint=joint)


def sheared(shell, angle):
    """(N, 3) state with the second family turned by `angle` [rad], every rod straight."""
    x, y, _ = shell.mesh.flat.T
    folded = np.column_stack([x - sin(angle) * y, cos(angle) * y, 0 * x])
    return shell.state(folded, None, np.tile(Z, (len(folded), 1)))


def folding_energy(joint, angle):
    """Energy [J], and largest force on a free node [N], of the folded lattice."""
    shell = lattice(joint)
    state = sheared(shell, angle)
    energy = sum(part.evaluate(state, np.zeros_like(state)) for part in (*shell.elements, shell.stretch))
    return energy, float(np.abs(gradient(shell, state)).max())


def bending_stiffness(joint):
    """Of the lattice between moments about y at both ends of the rods along x [N m/rad], by its small response.

    The moments act on the end edges, which lie a length of one edge less than the rods' apart. Three joints hold it.
    """
    shell = lattice(joint)
    load = np.zeros((len(shell.like), 3))
    for rod in range(3):
        nodes = shell.node_blocks[shell.mesh.rod_slice(rod)]
        for end, inner in ((nodes[0], nodes[1]), (nodes[-1], nodes[-2])):
            arm = abs(shell.mesh.flat[end, 0] - shell.mesh.flat[inner, 0])
            load[end, 2] -= 1.0 / arm
            load[inner, 2] += 1.0 / arm
    free = shell.freedom().with_directions(np.arange(shell.node_count), Z)
    held = [node_at(shell, *place) for place in ((-PITCH, -PITCH), (PITCH, -PITCH), (-PITCH, PITCH))]
    free = free.with_directions(np.array(held))
    return float(3.0 * 3.0 / np.vdot(load, response(shell, free, load)))


# Two straight rods, turned about their joint


def linker_energy(angle, corners, *, edge=5e-3, rod=None):
    """Energy [J] of a joint with linkers whose rods are turned from a right angle to `angle` [rad]."""
    paper = rs.Rod(rs.Circle(1e-3), rs.Material(1e6, 1e3))
    half = 2 * edge
    grid = rs.straight_rods([[[-half, 0], [half, 0]], [[0, -half], [0, half]]])
    shell = rs.Shell.of(rs.mesh_grid(grid, edge), rod or paper, joint=rs.Linker(corners=corners))
    state = sheared(shell, angle - pi / 2)
    return sum(part.evaluate(state, np.zeros_like(state)) for part in shell.elements)


# A shell with two planes of symmetry and two diagonal ones, popped up


def popped(joint, *, shorter=0.1):
    """A lattice, meshed alike on both sides, whose rod ends were moved towards its middle: shell and equilibrium."""
    kind = rs.Rod(rs.Circle(2e-3), rs.Material(1e9, 1e3))
    shell = lattice(joint, edge=0.1, rod=kind)
    flat = shell.mesh.flat
    goals = (1 - shorter) * flat[shell.ends]
    free = shell.freedom().with_directions(shell.ends)
    x, y, _ = (flat / flat.max()).T
    shape = (1 - shorter) * flat + 0.3 * Z * ((1 - x**2) * (1 - y**2))[:, None]
    shape[shell.ends] = goals
    problem = Problem(shell.elements, shell.stretch, Supports(free, shell.ends, goals), 2 * PITCH)
    found = find_equilibrium(problem, shell.state(shape), np.zeros(len(shell.stretch.blocks)))
    assert found.report.converged
    return shell, found


def asymmetry(joint):
    """Largest distance of a node from the mirror image of its partner, over the half-width: (by x, y; by x = y)."""
    shell, found = popped(joint)
    points, flat = found.state[: shell.mesh.node_count], shell.mesh.flat

    def off(mirror):
        partner = [int(np.argmin(np.linalg.norm(flat - mirror @ place, axis=1))) for place in flat]
        return float(np.abs(points[partner] - points @ mirror.T).max() / (2 * PITCH))

    planes = max(off(np.diag([-1.0, 1.0, 1.0])), off(np.diag([1.0, -1.0, 1.0])))
    return planes, off(np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
