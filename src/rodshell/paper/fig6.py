"""Figure 6: the three targets, from the flat grid to G0 [HQK 3.2]."""

from rodshell.paper.drapefigure import DrapeFigure
from rodshell.paper.drapes import Case, Progress, drape_all
from rodshell.targets import Ellipsoid, Hemisphere, Paraboloid

TITLE = "Fig 6 [HQK 3.2]: from the flat grid to G0, by three methods; where each ends against the inextensible net"
CASES = (
    Case("a", Hemisphere(0.2), (17, 17)),
    Case("b", Paraboloid(0.2, 0.12), (15, 15)),
    Case("c", Ellipsoid(0.2, 0.15, 0.12), (11, 15)),
)


def make(progress: Progress) -> DrapeFigure:
    """Drape all of them."""
    return DrapeFigure("fig6", TITLE, drape_all(CASES, progress))
