"""What the thickness of rods does to a net of lines: two layers of different lengths, and laths too wide to follow it.

A net knows no thickness. Rods laid one above the other lie on parallel surfaces, along which lengths differ by their
distance times the curvature. And a lath that lies flat must bend within the surface, about its strong axis, by the
geodesic curvature of its line; joints that hold its normal keep it from rolling out of that. Like a strip bent on edge
it then buckles sideways between two joints where the moment exceeds pi/a sqrt(EI1 GJ), a being their distance
[Timoshenko and Gere, Theory of Elastic Stability, chapter 6, pure bending of a strip].
"""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

from rodshell.geometry.vectors import cross, dot, unit
from rodshell.layout import GridMesh
from rodshell.rods.section import Circle, Ellipse, GivenSection, Rod, Tube
from rodshell.targets import Target
from rodshell.units import length_text

Floats = NDArray[np.float64]

THICK = 0.015  # difference of the layers' lengths, or
MUCH = 0.1  # of the rods' length beyond the moment at which they buckle: below it shells settle near their targets
CLOSE = 0.1  # thickness over the spacing: above these a sentence says what is left out


def thickness(rod: Rod) -> float:
    """Of a rod along the shell's normal [m]; 0 where the shape of its section is not known."""
    section = rod.section
    if isinstance(section, GivenSection):
        return 0.0
    if isinstance(section, Circle | Tube):
        return 2 * section.outer_radius
    return 2 * section.a if isinstance(section, Ellipse) else section.width


def layers_left_out(
    target: Target, mesh: GridMesh, positions: Floats, edges: NDArray[np.bool_], rod: Rod, spacing: float
) -> tuple[str, ...]:
    """That thick rods, if one lies above the other, would have other lengths than those of one surface.

    edges : (e,) those of the mesh that lie on the target, its nodes being at `positions` (n, 3).
    """
    thick = thickness(rod)
    normal, (a, b) = target.on_surface(positions).normal, mesh.edges[edges].T
    chord = positions[b] - positions[a]
    bent = thick * dot(normal[b] - normal[a], chord) / dot(chord, chord)
    if not (np.abs(bent).max(initial=0.0) > THICK or thick > CLOSE * spacing):
        return ()
    change = 0.5 * np.bincount(mesh.edge_rods[edges], weights=bent * mesh.edge_lengths[edges])
    share = 50 * np.abs(bent).max(initial=0.0)
    return (
        f"the rods are {length_text(thick)} thick and their joints hold their centre lines together: laid one above "
        f"the other, rods would be up to {length_text(float(np.abs(change).max(initial=0.0)))} shorter in one layer "
        f"and longer in the other, and joint distances up to {share:.2g} %; give the distance of their centre lines "
        "(joint.eccentricity), unless they are notched at the joints",
    )


@dataclass(frozen=True)
class Sideways:
    """How laths bend within the surface, about their strong axis, on a net.

    Parameters
    ----------
    ratio : EI2 / EI1.
    curvature : geodesic curvature where the moment is largest [1/m].
    moment : the largest moment that it takes, over that at which the lath buckles sideways between its joints.
    beyond : share of the rods' length where the moment is beyond that.
    """

    ratio: float
    curvature: float
    moment: float
    beyond: float

    @property
    def warnings(self) -> tuple[str, ...]:
        if self.beyond <= MUCH:
            return ()
        return (
            f"the rods are {self.ratio:.3g} times as stiff within the surface as out of it (EI2/EI1), and the net "
            f"bends them within it down to a radius of {length_text(1.0 / self.curvature)}: up to {self.moment:.3g} "
            f"times the moment at which they buckle sideways between joints, and beyond it on {100 * self.beyond:.0f} "
            "% of their length; use narrower rods (rod.section), a smaller spacing or a flatter target",
        )


def sideways(target: Target, mesh: GridMesh, positions: Floats, bends: NDArray[np.bool_], rod: Rod) -> Sideways:
    """Of a rod that lies flat on the target and cannot roll at its joints.

    bends : (b,) those of the mesh that lie on the target, its nodes being at `positions` (n, 3) [m].
    """
    weak, strong = rod.bend_stiffnesses
    before, here, after = (positions[mesh.bends[bends, k]] for k in range(3))
    tangents = unit(here - before), unit(after - here)
    side = unit(cross(target.on_surface(here).normal, after - before))
    curvature = np.abs(dot(tangents[1] - tangents[0], side)) / mesh.voronoi_lengths[bends]
    critical = pi * sqrt(weak * rod.twist_stiffness) / _spans(mesh)[mesh.bend_rods[bends]]
    moment = strong * curvature / critical if strong > weak else np.zeros_like(curvature)
    length = mesh.voronoi_lengths[bends]
    beyond = float(length[moment > 1.0].sum() / max(length.sum(), np.finfo(float).tiny))
    worst = int(np.argmax(moment)) if len(moment) else 0
    largest = (float(curvature[worst]), float(moment[worst])) if len(moment) else (0.0, 0.0)
    return Sideways(strong / weak, *largest, beyond)


def _spans(mesh: GridMesh) -> Floats:
    """(m,) usual distance of the joints of each rod [m]."""
    crossings, result = mesh.grid.crossings, np.full(len(mesh.grid.rods), np.inf)
    for rod in range(len(result)):
        gaps = np.diff(np.sort(crossings.at[crossings.rods == rod]))
        if len(gaps):
            result[rod] = np.median(gaps)
    return result
