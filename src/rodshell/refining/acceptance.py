"""A refinement from a form to a form: the last design that passes all gates is what is built.

Where the best design is refused, those accepted before it are tried, and designs between two of them. Then it is
searched again: on the mesh of the grid's spans where meshing changed the gap, with a higher limit of the lowest
eigenvalue where the shell does not withstand errors or comes to another shape from flat. Where none passes, the form
stays as it was. Each patch of a form is refined by itself: its ends at the seams are supports as any others.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import ConvergenceError, InputError, OutOfTimeError
from rodshell.figures.records import Ends
from rodshell.formfinding.patches import joined_again
from rodshell.formfinding.pipeline import Agreement, Stages, meshed_again
from rodshell.progress import Progress, silent
from rodshell.refining.gates import GATES, LARGEST_ERROR, SPAN_ERROR, Gates, gates, span_lengths, worst_with_errors
from rodshell.refining.gauss_newton import Step
from rodshell.refining.refine import LEAST_EIGENVALUE, Refinement, alone, between, loaded_gap, popped_up, refine
from rodshell.refining.structure import Point
from rodshell.refining.variables import Family
from rodshell.units import length_text, percent_text

FIRMER = (0.75, 1.0)  # shares of the lowest eigenvalue that are asked for where a shell does not withstand errors
EARLIER = 3  # designs that are tried where the best is refused
HALVINGS = 3  # between a design that passes and a better one that does not
NEARER = 1.0 - 1e-6  # of the gap before: more is not a gain


@dataclass(frozen=True, eq=False)
class _Asked:
    """What is varied, what the shell carries when it meets its target, and how exactly it is built; see `refined`."""

    vary: Sequence[Family]
    ends: Ends
    weight: float
    dead_loads: Floats | None
    span_error: float | None


@dataclass(frozen=True, eq=False)
class Refined:
    """A form before and after it was refined.

    Args:
        vary: names of the families that were varied.
        ends: how the rods' ends were held.
        before, after: the same object where nothing was accepted; else the second has these ends alone.
        gates: by name, whether the design passes: the one that was accepted, else the best that was refused.
        refused: why the best design was refused, beginning with the gate's name, or why there is none; "" if accepted.
        stopped: when and where the search was out of time, or "".
        design: values of the variables of the design that was accepted; of a form in patches none.
        loaded: gaps before and after of the shell that carries its own weight, where it was refined for that; else
            none.
    """

    vary: tuple[str, ...]
    ends: Ends
    before: Stages
    after: Stages
    gates: Mapping[str, bool]
    refused: str
    factorizations: int
    gate_factorizations: int
    stopped: str = ""
    design: tuple[float, ...] = ()
    loaded: tuple[Agreement, ...] = ()

    def __repr__(self) -> str:
        return f"<Refined by {', '.join(self.vary)}, {self.words}>"

    @property
    def changed(self) -> bool:
        """Whether a design was accepted."""
        return self.after is not self.before

    @property
    def gap_before(self) -> Agreement:
        """Distance to the target before, under the own weight where it was refined for that."""
        return self.loaded[0] if self.loaded else self.before.agreement[self.ends]

    @property
    def gap_after(self) -> Agreement:
        """Distance to the target after, as `gap_before`."""
        return self.loaded[1] if self.loaded else self.after.agreement[self.ends]

    @property
    def words(self) -> str:
        """What became of it, in one line."""
        if not self.changed:
            return f"{self.ends} ends: nothing changed, {self.refused}"
        gained = f"gap {percent_text(self.gap_before.rms_relative)} -> {percent_text(self.gap_after.rms_relative)} rms"
        earlier = f"; a nearer design was refused, {self.refused}" if self.refused else ""
        return f"{self.ends} ends: {gained}, all gates passed{earlier}"


def refined(
    stages: Stages, vary: Sequence[Family], *, ends: Ends | None = None, under_weight: float = 0.0,
    dead_loads: Floats | None = None, span_error: float | None = None,
    start: Sequence[float] | None = None, progress: Progress = silent,
) -> Refined:  # fmt: skip
    """Refine a form, patch by patch.

    Args:
        ends: the only end condition of the refined form; None: the first asked for.
        under_weight: factor on its own weight with which the shell is brought to the target, in place of the unloaded
            one.
        dead_loads: (n, 3) further fixed loads on the nodes with which it is brought there [N]; of a form in one piece.
        span_error: largest error of each span between two joints as it is built [m]; None: 0.05 % of the target's size.
        start: `Refined.design` of an earlier refinement, from which to continue.
        progress: called as progress(stage, detail, residual). An OutOfTimeError that it raises ends the search, and the
            gates are tried without it. A KeyboardInterrupt is raised again with a text that says where the search was.

    Raises:
        InputError: the form has no target, or no pop-up with these ends; `start` does not fit.
    """
    end = stages.ends[0] if ends is None else ends
    asked = _Asked(vary, end, under_weight, dead_loads, span_error)
    if stages.seams is None:
        return _of_piece(stages, asked, start, progress)
    if start is not None:
        raise InputError("refine.start: each patch of a form has a design of its own: leave it out")
    if dead_loads is not None:
        raise InputError("a form in patches is refined unloaded or under its own weight alone: set refine.under so")
    parts, patches = dict[str, Refined](), dict[str, Stages]()
    for name, patch in stages.patches.items():

        def of_patch(stage: str, detail: str, residual: float, name: str = name) -> None:
            progress(stage, f"patch {name}, {detail}", residual)

        parts[name] = _of_piece(patch, asked, None, of_patch)
        patches[name] = parts[name].after if parts[name].changed else alone(patch, end)
    every = list(parts.values())
    changed = any(part.changed for part in every)
    loaded = tuple(Agreement.of_all(gaps) for gaps in zip(*(part.loaded for part in every), strict=True))
    return Refined(
        tuple(family.name for family in vary), end,
        stages, joined_again(patches, stages.seams, end) if changed else stages,
        {name: all(part.gates[name] for part in every) for name in GATES},
        "; ".join(f"patch {name}, {part.refused}" for name, part in parts.items() if part.refused),
        sum(part.factorizations for part in every), sum(part.gate_factorizations for part in every),
        next((part.stopped for part in every if part.stopped), ""), (), loaded,
    )  # fmt: skip


def _of_piece(stages: Stages, asked: _Asked, start: Sequence[float] | None, progress: Progress) -> Refined:
    """Of a form in one piece: where the best design is refused, what refused it is respected in another search."""
    ends = asked.ends
    _check_error(stages, asked.span_error)
    progress("refine", ", ".join(family.name for family in asked.vary), 0.0)
    if ends in stages.popped and not stages.popped[ends].report.stable:
        return _unsearched(stages, asked, progress)
    first = best = last = _searched(stages, asked, start, LEAST_EIGENVALUE, progress)
    firmer, again = list(FIRMER), stages
    while last.refused and not last.stopped:
        gate = last.refused.partition(":")[0]
        if gate == "remeshed" and again is stages and asked.dead_loads is None:  # loads act on nodes of this mesh
            again = meshed_again(stages, ends)
            if not again.popped[ends].report.stable:
                break
        elif gate not in ("tolerance", "from_flat") or not firmer:
            break
        least = firmer.pop(0) if gate != "remeshed" else LEAST_EIGENVALUE
        last = _searched(again, asked, start, least, progress)
        made = best.factorizations + last.factorizations, best.gate_factorizations + last.gate_factorizations
        nearer = last.changed and (not best.changed or last.gap_after.rms < best.gap_after.rms)
        best = replace(last if nearer else best, factorizations=made[0], gate_factorizations=made[1])
    if not best.changed:
        refused, more = _explained(first.refused, alone(stages, ends), asked)
        more += best.gate_factorizations
        return replace(
            best, before=stages, after=stages, refused=refused, gate_factorizations=more, stopped=last.stopped
        )
    return replace(best, before=stages, stopped=last.stopped)


def _check_error(form: Stages, span_error: float | None) -> None:
    """That an error is one of a span, and not as large as most spans are long."""
    usual = np.median(span_lengths(form.footprint.mesh))
    if span_error is not None and not 0.0 <= span_error <= LARGEST_ERROR * usual:
        raise InputError(
            f"refine.tolerance, the largest error of a span as it is built, is {length_text(span_error)}; spans are "
            f"about {length_text(usual)} long: give at most half of that"
        )


def _explained(refused: str, stages: Stages, asked: _Asked) -> tuple[str, int]:
    """A refusal, of the gate of tolerance with what errors do to the form as it is; and the factorisations of that."""
    if not refused.startswith("tolerance") or not stages.popped[stages.ends[0]].report.stable:
        return refused, 0
    error = SPAN_ERROR * stages.target.size if asked.span_error is None else asked.span_error
    worst, made = worst_with_errors(stages, error)
    if worst is None:
        now = "the form as it is has no stable state nearby with them either"
    else:
        now = f"the form as it is then has up to {percent_text(worst)}"
    return f"{refused}; {now}. If it is built more exactly, give the largest error as refine.tolerance", made


def _searched(
    stages: Stages, asked: _Asked, start: Sequence[float] | None, least_eigenvalue: float, progress: Progress
) -> Refined:
    """One search, and the best of its designs that passes the gates."""
    best = list[Step]()

    def searching(step: Step) -> None:
        if step.accepted:
            best[:] = [step]
        gap = "no equilibrium" if step.rms is None else f"gap {percent_text(step.rms)} rms"
        lowest = "" if step.lowest is None else f", lowest eigenvalue {step.lowest:.2g} of before"
        progress("refine", f"design {step.number}: {gap}{lowest}, step {step.radius:.2g}", 0.0)

    try:
        found = refine(
            stages, asked.vary, ends=asked.ends, under_weight=asked.weight, dead_loads=asked.dead_loads, start=start,
            least_eigenvalue=least_eigenvalue, progress=searching,
        )  # fmt: skip
        late = _Late(silent if found.stopped else progress, found.stopped)
        form, design, judged, refused, made = _accepted(found, asked.span_error, late)
    except ConvergenceError as lost:
        return replace(_unsearched(stages, asked, progress), refused=f"stable: {lost}")
    except KeyboardInterrupt as stopped:
        raise KeyboardInterrupt(_where(best) or str(stopped)) from stopped
    loaded: tuple[Agreement, ...] = ()
    if found.loaded is not None:
        before = found.loaded[0]
        loaded = (before, before if form is None or design is None else loaded_gap(form, design, asked.ends))
    values = () if design is None else tuple(design.values.tolist())
    return Refined(
        found.vary, asked.ends, stages, form or stages, judged.passed, refused, found.factorizations, made,
        late.said, values, loaded,
    )  # fmt: skip


def _unsearched(stages: Stages, asked: _Asked, progress: Progress) -> Refined:
    """A form in which there is nothing to search, refused as the gates say."""
    judged = gates(alone(stages, asked.ends), span_error=asked.span_error, progress=progress)
    names = tuple(family.name for family in asked.vary)
    return Refined(names, asked.ends, stages, stages, judged.passed, judged.reason, 0, judged.factorizations)


def _where(best: list[Step]) -> str:
    """How to continue from the best design that an interrupted search has found."""
    if not best or best[0].rms is None:
        return ""
    values = ",".join(f"{value:.6g}" for value in best[0].values)
    return f"the gap was down to {percent_text(best[0].rms)} rms; to continue from there: --refine.start={values}"


def _accepted(
    found: Refinement, span_error: float | None, progress: Progress
) -> tuple[Stages | None, Point | None, Gates, str, int]:
    """The best design that passes all gates, and its form, or None; its gates, or those of the best one found; why that
    one was refused; and the factorisations that all took.

    Where a design is refused, the one before it in the search is tried, until one passes; then, by halving, designs
    between it and the one that was refused last.
    """
    before = found.gap_before if found.loaded is None else found.loaded[0]
    least = NEARER * before.rms_relative
    nearer = [design for design in found.designs if design.rms < least]
    if not nearer:
        judged = gates(found.before, span_error=span_error, progress=progress)
        return None, None, judged, "no nearer design was found", judged.factorizations
    form, judged, made = _judged(found, nearer[-1], span_error, True, progress)
    if judged.open:
        return form, nearer[-1], judged, "", made
    best, accepted, refused, low = judged, None, nearer[-1], found.designs[0]
    for design in _some(nearer[-2::-1]):
        form, judged, more = _judged(found, design, span_error, False, progress)
        made += more
        if judged.open:
            accepted, low, least = (form, design, judged), design, design.rms
            break
        refused = design
    for _ in range(HALVINGS):
        middle, spent = between(found, low, refused, 0.5)
        made += spent
        if middle is None:
            break
        form, judged, more = _judged(found, middle, span_error, False, progress)
        made += more
        if not judged.open:
            refused = middle
            continue
        low = middle
        if middle.rms < least:
            accepted, least = (form, middle, judged), middle.rms
    if accepted is None:
        return None, None, best, best.reason, made
    return *accepted, best.reason, made


class _Late:
    """Progress of the gates, which are tried to their end when the time is over, so that the search is not lost."""

    def __init__(self, progress: Progress, said: str = "") -> None:
        self._progress, self.said = progress, said

    def __call__(self, stage: str, detail: str, residual: float) -> None:
        if not self.said:
            try:
                self._progress(stage, detail, residual)
            except OutOfTimeError as late:
                self.said = str(late)


def _some(designs: Sequence[Point]) -> list[Point]:
    """At most `EARLIER` of a row of designs: the first, the last, and those evenly between them."""
    picked = np.unique(np.linspace(0, len(designs) - 1, min(EARLIER, len(designs))).round().astype(int))
    return [designs[k] for k in picked]


def _judged(
    found: Refinement, design: Point, span_error: float | None, all_of_them: bool, progress: Progress
) -> tuple[Stages, Gates, int]:
    """A design popped up, its gates, and the factorisations of both; tried at all gates, or until one refuses it."""
    form, spent = popped_up(found.before, found.variables, design, found.ends)
    judged = gates(form, all_of_them=all_of_them, span_error=span_error, progress=progress)
    return form, judged, spent + judged.factorizations
