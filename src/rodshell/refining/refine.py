"""Refinement: a shell that pops up next to its target becomes one that pops up on it.

The variables are chosen by families, Gauss and Newton's method finds their values with exact derivatives, and the grid
that they describe is popped up again.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import ConvergenceError, InputError
from rodshell.figures.records import Ends
from rodshell.formfinding.pipeline import Agreement, Stages, agreement
from rodshell.refining.end_families import Clamps, Supports
from rodshell.refining.gauss_newton import Found, Step, gauss_newton
from rodshell.refining.length_families import Holes, Offsets, Tails
from rodshell.refining.objectives import Gap, LowestEigenvalue, Objective, Prestress, residuals
from rodshell.refining.stiffness_families import DoubleLaths, Sections, Taper
from rodshell.refining.stock import rounded
from rodshell.refining.structure import Point, Structure, rebuilt, under_load
from rodshell.refining.variables import Design, Family, Grid, design_of
from rodshell.solve.equilibrium import find_equilibrium
from rodshell.units import percent_text
from rodshell.validation import choice

FAMILIES: dict[str, Family] = {
    family.name: family
    for family in (Taper(), DoubleLaths(), Sections(), Tails(), Clamps(), Supports(), Holes(), Offsets())
}
"""The families of variables by the names that users write."""

STIFFNESSES = ("taper", "double", "sections")  # the others work by compressing rods, too
LENGTHS = ("tails", "holes", "offsets")  # of which rods along curves of a target have their own
STIFFER = 1.02  # of the eigenvalue before, since EA does not follow EI
OPPOSITE = 0.5  # of the way that lengths go, to the other side: all of it mostly has no stable equilibrium
LEAST_EIGENVALUE = 0.5  # of the lowest one before
Progress = Callable[[Step], None]


@dataclass(frozen=True, eq=False)
class Refinement:
    """A shell before and after.

    Args:
        before, after: the stages, with the popped-up shell of these ends alone.
        designs: those that were accepted on the way, on the mesh of the search, the last best; the first is the shell
            before.
        converged: whether no further step would gain much.
        stopped: when and where the search was out of time, or "".
        loaded: gaps before and after under the loads, where it was refined under loads; else None.
    """

    vary: tuple[str, ...]
    ends: Ends
    before: Stages
    after: Stages
    designs: tuple[Point, ...]
    converged: bool
    factorizations: int
    steps: tuple[Step, ...]
    variables: Design
    stopped: str = ""
    loaded: tuple[Agreement, Agreement] | None = None

    def __repr__(self) -> str:
        gap = f"{percent_text(self.gap_before.rms_relative)} -> {percent_text(self.gap_after.rms_relative)} rms"
        return f"<Refinement by {', '.join(self.vary)}, {self.ends}: {gap}, {self.factorizations} factorisations>"

    @property
    def gap_before(self) -> Agreement:
        """Distance to the target before."""
        return self.before.agreement[self.ends]

    @property
    def gap_after(self) -> Agreement:
        """Distance to the target after."""
        return self.after.agreement[self.ends]


def refine(
    stages: Stages,
    vary: str | Family | Sequence[str | Family] = ("taper",),
    *,
    ends: Ends | None = None,
    objectives: Sequence[Objective] | None = None,
    least_eigenvalue: float = LEAST_EIGENVALUE,
    under_weight: float = 0.0,
    dead_loads: Floats | None = None,
    start: Sequence[float] | None = None,
    most_evaluations: int | None = None,
    progress: Progress = lambda step: None,
) -> Refinement:
    """Bring a popped-up shell nearer to its target.

    Args:
        stages: of one shell, with a stable pop-up.
        vary: what is varied: names of `FAMILIES`, or families with settings of their own.
        ends: how the rods' ends are held; None: as first asked for.
        objectives: what is made small; None: the mean square of the gap and, where not only stiffness varies,
            compression.
        least_eigenvalue: share of the lowest eigenvalue before below which no design is accepted [-].
        under_weight: factor on its own weight with which the shell is brought to the target, such as 1.0; unloaded it
            then stands above.
        dead_loads: (n, 3) further fixed loads on the nodes of the mesh under which it is brought there [N].
        start: values of the variables to begin with, as `Step.values` of an earlier search; None: no change.
        most_evaluations: designs that are tried; None: 60, or 30 on either side where no stiffness varies.
        progress: called after each; an OutOfTimeError that it raises ends the search with what was found.

    Raises:
        InputError: no such family; the shell has no target, no pop-up with these ends, or is not stable.
        ConvergenceError: it falls under the loads, or has no stable equilibrium with the design to start from.
    """
    families = _chosen_families(vary)
    if stages.flat_state is not None and (lengths := [each.name for each in families if each.name in LENGTHS]):
        raise InputError(
            f"{' and '.join(lengths)} cannot vary where rods follow curves of the target, on which their joints lie: "
            "vary taper, double or sections"
        )
    ends = stages.ends[0] if ends is None else ends
    structure = replace(structure_of(stages, ends), weight=under_weight, dead_loads=dead_loads)
    variables = design_of(structure, families)
    here, spent = first_point(structure, variables, start)
    before = structure.lowest if here.equilibrium.problem.load is None else float(here.modes.values[0])
    floor = LowestEigenvalue(least=least_eigenvalue, before=before)
    stressed = [Prestress()] if any(family.name not in STIFFNESSES for family in families) else []
    goals: list[Objective] = [*([Gap(), *stressed] if objectives is None else objectives), floor]
    stiff = any(family.name in STIFFNESSES for family in families)
    most = (60 if stiff else 30) if most_evaluations is None else most_evaluations

    def searched(first: Point) -> Found:
        return gauss_newton(variables, first, goals, floor, most=most, progress=progress)

    found = searched(here)
    accepted = found.accepted
    if start is None and found.converged and not stiff:
        opposite, more = _opposite(variables, here, accepted[-1])
        spent += more
        if opposite is not None:
            other = searched(opposite)
            steps, made = (*found.steps, *other.steps), found.factorizations + other.factorizations
            nearer = _cost(goals, other.accepted[-1]) < _cost(goals, accepted[-1])
            accepted = (here, *other.accepted) if nearer else accepted
            found = replace(other if nearer else found, factorizations=made, steps=steps, stopped=other.stopped)
    if any(sizes is not None for sizes in variables.stock):
        chosen, more = rounded(variables, accepted[-1], goals, floor.allows)
        spent += more
        accepted = (here, chosen) if chosen is not None and chosen.rms < here.rms else (here,)
    after, made = popped_up(stages, variables, accepted[-1], ends)
    loaded = None
    if here.equilibrium.problem.load is not None:
        loaded = loaded_gap(stages, here, ends), loaded_gap(after, accepted[-1], ends)
    names = tuple(family.name for family in families)
    return Refinement(
        names, ends, alone(stages, ends), after, accepted, found.converged, spent + found.factorizations + made,
        found.steps, variables, found.stopped, loaded,
    )  # fmt: skip


def _opposite(variables: Design, first: Point, found: Point) -> tuple[Point | None, int]:
    """A design on the other side of the first one than that which was found, and the factorisations that it took.

    Lengths act by bowing spans, outwards or inwards, so that the gap has several minima: what is found from both sides
    is compared.
    """
    box = variables.box
    values = np.clip(first.values - OPPOSITE * (found.values - first.values), box.lower, box.upper)
    if np.array_equal(values, first.values):
        return None, 0
    return first.tried(values, variables.change(values))


def _cost(goals: Sequence[Objective], here: Point) -> float:
    """The sum of squares that is made small."""
    return float(np.sum(residuals(goals, here) ** 2))


def alone(stages: Stages, ends: Ends) -> Stages:
    """The same with one end condition."""
    kept = {end: gap for end, gap in stages.agreement.items() if end == ends}
    return replace(stages, ends=(ends,), popped={ends: stages.popped[ends]}, agreement=kept)


def between(refinement: Refinement, low: Point, high: Point, share: float) -> tuple[Point | None, int]:
    """A design on the way from one to another.

    Args:
        share: of the way [-].

    Returns:
        The design, or None where it has no stable equilibrium near the first, or is of sizes in stock; and the
        factorisations that it took.
    """
    variables = refinement.variables
    if any(sizes is not None for sizes in variables.stock):
        return None, 0
    values = low.values + share * (high.values - low.values)
    point, made = low.tried(values, variables.change(values))
    return point, made + 1


def built(variables: Design, point: Point) -> Grid:
    """The grid of a design.

    A common factor on all stiffnesses changes no unloaded shape, unless joints are springs. It is chosen such that the
    thickest place has the section itself, or more where the lowest eigenvalue would else be lower than before.
    """
    structure, values = point.structure, point.values
    grid = Grid(structure.mesh, structure.popped.boundary)
    joint = structure.joint
    springs = any(0.0 < stiffness < inf for stiffness in (joint.shear, joint.out_of_plane, joint.twist))
    if point.equilibrium.problem.load is None and not springs:
        profiles = [rod.profile for rod in variables.applied(grid, values).mesh.grid.rods]
        thickest = max(1.0 if profile is None else max(profile.factors) for profile in profiles)
        least = STIFFER * structure.lowest / float(point.modes.values[0])
        values = variables.stiffer(values, float(np.log(max(1.0 / thickest, min(1.0, least)))))
    return variables.applied(grid, values)


def _chosen_families(vary: str | Family | Sequence[str | Family]) -> tuple[Family, ...]:
    """The families that are meant.

    Raises:
        InputError: an unknown name, none, or one twice.
    """
    given = vary if isinstance(vary, Sequence) and not isinstance(vary, str) else (vary,)
    families = tuple(
        FAMILIES[choice("vary", item, tuple(FAMILIES))] if isinstance(item, str) else item for item in given
    )
    names = [family.name for family in families]
    if not names or len(set(names)) < len(names):
        raise InputError(f"vary must name one family or several, each once, not {names}")
    stiff = [name for name in names if name in STIFFNESSES]
    if len(stiff) > 1:
        raise InputError(f"{' and '.join(stiff)} both decide the sections along a rod: vary one of them")
    return families


def structure_of(stages: Stages, ends: Ends) -> Structure:
    """The shell that is refined.

    Raises:
        InputError: it has no target, no pop-up with these ends, or is not stable.
    """
    if stages.from_table:
        raise InputError("a table of rods has no target to come nearer to: refine the form of a target")
    if ends not in stages.popped:
        raise InputError(f"the form was not popped up with {ends} ends: form it with ends = {ends} first")
    popped = stages.popped[ends]
    if not popped.report.stable:
        how = "is not stable" if popped.report.converged else popped.report.sentence
        raise InputError(f"the pop-up with {ends} ends {how}: there is no equilibrium to refine")
    if popped.shell.yields:
        raise InputError(f"the {ends} supports yield, which no refinement knows: refine with pinned or clamped ends")
    if any(rod.profile is not None for rod in stages.footprint.rods):
        raise InputError("this form was refined before: refine the form that it came from, with all families at once")
    return Structure(popped, stages.rod, stages.joint, stages.target)


def first_point(structure: Structure, variables: Design, start: Sequence[float] | None = None) -> tuple[Point, int]:
    """The design to start from, and the factorisations that it took.

    Args:
        start: other values than those without effect.

    Raises:
        InputError: `start` is not as long as there are variables.
        ConvergenceError: it has no stable equilibrium near the shell's own; the shell falls under the loads.
    """
    box = variables.box
    values = box.start
    if start is not None:
        if len(start) != len(values):
            raise InputError(
                f"the design to start from has {len(start)} values, but what is varied here has {len(values)}: leave "
                "it out, or vary the same as in the search that it comes from"
            )
        values = np.clip(np.asarray(start, dtype=float), box.lower, box.upper)
    change = variables.change(values)
    here, edges, made = structure.popped.equilibrium, structure.edges, 0
    if change.stiffness.any() or change.lengths.any() or change.held.any():
        edges = edges.varied(change.table(edges.table))
        problem = replace(here.problem, elements=edges.shell.elements, stretch=edges.shell.stretch)
        here = find_equilibrium(problem, here.state, here.forces)
        made = here.report.factorizations
        if not here.report.stable:
            raise ConvergenceError(
                "the first design has no stable equilibrium near the shell's own: vary something else"
            )
    load = structure.load(edges)
    if load is not None:
        loaded, more = under_load(here, load)
        if loaded is None:
            raise ConvergenceError("the shell falls under these loads: clamp its ends, or choose stiffer rods")
        here, made = loaded, made + more
    return Point(structure, values, change, edges.at(here.elements), here), made


def popped_up(stages: Stages, variables: Design, design: Point, ends: Ends) -> tuple[Stages, int]:
    """The stages of a grid built to a design, and the factorisations that its pop-up took.

    Raises:
        InputError: it has no stable equilibrium there after all.
    """
    grid, here = built(variables, design), design.equilibrium
    popped, made = rebuilt(stages.popped[ends], grid.mesh, grid.boundary, stages.rod, stages.joint, here), 0
    if here.problem.load is not None:
        unloaded, made = under_load(popped.equilibrium, np.zeros_like(here.state))
        found = unloaded or popped.equilibrium
        found = replace(found, problem=replace(found.problem, load=None))
        popped = replace(popped, shell=popped.shell.with_elements(found.elements), equilibrium=found)
    result = replace(
        stages, ends=(ends,), footprint=popped.footprint, boundary=grid.boundary,
        popped={ends: popped}, agreement={ends: agreement(popped, stages.target)},
    )  # fmt: skip
    return result, popped.report.factorizations + made


def loaded_gap(stages: Stages, design: Point, ends: Ends) -> Agreement:
    """Distance to the target of a shell under the loads that it was refined for.

    Args:
        design: of which it is built, with its loaded equilibrium.
    """
    popped, here = stages.popped[ends], design.equilibrium
    load, shell = design.structure.load_on(popped.shell), popped.shell.with_frames_of(here.elements)
    problem = replace(popped.equilibrium.problem, elements=shell.elements, load=load)
    return agreement(replace(popped, equilibrium=find_equilibrium(problem, here.state, here.forces)), stages.target)
