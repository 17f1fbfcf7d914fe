"""Tables and texts in Markdown."""

import inspect
import re
from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table, in whose cells bars and stars mean themselves; code stays code."""
    lines = [head, ["---"] * len(head), *([_escaped(cell) for cell in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _escaped(cell: str) -> str:
    parts = cell.replace("|", "\\|").split("`")
    return "`".join(part if k % 2 else part.replace("*", "\\*") for k, part in enumerate(parts))


def first_paragraph(thing: object) -> str:
    """The first paragraph of a docstring; "" for that of a dataclass without, which is its signature."""
    text = (inspect.getdoc(thing) or "").partition("\n\n")[0].replace("\n", " ")
    return "" if re.match(r"\w+\(\*?", text) else text
