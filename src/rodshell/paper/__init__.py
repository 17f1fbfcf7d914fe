"""The paper's figures, made again with their errors [HQK]: `figure_maker(name)(progress)` makes one."""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rodshell.paper.figure import Figure

FIGURES = {
    "fig1": "three shells popped up, and the boundaries between which their rods' ends move",
    "stencils": "Figs 2, 3 and 5 in one: unknowns and stencils of a rod, of rods with linkers, and of contact",
    "fig4": "two rods at one joint, of which one is twisted or turned: does the other follow?",
    "fig6": "the three targets from the flat grid to G0, by the paper's method, gravity statics and the bound drape",
    "fig7": "the hemisphere at spacings of 4 and 5 cm, by the same three",
    "fig8": "computing time against time step and number of unknowns, the paper's scheme and ours",
    "genetic": "a genetic algorithm's G0 and popped-up shape against those of the direct method",
    "studies": "G0 when H, E, r, g, C1 or C2 changes over decades: two claims of the text",
}

_MAKERS = {"fig6": ("drapes", "make_fig6"), "fig7": ("drapes", "make_fig7")}  # others: `make` of the module
_MORE = {
    "fig4": ["angles-?.csv"],
    "genetic": [f"{target}-*.json" for target in ("hemisphere", "paraboloid", "ellipsoid")],
}


def figure_maker(figure: str) -> "Callable[..., Figure]":
    """The function that makes a `figure` of FIGURES; its first argument is a progress."""
    module, function = _MAKERS.get(figure, (figure, "make"))
    maker: Callable[..., Figure] = getattr(import_module(f"rodshell.paper.{module}"), function)
    return maker


def reserved(figure: str) -> list[str]:
    """Patterns (of `Path.glob`) of the names that the files of a `figure` may have."""
    return ["result.json", "table.txt", "table.csv", f"{figure}.svg", f"{figure}-*.svg", *_MORE.get(figure, [])]
