"""The front door: from a target to a form in one call, and what can be done with it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rodshell.case.from_objects import case_text
from rodshell.checks import Checks, Contact, check
from rodshell.checks.contact import contact_of_patches
from rodshell.checks.joined import joined_checks
from rodshell.errors import InputError
from rodshell.fabrication import fabricate
from rodshell.formfinding import Bound, FoundForm, Method, PoppedTable, find_stages, pop_up_stages
from rodshell.formfinding.popup import Ends
from rodshell.formfinding.progress import Progress, limited, silent
from rodshell.formfinding.sewn import PatchLayout, SewnForm, find_sewn_stages
from rodshell.joints import Joint
from rodshell.layout import FlatGrid, GridLayout
from rodshell.output.files import save
from rodshell.output.options import OutputOptions
from rodshell.results import Archive, Results, Verdict
from rodshell.results.from_checks import checked_results, checked_states, final_ends, judged, sharpest
from rodshell.results.from_form import (
    States,
    form_results,
    form_states,
    patches_results,
    patches_states,
    table_results,
    table_states,
    with_seam_forces,
)
from rodshell.results.inputs import read_inputs
from rodshell.rods.section import Rod
from rodshell.targets import Target
from rodshell.targets.seam import Seam
from rodshell.validation import instance

FOUND = "a form that an earlier rodshell.find_form returned (one read from a folder: run its case.toml again)"
LONGEST_STRETCH = 1.02  # of a rod between its final ends; a rod drawn further is a mistake in the table


class _Judged:
    """A job's result with its checks, made once with the usual options, and what they come to."""

    @cached_property
    def _checked(self) -> Archive:
        return self.archive()  # type: ignore[attr-defined]

    @property
    def verdict(self) -> Verdict:
        """What the result is worth, all checks done: good, check or unbuildable, with the reasons.

        For a strength or other options of the checks: `archive(options=...).verdict`.
        """
        return self._checked.verdict

    def summary(self) -> str:
        """One screen of text, all checks done."""
        return self._checked.summary()


class Form(_Judged, FoundForm):
    """A form that was found: its stages, and its files."""

    def results(self) -> Results:
        """The typed content of result.json before anything was checked."""
        return form_results(self)

    def archive(
        self,
        case_toml: str | None = None,
        *,
        options: OutputOptions | None = None,
        inputs: Mapping[str, bytes] | None = None,
        progress: Progress = silent,
    ) -> Archive:
        """Everything that is kept, checked and made ready to be built.

        case_toml : the input it came from, by default one made from the objects.
        inputs : contents of the files that it names, by their path in it; default: as they are now.
        """
        options = options or OutputOptions()
        if case_toml is None:
            draped = self.draped
            case_toml = case_text(
                self.target, self.layout, self.rod, joint=self.joint,
                method=draped.method, anchor=draped.anchor, ends=self.ends, options=options,
            )  # fmt: skip
        return _archive(self, form_states(self), case_toml, options, progress, inputs)

    def save(
        self,
        folder: str | PathLike[str],
        *,
        case_toml: str | None = None,
        options: OutputOptions | None = None,
        kinds: Iterable[str] | None = None,
        force: bool = False,
    ) -> Path:
        """Write archive, drawings, schedules, models and report; the folder's absolute path.

        kinds : of files beside the archive, such as "dxf", "csv"; default: all that every installation can.
        force : also replace files that rodshell did not write, or that were changed since, where it has to write.

        Raises
        ------
        OutputError : the folder cannot be written, or such files are there and `force` is False.
        """
        return save(self.archive(case_toml, options=options), folder, kinds, force=force)


class PoppedUp(_Judged, PoppedTable):
    """A table of rods that was popped up, and its files."""

    def results(self) -> Results:
        """The typed content of result.json before anything was checked."""
        return table_results(self, "popup")

    def archive(self, *, options: OutputOptions | None = None, progress: Progress = silent) -> Archive:
        """Everything that is kept, checked and made ready to be built."""
        return _archive(self, table_states(self), "", options or OutputOptions(), progress)

    def save(
        self,
        folder: str | PathLike[str],
        *,
        options: OutputOptions | None = None,
        kinds: Iterable[str] | None = None,
        force: bool = False,
    ) -> Path:
        """As `Form.save`."""
        return save(self.archive(options=options), folder, kinds, force=force)


