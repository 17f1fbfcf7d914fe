"""Two claims of the text, tested: that H, E, r and g do not matter [HQK 3.2], and that C1 and C2 suffice [HQK 2.2].

The rods' parameters are changed one at a time over decades, and what G0 does is measured against the base case, the
paper's own: by gravity statics, where the height H is nothing, and H by the paper's falls on a coarser grid. A rod's
stretch stiffness EA and bending stiffness EI are also changed by themselves, which no E and no r can do. The penalties
C1 and C2 are made stiffer and stiffer against joints that share their unknowns, at rest, on the coarser grid.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from os import PathLike
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.formfinding import Draped, Fall, Gravity, drape, trim
from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, Joint, Linker
from rodshell.layout import GridLayout
from rodshell.nets import chebyshev_net
from rodshell.paper.drapes import EDGE, HEIGHT, LENGTH, ROD, Progress
from rodshell.paper.studies_pictures import studies_svg
from rodshell.paper.tables import aligned, result_of, write
from rodshell.results.folder import ResultFolder
from rodshell.rods.materials import Material
from rodshell.rods.section import Circle, GivenSection, Rod
from rodshell.targets import Hemisphere

TARGET = Hemisphere(0.2)
FINE = GridLayout.orthogonal(rods=(17, 17), spacing=0.03, edge=EDGE, length=LENGTH)
COARSE = GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.03, length=0.9)
DRAG = 5.0  # [1/s]
LONG = 30.0  # [s]: stopped at each step, grids creep the more slowly the shorter the steps
HEIGHTS = (0.01, 0.1, 1.0, 10.0, 100.0)  # times the paper's
TITLE = "G0 of the paper's hemisphere when one thing is changed [HQK 3.2, 2.2]"
COLUMNS = (
    "changed", "to", "times the base", "on", "G0 change, rms [mm]", "max [mm]", "G0 off the net, rms [mm]",
    "largest strain", "how it rests",
)  # fmt: skip


@dataclass(frozen=True)
class Line:
    """One run.

    Parameters
    ----------
    changed : what; value : to what, with its unit; factor : value over that of the base case; on : grid and method.
    change_rms, change_max : of G0's rod ends against the base case; off_net : rms distance from the exact net [m];
        NaN where there is no G0.
    strain : largest of the draped grid; rests : how it rests, in a word or two.
    """

    changed: str
    value: str
    factor: float
    on: str
    change_rms: float
    change_max: float
    off_net: float
    strain: float
    rests: str

    def row(self) -> tuple[str, ...]:
        errors = (self.change_rms, self.change_max, self.off_net)
        return (
            self.changed, self.value, f"{self.factor:g}", self.on,
            *("-" if np.isnan(one) else f"{1e3 * one:.2g}" for one in errors),
            "-" if np.isnan(self.strain) else f"{self.strain:.1e}", self.rests,
        )  # fmt: skip


@dataclass(frozen=True)
class Studies:
    """All runs. That a grid does not drape is a result, too."""

    lines: tuple[Line, ...]
    status = "converged"

    def rows(self) -> list[tuple[str, ...]]:
        """The table, a row for each run."""
        return [one.row() for one in self.lines]

    def summary(self) -> str:
        """The table as text."""
        return f"{TITLE}\n\n{aligned(COLUMNS, self.rows())}"

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        lines = [{k: None if v != v else v for k, v in asdict(one).items()} for one in self.lines]
        return result_of("studies", self.status, lines=lines)

    def save(self, folder: str | PathLike[str] | ResultFolder) -> None:
        """Write picture and table to `folder`."""
        write(folder, self.result(), self.summary(), COLUMNS, self.rows(), {"studies": studies_svg(self.lines)})


def make(progress: Progress) -> Studies:
    """Run all of it."""
    return Studies((*of_statics(progress), *of_height(progress), *of_penalties(progress)))


def of_statics(progress: Progress, *, layout: GridLayout = FINE) -> Iterator[Line]:
    """E, r, g, EA and EI by gravity statics."""
    base = drape(layout, ROD, TARGET, method=Gravity())
    for changed, (powers, given) in _PARAMETERS.items():
        for factor in (10.0**power for power in powers):
            value, rod, gravity = given(factor)
            progress(f"gravity statics, {changed}", value, 0.0)
            hung = partial(drape, layout, rod, TARGET, method=Gravity(acceleration=gravity))
            yield _line(changed, value, factor, base, hung)


def of_height(progress: Progress, *, factors: tuple[float, ...] = HEIGHTS) -> Iterator[Line]:
    """H, by falls."""
    base = _fallen(Fall(drag=DRAG))
    for factor in factors:
        height = HEIGHT * factor
        progress("in time, H", f"{height:g} m", 0.0)
        yield _line("H", f"{1e3 * height:g} mm", factor, base, partial(_fallen, Fall(drag=DRAG, height=height)))


def of_penalties(progress: Progress) -> Iterator[Line]:
    """C1 and C2, by falls."""
    runs: list[tuple[str, str, float, Coupling, Joint | None]] = []
    for power in range(6, 9):
        explicit = ExplicitPenalty(C1=10.0**power * ROD.bend_stiffness)
        runs.append(("C1 explicit", f"1e{power} EI", 10.0 ** (power - 6), explicit, None))
    for power in range(6, 11):
        implicit = ImplicitPenalty(C1=10.0**power * ROD.bend_stiffness)
        runs.append(("C1 implicit", f"1e{power} EI", 10.0 ** (power - 6), implicit, None))
    for corners in (2, 4):
        for factor in (0.01, 0.1, 1.0, 10.0, 100.0):
            stiff = ImplicitPenalty(C2=factor * ROD.twist_stiffness / COARSE.edge)
            runs.append((f"C2, {corners} linkers", f"{factor:g} GJ/l", factor, stiff, Linker(corners=corners)))
    bases: dict[Joint | None, Draped] = {}
    for changed, value, factor, coupling, joint in runs:
        progress(f"in time, {changed}", value, 0.0)
        if joint not in bases:
            bases[joint] = _fallen(Fall(drag=DRAG), joint)
        fall = Fall(coupling=coupling, drag=DRAG, duration=LONG if joint is None else None)
        yield _line(changed, value, factor, bases[joint], partial(_fallen, fall, joint))


def _fallen(fall: Fall, joint: Joint | None = None) -> Draped:
    return drape(COARSE, ROD, TARGET, method=fall, joint=joint)


def _line(changed: str, value: str, factor: float, base: Draped, run: Callable[[], Draped]) -> Line:
    how = "statics" if isinstance(base.method, Gravity) else "in time"
    on = f"{len(base.rods) // 2}x{len(base.rods) // 2}, {how}"
    try:
        draped = run()
        ends = _ends(draped)
    except InputError:  # no rod has three joints on the target
        nothing = float("nan")
        return Line(changed, value, factor, on, nothing, nothing, nothing, nothing, "does not cover the target")
    first, net = _ends(base), {rod.name: (rod.start, rod.end) for rod in chebyshev_net(TARGET, draped.layout).rods}
    change, report = _apart(ends, first), draped.report
    return Line(
        changed, value, factor, on, _rms(change), float(np.abs(change).max()), _rms(_apart(ends, net)),
        report.max_strain, report.status.value,
    )  # fmt: skip


def _ends(draped: Draped) -> dict[str, tuple[float, float]]:
    return {rod.name: (rod.start, rod.end) for rod in trim(draped).mesh.grid.rods}


def _apart(ends: dict[str, tuple[float, float]], others: dict[str, tuple[float, float]]) -> Floats:
    """(2m,) differences of the ends of rods that are in both [m]."""
    return np.concatenate([np.subtract(ends[name], others[name]) for name in ends if name in others])


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _stiff(EA: float = 1.0, EI: float = 1.0) -> Rod:
    """The paper's rod with some of its stiffnesses times a factor."""
    bend = EI * ROD.bend_stiffness
    section = GivenSection(
        EA=EA * ROD.stretch_stiffness, EI1=bend, EI2=bend, GJ=EI * ROD.twist_stiffness, mass=ROD.mass_per_length
    )
    return Rod(section)


_PARAMETERS: dict[str, tuple[range, Callable[[float], tuple[str, Rod, float]]]] = {
    "E": (range(-1, 4), lambda f: (f"{f:g} MPa", Rod(Circle(1e-3), Material(f * 1e6, 1e3)), 9.81)),
    "r": (range(-2, 2), lambda f: (f"{f:g} mm", Rod(Circle(f * 1e-3), Material(1e6, 1e3)), 9.81)),
    "g": (range(-3, 2), lambda f: (f"{f * 9.81:.4g} m/s2", ROD, f * 9.81)),
    "EA alone": (range(-1, 4), lambda f: (f"{f * ROD.stretch_stiffness:.3g} N", _stiff(EA=f), 9.81)),
    "EI alone": (range(-2, 4), lambda f: (f"{f * ROD.bend_stiffness:.3g} N m2", _stiff(EI=f), 9.81)),
}  # powers of ten, times the base; and what is then draped
