"""Figure 7: the hemisphere with wider spacings [HQK 3.2]."""

from rodshell.paper.drapefigure import DrapeFigure
from rodshell.paper.drapes import Case, Progress, drape_all
from rodshell.targets import Hemisphere

TITLE = "Fig 7 [HQK 3.2]: the hemisphere at spacings of 4 and 5 cm, by three methods; where each ends against the net"
CASES = (
    Case("1", Hemisphere(0.2), (13, 13), spacing=0.04, edge=0.02),
    Case("2", Hemisphere(0.2), (11, 11), spacing=0.05, edge=0.025),
)


def make(progress: Progress) -> DrapeFigure:
    """Drape both."""
    return DrapeFigure("fig7", TITLE, drape_all(CASES, progress))
