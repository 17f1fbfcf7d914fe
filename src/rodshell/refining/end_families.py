"""Families of variables at the ends of rods: directions of clamps, and supports that move along the boundary."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.geometry.frames import cross, unit
from rodshell.model.shell import last_edges
from rodshell.refining.change import Change
from rodshell.refining.length_families import FIRST, MOST, usual_span
from rodshell.refining.structure import Structure
from rodshell.refining.symmetry import Image, Operation
from rodshell.refining.variables import Box, Grid, Variables
from rodshell.rods.supports import CLAMPED
from rodshell.targets import Target
from rodshell.units import shown

MOST_TURN, FIRST_TURN = radians(15.0), radians(1.0)
PROBE = 1e-5  # of the target's size: differences of points on it are then exact to 1e-8
CORRECTIONS = 4  # of a support's place


@dataclass(frozen=True, eq=False)
class Directions(Variables):
    """Variables: two tangents of angles for each clamp, by which it is tilted out of the surface and turned within it.

    Args:
        axes: (2, 2m, 3) unit vectors across the clamp's direction: out of the surface, and within it.
        box: (4m,) the tilts and turns of each end in turn [-].
    """

    structure: Structure
    axes: Floats
    box: Box
    image: Callable[[Operation], Image]

    def _turned(self, values: Floats) -> Floats:
        """(2m, 3) directions of the clamps by `values` (4m,), not of length 1."""
        tilt, turn = values.reshape(-1, 2).T[:, :, None] * self.axes
        return np.asarray(self.structure.popped.boundary.tangents + tilt + turn)

    def change(self, values: Floats) -> Change:
        result, turned = self.no_change(), self._turned(values)
        length, now = np.linalg.norm(turned, axis=1)[:, None], unit(turned)
        reach, ends = last_edges(self.structure.mesh)[:, None], len(now)
        result.held[ends:] = reach * (now - self.structure.popped.boundary.tangents)
        for k, axis in enumerate(self.axes):
            across = (axis - np.einsum("ex,ex->e", axis, now)[:, None] * now) / length
            result.held_slopes[2 * np.arange(ends) + k, ends + np.arange(ends)] = reach * across
        return result

    def applied(self, grid: Grid, values: Floats) -> Grid:
        return replace(grid, boundary=replace(grid.boundary, tangents=unit(self._turned(values))))


@dataclass(frozen=True)
class Clamps:
    """Directions in which the rods' ends are clamped."""

    name = "clamps"

    def on(self, structure: Structure) -> Directions:
        """How much each clamp is tilted and turned.

        Raises:
            InputError: its ends are pinned.
        """
        if not len(structure.popped.shell.ghosts):
            raise InputError(f"the directions of clamps can only vary with ends = {shown(CLAMPED.name)}")
        boundary = structure.popped.boundary
        normals = structure.target.gap(boundary.points).normal
        within = unit(cross(normals, boundary.tangents))
        axes = np.stack([cross(boundary.tangents, within), within])
        box = Box.about_zero(2 * len(boundary.points), np.tan(MOST_TURN), np.tan(FIRST_TURN))

        def image(by: Operation) -> Image:
            index = np.column_stack([2 * by.ends, 2 * by.ends + 1]).ravel()
            return Image(index, np.tile([1.0, by.handed], len(by.ends)))

        return Directions(structure, axes, box, image)


@dataclass(frozen=True, eq=False)
class Slides(Variables):
    """Variables: how far each rod end is moved along the target's end, with its clamp; it stays as near to that end.

    Args:
        along, inwards: (2m, 3) unit vectors in the surface, along its end and across it.
        box: (2m,) [m].
    """

    structure: Structure
    along: Floats
    inwards: Floats
    box: Box
    image: Callable[[Operation], Image]

    def moved(self, values: Floats) -> Floats:
        """(2m, 3) displacements of the rod ends by `values` (2m,) [m].

        Each end goes along a straight line, and from there back to the surface and to its distance from the end. What
        that does to an end that is not moved at all is taken away: so no variable has an effect at zero.
        """
        return np.asarray(self._placed(values) - self._placed(0.0 * values))

    def change(self, values: Floats) -> Change:
        result, every, step = self.no_change(), np.arange(len(values)), PROBE * self.structure.target.size
        ahead, behind = (self._placed(values + sign * step) for sign in (1.0, -1.0))
        for first in range(0, len(result.held), len(values)):  # the ends, and the ghost nodes of clamps
            result.held[first + every] = self.moved(values)
            result.held_slopes[every, first + every] = (ahead - behind) / (2.0 * step)
        return result

    def applied(self, grid: Grid, values: Floats) -> Grid:
        return replace(grid, boundary=replace(grid.boundary, points=grid.boundary.points + self.moved(values)))

    def _placed(self, values: Floats) -> Floats:
        target, points = self.structure.target, self.structure.popped.boundary.points
        height, margin = target.distance(points), target.margin(points)
        x = points + values[:, None] * self.along
        for _ in range(CORRECTIONS):
            gap = target.gap(x)
            x = x - (gap.distance - height)[:, None] * gap.normal
            x = x + ((margin - target.margin(x)) / _steepness(target, x, self.inwards))[:, None] * self.inwards
        return x


def _steepness(target: Target, points: Floats, axes: Floats) -> Floats:
    """(k,) growth of the distance from the target's end along unit vectors [-]."""
    step = PROBE * target.size
    return np.asarray((target.margin(points + step * axes) - target.margin(points - step * axes)) / (2.0 * step))


@dataclass(frozen=True)
class Supports:
    """Positions of the supports along the end of the target."""

    name = "supports"

    def on(self, structure: Structure) -> Slides:
        """How far each rod end is moved."""
        target, points = structure.target, structure.popped.boundary.points
        normals = target.gap(points).normal
        steep = np.stack([_steepness(target, points, axis) for axis in np.eye(3)], axis=1)
        inwards = unit(steep - np.einsum("ex,ex->e", steep, normals)[:, None] * normals)
        span = usual_span(structure.mesh)
        box = Box.about_zero(len(points), MOST * span, FIRST * span)
        return Slides(
            structure, cross(normals, inwards), inwards, box, lambda by: Image(by.ends, np.full(len(points), by.handed))
        )
