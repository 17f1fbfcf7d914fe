"""How far a structure carries a load: the perfect one, with imperfections, and after years of creep.

Timber and fibre composites creep: under a permanent load the modulus counts divided by 1 + k, k being what deflections
grow by [k_def of EN 1995-1-1, 2.3.2.2]. The bends of erected rods creep too, so that all their stiffnesses and stresses
fall alike, and the unloaded shell keeps its shape. What does not creep moves it: cables, and supports that yield. An
equilibrium of crept rods under t times a load is one of the rods as erected, with cables and supports 1 + k times as
stiff, under t (1 + k) times the forces: so the path after years is followed on these. Without them it is the path as
erected, its factors divided by 1 + k. Laths of bracing, and joints, creep as the rods do.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from rodshell.checks.self_weight import shown_limit
from rodshell.errors import ConvergenceError
from rodshell.figures.loads import AfterYears
from rodshell.loads.bracing import in_steps
from rodshell.loads.settings import Stability
from rodshell.loads.structure import Structure
from rodshell.rods.elements import Elements
from rodshell.solve.imperfection import imperfect
from rodshell.solve.load import Load
from rodshell.solve.load_path import CLOSE, Limit, LoadPath, load_path
from rodshell.solve.modes import LinearBuckling, linear_buckling

MOST = 100.0  # times a combination: factors above are not looked for
Following = Callable[[int, float], None]


@dataclass(frozen=True, eq=False)
class Capacity:
    """How far a structure carries a load.

    Args:
        buckling: linear, about the unloaded structure; None: that is not stable.
        imperfect_factor, imperfect_kind: the smallest limit of the structures with an imperfection in one mode, of
            either sign, and what ends its path; None: above `MOST`, or not known; not asked for.
        factorizations: of all paths.
    """

    path: LoadPath
    buckling: LinearBuckling | None
    imperfect_factor: float | None
    imperfect_kind: Limit | None
    factorizations: int


def capacity(
    structure: Structure, load: Load, asked: Stability, *, stations: Sequence[float] = (1.0,), progress: Following
) -> Capacity:
    """How far a structure carries a load, from its equilibrium without it; `stations` and `progress` of its path."""
    unloaded = structure.equilibrium
    path = load_path(unloaded, load, most=MOST, stations=stations, progress=progress)
    buckling = None
    if path.limit != "unstable unloaded":
        buckling = linear_buckling(unloaded, load, asked.modes, most=MOST)
    factor, kind, more = _with_imperfections(structure, load, asked, buckling, progress)
    return Capacity(path, buckling, factor, kind, path.factorizations + more)


def after_years(
    structure: Structure, load: Load, asked: Stability, creep: float, erected: Capacity, *, progress: Following
) -> tuple[AfterYears, int]:
    """The same after years under the load, by the factorisations that it took.

    Args:
        erected: the structure before it has crept, its path with a station at 1 + `creep`.
    """
    times, later = 1.0 + creep, crept(structure, creep)
    if later is None:
        return AfterYears(creep=creep, limit_factor=0.0, limit_kind="unstable unloaded"), 0
    if later is structure and load.strains is None and load.motions is None:
        found, at, over, work = erected, erected.path.at(times), times, 0
    else:
        more = load if load.forces is None else replace(load, forces=times * load.forces)
        found = capacity(later, more, asked, progress=progress)
        at, over, work = found.path.at(1.0), 1.0, found.factorizations
    moved = None
    if at is not None:
        moved = np.linalg.norm(structure.positions(at) - structure.positions(structure.equilibrium), axis=1).max()
    imperfect_factor, kind = found.imperfect_factor, found.imperfect_kind
    years = AfterYears(
        creep=creep,
        limit_factor=None if found.path.limit == "none" else found.path.factor / over,
        limit_kind=shown_limit(found.path.limit),
        imperfect_factor=None if imperfect_factor is None else imperfect_factor / over,
        imperfect_kind=None if kind is None else shown_limit(kind),
        max_deflection=None if moved is None else float(moved),
    )
    return years, work


def crept(structure: Structure, creep: float) -> Structure | None:
    """The structure whose cables and springs of supports are 1 + `creep` times as stiff, and its beams by as much more
    as they creep less, in its equilibrium without loads; None where none that is stable was found."""
    shell, cables = structure.shell, structure.cables
    if cables is None and not shell.springs and not shell.beams and shell.turning is None:
        return structure
    last = len(shell.elements)

    def stiffer(elements: tuple[Elements, ...], share: float) -> tuple[Elements, ...]:
        times = 1.0 + share * creep
        springs = tuple(spring.times(times) for spring in shell.springs)  # type: ignore[attr-defined]
        beams = tuple(beam.times(times / (1.0 + share * (beam.creep or 0.0))) for beam in shell.beams)
        there = replace(shell, springs=springs, beams=beams)
        if shell.turning is not None:
            there = there.with_turning(times * shell.turning)
        there = there.with_frames_of(elements[:last])
        return (*there.elements, *(elements[last:] if cables is None else (cables.times(times),)))

    found = in_steps(structure.equilibrium, stiffer)
    return None if found is None else replace(structure, shell=structure.shell_at(found), equilibrium=found)


def _with_imperfections(
    structure: Structure, load: Load, asked: Stability, buckling: LinearBuckling | None, progress: Following
) -> tuple[float | None, Limit | None, int]:
    """The smallest limit factor of the imperfect structures, what ends its path, and the factorisations of all.

    Modes are not added: how their signs go together is arbitrary, and each would have a part of the amplitude only.
    """
    amplitude = asked.amplitude(structure.span)
    if not amplitude or buckling is None or not len(buckling.shapes):
        return None, None, 0
    kind: Limit = "none"
    least, work, missing = np.inf, 0, False
    for shape, sign in product(buckling.shapes, (1.0, -1.0)):
        try:
            start = imperfect(structure.equilibrium, shape, sign * amplitude)
        except ConvergenceError:
            missing = True
            continue
        # as far as it could be the smallest, by more than a limit is known to
        path = load_path(start, load, most=min(MOST, least * (1 - CLOSE)), stations=(), progress=progress)
        work += path.factorizations
        if path.limit != "none" and path.factor < least:
            least, kind = path.factor, path.limit
    if missing and (least >= 1 or kind == "lost"):  # else the shell falls in one that was found
        return None, "lost", work
    return (None if np.isinf(least) else least), kind, work
