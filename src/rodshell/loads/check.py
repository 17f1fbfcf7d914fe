"""A shell under combinations of loads: where it ends up, how far the loads may grow, and what it then uses.

For each combination and end condition the path of equilibria under t times the combination is followed from the
unloaded shell. What is read off at t = 1 is what the combination does; where the shell falls before, at the last factor
at which it is stable. Three factors stand side by side: the linear buckling factor about the unloaded shell, the factor
at which the path loses its stability, and the smallest of the same of shells with an imperfection in one of the lowest
modes. All multiply the whole combination, with the shell's weight if that is in it.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from pydantic import Field

from rodshell.arrays import Floats, Ints, largest_at
from rodshell.checks.bending import require_known_stress
from rodshell.checks.self_weight import linear_factor, self_weight, shown_limit
from rodshell.errors import InputError, OutOfTimeError
from rodshell.figures import loads as figures
from rodshell.figures.checks import SelfWeight
from rodshell.figures.findings import Said, said
from rodshell.figures.loads import Governs, Utilisations
from rodshell.figures.records import Ends, Found
from rodshell.formfinding import PopUp, Stages
from rodshell.layout import GridMesh
from rodshell.loads.bracing import stressed
from rodshell.loads.combinations import Loads
from rodshell.loads.edge_beams import used_beams, with_creep
from rodshell.loads.kinds import Forces, Settlement, Temperature
from rodshell.loads.laths import laid
from rodshell.loads.locked_joints import locked
from rodshell.loads.nodes import LoadedNodes
from rodshell.loads.settings import Cables, Laths, part_of_span
from rodshell.loads.stability import MOST, after_years, capacity
from rodshell.loads.strength import By, Limits, Utilisation, area_of, bending_under, preset_limits, utilisation
from rodshell.loads.structure import NO_PAIRS, Structure
from rodshell.progress import Progress, silent
from rodshell.rods.design_strength import Duration
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.load import Load
from rodshell.solve.modes import linear_buckling, softest_motion
from rodshell.targets.tributary import Tributary, tributary_areas
from rodshell.units import shown

BRACED: dict[type, Callable[..., Structure]] = {Cables: stressed, Laths: laid}
"""How each kind of bracing is put into a shell."""

PERMANENT: Duration = "permanent"
ROUND_OFF = 1e-14  # of the stiffness of each unknown alone: soft shells have 5e-12, mechanisms 1e-16


class LoadedShell(figures.LoadedShell):
    """A shell under one combination of loads, with its shapes."""

    displacements: Found[Floats] = Field(description="(n, 3) of the mesh's nodes against the unloaded shell [m]")
    positions: Found[Floats] = Field(description="(n, 3) of the mesh's nodes [m]")
    stress: Found[Floats | None] = Field(
        description="(k,) largest of bending, axial force and torsion at each entry of `rod_nodes` [Pa]; None: unknown"
    )
    used: Found[Utilisation] = Field(
        description="what rods and joints use of their strength, and the erected shell of its permanent strength"
    )
    bracing_forces: Found[Floats] = Field(
        description="(d,) axial force of each brace, tension positive, of slack cables exactly 0 [N]"
    )
    bracing_before: Found[Floats] = Field(description="(d,) the same before the loads [N]")
    acting: Found[Floats | None] = Field(
        description="(n, 3) forces of the combination at its factor 1 [N]; None: it does not act by forces alone"
    )
    modes: Found[Floats] = Field(description="(j, n, 3) lowest linear buckling modes, the largest component being 1")
    mode: Found[Floats | None] = Field(description="(n, 3) how the shell gives way at the limit, or None")


@dataclass(frozen=True, eq=False)
class LoadChecks:
    """A form under loads.

    Args:
        shells: by combination and end condition; an end condition whose shell did not converge is left out.
        braced: (d, 2) crossings that each brace joins, the rod ends counted on from them.
        limits: what the rods are judged by.
        stopped, missing: when a time limit came, or "", and which combinations were not reached.
        refused: why the form cannot be checked under these loads, or "".
        self_weight: how much of their own weight braced shells carry; empty without bracing.
    """

    asked: Loads
    shells: Mapping[str, Mapping[Ends, LoadedShell]]
    braced: Ints = field(default_factory=NO_PAIRS.copy)
    limits: Limits = field(default_factory=Limits)
    stopped: str = ""
    missing: tuple[str, ...] = ()
    refused: str = ""
    self_weight: Mapping[Ends, SelfWeight] = field(default_factory=dict)

    def __repr__(self) -> str:
        late = f", {self.stopped or self.refused}" if self.stopped or self.refused else ""
        return f"<LoadChecks of {', '.join(self.shells) or 'no combination'}{late}>"

    @property
    def warnings(self) -> tuple[Said, ...]:
        """Sentences that a user should read."""
        return tuple(self._warnings())

    def _warnings(self) -> Iterator[Said]:
        if self.refused:
            yield said("not_checked: refused", why=self.refused)
            return
        if self.stopped:
            yield said("not_checked: late", when=self.stopped, missing=", ".join(self.missing))
        known, wanted = self.limits.bending, {self.asked.duration(name) for name in self.asked.combinations}
        unknown = [name for name in (PERMANENT, *sorted(wanted - {PERMANENT})) if name not in known]
        if not known:
            yield said("no_strength: rods")
        elif unknown:
            yield said("no_strength: durations", durations=" and ".join(unknown))
        every = [shell for by_ends in self.shells.values() for shell in by_ends.values()]
        if any(shell.bracing_utilisation is None and len(shell.bracing_forces) for shell in every):
            yield said("no_strength: others", place="bracing", what="the bracing")


def check_shells(
    stages: Stages, loads: Loads, *,
    limits: Limits = Limits(), progress: Progress = silent,
) -> LoadChecks:  # fmt: skip
    """Check every shell of a form that converged under each combination.

    Args:
        stages: of the form; of one in patches these are loaded together, their seams held as supports are.
        progress: called with stage and figures; an OutOfTimeError that it raises ends the checks, and what was found
            until then is returned.

    Raises:
        InputError: a load does not fit the form; a strength is given, and the stress of its rods is not known.
    """
    if stages.from_table:
        raise InputError("the form comes from a table of rods: without a target no areas for loads are known")
    if loads.locked_joints is not None:
        loads.locked_joints.require_pins(stages.joint)
    areas = tributary_of(stages)
    done = {ends: popped for ends, popped in stages.popped.items() if popped.report.converged}
    found: dict[str, dict[Ends, LoadedShell]] = {name: {} for name in loads.combinations}
    missing = [f"{name} with {ends} ends" for ends in done for name in loads.combinations]
    stopped, braced, weighed = "", NO_PAIRS, dict[Ends, SelfWeight]()
    try:
        for ends, popped in done.items():
            if limits.bending:
                require_known_stress(stages.rod, twisted=popped.shell.frames is not None)
            structure = _locked(popped, ends, loads, stages)
            nodes = LoadedNodes(popped.positions, structure.mass, areas, stages.layout.least_spacing)
            braced, span = structure.braced, structure.span
            frequencies = structure.frequencies(loads.stability.modes, loads.cladding * areas.area)
            acting = {name: _load(structure, nodes, loads, factors) for name, factors in loads.combinations.items()}
            for name, load in acting.items():
                said = partial(_said, progress, f"{name}, {ends} ends")
                try:
                    shell = loaded_shell(
                        structure, load, loads, limits=limits, duration=loads.duration(name), progress=said
                    )
                    allowed = loads.deflections.get(name)
                    limit = None if allowed is None else part_of_span("the deflection", allowed, span)
                    found[name][ends] = shell.changed(frequencies=frequencies, deflection_limit=limit)
                except InputError as reason:
                    raise InputError(f"combination {shown(name)}: {reason}") from None
                missing.pop(0)
            if len(braced):
                following = partial(_following, partial(_said, progress, f"own weight, {ends} ends"), "")
                weighed[ends], _ = self_weight(
                    structure.shell, structure.equilibrium, mass=structure.mass, progress=following
                )
    except OutOfTimeError as late:
        stopped = str(late)
    return LoadChecks(loads, found, braced, limits, stopped, tuple(missing) if stopped else (), self_weight=weighed)


@dataclass(frozen=True)
class Estimate:
    """What is known of a shell after a few factorisations, before any path is followed.

    Args:
        linear: by combination, the linear buckling factor of the shell with its bracing; infinite: above `MOST`.
        bare: the same of its own weight, without its bracing.
        used: of the permanent strength by the erected shell with its bracing, at most; None: no strength is known.
        place: x, y where that is [m].
        radius: of the rod there [m].
    """

    linear: Mapping[str, float]
    bare: float
    used: float | None
    place: tuple[float, float]
    radius: float


def estimate(stages: Stages, loads: Loads, *, limits: Limits = Limits()) -> Estimate:
    """The first of the shells of a form before its loads are checked.

    Raises:
        InputError: as of `check_shells`.
    """
    ends, popped = next(iter(stages.popped.items()))
    structure, areas = _locked(popped, ends, loads, stages), tributary_of(stages)
    nodes = LoadedNodes(popped.positions, structure.mass, areas, stages.layout.least_spacing)
    acting = {name: _load(structure, nodes, loads, factors) for name, factors in loads.combinations.items()}
    state, forces = structure.equilibrium.state, structure.equilibrium.forces[: len(structure.mesh.edges)]
    bent = bending_under(structure.shell, state, structure.rod, forces, limits)
    used = utilisation(
        structure.shell, state, structure.rod, forces=forces, limits=limits, asked=loads.strength, duration=None,
        bent=bent,
    )  # fmt: skip
    by, entry = used.governs or (None, largest_at(bent.curvature))
    x, y, _ = structure.shell.positions(state)[structure.mesh.rod_nodes[entry]].tolist()
    linear = {name: _linear(structure, load) for name, load in acting.items()}
    return Estimate(
        linear, linear_factor(popped.shell, popped.equilibrium),
        None if by is None else used.largest[by], (x, y), 1.0 / float(bent.curvature[entry]),
    )  # fmt: skip


def _linear(structure: Structure, load: Load) -> float:
    """The lowest linear buckling factor; infinite: above `MOST`."""
    return float(np.min(linear_buckling(structure.equilibrium, load, 1, most=MOST).factors, initial=np.inf))


def unchecked(loads: Loads, *, refused: str = "", stopped: str = "") -> LoadChecks:
    """No checks of a form under these loads, which do not fit it (`refused`), or a computation failed (`stopped`)."""
    none: dict[str, dict[Ends, LoadedShell]] = {name: {} for name in loads.combinations}
    return LoadChecks(loads, none, stopped=stopped, missing=tuple(none), refused=refused)


def _said(progress: Progress, where: str, what: str) -> None:
    progress("loads", f"{where}, {what}", 0.0)


def _following(progress: Callable[[str], None], what: str, count: int, factor: float) -> None:
    progress(f"{factor:.3g} times{what}, {count} factorisations")


def _locked(popped: PopUp, ends: Ends, loads: Loads, stages: Stages) -> Structure:
    """The erected shell with its bracing locked, and then its joints; InputErrors are those of the bracing, and that
    the supports leave a mechanism."""
    shell, bracing = with_creep(popped.shell, loads.strength.service_class), loads.bracing
    structure = Structure.erected(replace(popped, shell=shell), stages.rod)
    if bracing is not None:
        fitted = replace(bracing, rod=stages.rod) if isinstance(bracing, Laths) and bracing.rod is None else bracing
        structure = BRACED[type(fitted)](fitted, structure, stages.target)
    if loads.locked_joints is not None:
        structure = locked(loads.locked_joints, structure)
    if (reason := mechanism(structure)) is not None:
        raise InputError(f"with {ends} ends {reason}")
    return structure


def mechanism(structure: Structure) -> str | None:
    """Which motion has no stiffness, and what to do, in words; None: every motion has one."""
    stiffness, motion = softest_motion(structure.equilibrium)
    if abs(stiffness) > ROUND_OFF:
        return None
    shell = structure.shell
    block = int(np.argmax(np.linalg.norm(motion, axis=1)))
    edge = block - shell.first_angle
    if 0 <= edge < len(shell.mesh.edges):
        name = shell.mesh.grid.rods[int(shell.mesh.edge_rods[edge])].name
        return (
            f"nothing keeps {name} from turning about itself (a mechanism), so that the shell cannot carry a load: use "
            'joints that hold it, such as pins (joint.kind = "pin")'
        )
    x, y, _ = structure.equilibrium.state[block]
    return (
        f"supports and joints leave the shell a motion without any stiffness (a mechanism), largest near ({x:.4g}, "
        f"{y:.4g}) m, so that it cannot carry a load: use pins or rigid joints, more rods, or clamped ends"
    )


def tributary_of(stages: Stages) -> Tributary:
    """The areas of the target that each node of a form takes."""
    layout, anchor = stages.layout, stages.target.summit
    if stages.seams is None:
        anchor = stages.draped.anchor or anchor
    spacing = layout.least_spacing
    return tributary_areas(stages.target, stages.on_target, anchor=anchor, rotate=layout.rotate, spacing=spacing)


def _load(structure: Structure, nodes: LoadedNodes, loads: Loads, factors: Mapping[str, float]) -> Load:
    """One combination as what acts on the structure at its factor 1."""
    forces = np.zeros((structure.size, 3))
    strains, motions = np.zeros(len(structure.equilibrium.problem.stretch.blocks)), np.zeros_like(forces)
    for name, factor in factors.items():
        load = loads.loads[name]
        if isinstance(load, Forces):
            forces[: structure.shell.node_count] += factor * load.forces(nodes)
        elif isinstance(load, Temperature):
            strains[: len(structure.mesh.edges)] += factor * load.strain
        else:
            _move(structure, load, factor, motions)
    return Load(
        forces=forces if forces.any() else None,
        strains=strains if strains.any() else None,
        motions=motions if motions.any() else None,
    )


def _move(structure: Structure, load: Settlement, factor: float, motions: Floats) -> None:
    shell = structure.shell
    names = shell.mesh.grid.support_names
    for name in load.supports:
        if name not in names:
            raise InputError(
                f"a settlement moves the support {shown(name)}, which the shell does not have: its supports are "
                f"{names[0]}, {names[1]} to {names[-1]}"
            )
        k = names.index(name)
        for block in (shell.ends[k], *shell.ghosts[k : k + 1]):
            motions[block] += factor * np.array(load.move)


def loaded_shell(
    structure: Structure, load: Load, loads: Loads, *,
    limits: Limits = Limits(), duration: Duration = "short",
    progress: Callable[[str], None] = lambda what: None,
) -> LoadedShell:  # fmt: skip
    """A structure under one combination, from its equilibrium without the loads.

    Args:
        load: what acts at the combination's factor 1.
        loads: for how stability is looked at, and for holes and slip of joints.
    """
    unloaded, following = structure.equilibrium, partial(_following, progress, " the loads")
    creep = limits.creep if duration == PERMANENT and _creeps_alike(structure, limits) else None
    stations = (1.0,) if creep is None else (1.0, 1.0 + creep)
    erected = capacity(structure, load, loads.stability, stations=stations, progress=following)
    path, buckling, work = erected.path, erected.buckling, erected.factorizations
    years = None
    if creep is not None:
        progress("after years")
        years, more = after_years(structure, load, loads.stability, creep, erected, progress=following)
        work += more
    factor, found = 0.0, unloaded
    if (at := path.at(1.0)) is not None:
        factor, found = 1.0, at
    elif (last := path.last_stable) is not None:
        factor, found = last.factor, last.equilibrium
    n = structure.shell.node_count
    positions, before = structure.shell.positions(found.state), structure.shell.positions(unloaded.state)
    edges = len(structure.mesh.edges)
    shell, forces = structure.shell_at(found), found.forces[:edges]
    bent = bending_under(shell, found.state, structure.rod, forces, limits)
    judged = partial(utilisation, rod=structure.rod, limits=limits, asked=loads.strength)
    moments = structure.locked_moments(found)
    slip = None if loads.locked_joints is None else loads.locked_joints.slip
    before_loads = (structure.shell, unloaded.state)
    standing = bending_under(*before_loads, structure.rod, unloaded.forces[:edges], limits)
    alone = judged(*before_loads, forces=unloaded.forces[:edges], duration=None, bent=standing)
    used = judged(
        shell, found.state, forces=forces, duration=duration, bent=bent, before=standing, moments=moments,
        slip_moment=slip,
    ).with_permanent(alone)  # fmt: skip
    total = np.zeros(3) if load.forces is None else factor * load.forces[:n].sum(axis=0)
    shapes, factors = np.zeros((0, n, 3)), np.zeros(0)
    if buckling is not None:
        shapes, factors = buckling.shapes[:, :n], buckling.factors
    held, supports = structure.reactions(found), structure.support_forces(found)
    mesh, names = structure.mesh, structure.mesh.grid.joint_names
    return LoadedShell(
        at_factor=factor,
        limit_factor=None if path.limit == "none" else path.factor,
        limit_kind=shown_limit(path.limit),
        linear_factor=float(factors[0]) if len(factors) else None,
        imperfect_factor=erected.imperfect_factor,
        imperfect_kind=None if erected.imperfect_kind is None else shown_limit(erected.imperfect_kind),
        after_years=years,
        reserve=loads.stability.reserve,
        load_sum=total,
        reaction_sum=held.force_sum,
        reactions=held.forces,
        support_forces=supports.forces,
        support_moments=supports.moments,
        uplift=float(max(0.0, -supports.forces[:, 2].min())),
        max_deflection=float(np.linalg.norm(positions - before, axis=1).max()),
        max_stress=None if bent.stress is None else float(bent.stress.max()),
        displacements=positions - before,
        positions=positions,
        stress=bent.stress,
        duration=duration,
        used=used,
        utilisation=None if used.governs is None else used.largest[used.governs[0]],
        utilisations=Utilisations(**used.largest),
        euler=float(used.euler.max()),
        euler_at=_place(mesh, largest_at(used.euler)),
        governs=None if used.governs is None else _place(mesh, used.governs[1], used.governs[0]),
        bracing_forces=structure.bracing_forces(found),
        bracing_before=structure.bracing_forces(unloaded),
        bracing_utilisation=_of_bracing(structure, found, loads, limits, duration),
        edge_beams=used_beams(shell, found, loads.strength, duration),
        joint_moments=moments,
        joint_moment_at=names[largest_at(np.abs(moments))] if len(moments) else None,
        slipping=tuple(names[k] for k in _slipping(mesh, used)),
        acting=None if load.forces is None or load.strains is not None or load.motions is not None else load.forces[:n],
        modes=shapes,
        mode_factors=factors,
        mode=None if path.mode is None else path.mode[:n],
        factorizations=work,
    )


def _creeps_alike(structure: Structure, limits: Limits) -> bool:
    """Whether laths of bracing creep as much as the rods, and the stiffness of supports that do not creep is known."""
    layer, springs = structure.laths, structure.shell.springs
    if layer is not None and layer.rod.material != structure.rod.material:
        return preset_limits(layer.rod, limits.service_class).creep == limits.creep
    known = all(beam.creep is not None for beam in structure.shell.beams)
    return known and all(hasattr(spring, "times") for spring in springs)


def _slipping(mesh: GridMesh, used: Utilisation) -> Ints:
    """The crossings at which a joint slips."""
    slip = used.uses.get("slip")
    return np.empty(0, dtype=np.intp) if slip is None else np.flatnonzero((slip[mesh.at_crossings] > 1).any(axis=1))


def _place(mesh: GridMesh, entry: int, by: By | None = None) -> Governs:
    """The place of an entry of the mesh's `rod_nodes`."""
    rod, at = mesh.place(entry)
    return Governs(rod=rod, at=at, by=by)


def _of_bracing(
    structure: Structure, found: Equilibrium, loads: Loads, limits: Limits, duration: Duration
) -> float | None:
    """Largest utilisation of the bracing; None: there is none, or its strength is not known."""
    bracing, asked, edges = loads.bracing, loads.strength, len(structure.mesh.edges)
    shares = list[float]()
    for state, lasting in ((found, duration), (structure.equilibrium, None)):  # prestress and bends of laths stay
        if isinstance(bracing, Cables):
            strength = preset_limits(bracing.rod, asked.service_class).bending.get(lasting or PERMANENT)
            pull = float(structure.bracing_forces(state).max(initial=0.0))
            shares += [] if strength is None else [pull / (strength * area_of(bracing.rod))]
        elif (layer := structure.laths) is not None:
            used = utilisation(
                *layer.alone(state, len(structure.shell.elements)), layer.rod, forces=state.forces[edges:],
                limits=limits if layer.rod == structure.rod else preset_limits(layer.rod, asked.service_class),
                asked=replace(asked, slip=None), duration=lasting,
            )  # fmt: skip
            shares += used.largest.values()
    return max(shares, default=None)
