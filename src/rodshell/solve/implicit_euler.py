"""One step of implicit Euler, by Newton's method in the free directions [HQK Eqs 3a-c, 4].

    M dq - h M v - h^2 F(q + dq) = 0,   v <- dq / h,   matrix M / h^2 + C / h + K   (Eq 4 over h^2)

Newton's method is damped by the natural monotonicity test [Deuflhard 2004, section 3.3]: a step is kept if the
simplified step that follows, by the same factors, is shorter. All lengths of steps are measured by the mass,
sqrt(sum m dq^2), so that metres and radians may be summed. The simplified step also corrects, and shows what is
left: steps of the lengths L0, L1 by one matrix are followed by one of about 2 L1^2 / L0, since the error of the
matrix, which made L1 of L0 where it grew from nothing, is there from the start. Where the motion is smooth, one
factorisation, two solutions and two evaluations, one with the Hessian, make a step.

A step whose matrix has negative pivots is refused. It would be longer than the time in which an instability
grows, and could end on a saddle of  |dq - h v|^2_M / 2h^2 + E;  at a minimum of that function, reached over convex
ground, kinetic and elastic energy together do not grow. Smaller steps have more of M / h^2 and pass.

The source frames of the elements stay those of the step's start and are refreshed when it is accepted. The twist
angles of a motion are therefore measured from frames that travel with the rod, and mean nothing without them.

With contact (`ContactEuler`) [HQK Algorithm 1] a step is a predictor, and a corrector until no new node is below the
target. Every step starts with nothing in contact, so that nodes can leave: one that the rest of the step lifts is not
below after the predictor. Where a law has friction, touching nodes first stick; those that stick by more than friction
can hold slip, with the force of friction held over the rest of the step.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isfinite
from typing import Self

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.contact.modified_mass import ModifiedMass, Touching
from rodshell.errors import InputError
from rodshell.kernels import njit
from rodshell.model import Freedom, Potential, Shell
from rodshell.model.elastic_rod import ElasticRod
from rodshell.rods.elements import NO_HESSIANS, Elements, in_parts
from rodshell.solve.newton_matrix import SummedMatrix, narrow_or_sparse
from rodshell.solve.problem import NO_CURVATURE, Constraint, Damping, Force, ImplicitForce, PointLoads, Supports
from rodshell.solve.sparse_ldl import SingularError
from rodshell.validation import array, described, function_of, instance, listed

MakeMatrix = Callable[[list[Ints], Freedom], SummedMatrix]

_RELATIVE = 1e-9  # of the step's own motion: what is left once the last simplified step has been taken
ROUND_OFF = 1e-13  # of the state: a shorter step cannot be distinguished from zero
_CONTRACTION = 0.1  # simplified steps that shorten by less than this are not worth continuing
MOST_ITERATIONS = 20
_LEAST_SHARE = 1 / 64
_MOST_PASSES = 30  # of predictor and corrector, with contact
PART = 1024  # elements evaluated at a time: their Hessians (2 MB) stay in the cache, and memory stays small


@dataclass(frozen=True, eq=False)
class Motion:
    """A body, its supports and the forces on it.

    Args:
        elements: every energy, stretch included; their source frames are those of the state to start from.
        mass: (N, 3) lumped mass of each component [kg]; of a twist angle the rotary inertia [kg m2].
        constraint: supports or a surface; or what they are at a time [s], for a motion that is prescribed.
        explicit: energies whose forces are frozen at the start of a step (`ExplicitPenalty`); not among the elements.
    """

    elements: tuple[Elements, ...]
    mass: Floats
    constraint: Constraint | Callable[[float], Constraint]
    forces: tuple[Force, ...] = ()
    explicit: tuple[Elements, ...] = ()

    def __post_init__(self) -> None:
        mass = array("the mass", self.mass, np.float64, None, 3)
        if not (allowed := np.isfinite(mass) & (mass >= 0)).all():
            where = np.argwhere(~allowed)[0].tolist()
            raise InputError(f"the mass is {mass[tuple(where)]} at {where}: give finite numbers of 0 or more")
        for name, values, needed in (
            ("elements", self.elements, "evaluate"),
            ("explicit", self.explicit, "evaluate"),
            ("forces", self.forces, "held"),
        ):
            for value in listed(name, values, f"a tuple of objects with {needed}(...)"):
                if not callable(getattr(value, needed, None)) or isinstance(value, type):
                    raise InputError(f"each of {name} must have {needed}(...), not {described(value)}")
        if not (callable(self.constraint) or callable(getattr(self.constraint, "freedom", None))):
            raise InputError(
                f"constraint must be rodshell supports, or a function of time, not {described(self.constraint)}"
            )

    @classmethod
    def of(
        cls,
        body: ElasticRod | Shell,
        *,
        constraint: Freedom | Constraint | Callable[[float], Constraint] | None = None,
        forces: tuple[Force, ...] = (),
    ) -> Self:
        """The motion of a rod or a shell; without a constraint it is free.

        Args:
            body: its source frames being at the state to start from.
            constraint: as of `Motion`; one that never moves may be given as a `Freedom`.
        """
        instance("body", body, ElasticRod | Shell)
        given = body.freedom() if constraint is None else constraint
        supports = Supports(given) if isinstance(given, Freedom) else given
        implicit = [element for element in body.elements if all(element is not other for other in body.explicit)]
        return cls((*implicit, body.stretch), body.mass, supports, forces, body.explicit)

    def constraint_at(self, time: float) -> Constraint:
        return self.constraint(time) if callable(self.constraint) else self.constraint

    @property
    def energies(self) -> Potential:
        """The sum of all energies."""
        return Potential((*self.elements, *self.explicit))

    def elastic_energy(self, state: Floats) -> float:
        """[J]"""
        return self.energies.energy(state)

    def kinetic_energy(self, velocity: Floats) -> float:
        """[J]"""
        return 0.5 * float(np.vdot(self.mass * velocity, velocity))

    def refreshed(self, state: Floats) -> Self:
        """The same motion with its source frames at `state`."""
        elements = tuple([element.refreshed(state) for element in self.elements])
        explicit = tuple([element.refreshed(state) for element in self.explicit])
        return type(self)(elements, self.mass, self.constraint, self.forces, explicit)

    def in_parts(self, most: int = PART) -> Self:
        """The same motion with its element sets divided, so that their Hessians stay in the cache."""
        return replace(self, elements=tuple(part for element in self.elements for part in in_parts(element, most)))


@dataclass(frozen=True, eq=False)
class Step:
    """A step taken: state (N, 3), velocity (N, 3), and the forces (N, 3) [N] that the supports exert."""

    state: Floats
    velocity: Floats
    reactions: Floats
    iterations: int
    factorizations: int


@dataclass(frozen=True)
class Refused:
    """A step that could not be taken, and why."""

    reason: str
    factorizations: int


class ImplicitEuler:
    """Takes single steps; keeps the matrix and the buffers between them, and nothing of the motion."""

    def __init__(self, matrix: MakeMatrix = narrow_or_sparse) -> None:
        function_of("matrix", matrix, "a function of blocks and free directions", None, None)
        self._make_matrix = matrix
        self._planned: tuple[object, ...] = ()

    def take(self, motion: Motion, state: Floats, velocity: Floats, *, time: float, step: float) -> Step | Refused:
        """One step.

        Args:
            motion: its source frames being at the state.
            state: (N, 3) at the start [m, at twist angles rad]; velocity : (N, 3) [m/s, rad/s].
            time: of the start [s].
            step: its length [s].

        Raises:
            InputError: an external force is not finite.
        """
        end = time + step
        constraint = motion.constraint_at(end)
        free = constraint.freedom(state)
        implicit = tuple([force for force in motion.forces if isinstance(force, ImplicitForce)])
        held, inertia = motion.mass * velocity, motion.mass / step**2
        held /= step
        for force in motion.forces:
            given = force.held(end, state, velocity, motion.mass)
            if given is not None:
                held += given
            if isinstance(force, Damping):
                inertia += force.drag(motion.mass) / step
        if motion.explicit:
            held -= Potential(motion.explicit).gradient(state)
        if not isfinite(float(held.sum())):
            raise InputError(f"an external force is not finite at t = {end:.6g} s: check its parameters")
        self._plan(motion, implicit, free)
        return _Newton(self, motion, constraint, implicit, inertia, held, state, velocity, end, step).solve()

    def _plan(self, motion: Motion, implicit: tuple[ImplicitForce, ...], free: Freedom) -> None:
        """Work arrays; allocated again only where the elements' blocks or the count of free directions have changed."""
        blocks = [*(element.blocks for element in motion.elements), *(force.blocks for force in implicit)]
        old = self._planned
        if old and len(old) == len(blocks) + 1 and all(a is b for a, b in zip(old[1:], blocks, strict=True)):
            count = old[0]
            if count is free.count or np.array_equal(count, free.count):  # type: ignore[arg-type]
                return
        self._planned = (free.count, *blocks)
        self.matrix = self._make_matrix(blocks, free)
        widths = {3 * b.shape[1]: max(len(c) for c in blocks if c.shape[1] == b.shape[1]) for b in blocks}
        self.buffers = {width: np.zeros((count, width, width)) for width, count in widths.items()}


