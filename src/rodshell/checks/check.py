"""All checks of a shell."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from math import inf
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.checks.bending import VON_MISES, Bending, bending, bending_of, shell_normals, worst
from rodshell.checks.contact import contact, contact_of
from rodshell.checks.deployment import Deployment, deploy_grids, reached_by_turning
from rodshell.checks.other_shapes import OtherShapes, other_shapes
from rodshell.checks.reactions import JointLoads, Reactions, joint_loads, reactions
from rodshell.checks.self_weight import self_weight, snow_carried
from rodshell.errors import OutOfTimeError
from rodshell.figures.checks import ClampedDeployment, Clearance, SelfWeight, Stage
from rodshell.figures.findings import Said, said
from rodshell.figures.records import Ends
from rodshell.formfinding import PopUp
from rodshell.formfinding.supports import figures_of
from rodshell.joints.crossings import UP
from rodshell.progress import Progress, require_progress, silent
from rodshell.quantities import MOST_STAGES
from rodshell.rods.section import Rod
from rodshell.rods.supports import PINNED, SUPPORTS, finals_first
from rodshell.solve.equilibrium import find_equilibrium
from rodshell.solve.load_path import MOST_FACTORIZATIONS
from rodshell.units import length_text, shown, stress_text
from rodshell.validation import array, brief, choice, instance, mapping, positive, whole

WORTH = 0.01  # of the stress: less torsion is not worth a word


@dataclass(frozen=True)
class ShellChecks:
    """The checks of the shell with one kind of ends.

    Args:
        self_weight, other_shapes: None where a time limit came before them, or the shell is not stable.
        snow: [Pa]; None where it is more than is looked for, or not known.
    """

    bending: Bending
    reactions: Reactions
    joints: JointLoads
    contact: Clearance
    self_weight: SelfWeight | None
    snow: float | None
    other_shapes: OtherShapes | None

    __repr__ = brief


@dataclass(frozen=True)
class Checks:
    """What was checked of the shells that converged.

    Args:
        deployment: from flat, with pinned ends, or None; `deployment_bending` the bending of its stages, the flat grid
            first.
        self_weight: by end condition, what share of its own weight the shell carries.
        snow: by end condition, uniform snow on the plan that it carries on top of its weight [Pa]; None: more than
            10 kPa; missing where it is not known.
        contact: by end condition; `deployment_contact` of the deployment's stages.
        other_shapes: by end condition, of shells that are stable; empty where they were not looked for.
        stopped, missing: when the time limit came, or "", and which checks were not reached.
    """

    bending: dict[Ends, Bending]
    reactions: dict[Ends, Reactions]
    joints: dict[Ends, JointLoads]
    deployment: Deployment | None = None
    deployment_bending: tuple[Bending, ...] = ()
    self_weight: dict[Ends, SelfWeight] = field(default_factory=dict)
    snow: dict[Ends, float | None] = field(default_factory=dict)
    contact: dict[Ends, Clearance] = field(default_factory=dict)
    deployment_contact: tuple[Clearance, ...] = ()
    other_shapes: dict[Ends, OtherShapes] = field(default_factory=dict)
    stopped: str = ""
    missing: tuple[str, ...] = ()

    def __repr__(self) -> str:
        stages = 0 if self.deployment is None else len(self.deployment.share)
        late = f", {self.stopped}" if self.stopped else ""
        return f"<Checks of {' and '.join(self.bending) or 'no shell'}, {stages} stages of deployment{late}>"

    def __getitem__(self, ends: Ends) -> ShellChecks:
        """The checks of the shell with these ends.

        Raises:
            KeyError: there is no such shell, or it did not converge.
        """
        if ends not in self.bending:
            known = " and ".join(map(str, self.bending)) or "none"
            raise KeyError(
                f"no shell with {ends} ends was checked: it was not asked for or did not converge; checked: {known}"
            )
        return ShellChecks(**{each.name: getattr(self, each.name).get(ends) for each in fields(ShellChecks)})

    @property
    def clamped_from_flat(self) -> bool | None:
        """Whether the pinned shell, reached from flat, comes to the clamped shape when its ends are turned into their
        clamps; None where that is not known."""
        return self.deployment.clamped.reached_from_flat if self.deployment and self.deployment.clamped else None

    @property
    def out_of_time(self) -> str:
        """A sentence on when that was and which checks are missing, or ""."""
        return "".join(self._late)

    @property
    def warnings(self) -> tuple[Said, ...]:
        """Sentences that a user should read."""
        way = () if self.deployment is None else self.deployment.warnings
        turned = (said("turned", finals_first(self.bending)[0]),) if self.clamped_from_flat is False else ()
        return (*self._late, *way, *turned, *self.tight)

    @property
    def _late(self) -> tuple[Said, ...]:
        return (said("not_checked: late", when=self.stopped, missing=", ".join(self.missing)),) if self.stopped else ()

    @property
    def stages_below_final(self) -> tuple[tuple[float, Bending], ...]:
        """Stages of the deployment below the final shape, with their shares."""
        shares = () if self.deployment is None else self.deployment.share.tolist()
        return tuple((share, bent) for share, bent in zip(shares, self.deployment_bending, strict=True) if share < 1)

    @property
    def closest_stage(self) -> Clearance | None:
        """The stage below the final shape in which rods are nearest; None where nothing was checked."""
        if self.deployment is None or not self.deployment_contact:
            return None
        stages = zip(self.deployment.share.tolist()[:-1], self.deployment_contact[:-1], strict=True)
        found = [stage.changed(share=share) for share, stage in stages]
        return min(found, key=lambda stage: inf if stage.clearance is None else stage.clearance)

    @property
    def tight(self) -> tuple[Said, ...]:
        """A sentence where rods that do not touch come so near to each other that there is no room for joints."""
        shapes = [(found, f"with {ends} ends") for ends, found in self.contact.items()]
        if (nearest := self.closest_stage) is not None:
            share = nearest.share
            shapes.append(
                (nearest, f"during deployment (stage at {100 * share:.0f} %)" if share else "in the flat grid")
            )
        near = [(found, where) for found, where in shapes if found.clearance is not None]
        if not near or any(found.pairs for found, _ in near):
            return ()
        worst, where = min(near, key=lambda pair: pair[0].clearance or 0.0)
        assert worst.clearance is not None
        assert worst.rods is not None
        assert worst.where is not None
        who = f"rods {worst.rods[0]} and {worst.rods[1]}" if worst.rods[0] != worst.rods[1] else f"rod {worst.rods[0]}"
        room, near_to = length_text(worst.clearance), ", ".join(f"{x:.4g}" for x in worst.where)
        where = f"{where}, near ({near_to}) m"
        return (said("no_room", None, worst.clearance, unit="m", place=worst.rods[0], who=who, room=room, where=where),)

    def shear_unknown(self, strength: float | None) -> tuple[Said, ...]:
        """A sentence where torsion counts and the shear strength of a material that is not isotropic is not known."""
        parts = [bent.torsion_stress for bent in (*self.bending.values(), *self.deployment_bending)]
        sheared = max((float(part.max()) for part in parts if part is not None), default=0.0)
        if strength is None or sheared <= WORTH * strength:
            return ()
        return (said("no_shear_strength", None, sheared, unit="Pa", stress=stress_text(sheared)),)


def check(
    popped: Mapping[Ends, PopUp], rod: Rod, *, stages: int = 8, shear_weight: float = VON_MISES,
    plan: Floats | None = None, progress: Progress = silent,
) -> Checks:  # fmt: skip
    """Check every shell that converged.

    Args:
        popped: the shells of one footprint by their end condition.
        stages: of the deployment from flat of the pinned shell; 0: none.
        shear_weight: strength over shear strength, by which torsion is added to bending, see `checks.bending`.
        plan: (n,) of the target's plan that each node takes snow from [m2]; None: it is not known how much is carried.
        progress: called with stage and figures; an OutOfTimeError that it raises ends the checks that take long, and
            what was found until then is returned.

    Raises:
        InputError: a value is of the wrong kind.
    """
    by_ends = f"shells by their ends, such as {{{shown(PINNED.name)}: rodshell.pop_up(...)}}"
    for ends, shape in mapping("popped", popped, by_ends).items():
        instance(f"the shell with {ends} ends", shape, PopUp, "what rodshell.pop_up returned")
        choice("the ends of popped", ends, tuple(dict.fromkeys((*SUPPORTS, shape.ends))))
    instance("rod", rod, Rod)
    whole("stages", stages, 0, MOST_STAGES)
    shear_weight = positive("shear_weight", shear_weight)
    require_progress(progress)
    done = {ends: _settled(shape) for ends, shape in popped.items() if shape.report.converged}
    for shape in done.values():
        plan = None if plan is None else array("plan", plan, np.float64, shape.shell.node_count)
    checks = Checks(
        bending={
            ends: bending_of(shape.shell, shape.state, rod, shear_weight=shear_weight) for ends, shape in done.items()
        },
        reactions={ends: _held(shape) for ends, shape in done.items()},
        joints={ends: joint_loads(shape.shell, shape.state) for ends, shape in done.items()},
        contact={ends: contact_of(shape.shell, shape.state, rod) for ends, shape in done.items()},
        **_long_checks(popped, done, stages, plan, progress),
    )
    if checks.deployment is None:
        return checks
    (mesh, *_), way = [shape.footprint.mesh for shape in done.values()], checks.deployment
    flat, shells = way.positions[0], way.shells
    directors = np.tile(UP, (len(mesh.edges), 1))
    bent = (
        bending(mesh, flat, rod, normals=shell_normals(mesh, flat)),
        *(bending_of(*stage, rod, shear_weight=shear_weight) for stage in shells),
    )
    return replace(
        checks,
        deployment=staged(checks.deployment, bent),
        deployment_bending=bent,
        deployment_contact=(
            contact(mesh, flat[mesh.rod_nodes], rod, directors=directors, each_grid=True),
            *(contact_of(*stage, rod, each_grid=True) for stage in shells),
        ),
    )


def staged(deployment: Deployment, bent: Sequence[Bending]) -> Deployment:
    """A deployment whose stages have their worst bending, of which `bent` is one each."""
    stages = zip(deployment.share.tolist(), deployment.positions, bent, strict=True)
    return deployment.changed(
        stages=tuple(Stage(share=at, height=float(np.ptp(there[:, 2])), **worst([each])) for at, there, each in stages)
    )


def _settled(shape: PopUp) -> PopUp:
    """Solved again from where the pop-up ended: the order of equal figures depends on the last bits."""
    last = shape.equilibrium
    found = find_equilibrium(last.problem, last.state, last.forces)
    return replace(shape, shell=shape.shell.with_elements(found.elements), equilibrium=found)


def _held(shape: PopUp) -> Reactions:
    """What the supports exert, and what they say of themselves."""
    found = reactions(shape.shell, shape.equilibrium)
    said_by = figures_of(shape.support, found.points - shape.boundary.points, found.forces)
    return found.changed(figures=said_by) if said_by else found


def _long_checks(
    popped: Mapping[Ends, PopUp], done: Mapping[Ends, PopUp], stages: int, plan: Floats | None, progress: Progress
) -> dict[str, Any]:
    """Fields of `Checks`, of the settled shells that are `done`, as far as the time limit allows."""
    held = (ends for ends, shape in done.items() if not (shape.support.holds_directions or shape.shell.yields))
    upright = next(held, None) if stages > 0 else None  # held in place and free to turn: can be followed from flat
    clamped = next((ends for ends, shape in done.items() if len(shape.shell.ghosts) and not shape.shell.yields), None)
    deployment, turned, stopped = None, None, ""
    weights, snow, others = dict[Ends, SelfWeight](), dict[Ends, float | None](), dict[Ends, OtherShapes]()
    weighings = ["self-weight", *(["snow"] if plan is not None else [])]
    missing = [f"{what} with {ends} ends" for ends in done for what in weighings]
    missing += [*(["the deployment from flat"] if upright else []), "other stable shapes"]
    try:
        for ends, shape in done.items():
            following = partial(_loading, progress, "self-weight", ends, 100.0, "% of the weight")
            weights[ends], whole = self_weight(shape.shell, shape.equilibrium, progress=following)
            missing.pop(0)
            if plan is None:
                continue
            if whole is not None:
                snow[ends] = snow_carried(whole, plan, partial(_loading, progress, "snow", ends, 1.0, "kPa"))
            elif weights[ends].limit not in ("not followed", "no mass"):
                snow[ends] = 0.0
            missing.pop(0)
        if upright is not None:
            deployment = deploy_grids(
                popped[upright],
                stages=stages,
                progress=lambda share: progress("deployment", f"{100 * share:.0f} %", 0.0),
            )
            missing[0] = f"whether the {clamped} shell is reached from flat"
            if deployment.reached_from_flat and clamped and done[clamped].report.stable:
                progress("deployment", "turning the ends into their clamps", 0.0)
                turned = reached_by_turning(popped[upright], popped[clamped])
            missing.pop(0)
        weighing = sum(weight.factorizations or 0 for weight in weights.values())
        for ends, search in _other_shapes(popped, done, deployment, weighing, progress):
            others[ends] = search
        missing.pop(0)
    except OutOfTimeError as error:
        stopped = str(error)
    return {
        "self_weight": weights,
        "snow": snow,
        "deployment": deployment and deployment.changed(clamped=ClampedDeployment(reached_from_flat=turned)),
        "other_shapes": others,
        "stopped": stopped,
        "missing": tuple(missing),
    }


def _other_shapes(
    popped: Mapping[Ends, PopUp], done: Mapping[Ends, PopUp], deployment: Deployment | None, weighing: int,
    progress: Progress,
) -> Iterator[tuple[Ends, OtherShapes]]:  # fmt: skip
    """Other stable shapes, with half of the factorisations that the shells, their deployment and their `weighing` took.

    Two thirds of them are for the first end condition; clamped shells seldom have other shapes.
    """
    work = weighing + sum(shape.report.factorizations for shape in popped.values())
    grids = max((len(shape.footprint.mesh.grids) for shape in done.values()), default=1)
    followed = (deployment.factorizations or 0 if deployment else 0) // grids  # of each alone: its share of one of all
    left = (work + followed) // 2
    stable = {ends: shape for ends, shape in done.items() if shape.report.stable}
    for number, (ends, shape) in enumerate(stable.items()):
        most = 2 * left // 3 if number == 0 else left
        left -= most
        way = deployment if deployment and ends == deployment.ends else None
        report = partial(_starting, ends, progress)
        found = other_shapes(shape.shell, shape.equilibrium, most_factorizations=most, deployment=way, progress=report)
        yield ends, found


def _starting(ends: Ends, progress: Progress, start: int) -> None:
    progress("other shapes", f"{ends} ends, start {start}", 0.0)


def _loading(
    progress: Progress, stage: str, ends: Ends, times: float, unit: str, count: int, factor: float
) -> None:  # fmt: skip
    done = f"{count} of at most {MOST_FACTORIZATIONS} factorisations"
    progress(stage, f"{ends} ends, {times * factor:.3g} {unit}, {done}", 0.0)
