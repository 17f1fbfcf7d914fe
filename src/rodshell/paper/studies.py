"""Two claims of the text, tested: that H, E, r and g do not matter [HQK 3.2], and that C1 and C2 suffice [HQK 2.2].

The rods' parameters are changed one at a time over decades, and the change of G0 is measured against the base case,
that of the paper: by gravity statics, which does not depend on the height H, and H by the paper's falls on a coarser
grid. A rod's stretch stiffness EA and bending stiffness EI are also changed separately, which E and r cannot do. The
penalties C1 and C2 are made stiffer and stiffer against joints that share their unknowns, at rest, on the coarser
grid.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.formfinding import Draped, Fall, Gravity, drape, trim
from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, Joint, Linker
from rodshell.layout import GridLayout
from rodshell.layout.gridlayout import require_chebyshev
from rodshell.nets import chebyshev_net
from rodshell.paper.figure import EDGE, HEIGHT, LENGTH, ROD, Chart, Figure, Part, Row, Series, charts_svg
from rodshell.progress import Progress
from rodshell.rods.materials import Material
from rodshell.rods.section import Circle, GivenSection, Rod
from rodshell.targets import Hemisphere

TARGET = Hemisphere(0.2)
FINE = GridLayout.orthogonal(rods=(17, 17), spacing=0.03, edge=EDGE, length=LENGTH)
COARSE = GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.03, length=0.9)
DRAG = 5.0  # [1/s]
LONG = 30.0  # [s]: grids whose nodes stop at each step creep; with shorter steps more slowly
HEIGHTS = (0.01, 0.1, 1.0, 10.0, 100.0)  # times the paper's
TITLE = "G0 of the paper's hemisphere when one thing is changed [HQK 3.2, 2.2]"
COLUMNS = (
    "changed", "to", "times the base", "on", "G0 change, rms [mm]", "max [mm]", "G0 off the net, rms [mm]",
    "largest strain", "how it rests",
)  # fmt: skip
FULL, _RING, BOX = "\N{BLACK CIRCLE}", "\N{LARGE CIRCLE}", "\N{WHITE SQUARE}"
PARAMETERS = {
    "E": ("#1f5f8b", FULL), "r": ("#a8552a", FULL), "g": ("#2f8f4e", FULL), "H": ("#8a3fa0", FULL),
    "EA alone": ("#22282f", _RING), "EI alone": ("#b8862a", BOX),
}  # fmt: skip
_PENALTIES = {
    "C1 explicit": ("#1f5f8b", FULL), "C1 implicit": ("#a8552a", BOX), "C2, 2 linkers": ("#2f8f4e", FULL),
    "C2, 4 linkers": ("#8a3fa0", FULL),
}  # fmt: skip
LEAST = 1e-5  # [mm]: smaller changes are not drawn


@dataclass(frozen=True)
class Line(Part):
    """One run.

    Args:
        value: its value, with its unit.
        factor: its value over that of the base case.
        change_rms, change_max: change of G0's rod ends against the base case [m]; NaN without a G0.
        off_net: rms distance of G0's rod ends from those of the exact net [m]; NaN without a G0.
        strain: largest axial strain of the draped grid [-].
        rests: its state of rest, in a word or two.
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

    def rows(self) -> list[Row]:
        errors = (self.change_rms, self.change_max, self.off_net)
        return [(
            self.changed, self.value, f"{self.factor:g}", self.on,
            *("-" if np.isnan(error) else f"{1e3 * error:.2g}" for error in errors),
            "-" if np.isnan(self.strain) else f"{self.strain:.1e}", self.rests,
        )]  # fmt: skip

    def result(self) -> dict[str, Any]:
        """None in the place of NaN."""
        return {name: None if value != value else value for name, value in asdict(self).items()}


@dataclass(frozen=True)
class Studies(Figure):
    """All runs. That a grid does not drape is a result, too."""

    parts: tuple[Line, ...]
    name, title, columns, key = "studies", TITLE, COLUMNS, "lines"

    def pictures(self) -> dict[str, str]:
        """Both charts."""
        return {"studies": _studies_svg(self.parts)}


def make(progress: Progress) -> Studies:
    """All runs."""
    return Studies((*of_statics(progress), *of_height(progress), *_of_penalties(progress)))


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
    """H, by falls; `factors` are heights over the paper's."""
    base = _fallen(Fall(drag=DRAG))
    for factor in factors:
        height = HEIGHT * factor
        progress("in time, H", f"{height:g} m", 0.0)
        yield _line("H", f"{1e3 * height:g} mm", factor, base, partial(_fallen, Fall(drag=DRAG, height=height)))


def _of_penalties(progress: Progress) -> Iterator[Line]:
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
    layout = require_chebyshev(draped.layout, "studies")
    first, net = _ends(base), {rod.name: (rod.start, rod.end) for rod in chebyshev_net(TARGET, layout).rods}
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


def _studies_svg(lines: Sequence[Line]) -> str:
    """Both charts."""
    across = ("(a)  times the base case", "(b)  C1 over 1e6 EI, C2 over GJ/l")
    return charts_svg(
        [
            Chart(
                _series(lines, looks),
                title,
                "change of G0, rms [mm]",
                [(f"{sign} {name}", colour) for name, (colour, sign) in looks.items()],
            )
            for looks, title in zip((PARAMETERS, _PENALTIES), across, strict=True)
        ]
    )


def _series(lines: Sequence[Line], looks: dict[str, tuple[str, str]]) -> list[Series]:
    """A line for each parameter, interrupted at the base case, where the change is zero."""
    result = []
    for changed, (colour, sign) in looks.items():
        points = [(line.factor, 1e3 * line.change_rms) for line in lines if line.changed == changed]
        base = next((k for k, (_, y) in enumerate(points) if y == 0.0), 0)
        for part in (points[:base], points[base:]):
            seen = [(x, y) for x, y in part if y > LEAST]
            if seen:
                x, y = zip(*seen, strict=True)
                result.append(Series(x, y, colour, sign, lined=True))
    return result


_PARAMETERS: dict[str, tuple[range, Callable[[float], tuple[str, Rod, float]]]] = {
    "E": (range(-1, 4), lambda f: (f"{f:g} MPa", Rod(Circle(1e-3), Material(f * 1e6, 1e3)), 9.81)),
    "r": (range(-2, 2), lambda f: (f"{f:g} mm", Rod(Circle(f * 1e-3), Material(1e6, 1e3)), 9.81)),
    "g": (range(-3, 2), lambda f: (f"{f * 9.81:.4g} m/s2", ROD, f * 9.81)),
    "EA alone": (range(-1, 4), lambda f: (f"{f * ROD.stretch_stiffness:.3g} N", _stiff(EA=f), 9.81)),
    "EI alone": (range(-2, 4), lambda f: (f"{f * ROD.bend_stiffness:.3g} N m2", _stiff(EI=f), 9.81)),
}  # powers of ten, times the base; and what is then draped
