"""Shells under loads by code of its own: `LoadedTwin` with other loads, cables, and linear buckling of its matrices."""

import numpy as np
from scipy.linalg import eigh
from scipy.spatial import cKDTree

from tests.checks.loaded_twin import TINY, LoadedTwin, _coordinates

RASTER = 500  # points across the plan, whose loads go to the nearest node


class BracedTwin(LoadedTwin):
    """Of a popped-up shell on a surface z(x, y) over a disc, under snow [N/m2 of plan].

    ropes : (d, 2) nodes that cables join, shortened by `prestrain` against the popped-up shell, of the stiffness EA.
    """

    def __init__(self, popped, rod, *, snow, height, radius, ropes=None, prestrain=0.0, rope_stiffness=0.0):
        super().__init__(popped, rod)
        ticks = radius * (2 * (np.arange(RASTER) + 0.5) / RASTER - 1)
        x, y = (part.ravel() for part in np.meshgrid(ticks, ticks))
        inside = np.hypot(x, y) <= radius
        points = np.column_stack([x, y, height(x, y)])[inside]
        _, nearest = cKDTree(popped.boundary.draped).query(points)
        plan = np.bincount(nearest, minlength=self.nodes) * (2 * radius / RASTER) ** 2
        self.load[:] = 0.0
        self.load[2 : 3 * self.nodes : 3] = -snow * plan
        if ropes is not None:
            self.ropes, x = ropes, self.x
            self.slack = np.linalg.norm(x[ropes[:, 1]] - x[ropes[:, 0]], axis=1) / (1 + prestrain)
            self.rope_stiffness = rope_stiffness
            self.terms.append((self.rope_energies, _coordinates(ropes), 3))

    def rope_energies(self, x):
        """(d,) [J] of two nodes each; none where slack."""
        apart = x[:, 1] - x[:, 0]
        strain = np.sqrt(np.sum(apart * apart, axis=1)) / self.slack - 1
        return np.where(strain.real > 0, 0.5 * self.rope_stiffness * self.slack * strain**2, 0.0)

    def negative_modes(self, factors):
        """Of the stiffness at the last of these factors, each equilibrium being found from the last one's tangent."""
        state, before = self.state, 0.0
        for factor in factors:
            solve, _ = self.factored(state)
            guess = state.copy()
            guess[self.free] += (factor - before) * solve(self.load[self.free])
            state, negative = self.settled(guess, factor)
            before = factor
        return negative

    def linear_factor(self, state):
        """Lowest factor of linear buckling about a state: the stiffness of the change of axial forces and of laths'
        moments, the geometry being frozen. Rods that bend alike have no strains of their bending."""
        free, n = self.free, 3 * self.nodes
        matrix = self.hessian(state)[free][:, free].toarray()
        along = np.zeros(len(state))
        along[free] = np.linalg.solve(matrix, self.load[free])
        x, v = state[:n].reshape(-1, 3), along[:n].reshape(-1, 3)
        stress = np.zeros((len(state), len(state)))
        members = [(self.edges, self.rest, self.axial_stiffness)]
        if hasattr(self, "ropes"):
            drawn = np.linalg.norm(x[self.ropes[:, 1]] - x[self.ropes[:, 0]], axis=1) > self.slack
            members.append((self.ropes[drawn], self.slack[drawn], self.rope_stiffness))
        for ends, rest, stiffness in members:
            for (a, b), length in zip(ends, rest, strict=True):
                t = (x[b] - x[a]) / np.linalg.norm(x[b] - x[a])
                pull = stiffness * (t @ (v[b] - v[a])) / length / np.linalg.norm(x[b] - x[a])
                local = pull * (np.eye(3) - np.outer(t, t))
                for p, q, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                    stress[3 * p : 3 * p + 3, 3 * q : 3 * q + 3] += sign * local
        stress += self.moment_stiffness(state, along)
        largest = eigh(-stress[np.ix_(free, free)], matrix, eigvals_only=True)[-1]
        return 1.0 / largest

    def moment_stiffness(self, state, along):
        """Of the moments that laths get along a motion: the second derivatives of their strains, times these."""
        laths = [(energies.__self__, index) for energies, index, width in self.terms if width == 1]
        if not laths:
            return 0.0
        ((bends, index),) = laths
        stiffness = (bends.one, bends.two, bends.twist)
        rates = [strain.imag / TINY for strain in bends.strains(state[index] + 1j * TINY * along[index])]
        moments = [k * rate / bends.voronoi for k, rate in zip(stiffness, rates, strict=True)]

        def work(values):
            return sum(moment * strain for moment, strain in zip(moments, bends.strains(values), strict=True))

        terms, self.terms = self.terms, [(work, index, 1)]
        try:
            return self.hessian(state).toarray()
        finally:
            self.terms = terms

    @property
    def axial_stiffness(self):
        """EA [N] of the rods."""
        return self.terms[0][0].__self__.stretch_stiffness
