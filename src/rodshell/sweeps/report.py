"""The report of a sweep: one page that works offline, with every design as a point that can be opened.

The charts are plotly's; the page holds its library, the table once, and pictures of a few shapes.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rodshell.errors import InputError
from rodshell.output.pictures import picture_svg
from rodshell.output.svg import inline
from rodshell.results import read
from rodshell.sweeps.columns import JOB, STANDARD, is_usable
from rodshell.sweeps.plan import Plan
from rodshell.sweeps.store import ARCHIVES, Store
from rodshell.sweeps.table import header_of, in_short, plain, replaced, table_rows

REPORT = "report.html"
SHAPES = 12  # pictures at most


@dataclass(frozen=True)
class Page:
    """What a report says.

    Parameters
    ----------
    kind : of the plan, in its heading; plan : whose designs are shown; summary : lines in its heading.
    first : the two columns that are shown first, across and up.
    objectives : whether they are objectives, of which the front is shown.
    shapes : jobs whose shapes are shown, kept in archives/; caption : what they are, in a sentence.
    """

    kind: str
    plan: Plan
    summary: Sequence[str]
    first: tuple[str, str]
    objectives: bool
    shapes: Sequence[str]
    caption: str


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
        title=page.plan.origin.name,
        summary=page.summary,
        objectives=page.objectives,
        caption=page.caption,
        shapes=[shape | {"svg": Markup(shape["svg"])} for shape in _shapes(store, page)],
        plotly=Markup(get_plotlyjs()),
        data=Markup(_script_json(_data(store, page))),
    )
    file = store.folder / REPORT
    with replaced(file) as part:
        part.write_text(text, encoding="utf-8")
    return file


def _data(store: Store, page: Page) -> dict[str, Any]:
    """The table by column, and for each design its link and its command."""
    keys, columns = header_of(store)
    names = [*keys, *STANDARD, *(column.name for column in columns)]
    rows = list(table_rows(store, columns))
    designs = [(design.job, design.row) for design in store.finished()]
    usable = [k for k, (_, row) in enumerate(designs) if is_usable(row)]
    cells = {name: [plain(row[k]) for row in rows] for k, name in enumerate(names) if name != JOB}
    links = [_link(store, job) for job, _ in designs]
    commands = [page.plan.command(row[: len(keys)]) for row in rows]
    return {
        "keys": keys, "rows": cells, "links": links, "commands": commands, "usable": usable, "first": list(page.first),
    }  # fmt: skip


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
            given = ", ".join(f"{key} {in_short(value)}" for key, value, changes in values if changes)
            link = _link(store, job) or ""
            yield {"svg": inline(picture_svg(archive, archive.final)), "link": link, "caption": given}


def _script_json(content: Any) -> str:
    """JSON that can stand in a script of a page."""
    return json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")
