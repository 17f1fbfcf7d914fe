"""How a solve ended: one record for every solver."""

from dataclasses import dataclass, replace
from enum import Enum


class Status(Enum):
    """Typed results; `sentence` says what to do."""

    CONVERGED = "converged"
    STALLED = "stalled"
    DIVERGED = "diverged"
    LOST_CONTACT = "lost contact"
    MOVING = "not at rest"
    BUCKLED = "buckled"
    OUT_OF_TIME = "out of time"

    @property
    def sentence(self) -> str:
        return _SENTENCES[self]


_SENTENCES = {
    Status.CONVERGED: "converged",
    Status.STALLED: "stopped at the largest number of iterations above its tolerance; refine the mesh or "
    "reduce the spacing",
    Status.DIVERGED: "the iteration diverged; reduce the spacing, or choose another anchor or heading",
    Status.LOST_CONTACT: "the grid lost contact with the target (without friction nothing holds it there); "
    "use method = bound",
    Status.BUCKLED: "was given up at its start: released from the target, the rods would buckle between their joints "
    "in very many places; a smaller spacing, a flatter target or, of laths, narrower ones may do",
    Status.OUT_OF_TIME: "was out of time",
    Status.MOVING: "was not at rest when its time was over; give it a longer duration, or drag",
}


@dataclass(frozen=True)
class SolveReport:
    """Figures of one solve.

    Parameters
    ----------
    dofs : reduced unknowns.
    force_residual : largest component of the gradient in the free directions [N].
    max_strain : largest axial strain, or constraint strain where rods are inextensible [-].
    negative_modes : of the exact Hessian in the free directions at the final state; 0 says stable.
    reason : when and where it was out of time, or "".
    """

    status: Status
    dofs: int
    iterations: int
    factorizations: int
    seconds: float
    force_residual: float
    max_strain: float
    negative_modes: int
    reason: str = ""

    @property
    def sentence(self) -> str:
        """How it ended, and what to do."""
        return self.reason or self.status.sentence

    @property
    def converged(self) -> bool:
        return self.status is Status.CONVERGED

    @property
    def stable(self) -> bool:
        return self.converged and self.negative_modes == 0

    def after(self, *earlier: "SolveReport") -> "SolveReport":
        """This report with the work of earlier solves added.

        Parameters
        ----------
        earlier : reports of the solves that led to this one.
        """
        return replace(
            self,
            iterations=self.iterations + sum(report.iterations for report in earlier),
            factorizations=self.factorizations + sum(report.factorizations for report in earlier),
            seconds=self.seconds + sum(report.seconds for report in earlier),
        )
