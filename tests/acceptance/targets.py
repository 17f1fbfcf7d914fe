"""Targets of any kind: `python -m tests.acceptance.targets` prints the rows; exit 1 where a figure is missed."""

import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np

import rodshell as rs
from examples.gallery import gallery
from tests.acceptance.cases import ROD
from tests.acceptance.rows import Row, print_table
from tests.acceptance.targets_broken import broken_files, called
from tests.acceptance.targets_random import outcome
from tests.targets.meshes import Mesh, capped_sphere, disc, sheet, strewn
from tests.targets.stepfile import StepFile

SIZE = 0.2  # m
SAME = rs.Rod(rs.Circle(radius=0.01), rs.Material(youngs_modulus=30e9, density=1900.0, poisson_ratio=0.3))
"""The rod of every target whose time is measured."""
GRID = rs.GridLayout.orthogonal(spacing=0.03, edge=0.005)
ROWS = {"2k": 18, "20k": 58, "200k": 182}  # rings of a round mesh of so many triangles
SURFACES: dict[str, tuple[rs.Target, Callable[[int], Mesh]]] = {
    "hemisphere": (rs.Hemisphere(SIZE), lambda rows: _scaled(rows, (0.2, 0.2, 0.2))),
    "ellipsoid": (rs.Ellipsoid(a=0.2, b=0.15, c=0.12), lambda rows: _scaled(rows, (0.2, 0.15, 0.12))),
    "saddle": (
        rs.HeightField(formula="(x^2 - y^2)/0.8", domain=rs.Disc(SIZE)),
        lambda rows: disc(lambda x, y: (x**2 - y**2) / 0.8, SIZE, rows),
    ),
}
Ends = dict[tuple[str, float], tuple[float, float]]


def _scaled(rows: int, axes: tuple[float, float, float]) -> Mesh:
    x, faces = capped_sphere(rows, np.pi / 2)
    return x * axes, faces


@cache
def analytic_form(name: str) -> rs.Form:
    return rs.find_form(SURFACES[name][0], GRID, ROD, anchor=(0.0, 0.0))


def ends_of(form: rs.Form, scale: float = 1.0) -> Ends:
    """Start and end of every rod of G0 over the scale, by family and offset."""
    return {
        (rod.family, round(rod.offset / scale, 6)): (rod.start / scale, rod.end / scale) for rod in form.footprint.rods
    }


def apart(one: Ends, other: Ends) -> float:
    """The largest distance between the ends of the same rods over the size; infinite if the rods are not the same."""
    if set(one) != set(other):
        return np.inf
    return max(float(np.abs(np.subtract(one[key], other[key])).max()) for key in one) / SIZE


def iterations(form: rs.Form) -> int:
    return sum(level.iterations for level in form.draped.levels) + sum(
        p.report.iterations for p in form.popped.values()
    )


def mesh_rows(name: str, meshes: tuple[str, ...]) -> Iterator[Row]:
    """An analytic target against meshes of it."""
    exact, mesh = analytic_form(name), SURFACES[name][1]
    before = np.inf
    for size in meshes:
        form = rs.find_form(rs.Freeform.of(*mesh(ROWS[size])), GRID, ROD, anchor=(0.0, 0.0))
        off, case = apart(ends_of(form), ends_of(exact)), f"{name}, {size} triangles"
        bound = {"2k": 0.2, "20k": 0.2, "200k": 0.05}[size]
        yield Row(case, "rod ends of G0 off the analytic ones", 100 * off, bound, "%size")
        if before < np.inf:  # to what is left by the rim's and the march's own errors
            yield Row(case, "the same, over that of the coarser mesh", off / max(before, 1e-5), 1.0)
        yield Row(case, "iterations over the analytic ones", iterations(form) / iterations(exact), 1.5)
        before = off


