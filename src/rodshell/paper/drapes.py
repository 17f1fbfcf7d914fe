"""The paper's targets draped by its own method, by gravity statics and bound: rod ends against the net's."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.formfinding import Bound, Draped, Fall, Gravity, Method, Trimmed, drape, trim
from rodshell.formfinding.methods import MethodName
from rodshell.layout import FlatRod, GridLayout
from rodshell.nets import chebyshev_net
from rodshell.rods.materials import Material
from rodshell.rods.section import Circle, Rod
from rodshell.targets import Target

Progress = Callable[[str, str, float], None]

ROD = Rod(Circle(radius=1e-3), Material(youngs_modulus=1e6, density=1e3))  # [HQK 3.2]
LENGTH, HEIGHT = 1.2, 0.05  # [m]
EDGE = 0.015  # [m]; the paper's "8000 DOFs" are this mesh, its stated 5 mm have four times as many
FALL = Fall(height=HEIGHT, drag=3.0)  # shared DOFs: the paper's *mapping*
METHODS: tuple[MethodName, ...] = ("paper", "gravity", "bound")
WORDS = {"paper": "paper's, in time", "gravity": "gravity statics", "bound": "bound to the target"}
COLUMNS = (
    "target", "rods", "method", "unknowns", "time [s]", "ends off the net, max [mm]", "rms [mm]", "how it rests",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A target and a grid: `label` is its letter in the paper's figure."""

    label: str
    target: Target
    rods: tuple[int, int]
    spacing: float = 0.03
    edge: float = EDGE

    @property
    def layout(self) -> GridLayout:
        return GridLayout.orthogonal(rods=self.rods, spacing=self.spacing, edge=self.edge, length=LENGTH)


@dataclass(frozen=True)
class Drape:
    """One case by one method.

    Parameters
    ----------
    seconds : of drape, trim and map back.
    ends : (m, 2) start and end of each rod where this drape crosses the target's end: those of G0, but by method
        bound, whose G0 is that of the net it started from, the drape's own [m].
    net : (m, 2) those of the exact net [m].
    """

    case: Case
    method: MethodName
    draped: Draped
    trimmed: Trimmed
    seconds: float
    ends: Floats
    net: Floats

    @property
    def errors(self) -> Floats:
        """(2m,) how far the drape's rod ends lie beyond the net's [m]."""
        return np.column_stack([self.net[:, 0] - self.ends[:, 0], self.ends[:, 1] - self.net[:, 1]]).ravel()

    @property
    def rests(self) -> str:
        """In a few words."""
        rest = self.draped.rest
        if rest is not None:
            if not rest.at_rest:
                return f"NOT AT REST after {rest.time:.1f} s"
            growth = rest.fastest_growth
            return f"after {rest.time:.1f} s; " + (f"unstable sideways, {growth:.1f} per s" if growth else "stable")
        if not self.draped.converged:
            return self.draped.report.status.value.upper()
        held = ", one joint and its heading held" if self.method == "gravity" else ""
        modes = self.draped.report.negative_modes
        return ("stable" if modes == 0 else f"{modes} negative modes") + held

    def row(self) -> tuple[str, ...]:
        """Of the table."""
        error = 1e3 * np.abs(self.errors)
        return (
            f"({self.case.label}) {self.case.target.name}, {1e3 * self.case.spacing:g} mm",
            f"{self.case.rods[0]}x{self.case.rods[1]}", WORDS[self.method], str(self.draped.report.dofs),
            f"{self.seconds:.3g}", f"{error.max():.2f}", f"{np.sqrt(np.mean(error**2)):.2f}", self.rests,
        )  # fmt: skip

    def result(self) -> dict[str, Any]:
        """Of result.json, SI."""
        rods = self.trimmed.mesh.grid.rods
        return {
            "case": self.case.label, "target": self.case.target.parameters(), "method": self.method,
            "spacing": self.case.spacing, "edge": self.case.edge, "dofs": self.draped.report.dofs,
            "status": self.draped.report.status.value, "seconds": self.seconds,
            "error_max": float(np.abs(self.errors).max()), "error_rms": float(np.sqrt(np.mean(self.errors**2))),
            "rods": [
                {"id": rod.name, "offset": rod.offset, "start": ends[0], "end": ends[1], "net": net}
                for rod, ends, net in zip(rods, self.ends.tolist(), self.net.tolist(), strict=True)
            ],
        }  # fmt: skip


def drape_all(
    cases: Sequence[Case], progress: Progress, *, fall: Fall = FALL, methods: Sequence[MethodName] = METHODS
) -> tuple[Drape, ...]:
    """Every case by every method."""
    return tuple(_drape(case, method, fall, progress) for case in cases for method in methods)


def _drape(case: Case, method: MethodName, fall: Fall, progress: Progress) -> Drape:
    def told(stage: str, detail: str, residual: float) -> None:
        progress(f"({case.label}) {case.target.name}, {stage}", detail, residual)

    begun = perf_counter()
    options: dict[MethodName, Method] = {"paper": fall, "gravity": Gravity(), "bound": Bound()}
    draped = drape(case.layout, ROD, case.target, method=options[method], progress=told)
    trimmed = trim(draped)
    seconds = perf_counter() - begun
    exact: dict[str, FlatRod] = {rod.name: rod for rod in chebyshev_net(case.target, case.layout).rods}
    rods = trimmed.mesh.grid.rods
    ends, net = (np.array([[rod.start, rod.end] for rod in some]) for some in (rods, [exact[r.name] for r in rods]))
    if draped.figures.net_deviation is not None:
        past = dict(zip([rod.name for rod in draped.rods], draped.figures.net_deviation, strict=True))
        ends += np.array([past[rod.name] for rod in rods]) * [-1.0, 1.0]
    return Drape(case, method, draped, trimmed, seconds, ends, net)
