"""Prints the table of targets as they are drawn: `python -m tests.acceptance.drawn`; exit 1 on a miss."""

import random
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import ceil, cos, pi, radians
from pathlib import Path
from typing import TypeVar

import ezdxf
import numpy as np
from scipy.spatial import Delaunay

import rodshell as rs
from rodshell.arrays import Bools
from rodshell.formfinding.patches import find_patched_stages
from rodshell.targets.creased import cut_at
from rodshell.targets.patch import Seam
from tests.acceptance import drawn_meshes, drawn_reserve, drawn_scale
from tests.acceptance.rows import Row, print_table
from tests.targets.meshes import CREASED, Floats, Mesh, creased
from tests.targets.test_creases import SEAMS, off_crease

ROD = rs.Rod(rs.Tube(radius=0.016, thickness=0.003), rs.Material.preset("gfrp"))
SURFACES = {  # half width and half depth of the rectangle [m], formula
    "saddle, 24 m": (12.0, 4.0, "2.5 - 0.12*y^2 + 0.02*x^2"),
    "barrel, 24 m": (12.0, 4.0, "3 - 0.1*y^2"),
    "dome, 12 m": (6.0, 5.0, "3 - 0.05*x^2 - 0.06*y^2"),
    "waves, 14 m": (7.0, 4.5, "3.2 + 0.9*cos(x/4.5)*cos(y/4) + 0.15*sin(x/3)"),
    "slope, 10 m": (5.0, 4.0, "2 - 0.05*x^2 - 0.04*y^2 + 0.1*x"),
    "hypar, 8 m": (4.0, 4.0, "2 + 0.06*x*y - 0.02*x^2"),
}
HEADINGS = (0, 15, 30, 45, 60, 75, 90)  # degrees
SPACINGS = (1.0, 1.0, 1.0, 0.5, 0.5, 0.25)  # m: the finest, which cost most, are drawn least
ENDS = ("rectangle", "OBJ", "DXF", "3dm", "mesh")
"""The domain of the formula; a polygon in a file, over a mesh of the surface; the edge of a mesh over a polygon."""
SIDES, POINTS = range(3, 13), range(1, 17)  # of a polygon, and on each of its sides
ALLOWED, FARTHEST = 2e-4, 1e-3  # of the size, and m
LEAST = 5  # times that each value occurs
PITCH, LONGEST = 0.4, 1.2  # m: of meshes, and of their edges where they end
UNEVEN = 0.1  # of the angle between two corners of a polygon
DENTS = 0.25  # of the half axes: how much polygons in files are not convex
REFUSED = 0.025  # of the combinations: beyond a mesh's edge the net runs over a surface that is only continued
SEED = 40
Value = TypeVar("Value")


@dataclass(frozen=True)
class Polygon:
    """Corners at irregular distances around an ellipse, and as many points on each side."""

    sides: int
    points: int
    seed: int

    def corners(self, half: Floats, dents: float) -> Floats:
        """(n, 2) [m], counter-clockwise around the origin; `dents` of the half axes deep, without any convex."""
        uneven = np.random.default_rng(self.seed).uniform(-1.0, 1.0, (2, self.sides))
        angle = 2 * np.pi * (np.arange(self.sides) + UNEVEN * uneven[0]) / self.sides + self.seed
        share = 1 - dents * (0.5 + 0.5 * uneven[1])
        return np.asarray(half * np.column_stack([share * np.cos(angle), share * np.sin(angle)]))

    def along(self, corners: Floats, longest: float = np.inf) -> Floats:
        """(n, 2) points on the sides: as many as it has, or more where they would be farther apart."""
        ahead = np.roll(corners, -1, axis=0) - corners
        counts = [max(self.points, ceil(length / longest)) for length in np.linalg.norm(ahead, axis=1)]
        return np.vstack(
            [corner + np.arange(n)[:, None] / n * side for corner, side, n in zip(corners, ahead, counts, strict=True)]
        )

    def __str__(self) -> str:
        return f"{self.sides} sides x {self.points}"


