"""Rods that are curved at rest: cut from a board, or bent when they were made."""

from typing import NamedTuple

import numpy as np

from rodshell.arrays import Floats


class RestCurve(NamedTuple):
    """The curvature of an unstressed rod that lies flat, linear between stations.

    Args:
        stations: material coordinates, ascending [m].
        curvatures: there, positive to the left seen from above [1/m].
    """

    stations: tuple[float, ...]
    curvatures: tuple[float, ...]

    def at(self, s: Floats) -> Floats:
        """Curvatures (...) at material coordinates `s` (...) [m]."""
        return np.asarray(np.interp(s, self.stations, self.curvatures))

    def between(self, start: float, end: float) -> "RestCurve":
        """The part from `start` to `end` [m], its stations measured from its start."""
        apart = 1e-6 * (end - start)
        s = np.array([start, *(s for s in self.stations if start + apart < s < end - apart), end])
        return RestCurve(tuple((s - start).tolist()), tuple(self.at(s).tolist()))

    def line(self, s: Floats) -> Floats:
        """(k, 2) points of the rod at rest, from the origin along x, at ascending material coordinates `s` (k,) [m]."""
        fine = np.union1d(s, np.linspace(s[0], s[-1], 20 * len(self.stations)))
        middle, step = 0.5 * (fine[1:] + fine[:-1]), np.diff(fine)
        curvature = self.at(fine)
        heading = np.append(0.0, np.cumsum(0.5 * step * (curvature[1:] + curvature[:-1])))
        halfway = heading[:-1] + 0.25 * step * (curvature[:-1] + self.at(middle))
        rates = [np.column_stack([np.cos(angle), np.sin(angle)]) for angle in (heading[:-1], halfway, heading[1:])]
        pieces = step[:, None] / 6.0 * (rates[0] + 4.0 * rates[1] + rates[2])  # Simpson
        points = np.vstack([np.zeros(2), np.cumsum(pieces, axis=0)])
        return points[np.searchsorted(fine, s)]