class ContactEuler:
    """Takes single steps, as `ImplicitEuler` does.

    Attributes:
        last: the constraint that the last step ended with.

    Args:
        law: what holds nodes that touch.
        matrix: makes the matrix of the Newton iterations.
    """

    def __init__(self, law: ModifiedMass, matrix: MakeMatrix = narrow_or_sparse) -> None:
        self._law, self._euler = law, ImplicitEuler(matrix)
        self.last: Touching | None = None

    def take(self, motion: Motion, state: Floats, velocity: Floats, *, time: float, step: float) -> Step | Refused:
        """One step; parameters as of `ImplicitEuler.take`."""
        law = self._law
        touching = Touching.none(motion.constraint_at(time + step), state)
        rubbing = np.zeros_like(state)
        forces = motion.forces
        iterations = factorizations = 0
        for _ in range(_MOST_PASSES):
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
        return Refused(f"contact has not settled in {_MOST_PASSES} passes", factorizations)


@dataclass(eq=False)
class _Newton:
    """Newton's iteration of one step."""

    plan: ImplicitEuler
    motion: Motion
    constraint: Constraint
    implicit: tuple[ImplicitForce, ...]
    inertia: Floats  # (N, 3) diagonal M / h^2 + C / h
    held: Floats  # (N, 3) M v / h and the forces that stay over the step
    start: Floats
    velocity: Floats
    end: float
    step: float

    def solve(self) -> Step | Refused:
        free = self.constraint.freedom(self.start)
        moved = free.expand(self.step * free.reduce(self.velocity))
        going = self.constraint.remaining(self.start)
        if going is not None:
            moved += going
        state, moved = self._retracted(moved)
        floor = ROUND_OFF * self._size(self.start)
        for iteration in range(1, MOST_ITERATIONS + 1):
            free = self.constraint.freedom(state)
            try:
                total = self._forces(free, state, moved, hessian=True)
                negative = self.plan.matrix.factor()
            except SingularError as error:
                return Refused(f"{error}: an edge turned by half a revolution, or nothing holds a block", iteration)
            if negative:
                return Refused(f"the step's matrix has {negative} negative pivots", iteration)
            newton = self.plan.matrix.solve(total, free)
            length, share = self._size(newton), 1.0
            while True:
                state, trial = self._retracted(moved - (newton if share == 1.0 else share * newton))
                simplified, reactions = self._simplified(state, trial)
                left = self._size(simplified)
                if left <= (1.0 - 0.25 * share) * length or left <= floor:
                    break
                share *= 0.5
                if share < _LEAST_SHARE:
                    return Refused("Newton's iteration does not contract", iteration)
            moved = trial
            while share == 1.0:
                state, moved = self._retracted(moved - simplified)
                bound = _RELATIVE * self._size(moved) + floor
                if left <= bound or 2.0 * left * left <= bound * length:
                    return Step(state, moved / self.step, reactions, iteration, iteration)
                if not left < _CONTRACTION * length:
                    break
                length = left
                simplified, reactions = self._simplified(state, moved)
                left = self._size(simplified)
        return Refused(f"Newton's iteration has not converged in {MOST_ITERATIONS} steps", iteration)

    def _simplified(self, state: Floats, moved: Floats) -> tuple[Floats, Floats]:
        """Minus Newton's step from here by the factors of the last matrix, and the forces of the supports."""
        free = self.constraint.freedom(state)
        total = self._forces(free, state, moved)
        return self.plan.matrix.solve(total, free), total

    def _forces(self, free: Freedom, state: Floats, moved: Floats, *, hessian: bool = False) -> Floats:
        """(N, 3) out-of-balance forces; if wanted, sums up Newton's matrix."""
        matrix, buffers = self.plan.matrix, self.plan.buffers
        total = self.inertia * moved
        total -= self.held
        if hessian:
            matrix.clear()
        for number, element in enumerate(self.motion.elements):
            hessians = buffers[3 * element.blocks.shape[1]][: len(element.blocks)] if hessian else NO_HESSIANS
            element.evaluate(state, total, hessians)
            if hessian:
                matrix.add(number, hessians, element.blocks, free)
        for number, force in enumerate(self.implicit, start=len(self.motion.elements)):
            given, hessians = force.at(self.end, state, moved / self.step, self.step)
            total -= given
            if hessian:
                matrix.add(number, hessians, force.blocks, free)
        if hessian:
            curvature = self.constraint.curvature(state, total)
            matrix.add_blocks(self.inertia, curvature if len(curvature) else NO_CURVATURE, free)
        return total

    def _retracted(self, moved: Floats) -> tuple[Floats, Floats]:
        """State and motion on the constraint. Where it is flat the motion keeps all its digits: v = dq / h."""
        state = self.start + moved
        back = self.constraint.retract(state)
        return (state, moved) if back is state else (back, back - self.start)

    def _size(self, motion: Floats) -> float:
        return float(_mass_norm(self.motion.mass.ravel(), motion.ravel()))


@njit("f1 f1", fastmath={"reassoc", "contract"})
def _mass_norm(mass, motion):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(len(motion)):
        total += mass[i] * motion[i] * motion[i]
    return np.sqrt(total)
