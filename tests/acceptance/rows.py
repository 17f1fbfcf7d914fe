"""The acceptance table, row by row: what was measured, and the figure that it must reach."""

import json
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import numpy as np

import rodshell as rs
from tests.acceptance.cases import AUTO, BEYOND, FURTHER, PAPER, ROD, SHARP, AcceptanceCase
from tests.nets.goursat import goursat_ends
from tests.nets.sphere_net import sphere_net_end

FOLDER = Path(__file__).parents[2] / "accept"


@dataclass(frozen=True)
class Row:
    """One line of the table: `measured` must not exceed `bound` (both in `unit`)."""

    case: str
    what: str
    measured: float
    bound: float
    unit: str = ""
    note: str = ""

    @property
    def reached(self) -> bool:
        return self.measured <= self.bound

    def __str__(self) -> str:
        verdict = "ok  " if self.reached else "MISS"
        figure = f"{self.measured:9.3g} <= {self.bound:<7.3g}{self.unit:<6}"
        return f"{verdict} {self.case:<36} {self.what:<38} {figure} {self.note}"


def print_table(name: str, rows: Iterable[Row]) -> int:
    """Print rows as they come and write them to accept/`name`.json; 1 where a figure is missed, for `sys.exit`.

    The file has the day, the commit and the rows, each with case, what, value, bound, unit and reached; it is written
    when the table is complete. The site's page on verification is made of these files.
    """
    entries = []
    for row in rows:
        print(row, flush=True)
        entry = {"case": row.case, "what": row.what, "value": float(row.measured), "bound": float(row.bound)}
        entries.append({**entry, "unit": row.unit, "reached": bool(row.reached)})
    FOLDER.mkdir(exist_ok=True)
    lines = ",\n".join(f" {json.dumps(entry)}" for entry in entries)
    head = f'"date": "{date.today().isoformat()}", "commit": "{_commit()}"'
    (FOLDER / f"{name}.json").write_text(f'{{{head}, "rows": [\n{lines}\n]}}\n')
    missed = sum(not entry["reached"] for entry in entries)
    print(f"{missed} figures missed" if missed else "every figure reached")
    return 1 if missed else 0


def _commit() -> str:
    """The commit that is checked out, with a plus where the source differs from it."""
    asked = (("rev-parse", "--short", "HEAD"), ("status", "--porcelain", "--", "src"))
    commit, changed = (
        subprocess.run(["git", *words], cwd=FOLDER.parent, capture_output=True, text=True).stdout.strip()
        for words in asked
    )
    return (commit or "unknown") + "+" * bool(changed)


_FORMS: dict[str, rs.Form] = {}


def form_of(case: AcceptanceCase) -> rs.Form:
    """The case's form; found once."""
    if case.name not in _FORMS:
        _FORMS[case.name] = rs.find_form(case.target, case.grid(), ROD, anchor=case.anchor)
    return _FORMS[case.name]


def net_rows(case: AcceptanceCase) -> Iterator[Row]:
    """Every rod end of G0 against the net found without the compass rule, on the sphere by its similarity equation."""
    rods = form_of(case).footprint.rods
    if isinstance(case.target, rs.Hemisphere):
        exact = [
            [sign * sphere_net_end(case.target.radius, rod.offset, case.target.base or 0.0) for sign in (-1, 1)]
            for rod in rods
        ]
        how = "similarity equation"
    else:
        offsets = {family: np.array([rod.offset for rod in rods if rod.family == family]) for family in "uv"}
        twin = goursat_ends(case.target, offsets["u"], offsets["v"], step=case.grid().spacing[0] / 6, reach=0.4)
        exact = [*twin.u.tolist(), *twin.v.tolist()]
        how = "second method"
    error = np.abs(np.array([[rod.start, rod.end] for rod in rods]) - np.array(exact)).max()
    yield Row(case.name, "rod ends of G0 off the exact net", 1e3 * float(error), 0.02, "mm", f"{len(rods)} rods, {how}")


def own_end_rows(case: AcceptanceCase) -> Iterator[Row]:
    """The bound drape's own ends against G0."""
    assert form_of(case).draped.figures.net_deviation is not None
    own = np.abs(form_of(case).draped.figures.net_deviation)
    yield Row(case.name, "the drape's own rod ends off G0, max", 1e3 * float(own.max()), 0.3, "mm")
    yield Row(case.name, "the same, median", 1e3 * float(np.median(own)), 0.06, "mm")


def drape_rows(case: AcceptanceCase) -> Iterator[Row]:
    """The bound drape's conditions of equilibrium."""
    draped = form_of(case).draped
    report = draped.report
    yield Row(case.name, "bound drape: not converged", float(not draped.converged), 0)
    yield Row(case.name, "bound drape: gap over the size", draped.figures.max_gap / case.target.size, 2e-5)
    yield Row(case.name, "bound drape: strain", report.max_strain, 2e-5)
    yield Row(case.name, "bound drape: negative modes", report.negative_modes, 0)
    yield Row(case.name, "bound drape: factorisations", report.factorizations, 8, note=f"{report.dofs} unknowns")


