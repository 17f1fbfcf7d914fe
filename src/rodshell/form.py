"""A form that was found: its stages, its checks and fabrication, and its files."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.case import Case
from rodshell.checks import Checks, check
from rodshell.errors import ConvergenceError, InputError
from rodshell.fabrication.fabricate import Fabricated, fabricate
from rodshell.fabrication.settings import has_slots
from rodshell.figures.design import Design
from rodshell.figures.form import FlatState
from rodshell.figures.records import Ends
from rodshell.formfinding import Agreement, Boundary, Draped, Footprint, PopUp, Stages, Trimmed
from rodshell.formfinding.seams import Meeting
from rodshell.formfinding.search import Search
from rodshell.joints import Joint
from rodshell.layout import Layout
from rodshell.layout.cells import Pattern
from rodshell.loads.check import LoadChecks, check_shells, tributary_of, unchecked
from rodshell.loads.combinations import Loads
from rodshell.loads.strength import net_factors
from rodshell.output.files import save, wanted_kinds
from rodshell.output.options import OutputOptions
from rodshell.output.pictures import picture_svg
from rodshell.output.viewer import frame_html, scene_of, widget_of
from rodshell.progress import Progress, require_progress, silent
from rodshell.refining.acceptance import Refined
from rodshell.results import Archive, Results, Verdict
from rodshell.results.from_checks import (
    checked_results,
    checked_states,
    final_ends,
    judged,
    loaded_results,
    loaded_states,
    sharpest,
)
from rodshell.results.from_form import results_of, states_of, with_refinement, with_seam_forces
from rodshell.results.judged.stress import THIN
from rodshell.rods.section import Rod
from rodshell.targets import Seam, Target
from rodshell.validation import instance

if TYPE_CHECKING:
    from anywidget import AnyWidget


@dataclass(frozen=True, eq=False, repr=False)
class Form:
    """What `Job.run` and `find_form` return. Two forms are equal that have the same case and the same shapes.

    Args:
        case: everything that decided it, in SI, with what was left open ("auto") as it was decided.
        asked: the same as it was asked for.
        stages: what form finding returned, of the whole or of its patches; where it was refined, the refined ones.
        options: of checks, fabrication and drawings.
        inputs: contents of the files that the case names, by their path in it.
        search: the search for anchor and heading, where the case asked for one.
        refined: the form before and after its refinement, where the case asked for one.
        reused: the stages that were taken over from an earlier form, see `Job.run`.
        design: how its loads decided what the case leaves open, where it asked for that.
    """

    case: Case
    asked: Case
    stages: Stages
    options: OutputOptions
    inputs: Mapping[str, bytes]
    search: Search | None = None
    refined: Refined | None = None
    reused: tuple[str, ...] = ()
    design: Design | None = None

    # What was asked for

    @property
    def unrefined(self) -> Stages:
        """The stages before they were refined."""
        return self.stages if self.refined is None else self.refined.before

    @property
    def target(self) -> Target:
        """The shape wanted.

        Raises:
            InputError: the form comes from a table of rods; so for `layout`.
        """
        return self.stages.target

    @property
    def layout(self) -> Layout:
        """The flat grid asked for."""
        return self.stages.layout

    @property
    def rod(self) -> Rod:
        return self.stages.rod

    @property
    def joint(self) -> Joint:
        return self.stages.joint

    @property
    def ends(self) -> tuple[Ends, ...]:
        """The end conditions asked for."""
        return self.stages.ends

    @property
    def from_table(self) -> bool:
        """Whether it comes from a table of rods, which has no target."""
        return self.stages.from_table

    # The stages

    @property
    def patches(self) -> tuple[Stages, ...]:
        """The stages of each patch; a form in one piece has one."""
        return self.stages.parts

    @property
    def seams(self) -> tuple[Seam, ...]:
        """The lines along which the target was cut: where it is creased along a seam, its crease."""
        return self.stages.seams.lines if self.stages.seams else ()

    @property
    def meetings(self) -> tuple[Meeting, ...]:
        """Where rods of two patches end at one point of a seam."""
        return self.stages.seams.meetings if self.stages.seams else ()

    @property
    def draped(self) -> Draped:
        """The grid on its target, of a form in one piece; of several patches see `patches`.

        Raises:
            InputError: the form has several patches, or comes from a table of rods; so for `trimmed`.
        """
        return self.stages.draped

    @property
    def trimmed(self) -> Trimmed:
        """The draped grid cut to its target, of a form in one piece."""
        return self.stages.trimmed

    @property
    def footprint(self) -> Footprint:
        """The flat grid; of several patches side by side."""
        return self.stages.footprint

    @property
    def boundary(self) -> Boundary:
        """Where all rod ends go, rod by rod."""
        return self.stages.boundary

    @property
    def popped(self) -> Mapping[Ends, PopUp]:
        """The popped-up shell with each kind of ends; of several patches that of all together."""
        return self.stages.popped

    @property
    def agreement(self) -> Mapping[Ends, Agreement]:
        """How far the popped-up shell is from its target, with each kind of ends; empty for a table of rods."""
        return self.stages.agreement

    @property
    def dropped(self) -> tuple[tuple[str, str], ...]:
        """Rods that are not built, with the reason."""
        return self.stages.dropped

    @property
    def status(self) -> str:
        """ "converged", or which stage stopped and what to do; checks are not counted."""
        return self.stages.status

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences of form finding that a user should read; those of checks are in the archive."""
        return self.stages.warnings

    @property
    def flat_state(self) -> FlatState | None:
        """Whether rods along curves of the target can be laid out in the plane, by what they withstand while they are
        erected; None where the flat grid is a straight lattice."""
        found = self.stages.flat_state
        if found is None:
            return None
        limits, material = self.options.limits(self.rod, self.case.strength), self.rod.material
        strength = limits.erection or limits.counted
        limit = strength / material.youngs_modulus if strength and material else THIN
        return FlatState(
            lies_flat=found.report.stable and (found.strain or 0.0) <= limit, in_plane_strain=found.strain, limit=limit,
            negative_modes=None if found.strain is None else found.report.negative_modes,
        )  # fmt: skip

    # Checks, fabrication, verdict

    @cached_property
    def checks(self) -> Checks:
        """The checks of every shell that converged; made when they are first asked for, if `Job.run` made none."""
        return self._checked(silent)

    @cached_property
    def fabrication(self) -> Fabricated:
        """Cut list, layers, splices, stock and bracing; made as `checks` are."""
        ends = final_ends(self.checks)
        shape = None if ends is None else self.popped[ends].positions
        return fabricate(
            self.footprint.mesh,
            self.rod,
            self.options.fabrication,
            curvature=sharpest(self.checks),
            final=shape,
            pattern=Pattern.of(getattr(self.case.bracing, "pattern", "both")),
            prestrain=getattr(self.case.bracing, "prestrain", None),
            to_supports=getattr(self.case.bracing, "ends_at", "joints") == "supports",
            slotted=() if shape is None else self._slotted(shape),
        )

    def _slotted(self, final: Floats) -> tuple[Floats, ...]:
        """The shapes (n, 3) in which strips fit into each other's slots: the final one and, where they are laid out in
        the plane first, that."""
        upright = not self.stages.from_table and self.stages.layout.upright
        if not has_slots(upright, self.rod, self.joint):
            return ()
        flat = self.flat_state
        return (final, self.footprint.mesh.flat) if flat and flat.lies_flat else (final,)

    @cached_property
    def loaded(self) -> LoadChecks | None:
        """The checks under the loads of the case, None where it has none; made as `checks` are."""
        loads = self.case.built_loads()
        return None if loads is None else check_loads(self, loads)

    @property
    def known_loaded(self) -> LoadChecks | None:
        """The checks under loads, if they were made."""
        return vars(self).get("loaded")

    @property
    def known_checks(self) -> Checks | None:
        """The checks, if they were made."""
        return vars(self).get("checks")

    @property
    def known_fabrication(self) -> Fabricated | None:
        """The fabrication, if it was made."""
        return vars(self).get("fabrication")

    @property
    def verdict(self) -> Verdict:
        """What the form is worth, all checks done: good, check, unbuildable or unknown, with the reasons."""
        return self._archive.verdict

    def with_options(self, options: OutputOptions) -> "Form":
        """The same stages, to be checked, fabricated and drawn with other options."""
        instance("options", options, OutputOptions)
        same = options.stages == self.options.stages and self._weight(options) == self._weight(self.options)
        known = self.known_checks if same else None
        case = replace(self.case, **options.tables)
        loaded = self.known_loaded if same and options.strength == self.options.strength else None
        return replace(self, case=case, options=options).knowing(checks=known, loaded=loaded)

    def knowing(self, **made: Checks | Fabricated | LoadChecks | None) -> "Form":
        """The same form with what was made of it before, by the names of its properties; None: nothing new."""
        form = replace(self)
        for name in ("checks", "fabrication", "loaded"):
            if (found := made.get(name) or vars(self).get(name)) is not None:
                vars(form)[name] = found
        return form

    def finished(self, progress: Progress = silent) -> "Form":
        """This form, its checks and fabrication made now; a progress may end the checks early. Under loads that do not
        fit the form it is not checked: `loaded.refused` says why."""
        require_progress(progress)
        checks = self.known_checks
        if checks is None or checks.stopped:
            checks = self._checked(progress)
        known = self.knowing(checks=checks)
        loaded, loads = self.known_loaded, self.case.built_loads()
        if loads is not None and (loaded is None or loaded.stopped):
            try:  # the form is kept in any case
                loaded = check_loads(known, loads, progress=progress)
            except InputError as error:
                loaded = unchecked(loads, refused=str(error))
            except ConvergenceError as error:
                loaded = unchecked(loads, stopped=str(error))
        return known.knowing(fabrication=known.fabrication, loaded=loaded)

    # Files

    def results(self) -> Results:
        """The typed content of result.json before anything was checked."""
        found = results_of(self.stages).changed(flat_state=self.flat_state)
        found = found if self.design is None else found.changed(design=self.design)
        return found if self.refined is None else with_refinement(found, self.refined)

    def unchecked(self) -> Archive:
        """What is kept of it before anything was checked, without a verdict."""
        return Archive(self.results(), states_of(self.stages), self.case.text(), self.inputs)

    def archive(self, *, options: OutputOptions | None = None) -> Archive:
        """Everything that is kept, checked and made ready to be built.

        options : of checks, fabrication and drawings in place of the form's own.
        """
        return self._archive if options is None else self.with_options(options)._archive

    def summary(self, *, verbose: bool = False) -> str:
        """Six lines of text, all checks done; `verbose`: all that was found."""
        return self._archive.summary(verbose=verbose)

    def save(
        self,
        folder: str | PathLike[str],
        *,
        options: OutputOptions | None = None,
        kinds: str | Iterable[str] | None = None,
        force: bool = False,
    ) -> Path:
        """Write archive, report, schedules and strips, or the files that are asked for; the folder's absolute path.

        Args:
            options: as of `archive`.
            kinds: of files in addition to the archive, such as ["dxf", "csv"], "dxf, csv" or "all"; default: report,
                csv, strips, and those of the case's `drawings.files`.
            force: also replace files that rodshell did not write, or that were changed since, where it has to write.

        Raises:
            InputError: an unknown kind. OutputError : the folder cannot be written, or such files are there and `force`
                is False.
        """
        wanted = wanted_kinds(kinds, (options or self.options).drawings.files)  # before the checks, which take time
        return save(self.archive(options=options), folder, wanted, force=force)

    def widget(self) -> "AnyWidget":
        """The 3D viewer for a notebook, whose `picked` is the id of the rod or joint that was clicked last.

        Raises:
            InputError: anywidget is not installed, or there is no shape in space.
        """
        scene = scene_of(self._archive)
        if scene is None:
            raise InputError("this form has no shape in space to look at: its verdict says why")
        return widget_of(scene)

    # Python manners

    def __repr__(self) -> str:
        rods, pieces = len(self.footprint.rods), len(self.patches)
        name = "a table of rods" if self.from_table else self.case.drawings.name or self.target.name
        parts = f" in {pieces} patches" if pieces > 1 else ""
        found = f"popped up {' and '.join(self.popped)}" if self.popped else "not popped up"
        return f"<rodshell.Form of {name}{parts}: {rods} rods, {found}, {self.status}>"

    def _repr_html_(self) -> str:
        """The 3D viewer with all shapes, and what they are worth, as notebooks show it."""
        scene = scene_of(self._archive)
        picture = picture_svg(self._archive, "flat") if scene is None else frame_html(scene)
        level, reasons = self.verdict.level, "".join(f"<li>{escape(reason)}</li>" for reason in self.verdict.reasons)
        return f"<div>{picture}<p>{escape(repr(self))}: <b>{level}</b></p><ul>{reasons}</ul></div>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Form):
            return NotImplemented
        if self is other:
            return True
        ours, theirs = self._shapes(), other._shapes()
        same = self.case == other.case and list(ours) == list(theirs)
        return same and all(np.array_equal(ours[name], theirs[name], equal_nan=True) for name in ours)

    def __hash__(self) -> int:
        return hash(self.case)

    def _shapes(self) -> dict[str, Floats]:
        return {"flat": self.footprint.mesh.flat} | {ends: shell.positions for ends, shell in self.popped.items()}

    def _weight(self, options: OutputOptions) -> float:
        return options.limits(self.rod, self.case.strength).shear_weight

    def _checked(self, progress: Progress) -> Checks:
        self.options.require_known_stress(self.rod, self.joint)
        flat = self.flat_state
        stages = self.options.stages if flat is None or flat.lies_flat else 0  # else it is assembled in place
        settings: dict[str, Any] = {"stages": stages, "shear_weight": self._weight(self.options)}
        if self.popped and not self.from_table:
            settings["plan"] = tributary_of(self.stages).plan
        return check(self.stages.popped, self.rod, **settings, progress=progress)

    @property
    def _design(self) -> dict[str, Floats]:
        """The values of a refined design, from which `rodshell refine DIR` continues."""
        design = () if self.refined is None else self.refined.design
        return {"design": np.array(design)} if design else {}

    @cached_property
    def _archive(self) -> Archive:
        checks, style = self.checks, self.options.drawings
        results = self.results()
        if self.stages.seams is not None:
            results = with_seam_forces(results, self.stages.seams, checks)
        mesh, asked = self.footprint.mesh, self.case.strength
        results = checked_results(
            results, mesh, checks, self.fabrication,
            limits=self.options.limits(self.rod, asked), net=net_factors(mesh, self.rod.section, asked.hole),
            positions={ends: popped.positions for ends, popped in self.popped.items()},
        )  # fmt: skip
        if self.loaded is not None:
            results = loaded_results(results, self.footprint.mesh, self.loaded)
        results = judged(results, drawings=style.parameters(), name=style.name, rod_chosen=self.options.rod_chosen)
        states = states_of(self.stages) | self._design | checked_states(checks, self.rod.stretch_stiffness)
        if self.loaded is not None:
            states |= loaded_states(self.loaded)
        return Archive(results, states, self.case.text(), self.inputs)


def check_loads(form: Form, loads: Loads, *, progress: Progress = silent) -> LoadChecks:
    """Check a form under loads: deflections, reactions, stability and utilisation under each of their combinations.

    Args:
        form: whose shells are loaded, with each end condition that converged.
        progress: called with stage and figures.

    Raises:
        InputError: a load does not fit the form; the form comes from a table of rods.
    """
    instance("form", form, Form)
    instance("loads", loads, Loads, "a rodshell.Loads(...)")
    require_progress(progress)
    return check_shells(form.stages, loads, limits=form.options.limits(form.rod, loads.strength), progress=progress)
