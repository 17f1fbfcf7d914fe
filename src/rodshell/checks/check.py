"""All checks of a popped-up shell in one call."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rodshell.checks.bending import Bending, bending, bending_of
from rodshell.checks.clamping import reached_by_turning
from rodshell.checks.deployment import Deployment, deploy
from rodshell.checks.joint_loads import JointLoads, joint_loads
from rodshell.checks.other_shapes import OtherShapes, other_shapes
from rodshell.checks.reactions import Reactions, reactions
from rodshell.formfinding import Popped
from rodshell.formfinding.popup import Ends
from rodshell.formfinding.progress import Progress, silent
from rodshell.layout import GridMesh
from rodshell.model import Shell
from rodshell.rods.section import Rod
from rodshell.solve.constraint import Supports
from rodshell.solve.mixed_newton import Equilibrium, find_equilibrium
from rodshell.solve.problem import Problem
from rodshell.units import length_text

THIN = 0.05  # strain of the outermost fibre up to which rods are thin: radii of ten depths


@dataclass(frozen=True)
class Checks:
    """What was checked of the shells that converged.

    Parameters
    ----------
    bending, reactions, joints : by end condition.
    deployment : the way up from flat with pinned ends, or None; `on_the_way` the bending of its stages.
    other_shapes : by end condition, of shells that are stable; empty where they were not looked for.
    clamped_from_flat : whether the pinned shell, reached from flat, comes to the clamped shape when its ends are
        turned into their clamps; None where that is not known.
    """

    bending: dict[Ends, Bending]
    reactions: dict[Ends, Reactions]
    joints: dict[Ends, JointLoads]
    deployment: Deployment | None
    on_the_way: tuple[Bending, ...]
    other_shapes: dict[Ends, OtherShapes] = field(default_factory=dict)
    clamped_from_flat: bool | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences that a user should read."""
        way = () if self.deployment is None else self.deployment.warnings
        if self.clamped_from_flat is False:
            way = (
                *way,
                "turned into their clamps after deployment, the ends lead to another than the clamped shape",
            )
        bends = [
            float((bent.strain - np.abs(bent.axial_strain)).max())
            for bent in (*self.bending.values(), *self.on_the_way)
            if bent.strain is not None
        ]
        if max(bends, default=0.0) <= THIN:
            return way
        return (
            *way,
            f"bending strains the rods by {100 * max(bends):.2g} %: they are too thick for their bends, the theory of "
            f"thin rods holds up to {100 * THIN:.0f} % or so; use thinner rods or a larger target",
        )

    def overstress(self, strength: float | None, mesh: GridMesh) -> tuple[str, ...]:
        """A sentence where the rods would break, in a final shape or on the way up, with the place.

        strength : of the rods' material [Pa], or None.
        """
        if strength is None:
            return ()
        shares = () if self.deployment is None else self.deployment.share
        final = [(_worst(bent) / strength, f"with {ends} ends", bent) for ends, bent in self.bending.items()]
        way = [
            (_worst(bent) / strength, f"on the way up (stage at {100 * share:.0f} %)", bent)
            for share, bent in zip(shares, self.on_the_way, strict=True)
            if share < 1
        ]
        worst = [max(each, key=lambda one: one[0]) for each in (final, way) if each]
        broken = sorted((one for one in worst if one[0] > 1), key=lambda one: -one[0])
        if not broken:
            return ()
        found = ", ".join(
            f"{max(101, round(100 * used))} % of the strength {where} in {_most_stressed(bent, mesh)}"
            for used, where, bent in broken
        )
        only = "" if any(one[0] > 1 for one in final) else ", or close the joints near that place last"
        return (f"the rods would break: {found}; use thinner, softer or stronger rods, or a flatter target{only}",)


def check(popped: Mapping[Ends, Popped], rod: Rod, *, stages: int = 8, progress: Progress = silent) -> Checks:
    """Check every shell that converged.

    stages : of the deployment, the way up from flat of the pinned shell; 0: none.
    """
    done = {ends: shell for ends, shell in popped.items() if shell.report.converged}
    settled = {ends: settled_shell(shell) for ends, shell in done.items()}
    bent = {ends: bending_of(shell, found.state, rod) for ends, (shell, found) in settled.items()}
    held = {ends: reactions(*pair) for ends, pair in settled.items()}
    carried = {ends: joint_loads(shell, found.state) for ends, (shell, found) in settled.items()}
    if "pinned" not in done or not stages:
        return Checks(bent, held, carried, None, (), _others(popped, settled, None))
    last = done["pinned"]
    deployment = deploy(
        last.shell, last.state, last.forces, stages=stages, pattern=settled["pinned"][1].pattern,
        told=lambda share: progress("deployment", f"{100 * share:.0f} % of the way", 0.0),
    )  # fmt: skip
    flat = bending(last.footprint.mesh, deployment.positions[0], rod)
    on_the_way = (flat, *(bending_of(shell, state, rod) for shell, state in deployment.shells))
    others, turned = _others(popped, settled, deployment), None
    if deployment.reached_from_flat and "clamped" in done and done["clamped"].report.stable:
        turned = reached_by_turning(last, done["clamped"])
    return Checks(bent, held, carried, deployment, on_the_way, others, turned)


def _others(
    popped: Mapping[Ends, Popped], settled: Mapping[Ends, tuple[Shell, Equilibrium]], deployment: Deployment | None
) -> dict[Ends, OtherShapes]:
    """Other stable shapes, with half of the factorisations that the shells and the deployment took.

    Two thirds of them are for the first end condition; clamped shells seldom have other shapes.
    """
    done = sum(one.report.factorizations for one in popped.values())
    left = (done + (0 if deployment is None else deployment.factorizations)) // 2
    found = dict[Ends, OtherShapes]()
    for ends, (shell, at) in settled.items():
        if at.report.stable:
            own = deployment if ends == "pinned" else None
            found[ends] = other_shapes(shell, at, most_factorizations=left if found else 2 * left // 3, deployment=own)
            left -= 2 * left // 3
    return found


def _worst(bent: Bending) -> float:
    return 0.0 if bent.stress is None else float(bent.stress.max())


def _most_stressed(bent: Bending, mesh: GridMesh) -> str:
    """The rod, and how far along it."""
    assert bent.stress is not None
    at = int(np.argmax(bent.stress))
    rod = mesh.grid.rods[int(np.searchsorted(mesh.rod_start, at, side="right")) - 1]
    return f"{rod.name}, {length_text(float(mesh.stations[at]) - rod.start)} from its start"


def settled_shell(popped: Popped) -> tuple[Shell, Equilibrium]:
    """A popped-up shell and its equilibrium, with what the pop-up does not keep of it: the gradient and the pattern."""
    shell = popped.shell
    length = 0.5 * float(np.ptp(popped.positions, axis=0).max())
    problem = Problem(shell.elements, shell.stretch, Supports(shell.held_ends()), length, places=shell.places)
    found = find_equilibrium(problem, popped.state, popped.forces)
    return shell.with_elements(found.elements), found
