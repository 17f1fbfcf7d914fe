"""A figure of drapes: its table, its pictures, its files."""

import csv
import json
from dataclasses import dataclass
from os import PathLike
from typing import Any

from gridshell.output.folder import FORMAT, VERSION, replacing
from gridshell.paper.drape_pictures import rows_svg
from gridshell.paper.drapes import COLUMNS, METHODS, Drape


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
        table = [COLUMNS, *self.rows()]
        widths = [max(len(row[k]) for row in table) for k in range(len(COLUMNS))]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in table]
        return "\n".join([self.title, "", *(line.rstrip() for line in lines)])

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return {
            "format": FORMAT, "version": VERSION, "units": "SI", "figure": self.name, "status": self.status,
            "drapes": [one.result() for one in self.drapes],
        }  # fmt: skip

    def save(self, folder: str | PathLike[str]) -> None:
        """Write pictures and tables to `folder`: the paper's method in NAME.svg, each method in NAME-METHOD.svg.

        Raises
        ------
        OutputError : it cannot be written, or holds other things than a result.
        """
        with replacing(folder) as temporary:
            (temporary / "result.json").write_text(json.dumps(self.result(), indent=1) + "\n", encoding="utf-8")
            (temporary / "table.txt").write_text(self.summary() + "\n", encoding="utf-8")
            with (temporary / "table.csv").open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows([COLUMNS, *self.rows()])
            for method in METHODS:
                picture = rows_svg([one for one in self.drapes if one.method == method])
                name = self.name if method == "paper" else f"{self.name}-{method}"
                (temporary / f"{name}.svg").write_text(picture, encoding="utf-8")
