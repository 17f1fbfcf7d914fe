"""Makes the diagrams of the theory: `python docs/diagrams.py`. Where a curve has an equation, it is drawn from that."""

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from math import atan2, cos, degrees, pi, radians, sin
from pathlib import Path

import numpy as np
from scipy.spatial import Voronoi

from rodshell.arrays import Floats
from rodshell.output.drawing import FAMILIES, INK, PALE, PAPER, SOFT, Pen, Pencil
from rodshell.output.svg import picture_document

FOLDER = Path(__file__).parent / "pictures"
TEXT = 15.0  # pixels
BLUE, BROWN, GREEN = FAMILIES
DASHED = (5.0, 4.0)
Point = Sequence[float] | Floats


class Sheet:
    """A sheet of so many pixels, with y up, on a ground of paper: readable on pages that are light or dark."""

    def __init__(self, width: float, height: float) -> None:
        self.pencil = Pencil()
        ground = [(0, 0), (width, 0), (width, height), (0, height)]
        self.pencil.line(ground, "CUT", closed=True, pen=Pen(PAPER, 0.0, fill=PAPER))

    def line(
        self, *points: Point, colour: str = INK, width: float = 1.5, dash: tuple[float, ...] = (), fill: str = ""
    ) -> None:
        pen = Pen(colour, width, dash, fill)
        self.pencil.line([list(point) for point in points], "CUT", closed=bool(fill), pen=pen)

    def curve(self, of: Callable[[Floats], Iterable[Floats]], low: float, high: float, **look: object) -> None:
        self.line(*np.column_stack(list(of(np.linspace(low, high, 121)))), **look)  # type: ignore[arg-type]

    def arc(self, at: Point, radius: float, start: float, end: float, **look: object) -> None:
        """A part of a circle between two angles [degrees]."""
        self.curve(
            lambda a: (at[0] + radius * np.cos(a), at[1] + radius * np.sin(a)), radians(start), radians(end), **look
        )

    def arrow(self, start: Point, end: Point, colour: str = INK, width: float = 1.5, **look: object) -> None:
        self.line(start, end, colour=colour, width=width, **look)  # type: ignore[arg-type]
        angle = atan2(end[1] - start[1], end[0] - start[0])
        head = [(end[0] - 9 * cos(angle + side), end[1] - 9 * sin(angle + side)) for side in (0.35, -0.35)]
        self.line(end, *head, colour=colour, width=0.8, fill=colour)

    def dot(self, *points: Point, colour: str = INK, radius: float = 4.0, hollow: bool = False) -> None:
        for point in points:
            self.pencil.mark(point, radius, "CUT", pen=Pen(colour, 1.5, fill=PAPER if hollow else colour))

    def text(
        self, words: str, x: float, y: float, *, colour: str = INK, anchor: str = "middle", size: float = TEXT
    ) -> None:
        self.pencil.write(words, (x, y), size, "LABEL", anchor=anchor, colour=colour, halo=PAPER)

    def save(self, name: str) -> None:
        drawing = self.pencil.done(name, name, TEXT)
        (FOLDER / f"{name}.svg").write_text(picture_document(drawing), encoding="utf-8")


