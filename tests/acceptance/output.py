"""Prints the acceptance table of what people take away: `python -m tests.acceptance.output`; exit 1 on a miss.

The forms are a hemisphere, an ellipsoid turned by 45 degrees and a free form (a height field with a ridge), found once.
"""

import csv
import io
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

import rodshell as rs
from rodshell.checks.bending import bending
from rodshell.layout import FlatGrid, mesh_grid, straight_rods
from rodshell.layout.gridlayout import lattice_rod
from rodshell.output.files import export
from rodshell.results import Archive
from tests.acceptance.cases import ELLIPSOID, HEMISPHERE, ROD, R, ridge_formula
from tests.acceptance.rows import Row, print_table
from tests.output.dxf_reader import read_dxf, rods_of_dxf
from tests.output.sample_archive import sample_archive, with_deployment

TARGETS = {
    "hemisphere": (HEMISPHERE, {"rods": (17, 17)}),
    "ellipsoid at 45 deg": (ELLIPSOID, {"rotate": np.pi / 4}),
    "ridge": (rs.HeightField(formula=ridge_formula(), domain=rs.Disc(R)), {}),
}


@cache
def form_of(name: str) -> rs.Form:
    target, layout = TARGETS[name]
    return rs.find_form(target, rs.GridLayout.orthogonal(**{"spacing": 0.03, "edge": 0.005, **layout}), ROD)


@cache
def archive_of(name: str) -> Archive:
    return form_of(name).archive()


def rebuilt_rows(name: str) -> Iterator[Row]:
    """Rods read from the DXF alone, by a reader of the tests, popped up from flat: the same shape."""
    with tempfile.TemporaryDirectory() as folder:
        export(archive_of(name), folder, ["dxf"])
        flat, final = rods_of_dxf(Path(folder) / "drawings/plan.dxf")
    grid = straight_rods(1e-3 * flat, names=[rod["id"] for rod in archive_of(name).results.plain()["rods"]])
    again = rs.pop_up_table(grid, 1e-3 * final, ROD, edge=0.005)
    shape = again.popped["pinned"]
    mesh, first = again.footprint.mesh, form_of(name).footprint.mesh
    names = [[rod.name for rod in one.grid.rods] for one in (mesh, first)]
    there = _joints(first, names[1], form_of(name).popped["pinned"].positions)
    here = _joints(mesh, names[0], shape.positions)
    shared = here.keys() & there.keys()
    apart = max(float(np.linalg.norm(here[key] - there[key])) for key in shared)
    note = f"{len(flat)} rods, {len(shared)} of {len(there)} joints; pop-up {shape.report.status.value}"
    yield Row(name, "rebuilt from DXF and popped up, apart", apart / form_of(name).target.size, 1e-4, "R", note)
    yield Row(name, "joints that only one of both has", len(here.keys() ^ there.keys()), 0)


def _joints(mesh: rs.GridMesh, names: list[str], positions: np.ndarray) -> dict[frozenset[str], np.ndarray]:
    pairs = mesh.grid.crossings.rods.tolist()
    return {frozenset((names[a], names[b])): positions[n] for (a, b), n in zip(pairs, mesh.joint_nodes, strict=True)}


