"""A shell's elastic energies written with numpy from HQK Eq 1, mesh topology included; derivatives by complex steps.

Nothing here uses the library's elements: stencils are read off the rods' nodes and stations.
"""

import numpy as np
from scipy.sparse import csr_matrix

STEP = 1e-7  # m, of a difference
TINY = 1e-30  # of a complex step: its square vanishes beside 1, so that the derivative is exact


class ElasticTwin:
    """Bending and stretch of a mesh of equal rods.

    Parameters
    ----------
    bends (b, 3), voronoi (b,) : nodes and length of each bend [m].
    edges (e, 2), rest (e,) : nodes and length of each edge [m].
    """

    def __init__(self, mesh, rod):
        bends, voronoi, edges, rest = [], [], [], []
        for k in range(len(mesh.grid.rods)):
            nodes, lengths = mesh.nodes_of(k), np.diff(mesh.stations[mesh.rod_slice(k)])
            edges += np.column_stack([nodes[:-1], nodes[1:]]).tolist()
            rest += lengths.tolist()
            bends += np.column_stack([nodes[:-2], nodes[1:-1], nodes[2:]]).tolist()
            voronoi += ((lengths[:-1] + lengths[1:]) / 2).tolist()
        self.bends, self.voronoi = np.array(bends), np.array(voronoi)
        self.edges, self.rest = np.array(edges), np.array(rest)
        self.bend_stiffness, self.stretch_stiffness = rod.bend_stiffness, rod.stretch_stiffness

    def bend_energies(self, points):
        """[HQK Eq 1b] (b,) energies of bends through `points` (b, 3, 3): EI |kappa b|^2 / 2 l [J]."""
        e, f = points[:, 1] - points[:, 0], points[:, 2] - points[:, 1]
        lengths = np.sqrt(np.sum(e * e, axis=1) * np.sum(f * f, axis=1))
        binormal = 2 * np.cross(e, f) / (lengths + np.sum(e * f, axis=1))[:, None]
        return self.bend_stiffness * np.sum(binormal**2, axis=1) / (2 * self.voronoi)

    def bend_gradient(self, positions):
        """(n, 3) [N]"""
        points, gradient = positions[self.bends], np.zeros_like(positions)
        for node in range(3):
            for axis in range(3):
                moved = points.astype(complex)
                moved[:, node, axis] += 1j * TINY
                np.add.at(gradient[:, axis], self.bends[:, node], self.bend_energies(moved).imag / TINY)
        return gradient

    def strains(self, positions):
        """[HQK Eq 1a] (e,)"""
        return np.linalg.norm(positions[self.edges[:, 1]] - positions[self.edges[:, 0]], axis=1) / self.rest - 1

    def pulls(self, positions):
        """Sparse (3n, e): gradient of each edge's length [-], that of a unit axial force."""
        count = len(self.edges)
        apart = positions[self.edges[:, 1]] - positions[self.edges[:, 0]]
        unit = apart / np.linalg.norm(apart, axis=1)[:, None]
        rows = 3 * self.edges[:, :, None] + np.arange(3)
        values = np.stack([-unit, unit], axis=1)
        columns = np.broadcast_to(np.arange(count)[:, None, None], values.shape)
        return csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(positions.size, count))

    def gradient(self, positions, forces=None):
        """(n, 3) of bending and stretch [N]; axial forces (e,) given, or those of elastic edges."""
        axial = self.stretch_stiffness * self.strains(positions) if forces is None else forces
        return self.bend_gradient(positions) + (self.pulls(positions) @ axial).reshape(positions.shape)

    def stretch_energies(self, points):
        """[HQK Eq 1a] (e,) energies of elastic edges between `points` (e, 2, 3): EA eps^2 l / 2 [J]."""
        apart = points[:, 1] - points[:, 0]
        strain = np.sqrt(np.sum(apart * apart, axis=1)) / self.rest - 1
        return self.stretch_stiffness * strain**2 * self.rest / 2

    def hessian(self, positions):
        """(3n, 3n) of bending and elastic stretch [N/m], by central differences of complex steps; 1e-8 of it off."""
        total = np.zeros((positions.size, positions.size))
        for energies, stencils in ((self.bend_energies, self.bends), (self.stretch_energies, self.edges)):
            count, width = stencils.shape
            local = np.empty((count, 3 * width, 3 * width))
            for row in range(3 * width):
                for column in range(3 * width):
                    moved = np.stack([positions[stencils].reshape(count, -1).astype(complex)] * 2)
                    moved[:, :, row] += 1j * TINY
                    moved[0, :, column] += STEP
                    moved[1, :, column] -= STEP
                    ahead, back = (energies(one.reshape(count, width, 3)).imag / TINY for one in moved)
                    local[:, row, column] = (ahead - back) / (2 * STEP)
            for stencil, matrix in zip(stencils, local, strict=True):
                rows = (3 * stencil[:, None] + np.arange(3)).ravel()
                total[np.ix_(rows, rows)] += (matrix + matrix.T) / 2
        return total