def net() -> None:
    sheet = Sheet(720, 290)
    d, a, b = np.array([70.0, 42.0]), np.array([240.0, 54.0]), np.array([100.0, 210.0])
    step = float(np.hypot(*(a - d)))
    middle, across = 0.5 * (a + b), np.array([a[1] - b[1], b[0] - a[0]])
    reach = np.sqrt(step**2 - np.sum((a - middle) ** 2))
    p = middle - reach * across / np.hypot(*across)
    for corner in (a, b):
        towards = degrees(atan2(p[1] - corner[1], p[0] - corner[0]))
        sheet.arc(corner, step, towards - 22, towards + 22, colour=SOFT, width=1.0, dash=DASHED)
    sheet.line(b, d, a, colour=INK, width=2.0)
    sheet.line(a, p, colour=BROWN, width=2.0)
    sheet.line(b, p, colour=BLUE, width=2.0)
    sheet.dot(a, b, d)
    sheet.dot(p, colour="#b3372c", radius=5.0)
    for name, (x, y) in {"A": a - [0, 24], "B": b - [20, 5], "D": d - [14, 22], "P": p + [16, 10]}.items():
        sheet.text(name, x, y)
    sheet.text("step", *(0.5 * (a + p) + [28, -10]), colour=BROWN)
    sheet.text("step", *(0.5 * (b + p) + [-6, 14]), colour=BLUE)
    origin, u, v = np.array([420.0, 60.0]), np.array([58.0, 4.0]), np.array([8.0, 52.0])
    nodes = {(i, j): origin + i * u + j * v - 3.2 * i * j * np.array([0.9, 1.0]) for i in range(5) for j in range(5)}
    for i in range(5):
        for j in range(5):
            on_axis = i * j == 0
            if i < 4 and i + 1 + j < 7:
                sheet.line(nodes[i, j], nodes[i + 1, j], colour=INK if j == 0 else BLUE, width=2.5 if j == 0 else 1.2)
            if j < 4 and i + j + 1 < 7:
                sheet.line(nodes[i, j], nodes[i, j + 1], colour=INK if i == 0 else BROWN, width=2.5 if i == 0 else 1.2)
            if not on_axis and i + j < 7:
                sheet.dot(nodes[i, j], colour=PAPER, radius=9.0)
                sheet.text(str(i + j - 1), *(nodes[i, j] - [0, 5]))
    sheet.dot(origin, radius=5.0)
    sheet.text("anchor", origin[0] - 8, origin[1] - 26)
    sheet.text("u", *(nodes[4, 0] + [20, -4]))
    sheet.text("v", *(nodes[0, 4] + [-16, 6]))
    sheet.save("net")


def blend() -> None:
    sheet = Sheet(720, 250)

    def surface(x: Floats) -> Floats:
        return 60 + 90 * np.cos((x - 360) / 260)

    facets = np.linspace(40, 680, 9)
    sheet.line(*np.column_stack([facets, surface(facets)]), colour=SOFT, width=1.2)
    sheet.dot(*np.column_stack([facets, surface(facets)]), colour=SOFT, radius=3.0)
    centres = np.array([160.0, 300.0, 440.0, 580.0])
    for x, colour in zip(centres, (BLUE, BROWN, GREEN, BLUE), strict=True):
        here, slope = surface(x), -90 / 260 * np.sin((x - 360) / 260)
        sheet.line((x - 62, here - 62 * slope), (x + 62, here + 62 * slope), colour=colour, width=1.0, dash=DASHED)
        sheet.curve(lambda s, x=x: (s, surface(s)), x - 100, x + 100, colour=colour, width=2.4)
        sheet.curve(
            lambda s, x=x: (s, 12 + 46 * np.exp(-(((s - x) / 70) ** 2))),
            max(x - 150, 8),
            min(x + 150, 712),
            colour=colour,
            width=1.2,
        )
        sheet.dot((x, here), colour=colour)
    sheet.arrow((300, surface(np.array(300.0))), (288, surface(np.array(300.0)) + 62), colour=BROWN)
    sheet.text("ζ", 276, surface(np.array(300.0)) + 54, colour=BROWN)
    sheet.text("centre, tangent plane and cubic", 452, 222, anchor="start")
    sheet.line((448, 222), (440, surface(np.array(440.0)) + 8), colour=SOFT, width=1.0)
    sheet.text("mesh", 52, 42, colour=SOFT)
    sheet.text("weights w", 660, 66, colour=SOFT)
    sheet.save("blend")


