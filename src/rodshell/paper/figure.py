"""What every figure has: a table, pictures and a status, written as result.json, table.txt, table.csv and SVG."""

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from typing import Any

from rodshell.output.schedules import csv_text
from rodshell.results.folder import ResultFolder, open_folder
from rodshell.results.results import FORMAT

Row = tuple[str, ...]
VERSION = 1  # of the keys of a figure's result.json


class Figure(ABC):
    """A figure or a study of the paper, computed.

    Attributes
    ----------
    name : such as "fig6".
    columns : heads of the table's columns.
    """

    name: str
    columns: Row

    @property
    @abstractmethod
    def status(self) -> str:
        """ "converged", or what did not converge."""

    @abstractmethod
    def heading(self) -> str:
        """A line above the table."""

    @abstractmethod
    def rows(self) -> list[Row]:
        """The table."""

    @abstractmethod
    def content(self) -> dict[str, Any]:
        """The figure's part of result.json, SI."""

    @abstractmethod
    def pictures(self) -> dict[str, str]:
        """SVG drawings by name."""

    def tables(self) -> Mapping[str, Iterable[Sequence[object]]]:
        """Further tables with their heads, by name."""
        return {}

    def texts(self) -> Mapping[str, str]:
        """Further files, by file name."""
        return {}

    def footing(self) -> str:
        """A line below the table."""
        return ""

    def summary(self) -> str:
        """The table as text."""
        parts = (self.heading(), aligned(self.columns, self.rows()), self.footing())
        return "\n\n".join(part for part in parts if part)

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        head = {"format": FORMAT, "version": VERSION, "units": "SI", "figure": self.name, "status": self.status}
        return head | self.content()

    def save(self, folder: str | PathLike[str] | ResultFolder) -> None:
        """Write the figure's files to `folder`.

        Raises
        ------
        OutputError : it cannot be written, or files that rodshell did not write would have to be replaced.
        """
        tables = {"table": [self.columns, *self.rows()], **self.tables()}
        files = {"result.json": json.dumps(self.result(), indent=1) + "\n", "table.txt": self.summary() + "\n"}
        files |= {f"{name}.csv": csv_text(table) for name, table in tables.items()}
        files |= {f"{name}.svg": picture for name, picture in self.pictures().items()} | dict(self.texts())
        with open_folder(folder, reserved=list(files)) as place:
            for name, content in files.items():
                place.put(name, content)
            place.commit()


def aligned(columns: Row, rows: Sequence[Row]) -> str:
    """A table as text, with its `columns` aligned.

    Parameters
    ----------
    columns : heads.
    rows : cells of each row.
    """
    table = [columns, *rows]
    widths = [max(len(row[k]) for row in table) for k in range(len(columns))]
    lines = ("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in table)
    return "\n".join(line.rstrip() for line in lines)
