"""The motion in the plane z = 0 that brings points nearest to others."""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats
from rodshell.geometry.frames import cross


@dataclass(frozen=True, eq=False)
class PlanarMotion:
    """A turn about the vertical, by `turn` (2, 2) of rows x, y, and a shift that takes `centre` (3,) to `goal` (3,) in
    plan [m]."""

    centre: Floats
    goal: Floats
    turn: Floats

    @staticmethod
    def onto(points: Floats, goals: Floats) -> "PlanarMotion":
        """The motion of the shortest paths in plan from points (n, 3) to their goals (n, 3) [m], in the least-squares
        sense: Procrustes' problem [Schönemann 1966]."""
        centre, goal = points.mean(axis=0), goals.mean(axis=0)
        a, b = (points - centre) * (1.0, 1.0, 0.0), (goals - goal) * (1.0, 1.0, 0.0)
        angle = np.arctan2(cross(a, b)[:, 2].sum(), np.sum(a * b))
        return PlanarMotion(centre, goal, np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]))

    def moved(self, points: Floats, height: float) -> Floats:
        """Points (n, 3) after the motion, raised by `height` [m]."""
        result = np.empty_like(points)
        result[:, :2] = (points - self.centre)[:, :2] @ self.turn + self.goal[:2]
        result[:, 2] = height + points[:, 2]
        return result