def file_rows(name: str) -> Iterator[Row]:
    """Joint marks on both rods, and cut lengths in every file."""
    archive = archive_of(name)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        names = export(archive, out, ["dxf", "svg", "csv"])
        plan = read_dxf(out / "drawings/plan.dxf")
        rows = list(csv.DictReader(io.StringIO((out / "schedule/rods.csv").read_text())))
        joints = list(csv.DictReader(io.StringIO((out / "schedule/joints.csv").read_text())))
        svg = _svg_lengths(out / "drawings/plan.svg")
        faults = sum(_faults(out / file) for file in names if file.endswith(".dxf"))
    cuts = {row["id"]: one.points for row, one in zip(rows, (p for p in plan if p.layer == "CUT"), strict=True)}
    marks = np.array([one.points[0] for one in plan if one.kind == "CIRCLE" and one.layer == "MARK"])
    off = 0.0
    for joint in joints:
        places = [_along(cuts[joint[f"rod_{side}"]], float(joint[f"at_{side}_from_cut_end_mm"])) for side in "ab"]
        nearest = marks[np.linalg.norm(marks - places[0], axis=1).argmin()]
        off = max(off, *(float(np.linalg.norm(place - nearest)) for place in places))
    yield Row(name, "joint marks of both rods and DXF, apart", off, 0.01, "mm", f"{len(joints)} joints")
    lengths = np.array([
        [1e3 * entry["cut_length"], float(row["cut_length_mm"]), svg[row["id"]],
         float(np.linalg.norm(np.subtract(*cuts[row["id"]])))]
        for entry, row in zip(archive.results.plain()["rods"], rows, strict=True)
    ])  # fmt: skip
    yield Row(name, "cut lengths in JSON, CSV, SVG, DXF, apart", float(np.ptp(lengths, axis=1).max()), 0.01, "mm")
    yield Row(name, "faults that the DXF audit finds", faults, 0)


def _along(line: np.ndarray, at: float) -> np.ndarray:
    return np.asarray(line[0] + at * (line[1] - line[0]) / np.linalg.norm(line[1] - line[0]))


def _svg_lengths(path: Path) -> dict[str, float]:
    found = {}
    for line in ElementTree.parse(path).getroot().iter("{http://www.w3.org/2000/svg}line"):
        if "data-rod" in line.attrib:
            x0, y0, x1, y1 = (float(line.attrib[key]) for key in ("x1", "y1", "x2", "y2"))
            found[line.attrib["data-rod"]] = float(np.hypot(x1 - x0, y1 - y0))
    return found


def _faults(path: Path) -> int:
    import ezdxf

    audit = ezdxf.readfile(path).audit()
    return len(audit.errors) + len(audit.fixes)


def reaction_rows(name: str) -> Iterator[Row]:
    """Sums of forces and of moments over the largest."""
    for ends, held in archive_of(name).results.plain()["reactions"].items():
        largest = f"largest {held['largest_force']:.2e} N, {held['largest_moment']:.1e} N m"
        yield Row(name, f"{ends}: sum of reactions over the largest", held["force_imbalance"], 1e-8, "", largest)
        yield Row(name, f"{ends}: sum of moments over the largest", held["moment_imbalance"], 1e-8)


def circle_rows() -> Iterator[Row]:
    """A rod bent to a circle, edges a 25th of its radius."""
    mesh = mesh_grid(FlatGrid.of([lattice_rod(0, "U01", 0.0, 0.0, 0.5)]), R / 25)
    angle = np.concatenate([[0.0], np.cumsum(2 * np.arcsin(mesh.edge_lengths / (2 * R)))])
    positions = np.empty((mesh.node_count, 3))
    positions[mesh.rod_nodes] = R * np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    along = np.column_stack([np.cos(angle), 0 * angle, -np.sin(angle)])
    stress = bending(mesh, positions, ROD, clamps=np.array([-along[0], along[-1]])).stress
    assert stress is not None
    assert ROD.material is not None
    exact = ROD.material.youngs_modulus * 1e-3 / R
    yield Row(
        "rod bent to a circle", "stress off E r/R, in shares of it", float(np.abs(stress / exact - 1).max()), 1e-3
    )


def size_rows() -> Iterator[Row]:
    """Sizes of reports."""
    for name, archive, bound in (
        ("hemisphere", archive_of("hemisphere"), 5.0),
        ("60 x 60 grid, ten stages", with_deployment(sample_archive(60, 6)), 15.0),
    ):
        with tempfile.TemporaryDirectory() as folder:
            export(archive, folder, ["report"])
            size = (Path(folder) / "report.html").stat().st_size / 1e6
        yield Row(name, "size of the report", size, bound, "MB", f"{len(archive.results.plain()['rods'])} rods")


def all_rows() -> Iterator[Row]:
    for name in TARGETS:
        yield from rebuilt_rows(name)
        yield from file_rows(name)
        yield from reaction_rows(name)
    yield from circle_rows()
    yield from size_rows()


if __name__ == "__main__":
    sys.exit(print_table("output", all_rows()))
