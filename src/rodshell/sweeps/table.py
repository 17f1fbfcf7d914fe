"""The table of a sweep: table.csv, Parquet, and Arrow for pandas or polars; a row for each finished design."""

import csv
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from rodshell.errors import needs_package
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


def header_notes(keys: Sequence[str], columns: Sequence[Column]) -> dict[str, str]:
    """What the table's columns are, in addition to those of every sweep, to be noted with the designs."""
    return {HEADER: json.dumps({"keys": list(keys), "columns": [column.name for column in columns]})}


class Sheet:
    """The table of a store as it is now: the axes' keys, the standard columns, those that the sweep names, and more."""

    def __init__(self, store: Store, more: Sequence[str] = ()) -> None:
        self._store = store
        with store.errors():
            noted = read_json(store.note(HEADER) or '{"keys": [], "columns": []}', dict)
            self.keys, columns = (list(noted[name]) for name in ("keys", "columns"))
            if not all(isinstance(name, str) for name in (*self.keys, *columns)):
                raise ValueError("the names of its columns are not texts")
            self._columns = [read_column(name) for name in columns]
        self._columns += [read_column(name) for name in more if name not in columns]
        self.names = [*self.keys, *STANDARD, *(column.name for column in self._columns)]

    def rows(self) -> Iterator[tuple[Finished, dict[str, Any]]]:
        """The finished designs, one by one, and their cells by the names of columns."""
        for design in self._store.finished():
            with self._store.errors():
                if len(design.keys) != len(self.keys):
                    raise ValueError(
                        f"its design {design.position} has {len(design.keys)} values for {len(self.keys)} keys"
                    )
            kept = design.row.get("results", {})
            more = (design.job if column.name == JOB else column.of(kept) for column in self._columns)
            cells = [*design.keys, *(design.row.get(name) for name in STANDARD), *more]
            yield design, dict(zip(self.names, cells, strict=True))


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
        sheet = Sheet(self._store)
        write_csv(self._store.folder / CSV, sheet.names, (cells for _, cells in sheet.rows()))


def write_csv(file: Path, names: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> None:
    """Write a table in place of a file.

    Args:
        rows: plain values by the names of columns.

    Raises:
        OutputError: it cannot be written.
    """
    with replaced(file) as part, part.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(names)
        for row in rows:
            writer.writerow(_csv_cell(row[name]) for name in names)


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
        return _arrow_table(Sheet(store, columns))


def _arrow_table(sheet: Sheet) -> "pyarrow.Table":
    with needs_package("reading a sweep as a table", "pyarrow", "sweep"):
        import pyarrow
    rows = [cells for _, cells in sheet.rows()]
    return pyarrow.table({name: pyarrow.array(_alike([cells[name] for cells in rows])) for name in sheet.names})


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

        with replaced(store.folder / PARQUET) as part:
            pyarrow.parquet.write_table(_arrow_table(Sheet(store)), part)
