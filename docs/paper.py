"""The paper's figures, made by the program: `python docs/paper.py [FIGURE ...]` writes docs/paper/ and docs/paper.md.

Without names all figures are made; the page shows all that there are, so that one can be made again by itself.
"""

import sys
from pathlib import Path

from rodshell.cli.reporting import Progress
from rodshell.paper import FIGURES, figure_maker
from rodshell.results.folder import open_folder

HERE = Path(__file__).parent
HEAD = """# The paper's figures

HQK = W. Huang, L. Qin, M. Khalid Jawed, J. Appl. Mech. 88 (2021). Made by `make paper`; a single one by
`rodshell paper FIGURE`, all of them by `rodshell paper all`. What differs from the paper, and why, is in
[equations.md](equations.md), E1 to E23. Times are of one thread and of the machine at hand: only their ratios mean
something.
"""

BESIDE = {  # what the paper has where we have this
    "fig1": "The paper shows the same three, without numbers.",
    "fig4": "The paper says that the second rod turns at the same angular velocity, 10 rpm, in both, and gives no lag.",
    "fig6": 'The paper shows the same panels, its own method only, without numbers: "the good match indicates the '
    'correctness". Rod counts, spacing and rod are its own; edges are 15 mm, which gives its 8000 unknowns (E21). '
    "The bound drape starts from the net, and its G0 is the net's: shown is where it would end by itself, which "
    "measures what the finite spacing does.",
    "fig7": 'The paper: the flat grids "match well with the analytical solution in both of these two cases".',
    "fig8": "The paper, on one thread of an i7-6600U at some 8000 unknowns: 50 s (hemisphere), 30 s (paraboloid), 20 s "
    "(ellipsoid), which may be simulated times or its own; h = 0.1 s against unknowns, which explicit ties do not bear "
    "(E7).",
    "genetic": 'The paper: a hemispherical gridshell "may take approximately" 100 generations of 500 individuals, or '
    "50,000 forward simulations, for which its own method needs one. It has the algorithm's G0 for the paraboloid and "
    "the ellipsoid, from reference 30, as a line in its figure, without numbers. Which shapes still stand depends on "
    "the last digits of the solver, and a search on that: the ellipsoid's, made again after those had changed, stalled "
    "at 6.2 mm, and its values here are those found before, their best popped up again with the solver as it is.",
    "studies": 'The paper: H, E, r and g "do not significantly influence the actuated shape" of soft, inextensible '
    'rods; C1 = C2 = 1e6 EI "after a convergent study".',
}


def section(name: str, folder: Path) -> str:
    """A figure's part of the page, from its files."""
    table = (folder / "table.txt").read_text(encoding="utf-8").rstrip()
    beside = f"{BESIDE[name]}\n\n" if name in BESIDE else ""
    return f"## {name}: {FIGURES[name]}\n\n{beside}```\n{table}\n```\n\n![{name}](paper/{name}/{name}.svg)\n"


def main() -> None:
    with Progress(quiet=False) as progress:
        for name in sys.argv[1:] or FIGURES:
            figure = figure_maker(name)(progress)
            with open_folder(HERE / "paper" / name, force=True) as place:  # git keeps what was there
                figure.save(place)
    made = [name for name in FIGURES if (HERE / "paper" / name / "table.txt").exists()]
    page = "\n".join([HEAD, *(section(name, HERE / "paper" / name) for name in made)])
    (HERE / "paper.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
