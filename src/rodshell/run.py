"""One run of a case: what is left open is decided, and each stage runs or is taken over from an earlier form."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from rodshell.case import Case
from rodshell.case.case import Built
from rodshell.case.held import built
from rodshell.case.rod_ends import RodEnds
from rodshell.checks.self_weight import linear_factor
from rodshell.checks.sizing import Fit, doubt_of_unit, require_likely_sizes
from rodshell.errors import OutOfTimeError
from rodshell.form import Form
from rodshell.formfinding import Bound, Fall, Stages, find_stages, pop_up_stages
from rodshell.formfinding.patches import best_heading, find_patched_stages
from rodshell.formfinding.search import Search, search
from rodshell.loads.fixed import fixed_forces
from rodshell.progress import Progress
from rodshell.refining.acceptance import Refined, refined
from rodshell.refining.variables import Family
from rodshell.results.archive import read_inputs
from rodshell.results.from_form import rod_type
from rodshell.results.judged.own_weight import ENOUGH, RESERVE
from rodshell.results.summary import chosen, rod_text
from rodshell.rods.section import GivenSection, Rod, size_text
from rodshell.rods.supports import PINNED
from rodshell.targets import Target
from rodshell.targets.patch import Seam
from rodshell.units import length_text

Announce = Callable[[str], None]

STAGES: dict[str, tuple[str, ...]] = {
    "target": ("target",),
    "drape": ("layout", "rod", "joint", "drape", "seams"),
    "trim": (),
    "pop-up": ("pop_up",),
    "refine": ("refine",),
    "checks": ("checks",),
    "fabrication": ("fabrication", "bracing", "strength"),
    "loads": ("loads", "combinations", "locked_joints", "stability"),
    "files": ("drawings",),
}
"""The stages of a job in their order, and the tables of the case that each brings in; those before it count too."""

DECIDED_BY = ("target", "layout", "rod", "joint", "drape", "seams", "checks")
"""Tables that decide what a case leaves open: anchor, heading and rod."""

SIZED_BY = (*DECIDED_BY, "pop_up", "strength")
"""Tables that decide a section that is chosen by the bends of pop-ups."""

MOST_SIZES = 6  # that are popped up: of like sections the second is right; with elastic joints up to four were needed


@dataclass
class Run:
    """One run of a case; parameters as of `Job.run`.

    Args:
        target: where it was built before.
        inputs: what the files of the case hold, by their path in it.
        earlier: from which it starts; one of another kind is left.
        pops_up: False ends it with the drape, trimmed and mapped back.
    """

    asked: Case
    target: Target | None
    inputs: Mapping[str, bytes]
    earlier: Form | None
    progress: Progress
    announce: Announce | None
    frames_in: Path
    pops_up: bool

    def __post_init__(self) -> None:
        self.options = self.asked.output_options()
        if self.earlier is not None and self.earlier.from_table != self.asked.of_table:
            self.earlier = None

    def form(self) -> Form:
        """Of a target."""
        earlier = self.earlier
        same_target = earlier is not None and self._same(earlier, ("target",))
        if same_target and earlier is not None:
            self.target = earlier.target
        case, found = self.asked, self.asked.build(self.target, self.progress)
        self._announce_sizes(found)
        case, found, searched = self._decided(case, found)
        rod, fit, stages, tried = found.rod, None, None, found._replace(method=Bound())
        if case.rod.left_open:
            fit = case.fit_on(found.target, found.layout, anchor=None if case.seams.lines else found.anchor)
        if fit and case.joint.resists_shear and case.ends and self.pops_up and self._sizes(rod):
            rod, fit, stages = self._sized(rod, fit, partial(self._stages, case, tried))
            case.require_strength(rod)
        if stages is None or found.method != tried.method:
            stages = self._stages(case, found, rod)
        if fit and case.ends and self.pops_up and self._sizes(rod):
            rod, fit, stages = self._carrying(rod, fit, stages, partial(self._stages, case, found))
        self._announce_rod(rod, fit)
        case = case.with_rod(rod)
        same = self._unchanged(case)
        return self._made(case, stages, searched, same, self._refined(case, stages, same))

    def table_form(self) -> Form:
        """Of a table of rods."""
        case = self.asked
        assert case.target.held is not None
        ends: RodEnds = case.target.held.value
        fit, stages = Fit.between(ends.lengths, ends.final), None
        rod = case.rod.held.value if case.rod.held else case.rod.build(lambda: fit, strength=case.permanent_strength)
        case.require_slots(rod, upright=False)
        require_likely_sizes(fit.width, min(ends.grid.span, fit.width), rod.section)  # flat, rods may be longer
        if self._sizes(rod):
            rod, fit, stages = self._sized(rod, fit, self._table_stages)
        self._announce_rod(rod, fit)
        stages = stages or self._table_stages(rod)
        case = case.with_rod(rod)
        return self._made(case, stages, None, self._unchanged(case))

    def _sizes(self, rod: Rod) -> bool:
        """Whether a section was left open and its material has a strength by which it can be chosen."""
        table, material = self.asked.rod, rod.material
        left_open = table.held is None and "section" in table.left_open
        return left_open and material is not None and self.asked.permanent_strength(material) is not None

    def _sized(self, rod: Rod, estimate: Fit, stages_of: Callable[[Rod], Stages]) -> tuple[Rod, Fit, Stages]:
        """The rod whose section is chosen by the bends of shells popped up with it; what it fits; those shells.

        Args:
            rod: provisional, of which the first shell is made.
            stages_of: the shells of a rod.
        """
        fit, weight, before = estimate, self.options.limits(rod, self.asked.strength).shear_weight, self._sized_before()
        rod = before or rod
        assert rod.material is not None
        strength, stages = self.asked.permanent_strength(rod.material), stages_of(rod)
        assert strength is not None
        for popped_before in range(MOST_SIZES):
            if stages.status != "converged":
                break
            fit = estimate.by_pop_ups(list(stages.popped.values()), rod, shear_weight=weight)
            section = fit.section(rod.material, strength=strength, shape=self.asked.rod.shape)
            chosen_so = popped_before > 0 or before is not None
            if section == rod.section or (chosen_so and fit.allows(rod, strength)):
                break
            if popped_before + 1 == MOST_SIZES:
                break
            following = Rod(section, rod.material)
            try:
                found = stages_of(following)
                status = found.status
            except OutOfTimeError as late:
                status = str(late)
            if status != "converged":  # what was found before is kept
                if self.announce is not None:
                    self.announce(f"{size_text(section)} fits better, but was not popped up: {status}")
                break
            rod, stages = following, found
        return rod, fit, stages

    def _carrying(
        self, rod: Rod, fit: Fit, stages: Stages, stages_of: Callable[[Rod], Stages]
    ) -> tuple[Rod, Fit, Stages]:
        """The same, of a thicker rod where the chosen one does not carry its own weight with the reserve that is asked
        for, and the whole strength allows one that does."""
        limits = self.options.limits(rod, self.asked.strength)
        strength = self.asked.permanent_strength(rod.material) if rod.material else None
        standing = [shell for shell in stages.popped.values() if shell.report.stable]
        if stages.status != "converged" or not standing or strength is None:
            return rod, fit, stages
        enough = ENOUGH * RESERVE * (1.0 + (limits.creep or 0.0))
        factor = min(linear_factor(shell.shell, shell.equilibrium) for shell in standing)
        if factor >= enough:
            return rod, fit, stages
        known = fit.by_pop_ups(list(stages.popped.values()), rod, shear_weight=limits.shear_weight)
        if (section := known.stiffer(rod, enough / factor, strength)) is None:
            return rod, fit, stages
        thicker = Rod(section, rod.material)
        try:
            found = stages_of(thicker)
        except OutOfTimeError:  # what was found before is kept
            return rod, fit, stages
        return (thicker, replace(known, by_weight=True), found) if found.status == "converged" else (rod, fit, stages)

    def _sized_before(self) -> Rod | None:
        """The rod of the earlier form, if its section was chosen by pop-ups and nothing that decided it has changed."""
        earlier = self.earlier
        if earlier is None or not self._same(earlier, SIZED_BY):
            return None
        stages = earlier.unrefined
        return stages.rod if stages.status == "converged" and stages.popped else None

    def _table_stages(self, rod: Rod) -> Stages:
        case, earlier = self.asked.with_rod(rod), self.earlier
        assert case.target.held is not None
        ends: RodEnds = case.target.held.value
        stages = earlier.stages if earlier is not None else None
        known = stages is not None and "pop-up" in self._unchanged(case)
        if stages is not None and known and stages.finished_pop_ups((PINNED,)):
            return stages
        joint = case.joint
        return pop_up_stages(ends.grid, ends.final, rod, joint=joint, edge=ends.edge, progress=self.progress)

    def _stages(self, case: Case, found: Built, rod: Rod) -> Stages:
        """The shells of a rod on a target, of which those of the earlier form are taken over that are the same."""
        same, seams = "trim" in self._unchanged(case.with_rod(rod)), [Seam.of(line) for line in case.seams.lines]
        earlier = self.earlier.unrefined if self.earlier is not None else None
        options: dict[str, Any] = {
            "joint": case.joint,
            "ends": case.popped_on if self.pops_up else (),
            "warm_start": earlier if earlier is not None and bool(earlier.seams) == bool(seams) else None,
            "progress": self.progress,
        }
        if seams:
            layouts = case.seams.patch_layouts()
            return find_patched_stages(
                found.target, seams, found.layout, rod, patch_layouts=layouts, same_drape=same, **options
            )
        method = found.method
        if isinstance(method, Fall) and case.drape.frames is not None and case.drape.held is None:
            method = replace(method, stream=self.frames_in / case.drape.frames)
        if isinstance(method, Fall) and self.announce is not None:
            height = length_text(method.height)
            self.announce(f"the flat grid falls from {height} above the target until it is at rest; then it is trimmed")
        same &= not (isinstance(method, Fall) and method.stream is not None)
        return find_stages(
            found.target, found.layout, rod, method=method, anchor=found.anchor, same_drape=same, **options
        )

    def _refined(self, case: Case, stages: Stages, same: Sequence[str]) -> Refined | None:
        """The refinement of these stages, where the case asks for one."""
        vary: tuple[Family, ...] = built(case.refine)
        if not vary or stages.status != "converged" or not stages.ends:
            return None
        earlier = self.earlier
        if earlier is not None and "refine" in same and _same_pop_ups(stages, earlier.unrefined):
            return earlier.refined
        table, weight, forces = case.refine, float(case.refine.under == "weight"), None
        ends = stages.ends[0] if table.ends is None else table.ends
        loads = case.built_loads() if table.under in case.combination_names else None
        if loads is not None and ends in stages.ends:
            weight, forces = fixed_forces(stages, ends, loads, table.under)
        return refined(
            stages, vary, ends=ends, under_weight=weight, dead_loads=forces, span_error=table.tolerance,
            start=table.start, progress=self.progress,
        )  # fmt: skip

    def _decided(self, case: Case, found: Built) -> tuple[Case, Built, Search | None]:
        """The case with anchor and heading, and the search for them, if they are "auto"."""
        if not case.undecided:
            return case, found, None
        earlier = self.earlier if self.earlier is not None and self._same(self.earlier, DECIDED_BY) else None
        if case.seams.lines:
            turn = earlier.layout.rotate if earlier is not None else self._best_heading(case, found)
            return case.headed(turn), found._replace(layout=replace(found.layout, rotate=turn)), None
        searched = earlier.search if earlier is not None else None
        if searched is None:
            anchor, heading = case.drape.anchor, case.layout.rotate
            searched = search(
                found.target, found.layout, found.rod, objective=case.drape.objective, progress=self.progress,
                anchors="auto" if anchor == "auto" else [anchor or found.target.summit],
                headings="auto" if heading == "auto" else [heading],
            )  # fmt: skip
        best = searched.best
        layout = replace(found.layout, rotate=best.heading)
        case = case.decided(best.anchor, best.heading)
        rod = case.rod_on(found.target, layout, anchor=best.anchor, progress=self.progress)
        return case, found._replace(layout=layout, anchor=best.anchor, rod=rod), searched

    def _best_heading(self, case: Case, found: Built) -> float:
        return best_heading(
            found.target, [Seam.of(line) for line in case.seams.lines], found.layout, case.seams.patch_layouts(),
            eccentricity=case.joint.eccentricity, progress=self.progress,
        )  # fmt: skip

    def _made(
        self, case: Case, stages: Stages, searched: Search | None, same: Sequence[str], better: Refined | None = None
    ) -> Form:
        """The form, with what it takes over from the earlier one."""
        built = stages if better is None else better.after
        form = Form(case, self.asked, built, self.options, self.inputs, searched, better)
        earlier, known = self.earlier, dict[str, Any]()
        if earlier is None:
            return form
        reused = ["target"] if "target" in same else []
        if stages.lies_as(earlier.unrefined):
            reused += [] if form.from_table else ["drape", "trim"]
            taken = _same_pop_ups(stages, earlier.unrefined)
            reused += ["pop-up"] if taken else []
            taken = taken and better is earlier.refined
            reused += ["refine"] if taken and better is not None else []
            checks = earlier.known_checks if taken and "checks" in same else None
            if checks is not None and not checks.stopped:
                reused += ["checks"]
                made = earlier.known_fabrication if "fabrication" in same else None
                reused += ["fabrication"] if made is not None else []
                loaded = earlier.known_loaded if "loads" in same else None
                loaded = None if loaded is None or loaded.stopped else loaded
                reused += ["loads"] if "loads" in same and (loaded is not None or not case.loads) else []
                known = {"checks": checks, "fabrication": made, "loaded": loaded}
        return replace(form, reused=tuple(reused)).knowing(**known)

    def _unchanged(self, case: Case) -> list[str]:
        """The stages up to the first one whose part of the decided case has changed."""
        same = list[str]()
        for stage, tables in STAGES.items():
            if self.earlier is None or not self._same(self.earlier, tables, case):
                break
            same.append(stage)
        return same

    def _same(self, earlier: Form, tables: Iterable[str], case: Case | None = None) -> bool:
        """Whether these tables are as they were, and so are their files; without a decided `case`, as asked for."""
        before, now = (earlier.asked, self.asked) if case is None else (earlier.case, case)
        before, now = before.absolute(), now.absolute()
        if "target" in tables and (dict(earlier.inputs) != dict(self.inputs) or not now.files <= self.inputs.keys()):
            return False  # a file too large to be kept may have changed
        return all(getattr(before, name) == getattr(now, name) for name in tables)

    def _announce_sizes(self, found: Built) -> None:
        """How wide the target is, and a spacing that was left to its size: a wrong unit shows here."""
        if self.announce is None or "auto" not in (self.asked.layout.spacing, self.asked.layout.edge):
            return
        name, width, said = self.asked.drawings.name or found.target.name, 2 * found.target.size, ""
        if self.asked.layout.spacing == "auto":
            said = doubt_of_unit(width, self.asked.rod.given_section, getattr(self.asked.target, "unit", None))
            said += f"; spacing {length_text(found.layout.least_spacing)}"
        self.announce(f"{name}, {length_text(width)} wide{said}")

    def _announce_rod(self, rod: Rod, fit: Fit | None) -> None:
        """A rod of which the case left something open, and what decided its size."""
        left_open = self.asked.rod.left_open
        if not left_open or fit is None or self.announce is None:
            return
        said = f"rod: {rod_text(rod_type(rod))}; {chosen(left_open)}"
        if "section" in left_open and rod.material and not isinstance(rod.section, GivenSection):
            strength = self.asked.permanent_strength(rod.material)
            why = fit.reason(rod.section, rod.material, strength=strength, shape=self.asked.rod.shape)
            said += f", {why}"
        self.announce(said)


def inputs_of(case: Case) -> dict[str, bytes]:
    """What the files that a case names hold, by their path in its text."""
    return read_inputs(case.text()) if case.files else {}


def _same_pop_ups(now: Stages, before: Stages) -> bool:
    """Whether all pop-ups of a form are those of an earlier one, which has no others."""
    same = now.ends == before.ends and list(now.popped) == list(before.popped)
    return same and all(shell is before.popped[ends] for ends, shell in now.popped.items())