class Sewn(_Judged, SewnForm):
    """A form in patches that are sewn together, and its files."""

    def results(self) -> Results:
        """The typed content of result.json before anything was checked."""
        return patches_results(self)

    def archive(
        self,
        case_toml: str | None = None,
        *,
        options: OutputOptions | None = None,
        inputs: Mapping[str, bytes] | None = None,
        progress: Progress = silent,
    ) -> Archive:
        """All patches as one: everything that is kept, checked and made ready to be built; see `Form.archive`."""
        options = options or OutputOptions()
        if case_toml is None:
            case_toml = case_text(
                self.target, self.layout, self.rod, joint=self.joint, ends=self.ends, options=options, sewn=self
            )
        options.require_known_stress(self.rod, self.joint)
        weight = options.judged_by(self.rod).shear_weight
        checks = joined_checks(
            {
                name: check(
                    one.popped, self.rod,
                    stages=options.stages, shear_weight=weight, progress=progress,
                )
                for name, one in self.found.items()
            },
            {ends: self._contact(ends) for ends in self.popped},
        )  # fmt: skip
        results = with_seam_forces(self.results(), self, checks)
        shapes = {ends: positions for ends, (positions, _) in self.popped.items()}
        return _kept(self, results, patches_states(self), checks, shapes, case_toml, options, inputs)

    def _contact(self, ends: Ends) -> Contact:
        """Of all patches."""
        popped = [one.popped[ends] for one in self.found.values()]
        return contact_of_patches(self.flat.mesh, [(one.shell, one.state) for one in popped], self.rod)

    def save(
        self,
        folder: str | PathLike[str],
        *,
        case_toml: str | None = None,
        options: OutputOptions | None = None,
        kinds: Iterable[str] | None = None,
        force: bool = False,
    ) -> Path:
        """As `Form.save`."""
        return save(self.archive(case_toml, options=options), folder, kinds, force=force)


def _archive(
    job: Form | PoppedUp, states: States, case_toml: str, options: OutputOptions, progress: Progress,
    inputs: Mapping[str, bytes] | None = None,
) -> Archive:  # fmt: skip
    """A job's result and states with its checks and its fabrication."""
    options.require_known_stress(job.rod, job.joint)
    weight = options.judged_by(job.rod).shear_weight
    checks = check(job.popped, job.rod, stages=options.stages, shear_weight=weight, progress=progress)
    shapes = {ends: shell.positions for ends, shell in job.popped.items()}
    return _kept(job, job.results(), states, checks, shapes, case_toml, options, inputs)


def _kept(
    job: Form | PoppedUp | Sewn, results: Results, states: States, checks: Checks, shapes: Mapping[Ends, Any],
    case_toml: str, options: OutputOptions, inputs: Mapping[str, bytes] | None,
) -> Archive:  # fmt: skip
    mesh, final = job.footprint.mesh, final_ends(checks)
    shape = None if final is None else shapes[final]
    fabricated = fabricate(mesh, job.rod, options.fabrication, curvature=sharpest(checks), final=shape)
    strengths = options.judged_by(job.rod)
    results = checked_results(
        results, mesh, checks, fabricated,
        strength=strengths.strength, shear_strength=strengths.shear_strength, strength_of=strengths.strength_of,
    )  # fmt: skip
    style = options.drawings
    results = judged(results, drawings=style.parameters(), name=style.name, rod_chosen=options.rod_chosen)
    kept = read_inputs(case_toml) if inputs is None else inputs
    return Archive(results, states | checked_states(checks), case_toml, kept)