def pop_up_rows(case: AcceptanceCase) -> Iterator[Row]:
    """Both end conditions from the draped state."""
    form = form_of(case)
    for ends, shell in form.popped.items():
        report = shell.report
        stable = "stable" if report.stable else f"NOT STABLE, {report.negative_modes} negative modes"
        gap = form.agreement[ends]
        note = f"{stable}; gap max {gap.max_relative:.4f}, rms {gap.rms_relative:.5f}"
        yield Row(case.name, f"pop-up {ends}: not converged", float(not report.converged), 0, note=note)
        yield Row(case.name, f"pop-up {ends}: factorisations", report.factorizations, 20)
    if case.clamped_rms is not None:
        rms = form.agreement["clamped"].rms_relative
        yield Row(case.name, "pop-up clamped: gap rms over the size", rms, case.clamped_rms)
    if case in PAPER and case.target == PAPER[0].target:
        rms = form.agreement["pinned"].rms_relative
        yield Row(case.name, "pop-up pinned: gap rms off 1 %", abs(rms - 0.01), 0.0025, note=f"rms {rms:.4f}")


def flat_rows() -> Iterator[Row]:
    """The hemisphere from flat and from draped."""
    form = form_of(PAPER[0])
    for ends, shell in form.popped.items():
        risen = rs.pop_up(form.footprint, form.trimmed.boundary, ROD, ends=ends, start="flat")
        apart = float(np.abs(risen.positions - shell.positions).max()) / form.target.size
        note = f"{risen.report.factorizations} factorisations from flat"
        yield Row(PAPER[0].name, f"from flat and draped apart, {ends}", apart, 1e-5, note=note)


def refused_rows() -> Iterator[Row]:
    """Beyond the net's limit, and at the edge of what a spacing can follow."""
    try:
        form_of(BEYOND)
        refused = "NOT REFUSED"
    except rs.NetLimitError as error:
        refused = str(error)
    yield Row(BEYOND.name, "not refused with the place of the limit", float("near (" not in refused), 0, note=refused)
    form = form_of(SHARP)
    said = form.status if form.status == "converged" else f"{form.status}; {form.warnings[0]}"
    silent = float(form.status != "converged" and not form.warnings)
    yield Row(SHARP.name, "stopped without a reason", silent, 0, note=said)


class _Inextensible(rs.Rod):
    """The paper's rod with EA x100 and the same EI."""

    @property
    def stretch_stiffness(self) -> float:  # type: ignore[override]
        return 100 * ROD.stretch_stiffness


def gravity_rows() -> Iterator[Row]:
    """The paper's rod falls on the hemisphere: its stretch makes G0 short of the inextensible net."""
    case = PAPER[0]
    for name, rod, low, high in (
        ("paper's rod", ROD, 2.8, 3.0),
        ("EA x100", _Inextensible(ROD.section, ROD.material), 0.0, 0.3),
    ):
        draped = rs.drape(case.grid(length=1.2), rod, case.target, method=rs.Gravity())
        rods = rs.trim(draped).mesh.grid.rods
        short = [
            sphere_net_end(case.target.size, abs(rod.offset)) - end for rod in rods for end in (rod.end, -rod.start)
        ]
        rms = 1e3 * float(np.sqrt(np.mean(np.square(short))))
        kind = "stable" if draped.report.stable else f"saddle: {draped.report.negative_modes} negative modes, said so"
        said = draped.report.stable or any("saddle" in warning for warning in draped.warnings)
        yield Row(
            f"gravity drape, {name}", "not converged, or a saddle not said", float(not draped.converged or not said), 0
        )
        yield Row(f"gravity drape, {name}", "G0 short of the exact net, rms", rms, high, "mm", kind)
        yield Row(f"gravity drape, {name}", "the same, at least", -rms, -low, "mm")


def scale_rows() -> Iterator[Row]:
    """The same case a hundred times as large, and with tubes of 25 GPa: the same shape."""
    case = PAPER[0]
    small = form_of(case)
    layout = rs.GridLayout.orthogonal(rods=(17, 17), spacing=3.0, edge=0.5, length=120.0)
    tube = rs.Rod(rs.Tube(radius=0.07, thickness=0.005), rs.Material(25e9, 1900.0, 0.3))
    scaled = rs.Rod(rs.Circle(radius=0.1), rs.Material(1e6, 1e3))
    for name, rod in (("x100", scaled), ("x100, 25 GPa tubes", tube)):
        large = rs.find_form(rs.Hemisphere(20.0), layout, rod)
        assert small.draped.figures.net_deviation is not None
        assert large.draped.figures.net_deviation is not None
        own = np.abs(large.draped.figures.net_deviation / 20 - small.draped.figures.net_deviation / 0.2).max()
        yield Row(f"hemisphere {name}", "the drape's own ends apart, over R", float(own), 1e-4)
        for ends in small.popped:
            apart = np.abs(large.popped[ends].positions / 20 - small.popped[ends].positions / 0.2).max()
            strains = [form.popped[ends].report.max_strain for form in (small, large)]
            stretch = abs(strains[0] - strains[1])
            note = f"largest strains {strains[0]:.1e} and {strains[1]:.1e}: their difference is allowed for"
            yield Row(f"hemisphere {name}", f"popped positions apart, {ends}", float(apart), 1e-4 + stretch, "R", note)


def all_rows() -> Iterator[Row]:
    for case in PAPER:
        yield from net_rows(case)
        yield from drape_rows(case)
        yield from pop_up_rows(case)
    for case in AUTO:
        yield from net_rows(case)
        yield from own_end_rows(case)
        yield from drape_rows(case)
        yield from pop_up_rows(case)
    for case in FURTHER:
        yield from drape_rows(case)
        yield from pop_up_rows(case)
    yield from flat_rows()
    yield from refused_rows()
    yield from gravity_rows()
    yield from scale_rows()
