"""The gallery's targets with laths along every lattice that exists there, in one sweep until pop-up and own weight.

A lattice exists on a target unless it is refused there with the place; a design whose shell does not converge gives up.
"""

import csv
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median

import rodshell as rs
from examples.gallery import gallery
from tests.acceptance.rows import Row

THIN = 0.006  # m
WIDTHS = (0.024, 0.060, 0.120)  # m, where EI2/EI1 is 16, 100 and 400
SCHERK = "4*(log(cos(y/4)) - log(cos(x/4)))"  # of the gallery's own targets the saddle alone has K < 0 everywhere
LATTICES: dict[str, dict[str, object]] = {
    "chebyshev": {"kind": "chebyshev"},
    "geodesic": {"kind": "geodesic"},
    "geodesic, 3 families": {"kind": "geodesic", "families": 3},
    "asymptotic": {"kind": "asymptotic"},
}
KEYS = "layout, rod.section.width, rod.section.height"
COLUMNS = (
    "agreement.pinned.max_relative", "self_weight.pinned.load_factor", "self_weight.pinned.limit",
    "bending.pinned.utilisation", "flat_state.lies_flat", "pop_up.pinned.stable", "pop_up.pinned.factorizations",
)  # fmt: skip
BALL = "ball below its equator"  # some of its great circles never end
SADDLES = ("saddle", "Scherk")
PLACES = ("m, where it is not a saddle", "m to the end of the target does not arrive")
LIMIT = "2 min"  # for a design
Table = dict[tuple[str, str, float], dict[str, str]]
"""The rows of a sweep by target, lattice and width of the lath."""


def bases(names: Sequence[str] = ()) -> list[rs.Job]:
    """A job for each target, or for those that are named."""
    lath = rs.Rod(rs.RectangularSection(width=THIN, height=WIDTHS[0]), rs.Material.preset("gfrp"))
    targets = {name: (piece.target, piece.spacing, piece.anchor) for name, piece in gallery().items()}
    targets["Scherk"] = rs.HeightField(formula=SCHERK, domain=rs.Disc(4.5)), 0.8, (0.0, 0.0)
    jobs = list[rs.Job]()
    for name in names or targets:
        target, spacing, anchor = targets[name]
        layout = rs.GridLayout.orthogonal(spacing=spacing)
        job = rs.Job(target, layout, lath, joint=rs.Pin(), ends="pinned", anchor=anchor)
        jobs.append(job.changed({"drawings.name": name, "checks.stages": 0}))
    return jobs


def gallery_table(names: Sequence[str] = ()) -> Table:
    """One sweep of all designs: laths lie flat on the target, or stand upright along asymptotic lines."""
    every = [(name, lattice, width) for name in LATTICES for lattice in [LATTICES[name]] for width in WIDTHS]
    sides = [(width, THIN) if name == "asymptotic" else (THIN, width) for name, _, width in every]
    values = [[lattice, *side] for (_, lattice, _), side in zip(every, sides, strict=True)]
    jobs = bases(names)
    with tempfile.TemporaryDirectory() as folder:
        run = {"time_limit": LIMIT}
        rs.sweep({"base": jobs, "axes": {KEYS: values}, "columns": COLUMNS, "run": run}, folder)
        with (Path(folder) / "table.csv").open() as stream:
            rows = list(csv.DictReader(stream))
    designs = [(job.case.drawings.name or "", name, width) for job in jobs for name, _, width in every]
    return dict(zip(designs, rows, strict=True))


def stands(row: dict[str, str]) -> bool:
    return row["status"] == "converged" and row["pop_up.pinned.stable"] == "true"


def gallery_rows(names: Sequence[str] = ()) -> Iterator[Row]:
    """What each lattice answers on each target, and at what cost."""
    table = gallery_table(names)
    targets = list(dict.fromkeys(target for target, _, _ in table))
    case, refused = f"gallery, {len(targets)} targets", {key: row for key, row in table.items() if not row["verdict"]}
    unsaid = [row["status"] for row in refused.values() if not any(word in row["status"] for word in PLACES)]
    note = f"{len(table)} designs, {len(refused)} refused; {unsaid[:1]}"
    yield Row(case, "refused without the place", len(unsaid), 0, "", note)
    never = {target for target, lattice, _ in refused if lattice.startswith("geodesic")} - {BALL}
    yield Row(case, "without geodesics, the ball left out", len(never), 0, "", ", ".join(never))
    known = {key: row for key, row in table.items() if key not in refused}
    yield Row(case, "verdicts that are unknown", sum(row["verdict"] == "unknown" for row in known.values()), 0)
    for lattice in LATTICES:
        here = [row for (_, name, _), row in known.items() if name == lattice]
        lost = [int(row["pop_up.pinned.factorizations"] or 0) for row in here if row["status"] != "converged"]
        verdicts = ", ".join(
            f"{count} {word}" for word, count in sorted(Counter(row["verdict"] for row in here).items())
        )
        note = f"{len(here)} designs, {sum(map(stands, here))} stand, {len(lost)} give up; {verdicts}"
        yield Row(f"gallery, {lattice}", "factorisations until it gives up", max(lost, default=0), 60, "", note)
    yield from _cost_rows(known)
    for target in targets:
        yield _width_row(target, known)


def _cost_rows(known: Table) -> Iterator[Row]:
    ratios = {
        lattice: [
            float(row["seconds"]) / float(net["seconds"])
            for (target, name, width), row in known.items()
            if name == lattice and stands(row) and stands(net := known[target, "chebyshev", width])
        ]
        for lattice in ("geodesic", "geodesic, 3 families")
    }
    each = ", ".join(f"{median(found):.2g} {name}" for name, found in ratios.items())
    every = [ratio for found in ratios.values() for ratio in found]
    yield Row(
        "gallery, geodesics", "CPU over that of a net, median", median(every), 3, "", f"{len(every)} pairs: {each}"
    )
    slowest = max(known, key=lambda design: float(known[design]["seconds"]))
    yield Row("gallery", "slowest design", float(known[slowest]["seconds"]), 60, "s", f"{slowest}")


def _width_row(target: str, known: Table) -> Row:
    """Along curves laths stand that are at least as wide as along a net."""
    widest = dict.fromkeys(["chebyshev", *(["asymptotic"] if target in SADDLES else [])], 0.0)
    for (name, lattice, width), row in known.items():
        if name == target:
            widest[lattice] = max(widest.get(lattice, 0.0), width * stands(row))
    note = ", ".join(f"{1e3 * width:.0f} mm {lattice}" for lattice, width in widest.items())
    less = 1e3 * (widest["chebyshev"] - min(widest.values()))
    return Row(f"gallery, {target}", "widest lath, net over other lattices", less, 0, "mm", f"stand: {note}")
