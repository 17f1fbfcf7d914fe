"""What the cheapest refinement that anybody can build would gain: double laths over the middle of every rod.

One step of Gauss and Newton's method from laths that are double over half of their length, and the equilibrium that it
leads to: a few factorisations. The gates are not tried.
"""

from dataclasses import dataclass

from rodshell.errors import InputError, OutOfTimeError
from rodshell.formfinding.patches import PatchedForm, merged_agreement
from rodshell.formfinding.pipeline import PatchForm
from rodshell.formfinding.popup import Ends
from rodshell.progress import Progress, silent
from rodshell.refining.gauss_newton import Step
from rodshell.refining.refine import refine
from rodshell.refining.stiffness_families import DoubleLaths
from rodshell.units import percent_text

WORTH = 0.8  # of the gap before: a larger one after is a small gain


@dataclass(frozen=True)
class Offer:
    """What a refinement would gain.

    Parameters
    ----------
    ends : how the rods' ends are held.
    before, after : root mean square of the gap over the target's size, as the form is and with double laths.
    shares : smallest and largest share of a rod's length that is then double, patch by patch.
    others : the gap with the form's other ends, as it is.
    factorizations : that finding it took.
    """

    ends: Ends
    before: float
    after: float
    shares: tuple[float, float]
    others: dict[Ends, float]
    factorizations: int

    @property
    def words(self) -> str:
        """One line: the gain, and which ends to choose."""
        low, high = (f"{100 * share:.0f}" for share in self.shares)
        part = f"the middle {low if low == high else f'{low} to {high}'} % of every rod"
        gain = f"{percent_text(self.before)} -> {percent_text(self.after)} rms"
        if self.after > WORTH * self.before:
            words = f"double laths would gain little with {self.ends} ends ({gain})"
        else:
            words = f"double laths over {part}, {self.ends} ends: gap {gain} (--vary double --ends {self.ends})"
        for ends, gap in self.others.items():
            better = min(self.after, self.before)
            if gap < better:
                words += (
                    f"; choose {ends} ends where supports can hold the rods' directions: {percent_text(gap)} as it is"
                )
            else:
                words += f"; {ends} ends have {percent_text(gap)}: choose {self.ends} ones"
        return words


def offer(stages: PatchForm | PatchedForm, *, progress: Progress = silent) -> Offer | None:
    """What double laths would gain, for pinned ends if the form has them.

    Parameters
    ----------
    stages : a form.
    progress : called as progress(stage, detail, residual).

    Returns
    -------
    None where the form has no stable shell and no target, or the time was over.
    """
    if stages.status != "converged" or not stages.agreement:
        return None
    patches = [stages] if isinstance(stages, PatchForm) else list(stages.patches.values())
    ends: Ends = next(iter(stages.agreement))
    if not all(patch.popped[ends].report.stable for patch in patches):
        return None

    def searching(step: Step) -> None:
        progress("offer", f"double laths, design {step.number}", 0.0)

    try:
        progress("offer", "double laths", 0.0)
        found = [refine(patch, DoubleLaths(), ends=ends, most_evaluations=2, progress=searching) for patch in patches]
    except (InputError, OutOfTimeError):
        return None
    shares = [float(part.designs[-1].point.values[0]) for part in found]
    return Offer(
        ends,
        stages.agreement[ends].rms_relative,
        merged_agreement([part.gap_after for part in found]).rms_relative,
        (min(shares), max(shares)),
        {other: gap.rms_relative for other, gap in stages.agreement.items() if other != ends},
        sum(part.factorizations for part in found),
    )
