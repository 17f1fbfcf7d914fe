"""A popped-up shell under its weight, by code of its own: energies from the papers, derivatives by complex steps,
plain Newton with elastic edges, steps of the load that halve, inertia by the signs of an unpivoted LU's pivots.

Of a form it takes geometry alone: the mesh's connectivity and rest lengths, where the ends and the clamps' directions
are, and the rods' EA, EI, GJ and mass per length; nothing of the library's energies, models and solvers. Rods bend
alike in all directions, or they are laths with a twist angle for each edge. Joints are balls.
Laths may be curved at rest.
"""

from itertools import pairwise

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import splu

from tests.formfinding.elastic_twins import ElasticTwin

TINY = 1e-30  # of a complex step: exact
STEP = 1e-6  # of the shortest edge, or in rad: of a difference of complex steps
GRAVITY = 9.81


class LoadedTwin:
    """Unknowns in a row: nodes, ghosts of the clamps past the ends, twist angles of laths' edges and ghost edges."""

    def __init__(self, popped, rod, *, gravity=GRAVITY):
        mesh = popped.footprint.mesh
        stations = [mesh.stations[mesh.rod_slice(k)] for k in range(len(mesh.grid.rods))]
        self.nodes, ends, n = mesh.node_count, mesh.ends.ravel(), mesh.node_count
        ghosts = np.arange(len(ends)) + n if popped.ends == "clamped" else np.arange(0)
        first = n + len(ghosts)
        edges, rest, bends, voronoi, pairs, at, at_rest = [], [], [], [], [], 0, []
        for k, s in enumerate(stations):
            row, lengths = list(mesh.nodes_of(k)), list(np.diff(s))
            edges += pairwise(row)
            rest += lengths
            reach = [(a + b) / 2 for a, b in pairwise(lengths)]
            if len(ghosts):  # half of the end's Voronoi length lies in the clamp
                row = [ghosts[2 * k], *row, ghosts[2 * k + 1]]
                reach = [lengths[0] / 2, *reach, lengths[-1] / 2]
            bends += zip(row[:-2], row[1:-1], row[2:], strict=True)
            voronoi += reach
            curve = mesh.grid.rods[k].curve
            places = s[1:-1] if len(reach) == len(s) - 2 else s
            at_rest += [0.0] * len(reach) if curve is None else np.interp(places, *curve).tolist()
            pairs += [(at + j, at + j + 1) for j in range(len(reach))]
            at += len(row) - 1
        self.edges, self.rest = np.array(edges), np.array(rest)
        self.bends, self.voronoi = np.array(bends), np.array(voronoi)
        self.x = np.vstack([popped.positions, np.zeros((len(ghosts), 3))])
        if len(ghosts):
            last = np.column_stack([[np.diff(s)[0], np.diff(s)[-1]] for s in stations]).T.ravel()
            self.x[ghosts] = self.x[ends] + last[:, None] * popped.boundary.tangents
        weight = np.zeros(first)
        for side in range(2):
            np.add.at(weight, self.edges[:, side], 0.5 * self.rest * rod.mass_per_length * gravity)
        axial = ElasticTwin.__new__(ElasticTwin)
        axial.rest, axial.stretch_stiffness = self.rest, rod.stretch_stiffness
        self.terms = [(axial.stretch_energies, _coordinates(self.edges), 3)]
        angles = 0
        if rod.bend_stiffnesses[0] == rod.bend_stiffnesses[1]:
            axial.voronoi, axial.bend_stiffness = self.voronoi, rod.bend_stiffnesses[0]
            self.terms.append((axial.bend_energies, _coordinates(self.bends), 3))
        else:
            angles = at
            lath = LathBends(self.x, self.bends, np.array(pairs), self.voronoi, rod, at_rest)
            index = np.hstack([_coordinates(self.bends), 3 * first + np.array(pairs)])
            self.terms.append((lath.energies, index, 1))
        self.load = np.zeros(3 * first + angles)
        self.load[2 : 3 * first : 3] = -weight
        held = _coordinates(np.append(ends, ghosts)[:, None]).ravel()
        self.free = np.setdiff1d(np.arange(len(self.load)), held)
        self.size = float(np.ptp(popped.positions, axis=0).max()) / 2
        self.state = np.append(self.x.ravel(), np.zeros(angles))
        self.ends, self.ghosts, self.angles = ends, ghosts, np.arange(3 * first, 3 * first + angles)
        for _ in range(20 if angles else 0):  # laths turn about themselves into the position of least energy
            residual = self.gradient(self.state)[self.angles]
            self.state[self.angles] -= splu(self.hessian(self.state)[self.angles][:, self.angles].tocsc()).solve(
                residual
            )

    def gradient(self, state):
        """Of the energies by every unknown."""
        result = np.zeros(len(state))
        for energies, index, width in self.terms:
            for column in range(index.shape[1]):
                moved = state[index].astype(complex)
                moved[:, column] += 1j * TINY
                np.add.at(result, index[:, column], _of(energies, moved, width).imag / TINY)
        return result

    def hessian(self, state):
        """Sparse, of all unknowns."""
        rows, columns, values = [], [], []
        for energies, index, width in self.terms:
            count = index.shape[1]
            step = np.full(count, STEP * self.rest.min())
            step[9:] = STEP
            for column in range(count):
                ahead, back = state[index].astype(complex), state[index].astype(complex)
                ahead[:, column] += step[column]
                back[:, column] -= step[column]
                for row in range(column, count):
                    ahead[:, row] += 1j * TINY
                    back[:, row] += 1j * TINY
                    change = _of(energies, ahead, width).imag - _of(energies, back, width).imag
                    ahead[:, row] -= 1j * TINY
                    back[:, row] -= 1j * TINY
                    rows += [index[:, row], index[:, column]] if row > column else [index[:, row]]
                    columns += [index[:, column], index[:, row]] if row > column else [index[:, column]]
                    values += [change / (2 * step[column] * TINY)] * (2 if row > column else 1)
        size = len(state)
        return coo_matrix(
            (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (size, size)
        ).tocsc()

    def factored(self, state):
        """The stiffness of the free unknowns, factorised, and the number of its negative eigenvalues."""
        matrix = self.hessian(state)[self.free][:, self.free]
        scale = diags(1 / np.sqrt(np.abs(matrix.diagonal())))
        factors = splu(
            (scale @ matrix @ scale).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )  # fmt: skip
        assert np.array_equal(factors.perm_r, factors.perm_c)  # unpivoted: the pivots' signs are the inertia
        return (lambda right: scale @ factors.solve(scale @ right)), int((factors.U.diagonal() < 0).sum())

    def residual(self, state, factor=0.0):
        """(free,) forces out of balance [N, N m]."""
        return (self.gradient(state) - factor * self.load)[self.free]

    def settled(self, state, factor, most=8):
        """The equilibrium next to a state, and its negative eigenvalues; None where Newton's method fails."""
        for _ in range(most):
            solve, negative = self.factored(state)
            step = -solve(self.residual(state, factor))
            state = state.copy()
            state[self.free] += step
            length = np.abs(step).max() / self.size
            if not length < 0.2:
                return None
            if length < 1e-7:
                return state, negative
        return None

    def reactions(self, state):
        """(2m, 3) forces [N] and (2m, 3) moments [N m] of the supports without load."""
        gradient = self.gradient(state)[: self.x.size].reshape(-1, 3)
        x = state[: self.x.size].reshape(-1, 3)
        forces, moments = gradient[self.ends], np.zeros((len(self.ends), 3))
        if len(self.ghosts):
            forces = forces + gradient[self.ghosts]
            moments = np.cross(x[self.ghosts] - x[self.ends], gradient[self.ghosts])
        return forces, moments

    def load_factor(self, accuracy=1e-3, most=1e5):
        """The largest factor on the weight that is found stable, by steps of the load that halve; and the state at 1.

        A step counts where the shell is stable and moves as its tangent says, within a third.
        """
        state, negative = self.settled(self.state, 0.0)
        if negative:
            return 0.0, None
        factor, step, at_one = 0.0, None, None
        while factor < most:
            solve, _ = self.factored(state)
            along = solve(self.load[self.free])
            if step is None:
                step = 5e-3 * self.size / np.abs(along[: len(self.free) - len(self.angles)]).max()
            while True:
                there = min(factor + step, 1.0) if factor < 1.0 else factor + step
                guess = state.copy()
                guess[self.free] += (there - factor) * along
                found = self.settled(guess, there)
                moved = None if found is None else np.abs(found[0] - guess).max() / np.abs(guess - state).max()
                if found is not None and found[1] == 0 and moved < 1 / 3:
                    break
                step /= 2
                if step < accuracy * factor:
                    return factor, at_one
            state, factor = found[0], there
            at_one = state if there == 1.0 else at_one
            step *= 1.5 if moved < 0.05 else 1.0
        return factor, at_one


class LathBends:
    """Bending and twist of anisotropic rods [HQK Eqs 1b, 1c; Bergou et al. 2008], curved `at_rest` to the left [1/m].

    Each edge's material frame is a director of its own, carried from where the edge began by the smallest rotation and
    turned by its angle; the twist is the angle between neighbouring frames, one being carried to the other.
    """

    def __init__(self, x, bends, pairs, voronoi, rod, at_rest):
        self.voronoi, self.pairs = voronoi, pairs
        self.natural = 2 * np.tan(0.5 * voronoi * np.array(at_rest))
        (self.one, self.two), self.twist = rod.bend_stiffnesses, rod.twist_stiffness
        count = pairs.max() + 1
        self.tangents, self.directors = np.zeros((count, 3)), np.zeros((count, 3))
        for (a, b, c), (e, f) in zip(bends, pairs, strict=True):
            for edge, p, q in ((e, a, b), (f, b, c)):
                self.tangents[edge] = (x[q] - x[p]) / np.linalg.norm(x[q] - x[p])
        following = dict(pairs.tolist())
        starts = sorted(set(following) - set(following.values()))
        for start in starts:  # from the edge that is most nearly level, where the normal is most nearly upright
            row = [start]
            while row[-1] in following:
                row.append(following[row[-1]])
            top = int(np.argmin(np.abs(self.tangents[row, 2])))
            t = self.tangents[row[top]]
            upright = np.array([0.0, 0.0, 1.0]) - t[2] * t
            self.directors[row[top]] = upright / np.linalg.norm(upright)
            for chain in (row[top:], row[top::-1]):
                for here, there in pairwise(chain):
                    carried = _carried(self.directors[here], self.tangents[here], self.tangents[there])
                    self.directors[there] = carried

    def energies(self, values):
        """(b,) [J] of three nodes and two angles each (b, 11)."""
        first, second, twist = self.strains(values)  # a director upright, the other one on the right
        strains = first, second + self.natural, twist
        return sum(k * s**2 for k, s in zip((self.one, self.two, self.twist), strains, strict=True)) / (
            2 * self.voronoi
        )

    def strains(self, values):
        """Three of (b,): bends towards both directors, and twist [rad], of three nodes and two angles each (b, 11)."""
        x = values[:, :9].reshape(-1, 3, 3)
        frames = []
        for side in range(2):
            apart = x[:, side + 1] - x[:, side]
            tangent = apart / np.sqrt(np.sum(apart * apart, axis=1))[:, None]
            edge, angle = self.pairs[:, side], values[:, 9 + side, None]
            carried = _carried(self.directors[edge], self.tangents[edge], tangent)
            across = np.cross(tangent, carried)
            first = np.cos(angle) * carried + np.sin(angle) * across
            frames.append((tangent, first, np.cross(tangent, first)))
        (s, m1, m2), (t, n1, n2) = frames
        binormal = 2 * np.cross(s, t) / (1 + np.sum(s * t, axis=1))[:, None]
        towards_first = np.sum(binormal * (m2 + n2), axis=1) / 2
        towards_second = -np.sum(binormal * (m1 + n1), axis=1) / 2
        over = _carried(m1, s, t)
        twist = np.arctan(np.sum(np.cross(over, n1) * t, axis=1) / np.sum(over * n1, axis=1))
        return towards_first, towards_second, twist


def _carried(vector, s, t):
    """Vectors across s turned with it into t by the smallest rotation."""
    share = np.sum(vector * t, axis=-1) / (1 + np.sum(s * t, axis=-1))
    return vector - share[..., None] * (s + t)


def _coordinates(blocks):
    return (3 * blocks[:, :, None] + np.arange(3)).reshape(len(blocks), -1)


def _of(energies, values, width):
    return energies(values.reshape(len(values), -1, 3) if width == 3 else values)
