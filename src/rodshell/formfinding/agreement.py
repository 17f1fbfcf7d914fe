"""Agreement: how far the popped-up shell is from the target, and where."""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats
from rodshell.formfinding.popup import PopUp
from rodshell.geometry.curves import on_curve
from rodshell.layout import GridMesh
from rodshell.targets import Target


@dataclass(frozen=True)
class Agreement:
    """Distance between rods and target, over nodes and the middles of edges; of rods in layers from their own layer.

    Parameters
    ----------
    gaps : (n,) signed distance of each node, positive outside [m].
    max, rms : of all nodes and edge middles [m].
    where : the point of the rods with the largest distance [m].
    size : the target's size, by which the relative figures are divided [m].
    """

    gaps: Floats
    max: float
    rms: float
    where: tuple[float, float, float]
    size: float

    @property
    def max_relative(self) -> float:
        return self.max / self.size

    @property
    def rms_relative(self) -> float:
        return self.rms / self.size

    def __str__(self) -> str:
        x, y, z = (1e3 * value for value in self.where)
        return (
            f"gap to the target: max {1e3 * self.max:.3f} mm ({100 * self.max_relative:.3f} % of its size) at "
            f"({x:.1f}, {y:.1f}, {z:.1f}) mm, rms {1e3 * self.rms:.3f} mm ({100 * self.rms_relative:.3f} %)"
        )


def agreement(popped: PopUp, target: Target) -> Agreement:
    """Distance of the popped-up rods to the target, continued smoothly past its end."""
    nodes, mesh = popped.positions, popped.footprint.mesh
    points = np.vstack([nodes, edge_middles(mesh, nodes)])
    gaps = target.distance(points) - np.append(mesh.heights, mesh.heights[mesh.edges[:, 0]])
    k = int(np.argmax(np.abs(gaps)))
    x, y, z = points[k].tolist()
    return Agreement(
        gaps[: len(nodes)], float(np.abs(gaps[k])), float(np.sqrt(np.mean(gaps**2))), (x, y, z), target.size
    )


def edge_middles(mesh: GridMesh, positions: Floats) -> Floats:
    """(e, 3) points of the rods halfway along each edge, on the cubic through the nearest nodes of the rod."""
    result = []
    for rod in range(len(mesh.grid.rods)):
        x, s = positions[mesh.nodes_of(rod)], mesh.stations[mesh.rod_slice(rod)]
        result.append(on_curve(s, x, 0.5 * (s[:-1] + s[1:])))
    return np.concatenate(result)