@dataclass(frozen=True)
class Drawn:
    """One combination; `edge` is the mesh edge of the rods [spacing]."""

    surface: str
    heading: int
    spacing: float
    end: str
    outer: Polygon | None
    opening: Polygon | None
    flat: bool = True
    edge: float = 1 / 6

    def __str__(self) -> str:
        end = self.end if self.outer is None else f"{self.end} {self.outer}"
        end += "" if self.opening is None else f" less {self.opening}"
        return f"{self.surface}, {self.heading} deg, {self.spacing:g} m, {end}"

    @property
    def polygons(self) -> list[Floats]:
        """Corners (n, 2) [m] of where it ends: of the rectangle, or of the polygons."""
        half = np.array(SURFACES[self.surface][:2])
        if self.outer is None:
            return [half * [[1, 1], [-1, 1], [-1, -1], [1, -1]]]
        dents = 0.0 if self.end == "mesh" else DENTS
        drawn = [self.outer.corners(0.95 * half, dents)]
        if self.opening is None:
            return drawn
        room = 0.3 * cos((1 + 2 * UNEVEN) * pi / self.outer.sides) * half
        return [*drawn, 0.2 * room + self.opening.corners(room, dents)]

    def target(self, folder: Path) -> rs.Target:
        """The surface that ends there; files are written to a folder."""
        half, height = SURFACES[self.surface][:2], _height(self.surface)
        if self.outer is None:
            domain = rs.Rectangle((2 * half[0], 2 * half[1]))
            return rs.HeightField(formula=SURFACES[self.surface][2], domain=domain)
        shapes = [shape for shape in (self.outer, self.opening) if shape is not None]
        pairs = list(zip(shapes, self.polygons, strict=True))
        if self.end == "mesh":
            pitches = (PITCH / 2**k for k in range(6))
            x, faces = next(filter(None, (_meshed(*_loops(pairs, pitch)) for pitch in pitches)))
            return rs.Freeform.of(np.column_stack([x, height(x)]), faces)
        curves = [shape.along(corners) for shape, corners in pairs]
        curves = [np.column_stack([x, 0 * x[:, 0] - 20.0 if self.flat else height(x)]) for x in curves]
        path = folder / f"edge.{self.end.lower()}"
        WRITERS[self.end](path, curves)
        return rs.surface_from(_surface_file(self.surface), unit=1.0, boundary=path)

    def supports(self) -> tuple[float, float, int]:
        """How far supports are off the drawn lines [m], what is allowed [m], and how many rods there are."""
        with tempfile.TemporaryDirectory() as folder:
            target = self.target(Path(folder))
        layout = rs.GridLayout.orthogonal(
            spacing=self.spacing, edge=self.spacing * self.edge, rotate=radians(self.heading)
        )
        draped = rs.drape(layout, ROD, target, anchor=(0.0, 0.0))
        if not draped.converged:
            raise rs.RodshellError(f"the drape is {draped.report.status}")
        trimmed = rs.trim(draped)
        off = np.min([_distance(trimmed.boundary.points[:, :2], corners) for corners in self.polygons], axis=0)
        return float(off.max()), min(ALLOWED * target.size, FARTHEST), len(trimmed.mesh.grid.rods)


