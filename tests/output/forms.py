"""Real results that the tests of files share, found once: a dome, an oval turned by 45 degrees, a ridge, and others."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import rodshell as rs
from rodshell.fabrication.settings import Fabrication
from rodshell.output.files import save
from rodshell.output.options import OutputOptions
from rodshell.output.settings import DrawingStyle
from rodshell.results import Archive
from rodshell.results.archive import read
from tests.acceptance.cases import ROD, ridge_formula

TARGETS = {
    "dome": (rs.Hemisphere(0.2), {}),
    "oval": (rs.Ellipsoid(a=0.2, b=0.15, c=0.12), {"rotate": 0.7853981633974483}),
    "ridge": (rs.HeightField(formula=ridge_formula(), domain=rs.Disc(0.2)), {}),
}


@cache
def form(name: str) -> rs.Form:
    target, turn = TARGETS[name]
    layout = rs.GridLayout.orthogonal(spacing=0.03, edge=0.01, **turn)
    return rs.find_form(target, layout, ROD)


@cache
def archive(name: str) -> Archive:
    """As it is without wishes."""
    return form(name).archive()


@cache
def wished() -> Archive:
    """The dome with allowances, stock, a strength and names of its own."""
    style = DrawingStyle(project="Pavilion", revision="B", tolerance=5e-4, layers={"CUT": "LASER"})
    making = Fabrication(end_allowance=0.012, stock_length=0.4, kerf=0.003)
    return form("dome").archive(options=OutputOptions(strength=2e4, stages=4, fabrication=making, drawings=style))


def breaking() -> Archive:
    """A dome whose rods use 169 % of their strength halfway up, and little of it before and after."""
    made = wished()
    history = made.states["history_stress"].copy()
    history[2] *= 1.69 * made.results.plain()["bending"]["strength"] / history[2].max()
    return replace(made, states={**made.states, "history_stress": history})


LATH = rs.Rod(
    rs.RectangularSection(width=0.012, height=0.05), rs.Material(youngs_modulus=11e9, shear=0.69e9, density=470)
)
ROOF = rs.HeightField(formula="3*cos(pi*x/16)*cos(pi*y/12) + 0.05*x", domain=rs.Rectangle((12.0, 8.0)))


def mesh_with_an_opening() -> rs.Target:
    """A vault of 12 by 8 m with a round opening of 1.3 m off its middle."""
    x, y = np.meshgrid(np.linspace(-6, 6, 61), np.linspace(-4, 4, 41), indexing="ij")
    points = np.column_stack([x.ravel(), y.ravel(), (3 * np.cos(np.pi * x / 16) * np.cos(np.pi * y / 12)).ravel()])
    index = np.arange(len(points)).reshape(x.shape)
    a, b, c, d = (one.ravel() for one in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    kept = np.linalg.norm(points[faces].mean(axis=1)[:, :2] - (1.0, 0.5), axis=1) > 1.3
    used, faces = np.unique(faces[kept], return_inverse=True)
    return rs.Freeform.of(points[used], faces.reshape(-1, 3))


KEPT = Path(__file__).with_name("archives")
"""Archives of forms that take seconds; `python -m tests.output.forms` makes them again."""


def found(name: str) -> Archive:
    """A roof on a rectangle, one with an "opening", or a dome that is "sewn" of two patches."""
    if name == "sewn":
        layout = rs.GridLayout.orthogonal(spacing=0.03, edge=0.01)
        return rs.find_form(rs.Hemisphere(0.2), layout, ROD, seams=[[(-1.0, 0.0), (1.0, 0.0)]]).archive()
    target, spacing = (ROOF, 0.8) if name == "roof" else (mesh_with_an_opening(), 0.6)
    return rs.find_form(target, rs.GridLayout.orthogonal(spacing=spacing, edge=0.2), LATH).archive()


@cache
def formed(name: str) -> Archive:
    """One of `TARGETS`, one of those that are kept, see `found`, the "pavilion" or a dome of three "families"."""
    if name == "pavilion":
        return rs.Job.load("pavilion", fabrication__stock_length="6 m").run().archive()
    if name == "families":
        lath = rs.Rod(rs.RectangularSection(width=0.002, height=0.020), rs.Material.preset("gfrp"))
        layout = rs.Geodesic(spacing=0.3, families=3)
        return rs.find_form(rs.Cap(radius=2.0, base=1.0), layout, lath, joint=rs.Pin(), ends="pinned").archive()
    return archive(name) if name in TARGETS else read(KEPT / name)


if __name__ == "__main__":
    for kept in ("roof", "opening", "sewn"):
        save(found(kept), KEPT / kept, [], force=True)