def nurbs_rows() -> Iterator[Row]:
    """A saddle that is a NURBS of degree two exactly, and half a sphere, in Rhino's files and in STEP."""
    square = rs.HeightField(formula="(x^2 - y^2)/0.8", domain=rs.Rectangle((2 * SIZE, 2 * SIZE)))
    exact = {
        "saddle": rs.find_form(square, GRID, ROD, anchor=(0.0, 0.0)),
        "hemisphere": analytic_form("hemisphere"),
    }
    with tempfile.TemporaryDirectory() as folder:
        for name, path, base in (*_rhino_files(Path(folder)), *_step_files(Path(folder))):
            form = rs.find_form(rs.surface_from(path, base=base), GRID, ROD, anchor=(0.0, 0.0))
            off = 100 * apart(ends_of(form), ends_of(exact[name]))
            yield Row(f"{name} as {path.suffix[1:]}", "rod ends off the analytic ones", off, 0.02, "%size")


def _saddle_controls() -> np.ndarray:
    """(3, 3, 3) Bezier points [m]: the heights of x^2 over [-a, a] are a^2, -a^2, a^2."""
    i, j = np.meshgrid(np.arange(3), np.arange(3), indexing="ij")
    return np.stack([SIZE * (i - 1), SIZE * (j - 1), SIZE**2 * ((-1.0) ** i - (-1.0) ** j) / 0.8], axis=2)


def _rhino_files(folder: Path) -> Iterator[tuple[str, Path, float | None]]:
    """A name, a file in millimetres, and where the base is [m]."""
    import rhino3dm

    saddle = rhino3dm.NurbsSurface.Create(3, False, 3, 3, 3, 3)
    for (i, j), p in zip(np.ndindex(3, 3), 1e3 * _saddle_controls().reshape(-1, 3), strict=True):
        saddle.Points[i, j] = rhino3dm.Point4d(*p.tolist(), 1.0)
    for knots in (saddle.KnotsU, saddle.KnotsV):
        for k in range(4):
            knots[k] = float(k > 1)
    ball = rhino3dm.Sphere(rhino3dm.Point3d(0, 0, 0), 1e3 * SIZE).ToBrep()
    for name, shape, base in (("saddle", saddle, None), ("hemisphere", ball, 0.0)):
        model, path = rhino3dm.File3dm(), folder / f"{name}.3dm"
        model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
        add = model.Objects.AddBrep if name == "hemisphere" else model.Objects.AddSurface
        add(shape, rhino3dm.ObjectAttributes())
        model.Write(str(path), 7)
        yield name, path, base


def _step_files(folder: Path) -> Iterator[tuple[str, Path, float | None]]:
    """The same as faces, in millimetres and in metres; the half sphere ends at its own edge."""
    saddle, cap = StepFile("mm"), StepFile("m")
    saddle.patch(1e3 * _saddle_controls(), 2, [0.0, 1.0])
    cap.cap(SIZE, 0.0)
    for name, file in (("saddle", saddle), ("hemisphere", cap)):
        path = folder / f"{name}.step"
        path.write_bytes(file.text())
        yield name, path, None


def same_rows() -> Iterator[Row]:
    """One surface in many meshes."""

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return 0.1 - x**2 - 0.6 * y**2 + 0.3 * x * y + 0.02 * np.sin(12 * x)

    anchor, angle = (0.02, 0.01), 0.6
    x, faces = sheet(height, SIZE, 60)
    plain = ends_of(rs.find_form(rs.Freeform.of(x, faces), GRID, ROD, anchor=anchor))
    place = rs.Placement(scale=1e3, turn=(0.0, 0.0, angle), move=(250.0, -90.0, 30.0))
    order = np.random.default_rng(0).permutation(len(x))
    other = {
        "turned, moved, scaled by 1000": (place(x), faces),
        "faces and vertices shuffled": (x[order], np.argsort(order)[np.random.default_rng(1).permutation(faces)]),
        "normals flipped": (x, faces[:, ::-1]),
        "half of the normals flipped": (x, np.where(np.arange(len(faces))[:, None] % 2, faces, faces[:, ::-1])),
        "remeshed unevenly": strewn(height, SIZE, 3000),
        "remeshed very unevenly": strewn(height, SIZE, 3000, crowd=3.0),
    }
    for name, mesh in other.items():
        moved = name.startswith("turned")
        where = place(np.array([[*anchor, 0.0]]))[0] if moved else np.array(anchor)
        grid = rs.GridLayout.orthogonal(spacing=30.0, edge=5.0, rotate=angle) if moved else GRID
        rod = rs.Rod(rs.Circle(radius=1.0), ROD.material) if moved else ROD
        form = rs.find_form(rs.Freeform.of(*mesh), grid, rod, anchor=(float(where[0]), float(where[1])))
        off = 100 * apart(plain, ends_of(form, 1e3 if moved else 1.0))
        yield Row(name, "rod ends off those of the plain mesh", off, 0.2, "%size", form.status)