def drape() -> None:
    sheet = Sheet(720, 270)

    def at(x: float) -> Floats:
        return np.array([x, 182 - 140 * ((x - 230) / 430) ** 2])

    sheet.curve(lambda s: at(s), 60, 520, colour=SOFT, width=4.0)  # type: ignore[arg-type]
    sheet.curve(lambda s: at(s), 520, 690, colour=PALE, width=4.0, dash=DASHED)  # type: ignore[arg-type]
    stations = np.linspace(80, 680, 11)
    nodes = [at(x) for x in stations]
    sheet.line(*nodes[:8], colour=BLUE, width=2.0)
    sheet.line(*nodes[7:], colour=BLUE, width=1.2, dash=DASHED)
    sheet.dot(*nodes[:8], colour=BLUE)
    sheet.dot(*nodes[8:], colour=BLUE, hollow=True)
    here = nodes[2]
    slope = -2 * 140 * (here[0] - 230) / 430**2
    along = np.array([1.0, slope]) / np.hypot(1.0, slope)
    across = np.array([-along[1], along[0]])
    sheet.arrow(here, here + 46 * along, colour=INK)
    sheet.arrow(here, here - 46 * along, colour=INK)
    sheet.arrow(here + 6 * across, here + 60 * across, colour="#b3372c")
    sheet.text("λ g", here[0] - 44, here[1] + 52, colour="#b3372c")
    sheet.text("free along the surface", here[0] + 10, here[1] - 36, anchor="start")
    end = at(520.0)
    sheet.line(end + [-4, -34], end + [10, 44], colour="#b3372c", width=1.5, dash=DASHED)
    sheet.text("end of the target: trim", end[0] + 18, end[1] + 48, colour="#b3372c", anchor="start")
    sheet.text("apron", 640, 92, colour=BLUE)
    sheet.text("target F = 0", 66, 112, colour=SOFT, anchor="start")
    sheet.save("drape")


def rod() -> None:
    sheet = Sheet(720, 250)
    x0, x1, x2 = np.array([90.0, 90.0]), np.array([340.0, 150.0]), np.array([590.0, 84.0])
    sheet.line(x1, x1 + 0.5 * (x1 - x0), colour=SOFT, width=1.0, dash=DASHED)
    sheet.line(0.5 * (x0 + x1), x1, 0.5 * (x1 + x2), colour=PALE, width=10.0)
    sheet.line(x0, x1, x2, colour=INK, width=2.5)
    sheet.dot(x0, x1, x2)
    before, after = x1 - x0, x2 - x1
    for (start, edge), name, colour in (((x0, before), "ᵢ₋₁", BLUE), ((x1, after), "ᵢ", BROWN)):
        middle, along = start + 0.5 * edge, edge / np.hypot(*edge)
        across = np.array([-along[1], along[0]])
        sheet.arrow(middle, middle + 66 * across, colour=colour, width=2.0)
        sheet.arrow(middle, middle + 30 * across * [1, 0.2] + 34 * along * [0.6, 1] - [0, 34], colour=colour, width=2.0)
        sheet.arrow(middle + 8 * along, middle + 74 * along, colour=INK)
        sheet.text(f"t{name}", *(middle + 82 * along - [0, 24]))
        sheet.text(f"m₁{name}", *(middle + 74 * across + [-4, 4]), colour=colour)
        sheet.text(f"m₂{name}", *(middle + [52, -48]), colour=colour)
        sheet.arc(middle, 40, 62, 92, colour=colour, width=1.2)
        sheet.text(f"θ{name}", *(middle + [24, 44]), colour=colour)
    sheet.arc(x1, 96, -14.8, 13.5, colour=SOFT, width=1.2)
    sheet.text("φᵢ", 452, 158, colour=SOFT)
    for name, at, off in (("xᵢ₋₁", x0, (-6, -26)), ("xᵢ", x1, (-4, 16)), ("xᵢ₊₁", x2, (18, -26))):
        sheet.text(name, *(at + off))
    sheet.line((215, 42), (465, 42), colour=SOFT, width=1.0)
    for x in (215, 465):
        sheet.line((x, 36), (x, 48), colour=SOFT, width=1.0)
    sheet.text("Δlᵢ: half of both edges at rest", 340, 18, colour=SOFT)
    sheet.save("rod")