def _distance(x: Floats, corners: Floats) -> Floats:
    """Distance (n,) [m] in plan of points (n, 2) from a closed polygon."""
    ahead = np.roll(corners, -1, axis=0) - corners
    off = x[:, None] - corners
    share = np.clip((off * ahead).sum(axis=2) / (ahead**2).sum(axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(off - share[..., None] * ahead, axis=2).min(axis=1))


def _height(surface: str):  # type: ignore[no-untyped-def]
    formula = SURFACES[surface][2].replace("^", "**")
    return lambda plan: eval(formula, {"cos": np.cos, "sin": np.sin, "x": plan[:, 0], "y": plan[:, 1]})


def _inside(x: Floats, corners: Floats) -> Bools:
    """(n,) which points of the plan are inside a closed polygon: a ray along x crosses it an odd number of times."""
    low, high = corners, np.roll(corners, -1, axis=0)
    across = (low[:, 1] > x[:, None, 1]) != (high[:, 1] > x[:, None, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        at = low[:, 0] + (x[:, None, 1] - low[:, 1]) / (high[:, 1] - low[:, 1]) * (high[:, 0] - low[:, 0])
    return np.asarray((across & (x[:, None, 0] < at)).sum(axis=1) % 2 == 1)


def _loops(pairs: list[tuple[Polygon, Floats]], pitch: float) -> tuple[Floats, list[Floats]]:
    """Points (n, 2) on the outer polygon, at most `LONGEST` apart, and on openings, at most a pitch."""
    outer, *openings = (shape.along(corners, pitch if k else LONGEST) for k, (shape, corners) in enumerate(pairs))
    return outer, openings


def _meshed(outer: Floats, openings: list[Floats]) -> Mesh | None:
    """Points (n, 2) and triangles over a convex polygon, less others; None if these have too few points."""
    half = np.abs(outer).max(axis=0)
    lattice = np.stack(np.meshgrid(*(np.arange(-h, h, PITCH) for h in half)), axis=-1).reshape(-1, 2)
    for loop, inside in ((outer, True), *((loop, False) for loop in openings)):
        lattice = lattice[(_inside(lattice, loop) == inside) & (_distance(lattice, loop) > 0.55 * PITCH)]
    x = np.vstack([outer, *openings, lattice])
    faces = Delaunay(x).simplices
    a, b, c = x[faces].transpose(1, 0, 2)
    gone = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] < 1e-9
    for loop in openings:
        gone |= _inside(x[faces].mean(axis=1), loop)
    ends = np.sort(np.vstack([faces[~gone][:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    on_loops = len(outer) + sum(map(len, openings))
    return (x, faces[~gone]) if edges[count == 1].max() < on_loops == (count == 1).sum() else None


@cache
def _surface_file(surface: str) -> Path:
    """An OBJ of the whole rectangle and a tenth more, in quads."""
    half = 1.1 * np.array(SURFACES[surface][:2])
    x, y = (np.linspace(-h, h, ceil(2 * h / PITCH) + 1) for h in half)
    plan = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    k = np.arange(len(plan)).reshape(len(x), len(y)) + 1
    quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1).reshape(-1, 4)
    rows = [f"v {a!r} {b!r} {c!r}" for (a, b), c in zip(plan.tolist(), _height(surface)(plan).tolist(), strict=True)]
    path = Path(SURFACE_FILES.name) / f"{surface.split(',')[0]}.obj"
    path.write_text("\n".join([*rows, *("f {} {} {} {}".format(*quad) for quad in quads.tolist()), ""]))
    return path


def _obj(path: Path, curves: list[Floats]) -> None:
    rows, first = list[str](), 1
    for curve in curves:
        rows += [f"v {x!r} {y!r} {z!r}" for x, y, z in curve.tolist()]
        rows.append("l " + " ".join(map(str, [*range(first, first + len(curve)), first])))
        first += len(curve)
    path.write_text("\n".join([*rows, ""]))


def _dxf(path: Path, curves: list[Floats]) -> None:
    """One closed polyline in the plane of the plan where it is flat, and lines from point to point where it is not."""
    drawing = ezdxf.new()
    model = drawing.modelspace()
    for curve in curves:
        if np.ptp(curve[:, 2]) == 0:
            model.add_lwpolyline(curve[:, :2], close=True, dxfattribs={"elevation": curve[0, 2]})
        else:
            for one, other in zip(curve, np.roll(curve, -1, axis=0), strict=True):
                model.add_line(one, other)
    drawing.saveas(path)


def _3dm(path: Path, curves: list[Floats]) -> None:
    """Polylines, in millimetres."""
    import rhino3dm

    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    for curve in curves:
        line = rhino3dm.Polyline(len(curve) + 1)
        for point in (1e3 * np.vstack([curve, curve[:1]])).tolist():
            line.Add(*point)
        model.Objects.AddPolyline(line)
    model.Write(str(path), 7)


WRITERS = {"OBJ": _obj, "DXF": _dxf, "3dm": _3dm}
SURFACE_FILES = tempfile.TemporaryDirectory(prefix="drawn-")


def combinations(count: int = 80, seed: int = SEED) -> list[Drawn]:
    """Seeded combinations in which each value occurs about equally often."""
    chance = random.Random(seed)

    def spread(values: Sequence[Value], number: int = count) -> list[Value]:
        often = [value for _ in range(number // len(values) + 1) for value in values][:number]
        chance.shuffle(often)
        return often

    given = zip(spread(SIDES, 2 * count), spread(POINTS, 2 * count), range(2 * count), strict=True)
    shapes = iter([Polygon(*shape) for shape in given])
    drawn = zip(spread([*SURFACES]), spread(HEADINGS), spread(SPACINGS), spread(ENDS), strict=True)
    return [
        Drawn(*values, *(None,) * 2)
        if values[-1] == "rectangle"
        else Drawn(*values, next(shapes), next(shapes) if k % 2 else None, flat=k % 4 < 2)
        for k, values in enumerate(drawn)
    ]


def seldom(drawn: list[Drawn]) -> list[str]:
    """Values that occur fewer than `LEAST` times."""
    shapes = [shape for one in drawn for shape in (one.outer, one.opening) if shape is not None]
    found = {
        name: (values, Counter(getattr(one, name) for one in of))
        for name, values, of in (
            ("surface", SURFACES, drawn), ("heading", HEADINGS, drawn), ("spacing", SPACINGS, drawn),
            ("end", ENDS, drawn), ("sides", SIDES, shapes), ("points", POINTS, shapes),
        )
    }  # fmt: skip
    return [f"{name} {value}" for name, (values, often) in found.items() for value in values if often[value] < LEAST]


def end_rows(count: int = 80) -> Iterator[Row]:
    """Supports against the lines that end the target; and with half the mesh edge, or half the spacing, too."""
    refused, formed = list[str](), list[Drawn]()
    for k, drawn in enumerate(combinations(count)):
        halved = {"edge": 1 / 12} if k % 2 or drawn.spacing < 0.5 else {"spacing": drawn.spacing / 2}
        finer = f"with half the {' '.join(halved)}"
        for one, what in ((drawn, "supports off the drawn lines"), (replace(drawn, **halved), f"the same {finer}")):
            try:
                off, allowed, rods = one.supports()
            except rs.RodshellError as error:
                refused.append(f"{drawn}: {error}")
                break
            formed += [drawn] * (one is drawn)
            yield Row(str(drawn), what, 1e3 * off, 1e3 * allowed, "mm", f"{rods} rods")
    few, case = seldom(formed) if count >= 80 else [], f"{count} drawn ends"
    yield Row(case, "refused, or said not to converge", len(refused), REFUSED * count, "", "; ".join(refused))
    yield Row(case, "values that occur fewer than 5 times", len(few), 0, "", ", ".join(few))


def crease_rows(names: Sequence[str] = tuple(CREASED)) -> Iterator[Row]:
    """Creased meshes in patches: rod ends against the crease, and patches against the surface of their side."""
    for name in names:
        seams = [Seam.of(line) for line in SEAMS[name]]
        target = cut_at(rs.Freeform.of(*creased(name)), seams)
        layout = rs.GridLayout.orthogonal(spacing=0.9, edge=0.225)
        form = find_patched_stages(target, seams, layout, ROD, ends=())
        points, size = np.array([meeting.point for meeting in form.seams.meetings]), target.size
        off = np.hypot(off_crease(name, points), points[:, 2] - CREASED[name](*points[:, :2].T))
        note = f"{len(points)} meetings, {len(form.patches)} patches"
        yield Row(f"{name}, creased", "rod ends off the crease", float(off.max()) / size, ALLOWED, "of the size", note)
        apart = np.abs(form.on_target[:, 2] - CREASED[name](*form.on_target[:, :2].T))
        yield Row(f"{name}, creased", "patches off their surfaces", float(apart.max()) / size, 5e-4, "of the size")


def all_rows() -> Iterator[Row]:
    yield from end_rows()
    yield from crease_rows()
    yield from drawn_meshes.rows()
    yield from drawn_scale.rows()
    yield from drawn_reserve.rows()


if __name__ == "__main__":
    sys.exit(print_table("drawn", all_rows()))