def gallery_rows() -> Iterator[Row]:
    """Every gallery target converged and stable."""
    for name, piece in gallery().items():
        form = piece.form()
        note = ", ".join(f"{ends} gap rms {100 * gap.rms_relative:.3f} %" for ends, gap in form.agreement.items())
        modes = form.draped.report.negative_modes + sum(p.report.negative_modes for p in form.popped.values())
        yield Row(name, "not converged", float(form.status != "converged"), 0, note=note)
        yield Row(name, "negative modes, drape and pop-ups", modes, 0)
        for ends, bound in (("pinned", piece.pinned), ("clamped", piece.clamped)):
            yield Row(name, f"gap {ends}, rms", 100 * form.agreement[ends].rms_relative, 100 * bound, "%size")


def gallery_target(name: str) -> rs.Target:
    """A gallery target made anew, so that the time of making it counts."""
    target = gallery_source(name)
    file = target.parameters().get("file")
    if not isinstance(file, str):
        return target
    unit, base = target.parameters().get("unit"), target.base
    return rs.surface_from(file, unit=unit, base=base)  # type: ignore[arg-type]


@cache
def gallery_source(name: str) -> rs.Target:
    return gallery()[name].target


def random_rows(seeds: range) -> Iterator[Row]:
    """Random targets: what they said, and what of it was wrong."""
    slow, started = 0.0, time.perf_counter()
    said: dict[str, int] = {}
    wrong = list[str]()
    for seed in seeds:
        begun = time.perf_counter()
        try:
            result = outcome(seed)
        except Exception as crash:
            wrong.append(f"{seed}: {type(crash).__name__}: {crash}")
            continue
        slow = max(slow, time.perf_counter() - begun)
        key = result.said.split(":")[0]
        said[key] = said.get(key, 0) + 1
        if result.wrong:
            wrong.append(f"{seed} ({result.kind}): {result.wrong}")
    note = "; ".join(f"{count} {what}" for what, count in said.items())
    note += f"; slowest {slow:.1f} s, all {time.perf_counter() - started:.0f} s"
    yield Row(
        f"{len(seeds)} random targets",
        "wrongly said to have converged, or crashed",
        len(wrong),
        0,
        note="; ".join([note, *wrong]),
    )
    yield Row(f"{len(seeds)} random targets", "none converged", float("converged" not in said), 0)


def broken_rows(every: int = 1) -> Iterator[Row]:
    """Broken inputs: one sentence, exit 2, in time and in memory."""
    import rodshell.form
    import rodshell.targets

    assert rodshell.form, rodshell.targets  # loaded before the processes fork
    wrong, slow, large, count = list[str](), 0.0, 0.0, 0
    with tempfile.TemporaryDirectory() as folder:
        for k, (what, arguments) in enumerate(broken_files(Path(folder))):
            if k % every:
                continue
            result = called(what, arguments, Path(folder) / "out")
            slow, large, count = max(slow, result.seconds), max(large, result.gigabytes), count + 1
            if result.wrong:
                wrong.append(f"{what} ({Path(arguments[0]).name}): {result.wrong}: {result.said[-200:]}")
    yield Row(f"{count} broken inputs", "not one sentence and exit 2", len(wrong), 0, note="; ".join(wrong))
    yield Row(f"{count} broken inputs", "slowest", slow, 10.0, "s")
    yield Row(f"{count} broken inputs", "largest", large, 2.0, "GB")


def all_rows() -> Iterator[Row]:
    for name in SURFACES:
        yield from mesh_rows(name, tuple(ROWS))
    yield from nurbs_rows()
    yield from same_rows()
    yield from gallery_rows()
    yield from random_rows(range(200))
    yield from broken_rows()


if __name__ == "__main__":
    sys.exit(print_table("targets", all_rows()))
