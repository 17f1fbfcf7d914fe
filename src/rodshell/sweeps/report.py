"""The report of a sweep: one page that works offline, with every design as a point that can be opened.

The charts are plotly's; the page holds its library, the table once, and pictures of a few shapes.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rodshell.case.link import studio_link
from rodshell.errors import InputError, needs_package
from rodshell.output.pictures import picture_svg
from rodshell.output.svg import inline
from rodshell.results import read
from rodshell.sweeps.columns import JOB, NUMBERS
from rodshell.sweeps.plan import GENERATION, Plan
from rodshell.sweeps.store import ARCHIVES, FOUND, Finished, Store, replaced
from rodshell.sweeps.table import Sheet, in_short, plain

REPORT = "report.html"
SHAPES = 12  # pictures at most


@dataclass(frozen=True)
class Page:
    """What a report says.

    Args:
        first: the two columns that are shown first, across and up.
        measures: columns that say how good a design is; of two the front is shown.
        larger: those of them that are to be large, and not small.
        counts: whether a design may be on the front.
        shapes: jobs whose shapes are shown, kept in archives/.
        caption: what they are, in a sentence.
    """

    kind: str
    plan: Plan
    summary: Sequence[str]
    first: tuple[str, str]
    measures: Sequence[str]
    larger: Sequence[str]
    counts: Callable[[Finished], bool]
    shapes: Sequence[str]
    caption: str


def require_plotly() -> None:
    """InputError where plotly is not installed."""
    with needs_package("--report", "plotly", "sweep"):
        import plotly.offline  # noqa: F401


def write_report(store: Store, page: Page) -> Path:
    """Write report.html; its path.

    Raises:
        OutputError: it cannot be written.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    environment = Environment(
        loader=PackageLoader("rodshell.sweeps", "templates"), autoescape=True, undefined=StrictUndefined
    )
    data = json.dumps(_data(store, page), separators=(",", ":"))
    text = environment.get_template("sweep.html.j2").render(
        kind=page.kind,
        title=page.plan.origin.name,
        summary=page.summary,
        front=len(page.measures) > 1,
        caption=page.caption,
        studio=page.plan.origin.studio_command,
        shapes=[shape | {"svg": Markup(shape["svg"])} for shape in _shapes(store, page)],
        plotly=Markup(get_plotlyjs()),
        data=Markup(data.replace("<", "\\u003c")),  # so that it can stand in a script
    )
    file = store.folder / REPORT
    with replaced(file) as part:
        part.write_text(text, encoding="utf-8")
    return file


def _data(store: Store, page: Page) -> dict[str, Any]:
    """The table by column, and for each design its report, its link to the studio and its command."""
    sheet = Sheet(store)
    designs, rows = list[tuple[str | None, bool, list[Any]]](), list[dict[str, Any]]()
    for design, cells in sheet.rows():
        designs.append((design.job if design.outcome == FOUND else None, page.counts(design), design.keys))
        rows.append(cells)
    columns = {name: [plain(cells[name]) for cells in rows] for name in sheet.names if name != JOB}
    return {
        "keys": sheet.keys, "rows": columns, "first": _with_values(page.first, columns), "larger": list(page.larger),
        "usable": [k for k, (_, counts, _) in enumerate(designs) if counts],
        "reports": [job and _report(store, job) for job, _, _ in designs],
        "studio": [_studio(page.plan, values) for _, _, values in designs],
        "commands": [page.plan.command(values) for _, _, values in designs],
    }  # fmt: skip


def _with_values(first: Sequence[str], columns: Mapping[str, Sequence[Any]]) -> list[str]:
    """The columns that are shown first, in place of those without a number the next that have some."""
    filled = [name for name, cells in columns.items() if any(isinstance(cell, int | float) for cell in cells)]
    others = iter([name for name in (*NUMBERS, *filled) if name in filled and name not in first])
    return [name if name in filled else next(others, name) for name in first]


def _report(store: Store, job: str) -> str | None:
    """The address of a design's own report, seen from the page; None if its results were not kept."""
    report = Path(ARCHIVES) / job / "report.html"
    return report.as_posix() if (store.folder / report).is_file() else None


def _studio(plan: Plan, values: Sequence[Any]) -> str | None:
    """The link that opens a design in the studio; None for values that no case can have, or that it does not open."""
    try:
        return studio_link(plan.job(values).case)
    except InputError:
        return None


def _shapes(store: Store, page: Page) -> Iterable[dict[str, str]]:
    """Picture, link and caption of each shape."""
    sheet = Sheet(store)
    by_job = {design.job: cells for design, cells in sheet.rows() if design.job in page.shapes}
    changing = [key for key in sheet.keys if len({json.dumps(row[key]) for row in by_job.values()}) > 1]
    said = [*(key for key in changing if key != GENERATION), *page.measures, "verdict"]
    for job in page.shapes:
        folder = store.folder / ARCHIVES / job
        if job not in by_job or not (folder / "result.json").is_file():
            continue
        archive = read(folder)
        if archive.final is not None:
            given = ", ".join(f"{name} {in_short(by_job[job][name])}" for name in said if by_job[job][name] != "")
            link = _report(store, job) or ""
            yield {"svg": inline(picture_svg(archive, archive.final)), "link": link, "caption": given}
