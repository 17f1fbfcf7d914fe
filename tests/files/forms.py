"""Real results that the tests of files share, found once: a dome, an oval turned by 45 degrees, a ridge."""

from functools import cache

import gridshell as gs
from gridshell.fabrication import Fabrication
from gridshell.output import Archive
from gridshell.output.takeaway import DrawingStyle, Takeaway
from tests.acceptance.cases import ROD, ridge_formula

TARGETS = {
    "dome": (gs.Hemisphere(0.2), {}),
    "oval": (gs.Ellipsoid(a=0.2, b=0.15, c=0.12), {"rotate": 0.7853981633974483}),
    "ridge": (gs.HeightField(formula=ridge_formula(), domain=gs.Disc(0.2)), {}),
}


@cache
def form(name: str) -> gs.Form:
    target, turn = TARGETS[name]
    layout = gs.GridLayout.orthogonal(spacing=0.03, edge=0.01, **turn)
    return gs.find_form(target, layout, ROD)


@cache
def archive(name: str) -> Archive:
    """As it is without wishes."""
    return form(name).archive()


@cache
def wished() -> Archive:
    """The dome with allowances, stock, a strength and names of its own."""
    style = DrawingStyle(project="Pavilion", revision="B", tolerance=5e-4, layers={"CUT": "LASER"})
    making = Fabrication(end_allowance=0.012, stock_length=0.4, kerf=0.003)
    return form("dome").archive(takeaway=Takeaway(strength=2e4, stages=4, fabrication=making, drawings=style))
