"""What the cheapest refinement that anybody can build would gain: double laths over the middle of every rod.

One step of Gauss and Newton's method in the share of each rod that is double, the derivative being the difference of
two shells: a few factorisations. Where that gains nothing one more design is tried near 1: rods that are double from
end to end have the shape of single ones, and a little less may be nearer. Neither the gates of a refinement nor its
limit on the lowest mode are tried.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rodshell.errors import InputError, OutOfTimeError
from rodshell.figures.records import Ends
from rodshell.formfinding.pipeline import Agreement, Stages, agreement
from rodshell.formfinding.popup import PopUp
from rodshell.layout.profile import DOUBLE, Profile
from rodshell.progress import Progress, silent
from rodshell.refining.structure import rebuilt
from rodshell.units import percent_text

FIRST, PROBE = 0.55, 0.1  # share of each rod that is double in the first design; the difference to the second
LONGEST = 0.3  # step to the third, which is where these two lead
NEAR_ALL = 0.9  # share of the fourth, which is tried where these three gain nothing
WORTH = 0.8  # of the gap before: a larger one after is a small gain


@dataclass(frozen=True)
class Offer:
    """What a refinement would gain.

    Args:
        before, after: root mean square of the gap over the target's size, as the form is and with double laths.
        shares: smallest and largest share of a rod's length that is then double, patch by patch.
        others: the gap with the form's other ends, as it is.
    """

    ends: Ends
    before: float
    after: float
    shares: tuple[float, float]
    others: dict[Ends, float]
    factorizations: int

    @property
    def words(self) -> str:
        """One line: the gain, and the gap with other ends."""
        low, high = (f"{100 * share:.0f}" for share in self.shares)
        part = f"the middle {low if low == high else f'{low} to {high}'} % of every rod"
        gain = f"{percent_text(self.before)} -> {percent_text(self.after)} rms"
        if self.after >= self.before:
            words = (
                f"no gain by double laths was found with {self.ends} ends "
                f"({percent_text(self.before)} rms as it is, {percent_text(self.after)} in the best design tried)"
            )
        elif self.after > WORTH * self.before:
            words = f"double laths would gain little with {self.ends} ends ({gain})"
        else:
            words = f"double laths over {part}, {self.ends} ends: gap {gain} (--vary double --ends {self.ends})"
        for ends, gap in self.others.items():
            better = gap < min(self.after, self.before)
            needs = ", which need supports that hold the rods' directions," if better else ""
            words += f"; with {ends} ends{needs} it is {percent_text(gap)} rms as it is"
        return words


def offer(stages: Stages, *, progress: Progress = silent) -> Offer | None:
    """What double laths would gain, for pinned ends if the form has them.

    Returns:
        None where the form has no target, no stable shell, or rods whose sections change along them; where no design of
        a patch is stable; or where the time was over.
    """
    if stages.status != "converged" or not stages.agreement:
        return None
    ends: Ends = next(iter(stages.agreement))
    if not stages.popped[ends].report.stable or stages.popped[ends].shell.yields:
        return None

    def telling(number: int) -> None:
        progress("offer", f"double laths, design {number}", 0.0)

    try:
        found = [_designs(patch, ends, telling) for patch in stages.parts]
    except InputError:
        return None
    if not all(designs for designs, _ in found):
        return None
    best = [min(designs, key=lambda design: design.gap.rms) for designs, _ in found]
    shares = [design.share for design in best]
    return Offer(
        ends,
        stages.agreement[ends].rms_relative,
        Agreement.of_all([design.gap for design in best]).rms_relative,
        (min(shares), max(shares)),
        {other: gap.rms_relative for other, gap in stages.agreement.items() if other != ends},
        sum(factorizations for _, factorizations in found),
    )


@dataclass(frozen=True)
class _Design:
    """Double laths over a share of every rod, and the gap of the shell."""

    share: float
    gap: Agreement


def _designs(patch: Stages, ends: Ends, telling: Callable[[int], None]) -> tuple[list[_Design], int]:
    """The designs of the search up to the first that is not stable, or to the end of the time, and the factorisations
    that all took; no designs for rods whose sections change already."""
    found, like, factorizations = list[_Design](), patch.popped[ends], 0
    if any(rod.profile is not None for rod in patch.footprint.rods):
        return found, factorizations
    while (share := _next_share(found, patch.agreement[ends])) is not None:
        try:
            telling(len(found) + 1)
        except OutOfTimeError:
            break
        like = _popped_up(patch, share, like)
        factorizations += like.report.factorizations
        if not like.report.stable:
            break
        found.append(_Design(share, agreement(like, patch.target)))
    return found, factorizations


def _next_share(found: Sequence[_Design], before: Agreement) -> float | None:
    """The share to be tried after the designs that were found; None: no more."""
    if len(found) < 2:
        return FIRST + len(found) * PROBE
    if len(found) == 2:
        first, second = found
        slope = (second.gap.gaps - first.gap.gaps) / (second.share - first.share)
        step = -float(slope @ second.gap.gaps) / max(float(slope @ slope), 1e-300)  # to the least sum of squares
        return float(np.clip(second.share + np.clip(step, -LONGEST, LONGEST), *DOUBLE))
    gains = min(design.gap.rms for design in found) < before.rms
    return None if gains or len(found) > 3 else NEAR_ALL


def _popped_up(patch: Stages, share: float, like: PopUp) -> PopUp:
    """The shell with double laths over a share of every rod, from the equilibrium of one with others."""
    mesh = like.shell.mesh.with_profiles(Profile.double(share))
    return rebuilt(like, mesh, like.boundary, patch.rod, patch.joint, like.equilibrium)
