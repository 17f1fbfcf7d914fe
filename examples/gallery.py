"""Twelve shells of some metres, with rods as they are sold, each formed, popped up, and held against its figures.

Their targets are formulas, meshes and a Rhino file. `python examples/gallery.py NAME ...` forms some of them ("all":
each), checks them, prints their verdicts and keeps the results in out/NAME; without names all are formed and nothing is
kept.
"""

import sys
from dataclasses import dataclass
from math import degrees, pi
from pathlib import Path

import rodshell as rs
from rodshell.results.verdict import verdict_of

DATA = Path(__file__).parent / "data"
MM = 1e-3  # m
GFRP, LARCH = rs.Material.preset("gfrp"), rs.Material.preset("larch")


def tube(diameter: float, wall: float) -> rs.Rod:
    """A pultruded tube [mm]."""
    return rs.Rod(rs.Tube(radius=diameter / 2 * MM, thickness=wall * MM), GFRP)


@dataclass(frozen=True)
class Piece:
    """A target, its rods and how it is gridded; the largest gaps, rms over the size, that its pop-ups may leave."""

    target: rs.Target
    rod: rs.Rod
    spacing: float
    pinned: float
    clamped: float
    anchor: tuple[float, float] | None = None
    rotate: float = 0.0

    def layout(self) -> rs.GridLayout:
        return rs.GridLayout.orthogonal(spacing=self.spacing, edge=self.spacing / 4, rotate=self.rotate)

    def form(self) -> rs.Form:
        return rs.find_form(self.target, self.layout(), self.rod, anchor=self.anchor)


def gallery() -> dict[str, Piece]:
    """The twelve by name, one of them in two formats. On bumps, ridges and cusps the free grid springs off."""
    disc = rs.Disc(5.0)
    vault = rs.HeightField(formula="4*cos(0.28*x)", domain=rs.Rectangle((9.0, 12.0)))
    bumps = "2.2*exp(-((x - 2.2)^2 + y^2)/4.5) + 1.8*exp(-((x + 2.2)^2 + y^2)/4.5)"
    ridge = "2 - 0.03*x^2 - 0.04*y^2 + 0.02*x*y + 0.9*exp(-(0.88*x + 0.48*y)^2/16 - (0.88*y - 0.48*x)^2/2.5)"
    lath = rs.Rod(rs.RectangularSection(width=10 * MM, height=30 * MM), LARCH)
    return {
        "garden pavilion": Piece(rs.Paraboloid(radius=4.5, height=1.8), lath, 0.6, 0.003, 0.0001),
        "dome": Piece(rs.Hemisphere(radius=5.0), tube(16, 2.5), 0.8, 0.0105, 0.0001),
        "barrel vault": Piece(vault, tube(20, 2.5), 0.9, 0.007, 0.003, rotate=pi / 4),
        "saddle": Piece(rs.HeightField(formula="(x^2 - y^2)/16", domain=disc), tube(25, 3), 0.8, 0.0004, 0.0001),
        "monkey saddle": Piece(
            rs.HeightField(formula="(x^3 - 3*x*y^2)/90", domain=disc), tube(12, 2), 0.8, 0.0025, 0.0005
        ),
        "two bumps": Piece(rs.HeightField(formula=bumps, domain=disc), tube(16, 2.5), 0.8, 0.032, 0.031),
        "freeform, OBJ": Piece(rs.surface_from(DATA / "freeform.obj", unit=MM), tube(16, 2.5), 0.9, 0.0012, 0.0009),
        "freeform, 3dm": Piece(rs.surface_from(DATA / "freeform.3dm"), tube(16, 2.5), 0.9, 0.0012, 0.0009),
        "ball below its equator": Piece(
            rs.surface_from(DATA / "ball.obj", unit=MM, base=-1.0), tube(12, 2), 0.6, 0.0145, 0.0003
        ),
        "torus": Piece(rs.surface_from(DATA / "torus.obj", unit=MM), tube(16, 2.5), 0.7, 0.002, 0.0002),
        "tent with an oculus": Piece(
            rs.surface_from(DATA / "tent.obj", unit=MM), tube(12, 2), 0.6, 0.002, 0.0015, anchor=(0.0, 0.0)
        ),
        "ridge": Piece(
            rs.HeightField(formula=ridge, domain=rs.Rectangle((10.0, 10.0))), tube(16, 2.5), 0.9, 0.021, 0.013
        ),
    }


def check(name: str, piece: Piece) -> rs.Form:
    """Form a piece and hold it to its figures."""
    form = piece.form()
    assert form.status == "converged", f"{name}: {form.status}"
    assert form.draped.report.negative_modes == 0, name
    for ends, allowed in (("pinned", piece.pinned), ("clamped", piece.clamped)):
        shell, gap = form.popped[ends], form.agreement[ends]
        assert shell.report.stable, f"{name}, {ends}: {shell.report.negative_modes} negative modes"
        assert gap.rms_relative <= allowed, f"{name}, {ends}: {gap}"
    return form


if __name__ == "__main__":
    asked = sys.argv[1:]
    for name, piece in gallery().items():
        if asked and not {name, "all"} & set(asked):
            continue
        form = check(name, piece)
        gaps = ", ".join(f"{ends} {100 * form.agreement[ends].rms_relative:.3f} %" for ends in form.popped)
        angle = degrees(form.draped.figures.min_angle)
        print(f"{name}: {len(form.footprint.rods)} rods, angle {angle:.0f} deg, gap rms {gaps}")
        if asked:
            archive = form.archive()
            found = verdict_of(archive.results)
            print(f"  {found.headline}")
            form.save(Path("out") / name.replace(" ", "-").replace(",", ""))
