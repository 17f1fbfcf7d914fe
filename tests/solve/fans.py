"""Two fans of straight rods, rigidly joined, which no support holds. Joints that are opened bend the rods in their
plane until, past a bifurcation, they bulge out of it to either side."""

from dataclasses import replace

import numpy as np

import rodshell as rs
from rodshell.joints.relative_rotation import RelativeRotation
from rodshell.model import Shell
from rodshell.solve.problem import Problem, Supports, mean_radius


def fans(size: float, opened: float) -> tuple[Problem, np.ndarray]:
    """The problem and its flat state: rods of 0.9 times the `size` [m], their joints to be `opened` by an angle [rad].

    One edge is held with its frame, which takes rigid motions away and carries no force.
    """
    offsets = np.linspace(-1, 1, 4)
    headings = np.radians(15) * (1 + 0.35 * offsets**2)
    ends = []
    for side in (1, -1):
        for offset, heading in zip(offsets, side * headings, strict=True):
            middle, along = np.array([0, 0.12 * offset]), np.array([np.cos(heading), np.sin(heading)])
            ends.append([middle - 0.45 * along, middle + 0.45 * along])
    mesh = rs.mesh_grid(rs.straight_rods(size * np.array(ends)), 0.1 * size)
    rod = rs.Rod(rs.RectangularSection(width=0.004 * size, height=0.008 * size), rs.Material.preset("gfrp"))
    shell = Shell.of(mesh, rod, joint=rs.Rigid())
    held = int(np.argmin(np.linalg.norm(mesh.flat[mesh.edges].mean(axis=1) - mesh.flat.mean(axis=0), axis=1)))
    start, end = mesh.edges[held]
    along = (mesh.flat[end] - mesh.flat[start]) / np.linalg.norm(mesh.flat[end] - mesh.flat[start])
    free = shell.freedom().with_directions(np.array([start])).with_directions(np.array([end]), tuple(along))
    elements = tuple(
        replace(element, rest_angle=element.rest_angle + np.sign(element.rest_angle) * opened)
        if isinstance(element, RelativeRotation)
        else element
        for element in shell.elements
    )
    supports = Supports(free.with_directions(np.array([shell.first_angle + held])))
    problem = Problem(
        elements, shell.stretch, supports, mean_radius(mesh.flat), flat_coordinates=shell.flat_coordinates
    )
    return problem, shell.state(mesh.flat)
