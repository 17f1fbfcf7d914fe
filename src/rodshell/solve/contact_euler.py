"""Steps of implicit Euler with contact: predictor, and corrector until no new node is below [HQK Algorithm 1].

Every step starts with nothing in contact, so that nodes can leave: one that the rest of the step lifts is not below
after the predictor. Where a law has friction, touching nodes first stick; those that stick by more than friction can
hold slip, with the force of friction held over the rest of the step.
"""

from dataclasses import replace
from typing import Protocol, TypeVar

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.solve.constraint import Constraint
from rodshell.solve.forces import PointLoads
from rodshell.solve.implicit_euler import ImplicitEuler, MakeMatrix, Motion, Refused, Step
from rodshell.solve.summed import narrow_or_sparse

MOST_PASSES = 30


class Planes(Constraint, Protocol):
    """The supports and the planes of nodes in contact."""

    @property
    def nodes(self) -> Ints: ...


P = TypeVar("P", bound=Planes)


class ContactLaw(Protocol[P]):
    """What `contact.modified_mass.ModifiedMass` offers."""

    def touching(self, supports: Constraint, state: Floats) -> P: ...
    def below(self, state: Floats, touching: P) -> P | None: ...
    def released(self, touching: P, reactions: Floats) -> tuple[P, Floats] | None: ...
    def landed(self, velocity: Floats, touching: P) -> Floats: ...


class ContactEuler:
    """Takes single steps, as `ImplicitEuler` does.

    Attributes
    ----------
    last : the constraint that the last step ended with.
    """

    def __init__(self, law: ContactLaw[P], matrix: MakeMatrix = narrow_or_sparse) -> None:
        self._law, self._euler = law, ImplicitEuler(matrix)
        self.last: P | None = None

    def take(self, motion: Motion, state: Floats, velocity: Floats, *, time: float, step: float) -> Step | Refused:
        law = self._law
        touching = law.touching(motion.constraint_at(time + step), state)
        rubbing = np.zeros_like(state)
        forces = motion.forces
        iterations = factorizations = 0
        for _ in range(MOST_PASSES):
            bound = replace(motion, constraint=touching, forces=forces)
            taken = self._euler.take(bound, state, velocity, time=time, step=step)
            factorizations += taken.factorizations
            if isinstance(taken, Refused):
                return replace(taken, factorizations=factorizations)
            iterations += taken.iterations
            more = law.below(taken.state, touching)
            if more is not None:
                touching = more
                continue
            slipping = law.released(touching, taken.reactions)
            if slipping is not None:
                touching, rubs = slipping
                rubbing += rubs
                forces = (*motion.forces, PointLoads(touching.nodes, rubbing[touching.nodes]))
                continue
            self.last = touching
            landed = law.landed(taken.velocity, touching)
            return Step(taken.state, landed, taken.reactions + rubbing, iterations, factorizations)
        return Refused(f"contact has not settled in {MOST_PASSES} passes", factorizations)
