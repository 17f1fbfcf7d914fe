"""A job as a value: everything that decides a form, and the one way to run it.

The command line, a studio, a sweep or a script load or make a `Job`, change it, and run it; none of them knows a stage.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Literal, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from rodshell.case import Case, load_case
from rodshell.case.from_objects import case_of, case_of_rod_ends
from rodshell.case.load import changed_case, flattened, is_described, require_keys_of_rods
from rodshell.case.rod_ends import RodEnds, read_result, read_table
from rodshell.design import designed
from rodshell.errors import InputError, OutOfMemoryError
from rodshell.figures.records import Ends
from rodshell.form import Form
from rodshell.formfinding import Bound, Method
from rodshell.formfinding.methods import require_method
from rodshell.formfinding.search import Objective
from rodshell.joints import Ball, Joint, require_joint
from rodshell.layout import FlatGrid, Layout
from rodshell.output.options import OutputOptions
from rodshell.progress import Progress, limited, silent
from rodshell.results.folder import reading
from rodshell.rods.section import Rod
from rodshell.rods.supports import BOTH, SUPPORTS, Asked, support_of, supports_of
from rodshell.run import Announce, Run, inputs_of
from rodshell.targets import Target
from rodshell.targets.patch_layout import PatchLayout
from rodshell.units import length_text, shown
from rodshell.validation import (
    array,
    choice,
    file_path,
    function_of,
    instance,
    is_auto,
    listed,
    mapping,
    number,
    point,
    positive,
)

Auto = Literal["auto"]

FOUND = "a form that Job.run or find_form returned (one read from a folder: run its case.toml again)"
OBJECTS = 'a job needs target, layout and rod; for a case by its name or its file use rodshell.Job.load("...")'


class Job:
    """Everything that decides a form: a value that can be compared, hashed, changed, written and run.

    It is its resolved case. Make one of objects by its constructor, or load one: `Job.load("roof.toml")`.

    Args:
        layout: the flat grid asked for.
        rod: section and material of every rod.
        method: of the drape: `Bound()`, `Gravity()` or `Fall()`, see `drape`.
        anchor: x, y of the point of the target where the axes of the grid cross [m]; "auto": the best found; default:
            the target's highest point.
        rotate: heading in place of the layout's [rad]; "auto": the best found.
        objective: what an "auto" anchor or heading makes smallest, see `search`.
        joint: the joints where rods cross, see `pop_up`; default: ball joints.
        ends: supports of the pop-up: "pinned", "clamped", "both", or a `Support` of your own; also in a tuple, which
            may be empty.
        seams: rows of points (x, y) of the plan [m], lines along which the target is cut straight down into patches;
            each continues straight past its ends, unless it is closed. Rods and length of the layout are then "auto";
            its heading is that at the target's summit, and "auto" is the heading that leaves out the fewest rods.
        patches: what patches, by their names A, B, ... from left to right, have of their own.
        options: of checks, fabrication and drawings.

    Raises:
        InputError: a value is of the wrong kind; a target too is missing.
    """

    __slots__ = ("_case", "_inputs", "_target")
    _case: Case
    _target: Target | None  # as it was given
    _inputs: Mapping[str, bytes] | None  # what its files held then: they may change on disk

    def __init__(
        self,
        target: Target | None = None,
        layout: Layout | None = None,
        rod: Rod | None = None,
        *,
        method: Method = Bound(),
        anchor: tuple[float, float] | Auto | None = None,
        rotate: float | Auto | None = None,
        objective: Objective = "shear",
        joint: Joint | None = None,
        ends: Asked = BOTH,
        seams: Iterable[ArrayLike] = (),
        patches: Mapping[str, PatchLayout] | None = None,
        options: OutputOptions | None = None,
    ) -> None:
        if target is None or layout is None or rod is None:
            raise InputError(OBJECTS)
        for name, value, kind in (("target", target, Target), ("layout", layout, Layout), ("rod", rod, Rod)):
            instance(name, value, kind)
        require_method(method)
        require_joint(joint)
        if anchor is not None and not is_auto(anchor):
            anchor = point("anchor", anchor)
        if rotate is not None and not is_auto(rotate):
            rotate = number("rotate", rotate, "rad")
        if options is not None:
            instance("options", options, OutputOptions)
        patches = {} if patches is None else patches
        for name, patch in mapping("patches", patches, 'settings by the names of patches, such as "A"').items():
            instance("the name of each patch", name, str, "text")
            instance(f"patches {name}", patch, PatchLayout)
        case = case_of(
            target, layout, rod,
            joint=joint or Ball(), method=method, anchor=anchor, rotate=rotate,
            objective=choice("objective", objective, get_args(Objective)), ends=supports_of(ends),
            seams=listed("seams", seams, "a list of lines, each of points x, y in m"),
            patches=patches, options=options or OutputOptions(),
        )  # fmt: skip
        self._set(case, target, inputs_of(case))

    @classmethod
    def load(
        cls,
        source: "str | PathLike[str] | Mapping[str, object]",
        overrides: Mapping[str, object] | None = None,
        /,
        **more: object,
    ) -> Self:
        """The job of a case, with some keys changed: `Job.load("hemisphere", layout__rotate="45 deg")`.

        Args:
            source: the name of a built-in case; the path of a case file, or of a surface; the text of a case file; its
                content as a mapping.
            overrides, more: values by dotted key; in Python's names two underscores stand for the dot.

        Raises:
            InputError: no such case or file, an unknown key, a value that cannot be used; in one sentence.
        """
        return cls.of_case(load_case(source, _changes(overrides, more)))

    @classmethod
    def of_case(cls, case: Case) -> Self:
        """The job of a case that was loaded before; of an earlier form: `Job.of_case(form.case)`."""
        instance("case", case, Case, "the case of a form or of a job; to load one by its name use rodshell.Job.load")
        job = cls.__new__(cls)
        job._set(case, None)
        return job

    @classmethod
    def of_table(
        cls,
        source: "str | PathLike[str] | RodEnds",
        overrides: Mapping[str, object] | None = None,
        /,
        *,
        unit: str | None = None,
        rod: Rod | None = None,
        joint: Joint | None = None,
        **more: object,
    ) -> Self:
        """The job of popping up rods that are given by where their ends lie flat and where they go.

        Args:
            source: a CSV table; the folder of an earlier result; or the ends themselves.
            overrides, more: as of `load`, of the tables rod, joint, checks, fabrication and drawings.
            unit: of the coordinates in a table, unless its columns end in _mm.
            rod: section and material; default: those of the result, or a rod that is chosen to fit.
            joint: where rods cross, without eccentricity; default: that of the result, or ball joints.

        Raises:
            InputError: the source cannot be read, or a value cannot be used. OutputError : there is no such result.
        """
        require_joint(joint)
        if rod is not None:
            instance("rod", rod, Rod)
        changes = _changes(overrides, more)
        require_keys_of_rods(changes)
        ends, case = _ends_and_case(source, unit, changes)
        given = case_of_rod_ends(ends, rod, joint or case.joint)
        tables = {name: getattr(case, name) for name in ("checks", "fabrication", "drawings")}
        if not (case.drawings.name or isinstance(source, RodEnds)):
            tables["drawings"] = replace(case.drawings, name=Path(source).resolve().stem)
        return cls.of_case(replace(given, **tables, rod=case.rod if rod is None else given.rod))

    def changed(self, overrides: Mapping[str, object] | None = None, /, **more: object) -> Self:
        """The same job with some keys changed: `job.changed(layout__rotate="10 deg")`; arguments as of `load`.

        Raises:
            InputError: as of `load`; also a key of a table that was made from an object which no key describes, and one
                that a table of rods does not use.
        """
        changes = _changes(overrides, more)
        job = type(self).of_case(changed_case(self._case, changes))
        if job._case.target == self._case.target:
            job._set(job._case, self._target, self._inputs)
        return job

    @property
    def case(self) -> Case:
        """Everything that decides the job, in SI."""
        return self._case

    def to_toml(self) -> str:
        """The job as a case file, in SI; `Job.load` of it gives an equal job.

        Raises:
            InputError: it holds an object that no case file can describe, such as a Python function as its target.
        """
        return self._case.to_toml()

    def run(
        self,
        *,
        warm_start: Form | None = None,
        progress: Progress = silent,
        time_limit: float | None = None,
        announce: Announce | None = None,
        until: Literal["drape", "pop-up", "fabrication"] = "fabrication",
        frames_in: str | PathLike[str] = "",
    ) -> Form:
        """Find the form: target, drape, trim, pop-up, checks, fabrication.

        Args:
            warm_start: an earlier form. Only the stages from the first one on whose part of the case has changed are
                run again, see `STAGES`; `Form.reused` names the others. Where a stage runs again, the earlier form is
                its first guess: its net is where the new net is looked for (with `Bound()`), and where its shells went
                from their draped states is where the new ones start, rods being matched by their place in the lattice.
                Any form is accepted; what does not help is left, and the shapes are the same as without, to the
                solver's tolerance. A shell that has several equilibria stays in its present one. The search for other
                stable shapes may take half of the factorisations that the form took, so that it tries fewer starts
                after a warm start.
            progress: called as progress(stage, detail, residual) at every iteration.
            time_limit: [s] after which the job ends, at its next iteration, with what was found until then.
            announce: called with a sentence for each value that the job chose itself, as soon as it is known.
            until: the last stage that is run now. With "drape" the form has the flat grid, but no popped-up shells; as
                `warm_start` of the next run it saves the drape. With "pop-up", checks and fabrication are made when
                first asked for.
            frames_in: folder in which a fall's folder of frames (drape.frames) is made; default: the current one.

        Returns:
            The form. Its `status` is "converged", or says which stage stopped, or was out of time; nothing is raised
            for that.

        Raises:
            InputError: values do not fit together. NetLimitError : no net covers the target from this anchor and
                heading.
            OutOfTimeError: the time limit came before there was a net.
        """
        if warm_start is not None:
            instance("warm_start", warm_start, Form, FOUND)
        choice("until", until, ("drape", "pop-up", "fabrication"))
        if time_limit is not None:
            time_limit = positive("time_limit", time_limit, "s", infinite=True)
        if announce is not None:
            function_of("announce", announce, "a function of a sentence, such as print", "")
        inputs = inputs_of(self._case) if self._inputs is None else self._inputs
        place, in_time = file_path("frames_in", frames_in), limited(progress, time_limit)

        def run_of(case: Case, earlier: Form | None, announce: Announce | None = None) -> Run:
            return Run(case, self._target, inputs, earlier, in_time, announce, place, pops_up=until != "drape")

        entered = progress if isinstance(progress, AbstractContextManager) else nullcontext()
        try:
            with entered:
                if self._case.design.open and until != "drape":
                    say = announce or (lambda sentence: None)
                    return designed(self._case, lambda case, earlier: run_of(case, earlier).form(), in_time, say)
                run = run_of(self._case, warm_start, announce)
                form = run.table_form() if self._case.of_table else run.form()
                return form.finished(in_time) if until == "fabrication" else form
        except MemoryError as error:
            raise error if isinstance(error, OutOfMemoryError) else OutOfMemoryError(error) from None

    def __repr__(self) -> str:
        case = self._case
        target = case.target.held.what if case.target.held else case.target.kind
        if case.of_table:
            return f"<rodshell.Job: pop up {target}>"
        what = case.drawings.name or target
        source = getattr(case.target, "file", None)
        spacings = (case.layout.spacing,) if isinstance(case.layout.spacing, float | str) else case.layout.spacing
        spacing = " x ".join(each if isinstance(each, str) else length_text(each) for each in spacings)
        cuts = len(case.seams.lines)
        seams = f", {cuts} seam{'s' if cuts > 1 else ''}" if cuts else ""
        return (
            f"<rodshell.Job: {what}{f' {source}' if source else ''}, spacing {spacing}{seams}, "
            f"{case.drape.method} drape, {case.joint.kind} joints, ends {' and '.join(case.ends) or 'none'}>"
        )

    def __eq__(self, other: object) -> bool:
        return self._case.absolute() == other._case.absolute() if isinstance(other, Job) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._case.absolute())

    def __getstate__(self) -> Case:
        return self._case

    def __setstate__(self, case: Case) -> None:
        self._set(case, None)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Job is a value: use job.changed(...) in place of setting {name}")

    def _set(self, case: Case, target: Target | None, inputs: Mapping[str, bytes] | None = None) -> None:
        object.__setattr__(self, "_case", case)
        object.__setattr__(self, "_target", target)
        object.__setattr__(self, "_inputs", inputs)


def _changes(overrides: Mapping[str, object] | None, more: Mapping[str, object]) -> dict[str, object]:
    """The values by dotted key that are given in a mapping or as arguments."""
    wanted = 'values by key, such as {"layout.spacing": "0.5 m"}'
    given = mapping("overrides", {} if overrides is None else overrides, wanted)
    return flattened({**given, **more})


def _ends_and_case(
    source: "str | PathLike[str] | RodEnds", unit: str | None, overrides: dict[str, object]
) -> tuple[RodEnds, Case]:
    """The rods of a table or a result; and the result's case, or an empty one, with `overrides`."""
    if isinstance(source, RodEnds):
        return source, load_case(None, overrides)
    path = file_path("source", source)
    if path.is_dir():
        if unit is not None:
            raise InputError(f"unit = {shown(unit)}: {path} is a result, which is in SI: leave it out")
        earlier = read_result(path)
        with reading(path) as file:
            kept = file("case.toml")
            case = kept if kept.is_file() and is_described(kept) else None
            joint = {f"joint.{key}": value for key, value in earlier.joint.items()}
            return earlier.ends, load_case(case, joint | overrides, otherwise={"rod": earlier.rod})
    if not path.exists():
        raise InputError(f"there is no file named {shown(str(path))}: give a table of rods, or the folder of a result")
    return read_table(path, unit), load_case(None, overrides)


