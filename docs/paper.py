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
`rodshell paper FIGURE`, all of them by `rodshell paper all`. Differences from the paper, with their reasons,
are in [equations.md](equations.md), E1 to E23. Times are those of one thread on one machine, with other
work: only ratios within one table can be compared.
"""

MORE = {"fig6": ["fig6-differences"]}  # pictures beside the figure's own
COMPARED = {  # what the paper shows in this place
    "fig1": "The paper shows the same three shells, without numbers.",
    "stencils": "Drawn from the elements themselves: which nodes and angles belong to a bend, a linker or a tie. In "
    "Fig 5, E13: the wall below the rim, and where Eqs 8 to 10 would move the same nodes.",
    "fig4": "The paper states that the second rod turns at the same angular velocity, 10 rpm, in both demonstrations, "
    "and gives no lag.",
    "fig6": 'The paper shows the same panels for its method only, without numbers: "the good match indicates the '
    'correctness". Rod counts, spacing and rod are those of the paper; edges are 15 mm, as its 8000 unknowns mean for '
    "rods with nodes of their own (8262, E21), while rods here share the nodes of their joints. The bound drape starts "
    "from the net and uses the net's G0; the figure shows where the rods of the drape "
    "alone would end, which measures the effect of the finite spacing. Below, panel (4) in numbers: the zero line is "
    "the exact net; on the hemisphere the analytical solution [12] agrees with it within a micrometre (`make accept`). "
    "Falls and gravity lie short of it by as much as their rods stretch, and alike; on the ellipsoid the grid rests on "
    "a saddle without friction, as gravity statics says. The genetic algorithm seeks the best popped-up shape, "
    "not the net.",
    "fig7": 'The paper: the flat grids "match well with the analytical solution in both of these two cases".',
    "fig8": "The paper, on one thread of an i7-6600U at some 8000 unknowns: 50 s (hemisphere), 30 s (paraboloid), 20 s "
    "(ellipsoid), which may be simulated times or computing times: the diamonds in (b). Its chart against "
    "unknowns has h = 0.1 s, at which explicit ties are unstable (E7); ours has 5 ms, at which all six sizes "
    "are stable. Of the two with edges of 30 mm one has rods 60 mm apart, the other 30 mm. The machine did "
    "other work: a fall is slowed by it all the time, while of our own runs, which are short, the least of four "
    "counts.",
    "genetic": 'The paper: a hemispherical gridshell "may take approximately" 100 generations of 500 individuals, or '
    "50,000 forward simulations, where its direct method needs one. It shows the algorithm's G0 for the paraboloid and "
    "the ellipsoid, from reference 30, as a line in its figure, without numbers. Searches from five seeds for each "
    "target are kept with the package; the best shape of each is popped up again with the present solver. A search is "
    "judged by the popped shape, so that two may end in different G0: how far they are from that of the direct method "
    "stands in the table. One of another seed takes some ten thousand pop-ups (`rodshell paper genetic --seed 6`).",
    "studies": 'The paper: H, E, r and g "do not significantly influence the actuated shape" of soft, inextensible '
    'rods; C1 = C2 = 1e6 EI "after a convergent study".',
}


def section(name: str, folder: Path) -> str:
    """A figure's part of the page, from its files."""
    table = (folder / "table.txt").read_text(encoding="utf-8").rstrip()
    compared = f"{COMPARED[name]}\n\n" if name in COMPARED else ""
    pictures = "\n\n".join(f"![{shown}](paper/{name}/{shown}.svg)" for shown in (name, *MORE.get(name, ())))
    return f"## {name}: {FIGURES[name]}\n\n{compared}```\n{table}\n```\n\n{pictures}\n"


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
