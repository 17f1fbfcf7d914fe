"""All checks of a popped-up shell in one call."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from math import inf

import numpy as np

from rodshell.checks.bending import Bending, bending, bending_of, shell_normals
from rodshell.checks.contact import Contact, contact, contact_of
from rodshell.checks.deployment import Deployment, deploy, reached_by_turning
from rodshell.checks.other_shapes import OtherShapes, other_shapes
from rodshell.checks.self_weight import SelfWeight, self_weight, unknown_weights
from rodshell.checks.support_and_joint_loads import JointLoads, Reactions, joint_loads, reactions
from rodshell.errors import OutOfTimeError
from rodshell.formfinding import PopUp
from rodshell.formfinding.popup import Ends
from rodshell.formfinding.progress import Progress, silent
from rodshell.model.shell import UP
from rodshell.rods.section import Rod
from rodshell.rods.section_stress import VON_MISES
from rodshell.solve.critical import MOST_FACTORIZATIONS
from rodshell.units import length_text, stress_text

WORTH = 0.01  # of the stress: less torsion is not worth a word


@dataclass(frozen=True)
class ShellChecks:
    """The checks of the shell with one kind of ends.

    Parameters
    ----------
    self_weight, other_shapes : None where a time limit came before them, or the shell is not stable.
    """

    bending: Bending
    reactions: Reactions
    joints: JointLoads
    contact: Contact
    self_weight: SelfWeight | None
    other_shapes: OtherShapes | None


@dataclass(frozen=True)
class Checks:
    """What was checked of the shells that converged.

    Parameters
    ----------
    bending, reactions, joints : by end condition.
    deployment : the way up from flat with pinned ends, or None; `on_the_way` the bending of its stages.
    self_weight : by end condition, what share of its own weight the shell bears.
    contact : by end condition; `contact_on_the_way` of the deployment's stages.
    other_shapes : by end condition, of shells that are stable; empty where they were not looked for.
    clamped_from_flat : whether the pinned shell, reached from flat, comes to the clamped shape when its ends are
        turned into their clamps; None where that is not known.
    stopped, missing : when the time limit came, or "", and which checks were not reached.
    """

    bending: dict[Ends, Bending]
    reactions: dict[Ends, Reactions]
    joints: dict[Ends, JointLoads]
    deployment: Deployment | None
    on_the_way: tuple[Bending, ...]
    self_weight: dict[Ends, SelfWeight] = field(default_factory=dict)
    contact: dict[Ends, Contact] = field(default_factory=dict)
    contact_on_the_way: tuple[Contact, ...] = ()
    other_shapes: dict[Ends, OtherShapes] = field(default_factory=dict)
    clamped_from_flat: bool | None = None
    stopped: str = ""
    missing: tuple[str, ...] = ()

    def __getitem__(self, ends: Ends) -> ShellChecks:
        """The checks of the shell with these ends.

        Raises
        ------
        KeyError : there is no such shell, or it did not converge.
        """
        return ShellChecks(
            self.bending[ends],
            self.reactions[ends],
            self.joints[ends],
            self.contact[ends],
            self.self_weight.get(ends),
            self.other_shapes.get(ends),
        )

    @property
    def out_of_time(self) -> str:
        """A sentence on when that was and which checks are missing, or ""."""
        return f"{self.stopped}; not checked: {', '.join(self.missing)}" if self.stopped else ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences that a user should read."""
        way = () if self.deployment is None else self.deployment.warnings
        late = (self.out_of_time,) if self.out_of_time else ()
        turned: tuple[str, ...] = ()
        if self.clamped_from_flat is False:
            turned = ("turned into their clamps after deployment, the ends lead to another than the clamped shape",)
        return (*late, *way, *turned, *unknown_weights(self.self_weight), *self.tight)

    @property
    def before_the_end(self) -> tuple[tuple[float, Bending], ...]:
        """Stages of the deployment below the final shape, with their shares."""
        shares = () if self.deployment is None else self.deployment.share.tolist()
        return tuple((share, bent) for share, bent in zip(shares, self.on_the_way, strict=True) if share < 1)

    @property
    def nearest_on_the_way(self) -> tuple[float, Contact] | None:
        """The stage below the final shape in which rods are nearest, by its share; None where nothing was checked."""
        if self.deployment is None or not self.contact_on_the_way:
            return None
        pairs = zip(self.deployment.share.tolist()[:-1], self.contact_on_the_way[:-1], strict=True)
        return min(pairs, key=lambda pair: inf if pair[1].clearance is None else pair[1].clearance)

    @property
    def tight(self) -> tuple[str, ...]:
        """A sentence where rods that do not touch come so near to each other that there is no room for joints."""
        shapes = [(found, f"with {ends} ends") for ends, found in self.contact.items()]
        if (nearest := self.nearest_on_the_way) is not None:
            share, found = nearest
            shapes.append((found, f"during deployment (stage at {100 * share:.0f} %)" if share else "in the flat grid"))
        near = [(found, where) for found, where in shapes if found.clearance is not None]
        if not near or any(found.pairs for found, _ in near):
            return ()
        worst, where = min(near, key=lambda pair: pair[0].clearance or 0.0)
        assert worst.clearance is not None
        assert worst.rods is not None
        assert worst.where is not None
        who = f"rods {worst.rods[0]} and {worst.rods[1]}" if worst.rods[0] != worst.rods[1] else f"rod {worst.rods[0]}"
        return (
            f"{who} pass each other with {length_text(worst.clearance)} between them {where}, near "
            f"({worst.where[0]:.4g}, {worst.where[1]:.4g}, {worst.where[2]:.4g}) m: that leaves hardly any room for "
            "joints; use thinner rods (rod.section) or a larger spacing",
        )

    def shear_unknown(self, strength: float | None) -> tuple[str, ...]:
        """A sentence where torsion counts and the shear strength of a material that is not isotropic is not known."""
        parts = [bent.torsion_stress for bent in (*self.bending.values(), *self.on_the_way)]
        sheared = max((float(part.max()) for part in parts if part is not None), default=0.0)
        if strength is None or sheared <= WORTH * strength:
            return ()
        return (
            f"torsion shears the rods by up to {stress_text(sheared)}, counted by von Mises as in isotropic "
            "materials; timber and fibre composites bear less along their fibres: give checks.shear_strength",
        )