def find_form(
    target: Target,
    layout: Layout,
    rod: Rod,
    *,
    method: Method = Bound(),
    anchor: tuple[float, float] | Auto | None = None,
    joint: Joint | None = None,
    ends: Asked = BOTH,
    seams: Iterable[ArrayLike] = (),
    patches: Mapping[str, PatchLayout] | None = None,
    warm_start: Form | None = None,
    progress: Progress = silent,
    time_limit: float | None = None,
) -> Form:
    """Find the flat grid that pops up into a target: a `Job` of these objects, run.

    Checks and fabrication are made when they are first asked for.

    Args:
        target, layout, rod, method, anchor, joint, ends, seams, patches: as of `Job`.
        warm_start, progress, time_limit: as of `Job.run`.

    Raises:
        InputError, NetLimitError, OutOfTimeError: as of `Job` and `Job.run`.
    """
    job = Job(
        target, layout, rod,
        method=method, anchor=anchor, joint=joint, ends=ends, seams=seams, patches=patches,
    )  # fmt: skip
    return job.run(warm_start=warm_start, progress=progress, time_limit=time_limit, until="pop-up")


def refine(
    form: Form,
    vary: str | Sequence[str] = "taper",
    *,
    ends: Ends | None = None,
    ratio: float = 8.0,
    per: Literal["shell", "family", "rod"] = "shell",
    varies: Literal["size", "width", "height", "a", "b"] = "size",
    under: str = "nothing",
    tolerance: float | None = None,
    progress: Progress = silent,
    time_limit: float | None = None,
) -> Form:
    """Bring a form nearer to its target by varying its rods; checks and fabrication are made when first asked for.

    A design is accepted if it lies flat, pops up from flat to the same shape, does not depend on the mesh, and stays
    stable and near its target when it is built with errors. Where none is, the form is as it was; `Form.refined` says
    why.

    Args:
        vary: families, one or several: "taper" (EI along rods), "double" (two laths over a share of each rod), "tails"
            (cut lengths), "clamps" (directions of clamped ends), "holes" (joints along rods), "offsets" (of rods).
        ends: the only end condition of the refined form; None: the first of the form's.
        ratio: of the largest EI to the smallest along a taper [-].
        per: one taper for the whole shell, one for each family of rods, or one for each rod.
        varies: what of the section a taper changes: "size", all its lengths alike, or one of them by its name.
        under: "nothing": unloaded; "weight": with its own weight; or the name of a combination of the form's case.
        tolerance: largest error of a span between two joints as it is built [m]; None: 0.05 % of the target's size.
        progress, time_limit: as of `Job.run`.

    Raises:
        InputError: a value is of the wrong kind; the form comes from a table of rods, or has no such combination; one
            of its loads is not a force.
    """
    instance("form", form, Form, FOUND)
    if form.from_table:
        raise InputError("a table of rods has no target to come nearer to: refine the form of a target")
    asked = form.case.ends
    end = support_of(ends).name if ends is not None else (asked or tuple(SUPPORTS))[0]
    changes: dict[str, object] = {"vary": vary, "ends": end, "ratio": ratio, "per": per, "varies": varies}
    changes |= {"under": under, "tolerance": tolerance}
    job = Job.of_case(form.case).changed({f"refine.{key}": value for key, value in changes.items()})
    if end not in asked:
        job = job.changed({"pop_up.ends": end})
    return job.run(warm_start=form, progress=progress, time_limit=time_limit, until="pop-up")


def pop_up_table(
    grid: FlatGrid,
    finals: ArrayLike,
    rod: Rod,
    *,
    joint: Joint | None = None,
    edge: float | None = None,
    progress: Progress = silent,
    time_limit: float | None = None,
) -> Form:
    """Pop up rods from elsewhere, pinned, from flat: a `Job` of a table of rods, run.

    Args:
        grid: the rods, flat (see `straight_rods`).
        finals: (m, 2, 3) where the ends of each rod go [m].
        rod: section and material of every rod.
        joint: where rods cross, see `pop_up`, without eccentricity; ball joints without.
        edge: longest edge of the mesh [m]; default: a sixth of the usual distance between joints.
        progress, time_limit: as of `Job.run`.

    Raises:
        InputError: `finals` does not fit `grid`; no rod has three joints; the joint is eccentric.
    """
    job = Job.of_table(RodEnds(grid, array("finals", finals, np.float64, None, 2, 3), edge), rod=rod, joint=joint)
    return job.run(progress=progress, time_limit=time_limit, until="pop-up")
