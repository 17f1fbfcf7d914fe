"""A figure of drapes: its table, its pictures, its files."""

from dataclasses import dataclass
from os import PathLike
from typing import Any

from rodshell.paper.drape_pictures import rows_svg
from rodshell.paper.drapes import COLUMNS, METHODS, Drape
from rodshell.paper.tables import aligned, result_of, write
from rodshell.results.folder import ResultFolder


@dataclass(frozen=True)
class DrapeFigure:
    """Every case by every method; `name` of the figure, such as "fig6"."""

    name: str
    title: str
    drapes: tuple[Drape, ...]

    @property
    def status(self) -> str:
        """ "converged", or which drape did not come to rest."""
        stuck = [one for one in self.drapes if not one.draped.converged]
        if not stuck:
            return "converged"
        return f"({stuck[0].case.label}) by method {stuck[0].method} {stuck[0].draped.report.status.sentence}"

    def rows(self) -> list[tuple[str, ...]]:
        """The table, a row for each case and method."""
        return [one.row() for one in self.drapes]

    def summary(self) -> str:
        """The table as text."""
        return f"{self.title}\n\n{aligned(COLUMNS, self.rows())}"

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return result_of(self.name, self.status, drapes=[one.result() for one in self.drapes])

    def save(self, folder: str | PathLike[str] | ResultFolder) -> None:
        """Write pictures and tables to `folder`: the paper's method in NAME.svg, each method in NAME-METHOD.svg."""
        pictures = {
            self.name if method == "paper" else f"{self.name}-{method}": rows_svg(
                [one for one in self.drapes if one.method == method]
            )
            for method in METHODS
        }
        write(folder, self.result(), self.summary(), COLUMNS, self.rows(), pictures)
