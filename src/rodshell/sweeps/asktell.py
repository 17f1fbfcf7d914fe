"""Searches by populations: asked for points, and given their values; the algorithms are pymoo's.

A search depends on its seed and the values that it is given, and on nothing else, so that it is restored by the same
values.
"""

from typing import Any, Self

import numpy as np

from rodshell.arrays import Floats


class AskTell:
    """A search for small values, maybe of several objectives, where no constraint is above zero.

    Make one by `differential_evolution` or `nsga2`.
    """

    def __init__(
        self, algorithm: Any, lower: Floats, upper: Floats, *, objectives: int, constraints: int, seed: int
    ) -> None:
        from pymoo.core.problem import Problem

        problem = Problem(n_var=len(lower), n_obj=objectives, n_ieq_constr=constraints, xl=lower, xu=upper)
        algorithm.setup(problem, seed=seed, termination=("n_gen", np.inf))
        self._algorithm = algorithm
        self._asked: Any = None

    @classmethod
    def differential_evolution(
        cls, lower: Floats, upper: Floats, first: Floats, *, constraints: int = 0, seed: int, difference: float,
        crossed: float,
    ) -> Self:  # fmt: skip
        """Of one objective, DE/best/1/bin: each individual has one child, the best of all moved by the difference of
        two others and crossed with the parent, which it replaces if it is better.

        Args:
            lower, upper: (n,) bounds; first : (k, n) population.
            constraints: their number; seed : of the random numbers.
            difference: factor of the difference; crossed : share of the variables that come from the moved one.

        Raises:
            ImportError: pymoo is not installed.
        """
        from pymoo.algorithms.soo.nonconvex.de import DE

        algorithm = DE(
            pop_size=len(first), sampling=first, variant="DE/best/1/bin", F=difference, CR=crossed, prob_mut=0.0
        )
        return cls(algorithm, lower, upper, objectives=1, constraints=constraints, seed=seed)

    @classmethod
    def nsga2(
        cls, lower: Floats, upper: Floats, first: Floats, *, objectives: int, constraints: int = 0, seed: int
    ) -> Self:
        """Of several objectives: the non-dominated sorting genetic algorithm [Deb et al. 2002].

        Args:
            lower, upper: (n,) bounds; first : (k, n) population.
            objectives, constraints: their numbers; seed : of the random numbers.

        Raises:
            ImportError: pymoo is not installed.
        """
        from pymoo.algorithms.moo.nsga2 import NSGA2

        algorithm = NSGA2(pop_size=len(first), sampling=first)
        return cls(algorithm, lower, upper, objectives=objectives, constraints=constraints, seed=seed)

    def ask(self) -> Floats:
        """(k, n) points of the next generation."""
        self._asked = self._algorithm.ask()
        points: Floats = self._asked.get("X")
        return points

    def tell(self, values: Floats, violations: Floats | None = None) -> None:
        """What was found there.

        Args:
            values: (k, objectives); violations : (k, constraints), above zero where a constraint does not hold.
        """
        self._asked.set("F", values)
        if violations is not None:
            self._asked.set("G", violations)
        self._algorithm.tell(self._asked)

    @property
    def survivors(self) -> tuple[Floats, Floats]:
        """(k, n) points and (k, objectives) values of the population."""
        return self._algorithm.pop.get("X"), self._algorithm.pop.get("F")
