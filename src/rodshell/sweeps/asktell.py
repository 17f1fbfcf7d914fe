"""Searches by populations: asked for points, and given their values; the algorithms are pymoo's.

A search depends on its seed and the values that it is given, and on nothing else, so that it is restored by the same
values.
"""

from typing import Any

import numpy as np

from rodshell.arrays import Floats

DIFFERENCE, CROSSED = 0.6, 0.9  # smaller steps or populations converge to a worse minimum


class AskTell:
    """A search for small values where no constraint is above zero.

    Of one objective by differential evolution, DE/best/1/bin: each individual has one child, the best of all moved by
    the difference of two others and crossed with the parent, which it replaces if it is better. Of several objectives
    by the non-dominated sorting genetic algorithm [Deb et al. 2002].

    Args:
        lower, upper: (n,) bounds.
        first: (k, n) population.
        objectives, constraints: their numbers.

    Raises:
        ImportError: pymoo is not installed.
    """

    def __init__(
        self, lower: Floats, upper: Floats, first: Floats, *, objectives: int = 1, constraints: int = 0, seed: int
    ) -> None:
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.algorithms.soo.nonconvex.de import DE
        from pymoo.core.problem import Problem

        self._algorithm: Any
        if objectives == 1:
            best = {"variant": "DE/best/1/bin", "F": DIFFERENCE, "CR": CROSSED, "prob_mut": 0.0}
            self._algorithm = DE(pop_size=len(first), sampling=first, **best)
        else:
            self._algorithm = NSGA2(pop_size=len(first), sampling=first)
        problem = Problem(n_var=len(lower), n_obj=objectives, n_ieq_constr=constraints, xl=lower, xu=upper)
        self._algorithm.setup(problem, seed=seed, termination=("n_gen", np.inf))
        self._asked: Any = None

    def ask(self) -> Floats:
        """(k, n) points of the next generation."""
        self._asked = self._algorithm.ask()
        points: Floats = self._asked.get("X")
        return points

    def tell(self, values: Floats, violations: Floats | None = None) -> None:
        """What was found there.

        Args:
            values: (k, objectives).
            violations: (k, constraints), above zero where a constraint does not hold.
        """
        self._asked.set("F", values)
        if violations is not None:
            self._asked.set("G", violations)
        self._algorithm.tell(self._asked)

    @property
    def survivors(self) -> tuple[Floats, Floats]:
        """(k, n) points and (k, objectives) values of the population."""
        return self._algorithm.pop.get("X"), self._algorithm.pop.get("F")