def check(
    popped: Mapping[Ends, PopUp], rod: Rod, *, stages: int = 8, shear_weight: float = VON_MISES,
    progress: Progress = silent,
) -> Checks:  # fmt: skip
    """Check every shell that converged.

    Parameters
    ----------
    stages : of the deployment from flat of the pinned shell; 0: none.
    shear_weight : strength over shear strength, by which torsion is added to bending, see `rods.section_stress`.
    """
    done = {ends: shape for ends, shape in popped.items() if shape.report.converged}
    bent = {ends: bending_of(shape.shell, shape.state, rod, shear_weight=shear_weight) for ends, shape in done.items()}
    met = {ends: contact_of(shape.shell, shape.state, rod) for ends, shape in done.items()}
    held = {ends: reactions(shape.shell, shape.equilibrium) for ends, shape in done.items()}
    joints = {ends: joint_loads(shape.shell, shape.state) for ends, shape in done.items()}
    weighed = dict[Ends, SelfWeight]()
    follow = "pinned" in done and stages > 0
    deployment, turned, others, stopped = None, None, dict[Ends, OtherShapes](), ""
    missing = [f"self-weight with {ends} ends" for ends in done]
    missing += [*(["the deployment from flat"] if follow else []), "other stable shapes"]
    try:
        for ends, shape in done.items():
            weighed[ends] = self_weight(shape.shell, shape.equilibrium, progress=_weighing(ends, progress))
            missing.pop(0)
        if follow:
            deployment = _deployed(done["pinned"], stages, progress)
            missing[0] = "whether the clamped shell is reached from flat"
            if deployment.reached_from_flat and "clamped" in done and done["clamped"].report.stable:
                progress("deployment", "turning the ends into their clamps", 0.0)
                turned = reached_by_turning(done["pinned"], done["clamped"])
            missing.pop(0)
        done_before = sum(weight.factorizations for weight in weighed.values())
        for ends, search in _other_shapes(popped, deployment, done_before, progress):
            others[ends] = search
        missing.pop(0)
    except OutOfTimeError as error:
        stopped = str(error)
    late = stopped, tuple(missing)
    if deployment is None:
        return Checks(bent, held, joints, None, (), weighed, met, (), others, None, *late)
    mesh, laid = done["pinned"].footprint.mesh, deployment.positions[0]
    flat = bending(mesh, laid, rod, normals=shell_normals(mesh, laid))
    on_the_way = (flat, *(bending_of(*stage, rod, shear_weight=shear_weight) for stage in deployment.shells))
    met_flat = contact(mesh, laid[mesh.rod_nodes], rod, directors=np.tile(UP, (len(mesh.edges), 1)))
    met_on_the_way = (met_flat, *(contact_of(*stage, rod) for stage in deployment.shells))
    return Checks(bent, held, joints, deployment, on_the_way, weighed, met, met_on_the_way, others, turned, *late)


def _other_shapes(
    popped: Mapping[Ends, PopUp], deployment: Deployment | None, weighing: int, progress: Progress
) -> Iterator[tuple[Ends, OtherShapes]]:
    """Other stable shapes, with half of the factorisations that the shells, their deployment and their `weighing` took.

    Two thirds of them are for the first end condition; clamped shells seldom have other shapes.
    """
    done = weighing + sum(shape.report.factorizations for shape in popped.values())
    left = (done + (0 if deployment is None else deployment.factorizations)) // 2
    stable = {ends: shape for ends, shape in popped.items() if shape.report.stable}
    for number, (ends, shape) in enumerate(stable.items()):
        most = 2 * left // 3 if number == 0 else left
        left -= most
        yield (
            ends,
            other_shapes(
                shape.shell,
                shape.equilibrium,
                most_factorizations=most,
                deployment=deployment if ends == "pinned" else None,
                progress=partial(_starting, ends, progress),
            ),
        )


def _starting(ends: Ends, progress: Progress, start: int) -> None:
    progress("other shapes", f"{ends} ends, start {start}", 0.0)


def _weighing(ends: Ends, progress: Progress) -> Callable[[int, float], None]:
    def report(count: int, factor: float) -> None:
        done = f"{count} of at most {MOST_FACTORIZATIONS} factorisations"
        progress("self-weight", f"{ends} ends, {100 * factor:.3g} % of the weight, {done}", 0.0)

    return report


def _deployed(last: PopUp, stages: int, progress: Progress) -> Deployment:
    return deploy(
        last.shell,
        last.equilibrium,
        stages=stages,
        progress=lambda share: progress("deployment", f"{100 * share:.0f} % of the way", 0.0),
    )
