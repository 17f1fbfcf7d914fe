"""What the thickness of rods does to a net of lines: two layers of different lengths, and laths too wide to follow it.

A net knows no thickness. Rods laid one above the other lie on parallel surfaces, along which lengths differ by their
distance times the curvature. And a lath whose joints keep it from rolling bends about its strong axis, too: lying flat
by the geodesic curvature of its line, on edge by the surface's. Like any strip it then buckles sideways between two
joints where that moment exceeds pi/a sqrt(EI GJ), EI being the smaller stiffness and a the joints' distance
[Timoshenko and Gere, Theory of Elastic Stability, chapter 6, pure bending of a strip].
"""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.geometry.vectors import cross, dot, unit
from rodshell.layout import GridMesh
from rodshell.rods.section import Circle, Ellipse, GivenSection, Rod, Tube
from rodshell.targets import Target
from rodshell.units import length_text

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
    target: Target, mesh: GridMesh, positions: Floats, edges: Bools, rod: Rod, spacing: float
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
class StrongBending:
    """How the rods of a net bend about their strong axis.

    Parameters
    ----------
    ratio : of the larger bending stiffness to the smaller.
    flat : whether they lie flat, the strong axis being the surface's normal; else they stand on edge.
    curvature : about the strong axis, where the moment is largest [1/m].
    moment : the largest moment that it takes, over that at which a rod buckles sideways between its joints.
    beyond : share of the rods' length where the moment is beyond that.
    """

    ratio: float
    flat: bool
    curvature: float
    moment: float
    beyond: float

    @property
    def warnings(self) -> tuple[str, ...]:
        if self.beyond <= MUCH:
            return ()
        ways, stiffnesses = ["within the surface", "out of it"], ["EI2", "EI1"]
        if not self.flat:
            ways, stiffnesses = ["out of the surface", "within it"], ["EI1", "EI2"]
        return (
            f"the rods are {self.ratio:.3g} times as stiff {ways[0]} as {ways[1]} ({'/'.join(stiffnesses)}), and the "
            f"target bends them that way down to a radius of {length_text(1.0 / self.curvature)}: up to "
            f"{self.moment:.3g} times the moment at which they buckle sideways between joints, and beyond it on "
            f"{100 * self.beyond:.0f} % of their length; use rods with less of a strong axis (rod.section), a smaller "
            "spacing or a flatter target",
        )


def strong_bending(target: Target, mesh: GridMesh, positions: Floats, bends: Bools, rod: Rod) -> StrongBending | None:
    """Of rods that cannot roll at their joints; None where they bend alike all ways.

    bends : (b,) those of the mesh that lie on the target, its nodes being at `positions` (n, 3) [m].
    """
    stiffnesses = rod.bend_stiffnesses
    weak, strong = sorted(stiffnesses)
    if weak == strong or not bends.any():
        return None
    flat = stiffnesses[1] == strong
    before, here, after = (positions[mesh.bends[bends, k]] for k in range(3))
    towards = target.on_surface(here).normal
    if flat:
        towards = unit(cross(towards, after - before))
    length = mesh.voronoi_lengths[bends]
    curvature = np.abs(dot(unit(after - here) - unit(here - before), towards)) / length
    moment = strong * curvature * _spans(mesh)[mesh.bend_rods[bends]] / (pi * sqrt(weak * rod.twist_stiffness))
    worst = int(np.argmax(moment))
    beyond = float(length[moment > 1.0].sum() / length.sum())
    return StrongBending(strong / weak, flat, float(curvature[worst]), float(moment[worst]), beyond)


def _spans(mesh: GridMesh) -> Floats:
    """(m,) usual distance of the joints of each rod [m]; 0 of a rod that has but one."""
    crossings, result = mesh.grid.crossings, np.zeros(len(mesh.grid.rods))
    for rod in range(len(result)):
        gaps = np.diff(np.sort(crossings.at[crossings.rods == rod]))
        if len(gaps):
            result[rod] = np.median(gaps)
    return result