def clamp() -> None:
    sheet = Sheet(720, 220)
    end, ghost = np.array([480.0, 60.0]), np.array([590.0, 42.0])
    nodes = [np.array(point) for point in ((80.0, 138.0), (180.0, 150.0), (282.0, 140.0), (384.0, 106.0))]
    sheet.line(0.5 * (nodes[-1] + end), end, colour=PALE, width=10.0)
    sheet.line(*nodes, end, colour=BLUE, width=2.5)
    sheet.line(end, ghost, colour=BLUE, width=1.5, dash=DASHED)
    sheet.dot(*nodes, colour=BLUE)
    sheet.dot(end, colour="#b3372c", radius=5.0)
    sheet.dot(ghost, colour="#b3372c", radius=5.0, hollow=True)
    sheet.arrow(end + [30, 24], end + [30, 24] + 0.7 * (ghost - end), colour=INK)
    sheet.text("direction of the clamp", 560, 100, anchor="middle")
    sheet.text("end, held", 474, 26, colour="#b3372c")
    sheet.text("ghost node, fixed", 606, 16, colour="#b3372c")
    sheet.text("half the last edge", 380, 60, colour=SOFT, anchor="end")
    sheet.line((386, 66), (444, 78), colour=SOFT, width=1.0)
    sheet.text("l", 436, 108)
    sheet.text("l", 534, 34)
    sheet.save("clamp")


def joint() -> None:
    sheet = Sheet(720, 290)
    for left, title in ((140.0, "sections and half edges"), (370.0, "two linkers"), (600.0, "pin")):
        c = np.array([left, 160.0])
        u, v = np.array([92.0, -18.0]), np.array([26.0, 92.0])
        sheet.line(c - u, c + u, colour=BLUE, width=3.0)
        sheet.line(c - v, c + v, colour=BROWN, width=3.0)
        sheet.dot(c - u, c + u, colour=BLUE)
        sheet.dot(c - v, c + v, colour=BROWN)
        sheet.text(title, left, 24)
        if left < 200:
            for along, colour in ((u, BLUE), (v, BROWN)):
                sheet.line(c - 0.5 * along, c + 0.5 * along, colour=PALE, width=11.0)
                sheet.line(c - 0.5 * along, c + 0.5 * along, colour=colour, width=3.0)
                sheet.arrow(c, c + 0.62 * along, colour=colour, width=2.5)
            sheet.dot(c, radius=6.0, hollow=True)
            sheet.arc(c, 38, -11, 74, colour=INK, width=1.2)
            sheet.text("γ + r", left + 64, 188)
            sheet.text("T", left + 62, 132, colour=BLUE)
            sheet.text("T", left - 2, 222, colour=BROWN)
            sheet.text("A", left + 108, 136, colour=BLUE)
            sheet.text("B", left + 42, 250, colour=BROWN)
        elif left < 500:
            for one, other in ((-u, v), (-v, u)):
                points = c + one * 0.94, c + 0.11 * (one + other), c + other * 0.94
                sheet.line(*points, colour=GREEN, width=2.2)
            sheet.dot(c)
            sheet.text("from edge to edge", left - 70, 238, colour=GREEN)
        else:
            sheet.dot(c, radius=9.0, hollow=True)
            sheet.dot(c, radius=2.5)
            sheet.arc(c, 44, -6, 66, colour=SOFT, width=1.2)
            sheet.arrow(c + [20, 38], c + [10, 43], colour=SOFT, width=1.2)
            sheet.text("free", left + 58, 194, colour=SOFT)
    sheet.save("joint")


