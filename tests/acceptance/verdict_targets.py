"""Flat targets, meshes from which faces were left out, and the captions of the report's view in a browser."""

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import rodshell as rs
from rodshell.output.files import export
from tests.acceptance.rows import Row
from tests.acceptance.targets_broken import WRITERS
from tests.acceptance.verdict_levels import said_of
from tests.output.browser import open_report, wrong_legends
from tests.output.forms import TARGETS, archive, breaking
from tests.output.sample_archive import table_archive
from tests.targets.meshes import Mesh, capped_sphere, equilateral, left_out, sheet

GFRP = rs.Rod(rs.Circle(0.01), rs.Material.preset("gfrp"))
RIM, OCULUS, DOOR = 3.9, 0.9, 0.8  # m: radii of the rim and the oculus, half the door's width
MIDDLE = (0.4, 0.0)  # of the oculus
SPACINGS = ((0.3, 0.0), (0.6, 0.0), (0.6, 0.5))  # of the grids, and their headings


def cap(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A dome of 5 m radius that rises by 2 m over the rim."""
    return np.sqrt(25.0 - x**2 - y**2) - 3.0


def stairs(mesh: Mesh, whole: bool) -> Mesh:
    """Without the faces of an oculus, a door, and, where it is no `whole` dome, those outside of the rim."""

    def gone(x: np.ndarray) -> np.ndarray:
        oculus = np.hypot(x[:, 0] - MIDDLE[0], x[:, 1] - MIDDLE[1]) < OCULUS
        door = (np.abs(x[:, 1] - 0.15 * x[:, 0]) < DOOR) & (x[:, 0] > 2.6)
        return np.asarray(oculus | door | (not whole) & (np.hypot(x[:, 0], x[:, 1]) > RIM))

    return left_out(mesh, gone)


def _polar(count: int) -> Mesh:
    points, faces = capped_sphere(count // 2, np.arccos(0.6))
    return 5.0 * points - [0.0, 0.0, 3.0], faces


LATTICES: dict[str, Callable[[int], tuple[Mesh, bool]]] = {
    "squares": lambda count: (sheet(cap, 3.5 if count < 40 else 3.4, count), False),
    "equilateral": lambda count: (equilateral(cap, 3.4, count), False),
    "rings": lambda count: (_polar(count), True),
}


def flat_rows() -> Iterator[Row]:
    """A floor as a mesh, a slope as a formula, and a roof that rises by less than its rods are thick."""
    with tempfile.TemporaryDirectory() as folder:
        floor = Path(folder) / "floor.obj"
        floor.write_bytes(WRITERS["obj"](*sheet(lambda x, y: 0 * x, 2.0, 20)))
        given = ["--rod.section.radius", "20 mm", "--rod.material.preset", "gfrp", "--spacing", "500 mm"]
        shallow = "0.015*(1 - x^2/4 - y^2/4)"
        for name, words in (
            ("flat mesh", [str(floor), "--unit", "m", "--spacing", "500 mm"]),
            ("flat formula", ["heightfield", "--formula", "0.3*x + 0.1*y", "--target.radius", "2 m", *given]),
            ("rises by 15 mm", ["heightfield", "--formula", shallow, "--target.radius", "2 m", *given]),
        ):  # fmt: skip
            said = said_of(*words)
            headline = said.headlines["python"]
            note = headline
            yield Row(name, "level, code, colour, sentence: disagree", len(said.disagreements), 0, note=note)
            yield Row(name, "level is not unbuildable", float(said.levels["python"] != "unbuildable"), 0)
            wrong = float("the target is flat, nothing pops up" not in headline)
            yield Row(name, "first sentence without its being flat", wrong, 0)


def stair_rows() -> Iterator[Row]:
    """A dome with an oculus and a door in meshes of three kinds and two sizes, under grids of three kinds."""
    for name, make in LATTICES.items():
        for count in (31, 61):
            mesh, whole = make(count)
            target = rs.Freeform.of(*stairs(mesh, whole))
            case = f"oculus, door; {name}, {len(target.surface.faces)} faces"
            angle = np.linspace(0, 2 * np.pi, 100)
            x, y = MIDDLE[0] + OCULUS * np.cos(angle), MIDDLE[1] + OCULUS * np.sin(angle)
            loop = target.surface.vertices[target.surface.loops[1]]
            edge = float(np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1).max())
            off = float(np.abs(target.margin(np.column_stack([x, y, cap(x, y)]))).max())
            note = next((words for words in target.warnings if "jagged" in words), "NOT SAID")
            yield Row(case, "oculus off its circle, over an edge", off / edge, 0.5, note=note)
            yield Row(case, "smoothing not said", float(note == "NOT SAID"), 0)
            forms = [
                rs.find_form(target, rs.GridLayout.orthogonal(spacing=spacing, edge=spacing / 4, rotate=turn), GFRP)
                for spacing, turn in SPACINGS
            ]
            solved = [form.draped.report for form in forms]
            popped = [shell.report for form in forms for shell in form.popped.values()]
            modes = [report.negative_modes for report in (*solved, *popped)]
            gaps = [form.agreement["clamped"].max_relative for form in forms if "clamped" in form.agreement]
            yield Row(case, "not converged", sum(form.status != "converged" for form in forms), 0)
            yield Row(case, "strain", max(report.max_strain for report in solved), 1e-9)
            yield Row(case, "negative modes, drape and pop-ups", sum(modes), 0)
            yield Row(case, "gap, clamped ends", 100 * max(gaps, default=np.inf), 0.5, "%size")


def stair_verdict_rows() -> Iterator[Row]:
    """The verdict on one of them by everybody."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "dome.obj"
        path.write_bytes(WRITERS["obj"](*stairs(*LATTICES["equilateral"](61))))
        rod = ["--rod.section.radius", "5 mm", "--rod.material.preset", "gfrp"]
        said = said_of(str(path), "--unit", "m", "--spacing", "500 mm", *rod)
    note = said.headlines["python"]
    yield Row("door and oculus", "level, code, colour, sentence: disagree", len(said.disagreements), 0, note=note)
    yield Row("door and oculus", "called unbuildable", float(said.levels["python"] == "unbuildable"), 0)


def caption_rows() -> Iterator[Row]:
    """Every stage by every colour, forwards and backwards, in a browser."""
    reports = {name: archive(name) for name in TARGETS} | {"table": table_archive(), "169 % on the way": breaking()}
    for name, made in reports.items():
        with tempfile.TemporaryDirectory() as folder:
            export(made, Path(folder), ["report"])
            found, console = open_report(Path(folder) / "report.html", Path(folder))
        wrong = wrong_legends(made, found)
        note = wrong[0] if wrong else f"{len(found['legends'])} looked at"
        yield Row(f"report's view, {name}", "captions and scales that are wrong", len(wrong), 0, note=note)
        yield Row(f"report's view, {name}", "lines on the console", len(console), 0)


def rows() -> Iterator[Row]:
    yield from flat_rows()
    yield from stair_rows()
    yield from stair_verdict_rows()
    yield from caption_rows()
