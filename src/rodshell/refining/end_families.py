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
from rodshell.refining.structure import Structure
from rodshell.refining.symmetry import Image, Operation
from rodshell.refining.variables import Box, Grid

MOST_TURN, FIRST_TURN = radians(15.0), radians(1.0)


@dataclass(frozen=True, eq=False)
class Directions:
    """Two tangents of angles for each clamp: how much it is tilted out of the surface, and turned within it.

    Parameters
    ----------
    structure : the shell.
    axes : (2, 2m, 3) unit vectors across the clamp's direction: out of the surface, and within it.
    box : of the variables, the tilts and turns of each end in turn [-].
    image : where an operation maps the variables.
    """

    structure: Structure
    axes: Floats
    box: Box
    image: Callable[[Operation], Image]

    def tangents(self, values: Floats) -> Floats:
        """(2m, 3) directions of the clamps.

        Parameters
        ----------
        values : (4m,) of the variables.
        """
        first = self.structure.popped.boundary.tangents
        tilt, turn = values.reshape(-1, 2).T[:, :, None] * self.axes
        return unit(first + tilt + turn)

    def change(self, values: Floats) -> Change:
        """What a design does.

        Parameters
        ----------
        values : (4m,) the design [-].
        """
        structure = self.structure
        first, now = structure.popped.boundary.tangents, self.tangents(values)
        tilt, turn = values.reshape(-1, 2).T[:, :, None] * self.axes
        length = np.linalg.norm(first + tilt + turn, axis=1)[:, None]
        reach, ends = last_edges(structure.mesh)[:, None], len(now)
        none = Change.none(len(structure.mesh.edges), 2 * ends, 2 * ends)
        held, slopes = none.held, none.held_slopes
        held[ends:] = reach * (now - first)
        for k, axis in enumerate(self.axes):
            across = (axis - np.einsum("ex,ex->e", axis, now)[:, None] * now) / length
            slopes[2 * np.arange(ends) + k, ends + np.arange(ends)] = reach * across
        return replace(none, held=held, held_slopes=slopes)

    def applied(self, grid: Grid, values: Floats) -> Grid:
        """The grid with these clamps.

        Parameters
        ----------
        grid : before.
        values : (4m,) the design [-].
        """
        return replace(grid, boundary=replace(grid.boundary, tangents=self.tangents(values)))


@dataclass(frozen=True)
class Clamps:
    """Directions in which the rods' ends are clamped."""

    name = "clamps"

    def on(self, structure: Structure) -> Directions:
        """How much each clamp is tilted and turned.

        Parameters
        ----------
        structure : the shell.

        Raises
        ------
        InputError : its ends are pinned.
        """
        if not len(structure.popped.shell.ghosts):
            raise InputError('the directions of clamps can only vary with ends = "clamped"')
        boundary = structure.popped.boundary
        normals = structure.target.gap(boundary.points).normal
        within = unit(cross(normals, boundary.tangents))
        axes = np.stack([cross(boundary.tangents, within), within])
        zero = np.zeros(2 * len(boundary.points))
        box = Box(zero, zero - np.tan(MOST_TURN), zero + np.tan(MOST_TURN), zero + np.tan(FIRST_TURN))

        def image(by: Operation) -> Image:
            index = np.column_stack([2 * by.ends, 2 * by.ends + 1]).ravel()
            return Image(index, np.tile([1.0, by.handed], len(by.ends)))

        return Directions(structure, axes, box, image)
