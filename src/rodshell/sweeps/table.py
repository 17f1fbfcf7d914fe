"""The table of a sweep: table.csv, Parquet, and Arrow for pandas or polars; a row for each finished design."""

import csv
import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from rodshell.errors import InputError
from rodshell.figures.records import printable
from rodshell.output.schedules import safe_cell
from rodshell.sweeps.columns import JOB, STANDARD, Column, read_column
from rodshell.sweeps.store import Finished, Store, read_json, replaced
from rodshell.validation import file_path

if TYPE_CHECKING:
    import pyarrow

CSV, PARQUET = "table.csv", "table.parquet"
SHARE = 0.05  # of the time at most is spent on writing table.csv
PAUSE = 2.0  # s between two of them at least
HEADER = "header"  # note of the store: {"keys", "columns"}


def header_of(store: Store) -> tuple[list[str], list[Column]]:
    """The axes' keys of a sweep, and its own columns."""
    with store.errors():
        noted = read_json(store.note(HEADER) or '{"keys": [], "columns": []}', dict)
        keys, columns = (list(noted[name]) for name in ("keys", "columns"))
        if not all(isinstance(name, str) for name in (*keys, *columns)):
            raise ValueError("the names of its columns are not texts")
        return keys, [read_column(name) for name in columns]


def header_notes(keys: Sequence[str], columns: Sequence[Column]) -> dict[str, str]:
    """What the table's columns are, to be noted with the designs.

    Args:
        keys: of the designs; columns : in addition to those of every sweep.
    """
    return {HEADER: json.dumps({"keys": list(keys), "columns": [column.name for column in columns]})}


def names_of(keys: Sequence[str], columns: Sequence[Column]) -> list[str]:
    """The names of all columns of a table; `keys` and `columns` as of `header_notes`."""
    return [*keys, *STANDARD, *(column.name for column in columns)]


def table_rows(store: Store, columns: Sequence[Column]) -> Iterator[list[Any]]:
    """The rows of the finished designs, one by one: the axes' keys, the standard columns, and `columns`.

    Args:
        store: of the sweep; columns : in addition to those of every sweep.
    """
    keys = header_of(store)[0]
    for design in store.finished():
        with store.errors():
            if len(design.keys) != len(keys):
                raise ValueError(f"its design {design.position} has {len(design.keys)} values for {len(keys)} keys")
        yield [*design.keys, *(design.row.get(name) for name in STANDARD), *(_cell(design, c) for c in columns)]


def _cell(design: Finished, column: Column) -> Any:
    return design.job if column.name == JOB else column.of(design.row.get("results", {}))


class Table:
    """table.csv of a sweep, which is replaced in one step."""

    def __init__(self, store: Store) -> None:
        self._store, self._next = store, monotonic() + PAUSE

    def refresh(self) -> None:
        """Write it, unless that was done a moment ago: all of them together take `SHARE` of the time."""
        begun = monotonic()
        if begun >= self._next:
            self.write()
            self._next = monotonic() + max(PAUSE, (monotonic() - begun) / SHARE)

    def write(self) -> None:
        """Write it now.

        Raises:
            OutputError: it cannot be written.
        """
        keys, columns = header_of(self._store)
        names = names_of(keys, columns)
        write_csv(self._store.folder / CSV, names, table_rows(self._store, columns))


def write_csv(file: Path, names: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table.

    Args:
        file: which is replaced; names : of the columns; rows : of plain values.

    Raises:
        OutputError: it cannot be written.
    """
    with replaced(file) as part, part.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(names)
        for row in rows:
            writer.writerow(map(_csv_cell, row))


def _csv_cell(value: Any) -> Any:
    if isinstance(value, bool):
        return str(value).lower()
    return safe_cell(value) if isinstance(value, str) else plain(value)


def plain(value: Any) -> Any:
    """A value as a cell shows it: lists and tables as JSON."""
    return json.dumps(value) if isinstance(value, list | tuple | dict) else value


def in_short(value: Any) -> str:
    """A value in a sentence."""
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else printable(str(plain(value)))


def read_sweep(folder: str | PathLike[str], columns: Sequence[str] = ()) -> "pyarrow.Table":
    """The table of a sweep, also of one that still runs; `.to_pandas()`, or `polars.from_arrow` of it.

    Args:
        columns: further keys of result.json; nothing is computed again for them.

    Returns:
        A row for each finished design: the axes' keys, the columns of every sweep, those that it names, and `columns`.
        Numbers are in SI, what is not known is null, lists and tables are JSON.

    Raises:
        InputError: pyarrow is not installed, or result.json has no such key. OutputError : there is no sweep.
    """
    with Store(file_path("folder", folder), writing=False) as store:
        keys, columns_of_sweep = header_of(store)
        there = [column.name for column in columns_of_sweep]
        asked = [*columns_of_sweep, *(read_column(name) for name in columns if name not in there)]
        return _arrow_table(names_of(keys, asked), table_rows(store, asked))


def _arrow_table(names: Sequence[str], rows: Iterator[list[Any]]) -> "pyarrow.Table":
    """Rows as an Arrow table.

    Args:
        names: of the columns; rows : of plain values.

    Raises:
        InputError: pyarrow is not installed.
    """
    try:
        import pyarrow
    except ImportError:
        raise InputError(
            'reading a sweep as a table needs the package pyarrow: pip install "rodshell[sweep]"'
        ) from None
    table = list(rows)
    cells = {name: [row[k] for row in table] for k, name in enumerate(names)}
    return pyarrow.table({name: pyarrow.array(_alike(values)) for name, values in cells.items()})


def _alike(values: list[Any]) -> list[Any]:
    """Cells of one type: truth values, whole numbers, numbers, or text."""
    known = [value for value in values if value is not None]
    if any(all(type(value) is kind for value in known) for kind in (bool, int, str)):
        return values
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in known):
        return [None if value is None else float(value) for value in values]
    return [value if value is None or isinstance(value, str) else json.dumps(value) for value in values]


def write_parquet(store: Store) -> None:
    """Write table.parquet, if pyarrow is installed.

    Raises:
        OutputError: it cannot be written.
    """
    with suppress(ImportError):
        import pyarrow.parquet

        keys, columns = header_of(store)
        names = names_of(keys, columns)
        with replaced(store.folder / PARQUET) as part:
            pyarrow.parquet.write_table(_arrow_table(names, table_rows(store, columns)), part)
