"""The paper's figures, made by the program: `python docs/paper.py [FIGURE ...]` writes docs/paper/ and docs/paper.md.

Without names all figures are made; the page shows all that there are, so that one can be made again by itself.
"""

import sys
from importlib import import_module
from pathlib import Path

from gridshell.cli.progress import Progress
from gridshell.paper import FIGURES

HERE = Path(__file__).parent
HEAD = """# The paper's figures

HQK = W. Huang, L. Qin, M. Khalid Jawed, J. Appl. Mech. 88 (2021). Made by `make paper`; a single one by
`gridshell paper FIGURE`. What differs from the paper, and why, is in [equations.md](equations.md), E1 to E18.
Times are of one thread and of the machine at hand: only their ratios mean something.
"""


def section(name: str, folder: Path) -> str:
    """A figure's part of the page, from its files."""
    table = (folder / "table.txt").read_text(encoding="utf-8").rstrip()
    return f"## {name}: {FIGURES[name]}\n\n```\n{table}\n```\n\n![{name}](paper/{name}/{name}.svg)\n"


def main() -> None:
    with Progress(quiet=False) as progress:
        for name in sys.argv[1:] or FIGURES:
            import_module(f"gridshell.paper.{name}").make(progress).save(HERE / "paper" / name)
    made = [name for name in FIGURES if (HERE / "paper" / name / "table.txt").exists()]
    page = "\n".join([HEAD, *(section(name, HERE / "paper" / name) for name in made)])
    (HERE / "paper.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
