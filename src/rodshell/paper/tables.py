"""A figure's table as text, and its files: every figure has result.json, table.txt, table.csv and its pictures."""

import json
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from typing import Any

from rodshell.output.schedules import csv_text
from rodshell.results.folder import ResultFolder, open_folder
from rodshell.results.results import FORMAT

Rows = Sequence[tuple[str, ...]]
VERSION = 1  # of the keys of a figure's result.json


def aligned(columns: tuple[str, ...], rows: Rows) -> str:
    """The table with its columns one under the other."""
    table = [columns, *rows]
    widths = [max(len(row[k]) for row in table) for k in range(len(columns))]
    lines = ("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in table)
    return "\n".join(line.rstrip() for line in lines)


def result_of(figure: str, status: str, **content: Any) -> dict[str, Any]:
    """The content of a figure's result.json."""
    return {"format": FORMAT, "version": VERSION, "units": "SI", "figure": figure, "status": status, **content}


def write(
    folder: str | PathLike[str] | ResultFolder,
    result: dict[str, Any],
    summary: str,
    columns: tuple[str, ...],
    rows: Rows,
    pictures: Mapping[str, str],
    more: Mapping[str, Iterable[Sequence[object]]] | None = None,
    texts: Mapping[str, str] | None = None,
) -> None:
    """Write a figure's files to `folder`.

    pictures : SVG, by name; more : other tables with their heads, by name; texts : other files, by file name.

    Raises
    ------
    OutputError : it cannot be written, or files that rodshell did not write stand where it has to write.
    """
    files = {"result.json": json.dumps(result, indent=1) + "\n", "table.txt": summary + "\n"}
    files |= {f"{name}.csv": csv_text(table) for name, table in {"table": [columns, *rows], **(more or {})}.items()}
    files |= {f"{name}.svg": picture for name, picture in pictures.items()} | dict(texts or {})
    with open_folder(folder, reserved=list(files)) as place:
        for name, content in files.items():
            place.put(name, content)
        place.commit()