def find_form(
    target: Target,
    layout: GridLayout,
    rod: Rod,
    *,
    method: Method = Bound(),
    anchor: tuple[float, float] | None = None,
    joint: Joint | None = None,
    ends: Ends | Sequence[Ends] = ("pinned", "clamped"),
    start: FoundForm | None = None,
    progress: Progress = silent,
    time_limit: float | None = None,
) -> Form:
    """From a target to the flat grid that pops up into it, with the proof.

    Parameters
    ----------
    target : the shape wanted.
    layout : the flat grid asked for.
    rod : section and material of every rod.
    method : of the drape: `Bound()`, `Gravity()` or `Fall()`, see `drape`.
    anchor : x, y of the point of the target under the layout's middle [m]; default: the target's highest point.
    joint : what the rods do to each other where they cross, see `pop_up`; ball joints without.
    ends : end conditions of the pop-up: "pinned", "clamped", or both in a tuple.
    start : a form found before, for a spacing, heading, anchor or target that has changed a little: its net is where
        the new net is looked for (with `Bound()`), and where its shells went from their draped states is where the new
        ones start, rods being matched by their place in the lattice. Any form will do; what does not help is
        left, and the result is the same as without, to the solver's tolerance. A shell that has several equilibria
        stays with the one that it is in.
    progress : called as progress(stage, detail, residual) at every iteration.
    time_limit : [s] after which the search ends, at its next iteration, with what was found until then.

    Returns
    -------
    The form. Its `status` is "converged", or says which stage stopped, or was out of time; nothing is raised for that.

    Raises
    ------
    InputError : a value does not fit. NetLimitError : no net covers the target from this anchor and heading.
    OutOfTimeError : the time limit came before there was a net.
    """
    for name, value, kind in (("target", target, Target), ("layout", layout, GridLayout), ("rod", rod, Rod)):
        instance(name, value, kind)
    if start is not None:
        instance("start", start, FoundForm, FOUND)
    found = find_stages(
        target, layout, rod,
        method=method, anchor=anchor, joint=joint, ends=ends,
        start=start, progress=limited(progress, time_limit),
    )  # fmt: skip
    return Form(**{field.name: getattr(found, field.name) for field in fields(found)})


def sew(
    target: Target,
    seams: Sequence[ArrayLike],
    layout: GridLayout,
    rod: Rod,
    *,
    own: Mapping[str, PatchLayout] | None = None,
    joint: Joint | None = None,
    ends: Ends | Sequence[Ends] = ("pinned", "clamped"),
    search: bool = False,
    progress: Progress = silent,
    time_limit: float | None = None,
) -> Sewn:
    """From a target cut into patches to the flat grids that pop up into them and meet at the seams.

    Parameters
    ----------
    seams : rows of points (x, y) of the plan [m], lines along which the target is cut straight down; each goes on
        straight past its ends, unless it is closed.
    layout : of every patch, rods and length "auto"; its heading is that at the target's summit.
    own : what patches, by their names A, B, ... from left to right, have of their own.
    rod, joint, ends, progress, time_limit : as of `find_form`.
    search : whether to look for the heading that leaves out the fewest rods, in place of the layout's.

    Raises
    ------
    InputError : a value does not fit. NetLimitError : no net covers a patch from its anchor and heading.
    OutOfTimeError : the time limit came before every patch had its net.
    """
    for name, value, kind in (("target", target, Target), ("layout", layout, GridLayout), ("rod", rod, Rod)):
        instance(name, value, kind)
    found = find_sewn_stages(
        target, [Seam.of(row) for row in seams], layout, rod,
        own=own, joint=joint, ends=ends, search=search, progress=limited(progress, time_limit),
    )  # fmt: skip
    return Sewn(**{field.name: getattr(found, field.name) for field in fields(found)})


def pop_up_table(
    grid: FlatGrid,
    finals: ArrayLike,
    rod: Rod,
    *,
    joint: Joint | None = None,
    edge: float | None = None,
    progress: Progress = silent,
    time_limit: float | None = None,
) -> PoppedUp:
    """Pop up rods from elsewhere: pinned, from flat.

    Parameters
    ----------
    grid : the rods, flat (see `straight_rods`).
    finals : (m, 2, 3) where the ends of each rod go [m].
    joint : where rods cross, see `pop_up`, without eccentricity; ball joints without.
    edge : longest edge of the mesh [m]; default: a sixth of the usual distance between joints.
    progress, time_limit : as of `find_form`.

    Raises
    ------
    InputError : `finals` does not fit `grid`; no rod has three joints; the joint is eccentric.
    """
    points = np.asarray(finals, dtype=float)
    if points.shape != (len(grid.rods), 2, 3) or not np.isfinite(points).all():
        raise InputError(f"final ends must be finite and of the shape ({len(grid.rods)}, 2, 3), not {points.shape}")
    apart = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
    for rod_line, distance in zip(grid.rods, apart, strict=True):
        if distance > LONGEST_STRETCH * rod_line.length:
            raise InputError(
                f"rod {rod_line.name} is {rod_line.length:.4g} m long, but its final ends lie {distance:.4g} m apart: "
                "move them closer, or give a longer rod"
            )
    found = pop_up_stages(grid, points, rod, joint=joint, edge=edge, progress=limited(progress, time_limit))
    return PoppedUp(**{field.name: getattr(found, field.name) for field in fields(found)})
