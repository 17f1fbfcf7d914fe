"""A figure's table as text, and its files: every figure has result.json, table.txt, table.csv and its pictures."""

import json
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from typing import Any

from rodshell.output.csvtext import csv_text
from rodshell.output.folder import FORMAT, VERSION, replacing

Rows = Sequence[tuple[str, ...]]


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
    folder: str | PathLike[str],
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
    OutputError : it cannot be written, or holds other things than a result.
    """
    with replacing(folder) as temporary:
        (temporary / "result.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        (temporary / "table.txt").write_text(summary + "\n", encoding="utf-8")
        for name, table in {"table": [columns, *rows], **(more or {})}.items():
            (temporary / f"{name}.csv").write_text(csv_text(table), encoding="utf-8", newline="")
        for name, picture in pictures.items():
            (temporary / f"{name}.svg").write_text(picture, encoding="utf-8")
        for name, text in (texts or {}).items():
            (temporary / name).write_text(text, encoding="utf-8")
        for name, text in (texts or {}).items():
            (temporary / name).write_text(text, encoding="utf-8")
