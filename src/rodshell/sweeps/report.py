"""The report of a sweep: one page that works offline, with every design as a point that can be opened.

The charts are plotly's; the page holds its library, the table once, and pictures of a few shapes.
"""

import json
import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rodshell.errors import InputError, OutputError
from rodshell.output.pictures import picture_svg
from rodshell.output.svg import inline
from rodshell.results import read
from rodshell.sweeps.columns import CONVERGED, JOB, STANDARD
from rodshell.sweeps.computing import ARCHIVES
from rodshell.sweeps.store import Store
from rodshell.sweeps.table import header_of, table_rows

REPORT = "report.html"
SHAPES = 12  # pictures at most


@dataclass(frozen=True)
class Page:
    """What a report says.

    Parameters
    ----------
    kind, title : in its heading; summary : lines under it.
    first : the two columns that are shown first, across and up.
    objectives : whether they are objectives, of which the front is shown.
    shapes : jobs whose shapes are shown, kept in archives/; caption : what they are, in a sentence.
    command : that makes the report of a design, by the values of its keys; None where there is none.
    """

    kind: str
    title: str
    summary: Sequence[str]
    first: tuple[str, str]
    objectives: bool
    shapes: Sequence[str]
    caption: str
    command: Callable[[Sequence[Any]], str | None]


def require_plotly() -> None:
    """InputError where plotly is not installed."""
    try:
        import plotly.offline  # noqa: F401
    except ImportError:
        raise InputError('--report needs the package plotly: pip install "rodshell[sweep]"') from None


def write_report(store: Store, page: Page) -> Path:
    """Write report.html; returns its path.

    Parameters
    ----------
    store : of the sweep, whose designs it shows; page : what it says.

    Raises
    ------
    OutputError : it cannot be written.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    environment = Environment(
        loader=PackageLoader("rodshell.sweeps", "templates"), autoescape=True, undefined=StrictUndefined
    )
    text = environment.get_template("sweep.html.j2").render(
        kind=page.kind,
        title=page.title,
        summary=page.summary,
        objectives=page.objectives,
        caption=page.caption,
        shapes=[shape | {"svg": Markup(shape["svg"])} for shape in _shapes(store, page)],
        plotly=Markup(get_plotlyjs()),
        data=Markup(_script_json(_data(store, page))),
    )
    file = store.folder / REPORT
    part = file.with_name(f".{REPORT}.part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, file)
    except OSError as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise OutputError(f"cannot write {file}: {error.strerror}") from error
    return file


def _data(store: Store, page: Page) -> dict[str, Any]:
    """The table by column, and for each design its link and its command."""
    keys, columns = header_of(store)
    names = [*keys, *STANDARD, *(column.name for column in columns)]
    rows = list(table_rows(store, columns))
    designs = [(design.job, design.row) for design in store.finished()]
    usable = [
        k
        for k, (_, row) in enumerate(designs)
        if row.get("status") == CONVERGED and row.get("verdict") != "unbuildable"
    ]
    cells = {name: [_cell(row[k]) for row in rows] for k, name in enumerate(names) if name != JOB}
    links = [_link(store, job) for job, _ in designs]
    commands = [page.command(row[: len(keys)]) for row in rows]
    return {
        "keys": keys, "rows": cells, "links": links, "commands": commands, "usable": usable, "first": list(page.first),
    }  # fmt: skip


def _cell(value: Any) -> Any:
    return value if value is None or isinstance(value, int | float | str) else json.dumps(value)


def _link(store: Store, job: str) -> str | None:
    report = Path(ARCHIVES) / job / "report.html"
    return report.as_posix() if (store.folder / report).is_file() else None


def _shapes(store: Store, page: Page) -> Iterable[dict[str, str]]:
    """Picture, link and caption of each shape."""
    keys, _ = header_of(store)
    by_job = {design.job: design for design in store.finished() if design.job in page.shapes}
    rows = [design.keys for design in by_job.values()]
    changing = [len({json.dumps(row[k]) for row in rows}) > 1 for k in range(len(keys))]
    for job in page.shapes:
        folder = store.folder / ARCHIVES / job
        if job not in by_job or not (folder / "result.json").is_file():
            continue
        archive = read(folder)
        if archive.final is not None:
            values = zip(keys, by_job[job].keys, changing, strict=True)
            given = ", ".join(f"{key} {_shown(value)}" for key, value, changes in values if changes)
            link = _link(store, job) or ""
            yield {"svg": inline(picture_svg(archive, archive.final)), "link": link, "caption": given}


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(_cell(value))


def _script_json(content: Any) -> str:
    """JSON that can stand in a script of a page."""
    return json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")
