"""A refinement from a form to a form: the last design that passes all gates is what is built.

Where the best design is refused, those accepted before it are tried, and designs between the last two; where none
passes, the form stays as it was. Each patch of a form is refined by itself: its ends at the seams are supports as any
others.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from rodshell.errors import InputError
from rodshell.formfinding.patches import PatchedForm
from rodshell.formfinding.pipeline import Agreement, PatchForm
from rodshell.formfinding.popup import Ends
from rodshell.formfinding.progress import Progress, silent
from rodshell.refining.gates import GATES, Gates, gates
from rodshell.refining.gauss_newton import Step
from rodshell.refining.refine import Candidate, Refinement, between, popped_up, refine
from rodshell.refining.variables import Family
from rodshell.units import percent_text

Stages = PatchForm | PatchedForm
HALVINGS = 3  # between a design that passes and a better one that does not


@dataclass(frozen=True, eq=False)
class Refined:
    """A form before and after it was refined.

    Parameters
    ----------
    vary : names of the families that were varied.
    ends : how the rods' ends were held.
    before, after : the same object where nothing was accepted; else the second has these ends alone.
    gates : by name, whether the design passes: the one that was accepted, else the best that was refused.
    refused : why the best design was refused, beginning with the gate's name, or why there is none; "" if accepted.
    factorizations : of the search.
    gate_factorizations : of all gates.
    """

    vary: tuple[str, ...]
    ends: Ends
    before: Stages
    after: Stages
    gates: Mapping[str, bool]
    refused: str
    factorizations: int
    gate_factorizations: int

    def __repr__(self) -> str:
        return f"<Refined by {', '.join(self.vary)}, {self.words}>"

    @property
    def changed(self) -> bool:
        """Whether a design was accepted."""
        return self.after is not self.before

    @property
    def gap_before(self) -> Agreement:
        """Distance to the target before."""
        return self.before.agreement[self.ends]

    @property
    def gap_after(self) -> Agreement:
        """Distance to the target after."""
        return self.after.agreement[self.ends]

    @property
    def words(self) -> str:
        """What became of it, in one line."""
        if not self.changed:
            return f"{self.ends} ends: nothing changed, {self.refused}"
        gained = f"gap {percent_text(self.gap_before.rms_relative)} -> {percent_text(self.gap_after.rms_relative)} rms"
        earlier = f"; a nearer design was refused, {self.refused}" if self.refused else ""
        return f"{self.ends} ends: {gained}, all gates passed{earlier}"


def refined(
    stages: Stages, vary: Sequence[Family], *, ends: Ends | None = None, progress: Progress = silent
) -> Refined:
    """Refine a form, patch by patch.

    Parameters
    ----------
    stages : the form.
    vary : what is varied.
    ends : the only end condition of the refined form; None: the first asked for.
    progress : called as progress(stage, detail, residual).

    Raises
    ------
    InputError : the form has no target, or no pop-up with these ends.
    """
    end = stages.ends[0] if ends is None else ends
    if isinstance(stages, PatchForm):
        return _of_piece(stages, vary, end, progress)
    parts, patches = dict[str, Refined](), dict[str, PatchForm]()
    for name, patch in stages.patches.items():

        def of_patch(stage: str, detail: str, residual: float, name: str = name) -> None:
            progress(stage, f"patch {name}, {detail}", residual)

        parts[name] = _of_piece(patch, vary, end, of_patch)
        refined_patch = parts[name].after
        assert isinstance(refined_patch, PatchForm)
        patches[name] = refined_patch if parts[name].changed else _alone(patch, end)
    changed = any(part.changed for part in parts.values())
    return Refined(
        tuple(family.name for family in vary), end,
        stages, replace(stages, patches=patches, ends=(end,)) if changed else stages,
        {name: all(part.gates[name] for part in parts.values()) for name in GATES},
        "; ".join(f"patch {name}, {part.refused}" for name, part in parts.items() if part.refused),
        sum(part.factorizations for part in parts.values()),
        sum(part.gate_factorizations for part in parts.values()),
    )  # fmt: skip


def _of_piece(stages: PatchForm, vary: Sequence[Family], ends: Ends, progress: Progress) -> Refined:
    """Of a form in one piece."""

    def searching(step: Step) -> None:
        gap = "no equilibrium" if step.rms is None else f"gap {percent_text(step.rms)} rms"
        lowest = "" if step.lowest is None else f", lowest eigenvalue {step.lowest:.2g} of before"
        progress("refine", f"design {step.number}: {gap}{lowest}, step {step.radius:.2g}", 0.0)

    names = tuple(family.name for family in vary)
    progress("refine", ", ".join(names), 0.0)
    if ends in stages.popped and not stages.popped[ends].report.stable:
        judged = gates(_alone(stages, ends), progress=progress)
        return Refined(names, ends, stages, stages, judged.passed, judged.reason, 0, judged.factorizations)
    found = refine(stages, vary, ends=ends, progress=searching)
    form, judged, refused, made = _accepted(found, progress)
    return Refined(names, ends, stages, form or stages, judged.passed, refused, found.factorizations, made)


def _accepted(found: Refinement, progress: Progress) -> tuple[PatchForm | None, Gates, str, int]:
    """The best design that passes all gates, or None; its gates, or those of the best one found; why that one was
    refused; and the factorisations that all took.

    Where a design is refused, the one before it in the search is tried, until one passes; then, by halving, designs
    between it and the one that was refused last.
    """
    if len(found.designs) == 1:
        judged = gates(found.before, progress=progress)
        return None, judged, "no nearer design was found", judged.factorizations
    form, judged, made = _judged(found, found.designs[-1], True, progress)
    if judged.open:
        return form, judged, "", made
    best, accepted, refused = judged, None, found.designs[-1]
    low = found.designs[0]
    for design in found.designs[-2:0:-1]:
        form, judged, more = _judged(found, design, False, progress)
        made += more
        if judged.open:
            accepted, low = (form, judged), design
            break
        refused = design
    for _ in range(HALVINGS):
        middle, spent = between(found, low, refused, 0.5)
        made += spent
        if middle is None:
            break
        form, judged, more = _judged(found, middle, False, progress)
        made += more
        if judged.open:
            accepted, low = (form, judged), middle
        else:
            refused = middle
    if accepted is None:
        return None, best, best.reason, made
    return *accepted, best.reason, made


def _judged(
    found: Refinement, design: Candidate, all_of_them: bool, progress: Progress
) -> tuple[PatchForm | None, Gates, int]:
    """A design popped up, its gates, and the factorisations of both; tried at all gates, or until one refuses it."""
    try:
        form, spent = popped_up(found.before, design, found.ends)
    except InputError as gone:
        return None, Gates(dict.fromkeys(GATES, False), f"stable: {gone}", 0), 0
    judged = gates(form, all_of_them=all_of_them, progress=progress)
    return form, judged, spent + judged.factorizations


def _alone(stages: PatchForm, ends: Ends) -> PatchForm:
    """The same with one end condition."""
    kept = {end: gap for end, gap in stages.agreement.items() if end == ends}
    return replace(stages, ends=(ends,), popped={ends: stages.popped[ends]}, agreement=kept)