def dissection() -> None:
    sheet = Sheet(720, 270)
    rank = {}
    for i in range(7):
        for j in range(7):
            rank[i, j] = 0 if i == 3 else 1 if j == 3 else 2 if i in (1, 5) else 3
    colours = ("#b3372c", BLUE, GREEN, INK)
    for i, j in rank:
        at = (60 + 34 * i, 34 + 34 * j)
        for step in ((1, 0), (0, 1)):
            if (i + step[0], j + step[1]) in rank:
                sheet.line(at, (at[0] + 34 * step[0], at[1] + 34 * step[1]), colour=PALE, width=1.2)
    for (i, j), level in rank.items():
        sheet.dot((60 + 34 * i, 34 + 34 * j), colour=colours[level], radius=(8.0, 7.0, 6.0, 4.0)[level])
    levels = [[(500.0, 232.0)], [(430.0, 166.0), (570.0, 166.0)]]
    levels.append([(x + side, 100.0) for x, _ in levels[1] for side in (-35.0, 35.0)])
    levels.append([(x + side, 44.0) for x, _ in levels[2] for side in (-17.0, 17.0)])
    for upper, lower in pairwise(levels):
        for k, at in enumerate(lower):
            sheet.line(at, upper[k // 2], colour=SOFT, width=1.2)
    for level, row in enumerate(levels):
        sheet.dot(*row, colour=colours[level], radius=(8.0, 7.0, 6.0, 4.0)[level])
    sheet.text("eliminated last", 526, 228, anchor="start", colour=colours[0])
    sheet.text("first", 646, 39, anchor="start")
    sheet.save("dissection")


def axes(sheet: Sheet, x: float, y: float, width: float, height: float, across: str, up: str) -> None:
    sheet.arrow((x, y), (x + width, y), colour=SOFT, width=1.2)
    sheet.arrow((x, y), (x, y + height), colour=SOFT, width=1.2)
    sheet.text(across, x + width, y - 20, colour=SOFT, anchor="end")
    sheet.text(up, x + 10, y + height - 6, colour=SOFT, anchor="start")


def path() -> None:
    """Von Mises' truss, t = u (1 - u) (2 - u); and Koiter's q (1 + a q^2 - t) = t d next to a bifurcation."""
    sheet = Sheet(720, 280)
    axes(sheet, 50, 60, 290, 200, "displacement", "factor t")
    scale, top = 390.0, 1 - 1 / np.sqrt(3)

    def truss(u: Floats) -> tuple[Floats, Floats]:
        return 50 + 150 * u, 110 + scale * u * (1 - u) * (2 - u) - 50

    sheet.curve(truss, 0.0, float(top), colour=BLUE, width=2.5)
    sheet.curve(truss, float(top), 1.13, colour=BLUE, width=2.0, dash=DASHED)
    peak = np.array([float(part) for part in truss(np.array(top))])
    sheet.line(peak - [60, 0], peak + [60, 0], colour=SOFT, width=1.0)
    sheet.dot(peak, colour="#b3372c", radius=5.0)
    sheet.text("limit point", peak[0], peak[1] + 14, colour="#b3372c")
    start = np.array([float(part) for part in truss(np.array(0.12))])
    slope = np.array([150.0, scale * (2 - 6 * 0.12 + 3 * 0.12**2)])
    ahead = start + 64 * slope / np.hypot(*slope)
    sheet.arrow(start, ahead, colour=INK)
    sheet.dot(start, colour=BLUE)
    flat = np.array([-slope[1], slope[0]]) / np.hypot(*slope)
    sheet.line(ahead - 26 * flat, ahead + 26 * flat, colour=INK, width=1.0, dash=DASHED)
    sheet.text("arc", start[0] + 34, start[1] + 20, anchor="start")
    axes(sheet, 390, 60, 290, 200, "displacement along the mode", "factor t")
    critical, share = 150.0, 230.0
    sheet.line((390, 60), (390, 60 + critical), colour=BLUE, width=2.5)
    sheet.line((390, 60 + critical), (390, 246), colour=BLUE, width=2.0, dash=DASHED)
    sheet.curve(lambda q: (390 + share * q, 60 + critical * (1 + 0.25 * q**2)), 0.0, 1.15, colour=BLUE, width=2.5)
    for deviation, colour in ((0.04, BROWN), (0.15, GREEN)):
        sheet.curve(
            lambda q, d=deviation: (390 + share * q, 60 + critical * (1 + 0.25 * q**2) * q / (q + d)),
            0.0, 1.15, colour=colour, width=1.8,
        )  # fmt: skip
    sheet.dot((390, 60 + critical), colour="#b3372c", radius=5.0)
    sheet.text("bifurcation", 404, 222, colour="#b3372c", anchor="start")
    sheet.text("imperfect", 520, 140, colour=GREEN, anchor="start")
    sheet.save("path")


def edge_beam() -> None:
    sheet = Sheet(720, 270)
    ends = [np.array([80 + 80.0 * k, 66 + 26 * sin(pi * k / 7)]) for k in range(8)]
    for k, end in enumerate(ends):
        sheet.line(
            end, end + [26 + 4 * (3.5 - k), 138 + 10 * sin(pi * k / 7)], colour=BLUE if k % 2 else BROWN, width=2.0
        )
    sheet.line(*ends, colour=INK, width=5.0)
    sheet.dot(*ends, colour="#b3372c", radius=5.5)
    for first, second in pairwise(ends):
        middle = 0.5 * (first + second)
        sheet.arrow(middle, middle + [-8, 44], colour=GREEN)
    sheet.text("first direction: the shell's normal", 660, 248, colour=GREEN, anchor="end")
    sheet.text("rod ends: shared nodes", 90, 30, colour="#b3372c", anchor="start")
    sheet.text("beam, free of stress as fitted", 640, 30, anchor="end")
    sheet.text("rods", 80, 248, colour=BROWN)
    sheet.save("edge_beam")


def cells() -> None:
    sheet = Sheet(720, 300)
    u, v = np.array([82.0, 12.0]), np.array([-22.0, 70.0])
    sites = np.array([[70, 10] + i * u + j * v for i in range(-2, 11) for j in range(-3, 7)])
    found = Voronoi(sites)
    low, high = np.array([16.0, 10.0]), np.array([520.0, 290.0])
    inside = np.all((sites > low) & (sites < high), axis=1)
    triangle = np.array([[292.0, 112.0], [394.0, 134.0], [318.0, 206.0]])
    sheet.line(*triangle, colour=BLUE, width=1.5, fill="#d5e4ef")
    for (a, b), ridge in zip(found.ridge_points, found.ridge_vertices, strict=True):
        if -1 in ridge or not (inside[a] or inside[b]):
            continue
        ends = found.vertices[ridge]
        if np.all((ends > low) & (ends < high)):
            sheet.line(*ends, colour=BROWN, width=1.6)
    sheet.line(*triangle, triangle[0], colour=BLUE, width=1.5)
    for site in sites[inside]:
        for step in (u, v):
            if np.all((site + step > low) & (site + step < high)):
                sheet.line(site, site + step, colour=PALE, width=1.2)
    sheet.dot(*sites[inside])
    sheet.text("a triangle of the target,", 540, 166, colour=BLUE, anchor="start")
    sheet.text("cut into the cells", 540, 146, colour=BLUE, anchor="start")
    sheet.text("cells of the nodes", 540, 226, colour=BROWN, anchor="start")
    sheet.text("rods", 540, 86, colour=SOFT, anchor="start")
    sheet.save("cells")


def refinement() -> None:
    """Minima of E = (x^2 - 1)^2 / 4 + p x, whose valleys move with p by -p / E''."""
    sheet = Sheet(720, 270)
    axes(sheet, 60, 44, 620, 210, "state x", "energy E")

    def energy(x: Floats, p: float) -> Floats:
        return 96 + 180 * (0.25 * (x**2 - 1) ** 2 + p * (x - 0.6))

    def across(x: Floats) -> Floats:
        return 80 + 330 * x

    for p, colour, dash in ((0.0, BLUE, ()), (-0.3, BROWN, DASHED)):
        sheet.curve(lambda x, p=p: (across(x), energy(x, p)), 0.25, 1.62, colour=colour, width=2.2, dash=dash)
        x = max(np.roots([1, 0, -1, p]).real)
        sheet.dot((float(across(x)), float(energy(x, p))), colour=colour, radius=5.0)
    sheet.line(
        (float(across(np.array(1.0))), 44), (float(across(np.array(1.0))), 96 + 2), colour=SOFT, width=1.0, dash=DASHED
    )
    sheet.line(
        (float(across(np.array(1.15))), 44), (float(across(np.array(1.15))), 78), colour=SOFT, width=1.0, dash=DASHED
    )
    sheet.arrow((float(across(np.array(1.0))), 62), (float(across(np.array(1.15))), 62), colour=INK, width=1.8)
    sheet.text("predicted: -K⁻¹ r_p δp", 474, 56, anchor="start")
    sheet.text("parameters p", 300, 150, colour=BLUE, anchor="end")
    sheet.text("p + δp", 268, 206, colour=BROWN, anchor="start")
    sheet.save("refinement")


def deployment() -> None:
    sheet = Sheet(720, 280)
    axes(sheet, 60, 46, 620, 216, "share s of the deployment", "energy")

    def main_branch(s: Floats) -> tuple[Floats, Floats]:
        return 60 + 560 * s, 50 + 150 * s

    def other(s: Floats) -> tuple[Floats, Floats]:
        return 60 + 560 * s, 58 + 190 * s + 20 * s**2

    sheet.curve(main_branch, 0.30, 1.0, colour=BLUE, width=2.5)
    sheet.curve(other, 0.02, 0.62, colour=BROWN, width=2.5)
    for k in range(4, 8):
        sheet.dot(tuple(float(part) for part in main_branch(np.array((k / 7) ** 2))), colour=BLUE)
    sheet.dot((620, 200), colour=BLUE, radius=6.0)
    sheet.text("popped up", 636, 214, colour=BLUE, anchor="start")
    start, end = (np.array([float(part) for part in of(np.array(0.62))]) for of in (other, main_branch))
    sheet.dot(start, colour="#b3372c", radius=5.0)
    sheet.arrow(start - [0, 6], end + [0, 7], colour="#b3372c")
    sheet.text("snap: supports held,", start[0] + 14, start[1] + 16, colour="#b3372c", anchor="start")
    sheet.text("the energy falls", start[0] + 14, start[1] - 2, colour="#b3372c", anchor="start")
    sheet.text("from flat", 150, 116, colour=BROWN)
    sheet.text("backwards, stage by stage", 420, 112, colour=BLUE, anchor="start")
    sheet.text("flat", 60, 22, colour=SOFT)
    sheet.save("deployment")


def contact() -> None:
    sheet = Sheet(720, 270)
    centre, radius = np.array([300.0, -210.0]), 350.0
    sheet.arc(centre, radius, 42, 138, colour=SOFT, width=3.0)
    above, below = np.array([180.0, 210.0]), np.array([352.0, 84.0])
    out = (below - centre) / np.hypot(*(below - centre))
    closest, along = centre + radius * out, np.array([-out[1], out[0]])
    sheet.line(closest - 150 * along, closest + 150 * along, colour=BROWN, width=1.2, dash=DASHED)
    sheet.arrow(above, below, colour=INK)
    sheet.arrow(below, closest - 3 * out, colour="#b3372c", width=2.2)
    sheet.arrow(closest, closest + 66 * out, colour=GREEN)
    sheet.dot(above, colour=BLUE, radius=5.0)
    sheet.dot(below, colour=BLUE, radius=5.0, hollow=True)
    sheet.dot(closest, colour="#b3372c", radius=5.0)
    sheet.text("start of the step", above[0] - 14, above[1] + 12, colour=BLUE)
    sheet.text("predictor, below: d < 0", below[0] + 4, below[1] - 24, colour=BLUE)
    sheet.text("δ", below[0] + 16, below[1] + 20, colour="#b3372c")
    sheet.text("c", closest[0] - 16, closest[1] + 10, colour="#b3372c")
    sheet.text("n", *(closest + 74 * out + [12, 0]), colour=GREEN)
    sheet.text("plane on which the node may slide", 470, 128, colour=BROWN, anchor="start")
    sheet.text("body", 122, 38, colour=SOFT)
    sheet.save("contact")


DIAGRAMS = (
    net, blend, drape, rod, clamp, joint, dissection, path, edge_beam, cells, refinement, deployment, contact
)  # fmt: skip

if __name__ == "__main__":
    for diagram in DIAGRAMS:
        diagram()
