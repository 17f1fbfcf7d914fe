"""The page on verification: every acceptance table as it was last printed, with its day and its commit."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docs.generators.tables import table

ROOT = Path(__file__).parents[2]
HEAD = """# Verification

What is computed, against closed forms, published values, other programs and second methods. Each row has the figure
that was measured and the one that it may not exceed; `make accept-NAME` prints its table again. Each table says when
and at which commit it was printed last; a plus marks source that was changed since.

"""


def tables() -> dict[str, dict[str, Any]]:
    """Date, commit and rows of each table by its name."""
    files = sorted((ROOT / "accept").glob("*.json"))
    return {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in files}


def page() -> str:
    return HEAD + "\n".join(_section(name, found) for name, found in tables().items())


def _section(name: str, found: dict[str, Any]) -> str:
    rows = found["rows"]
    missed = sum(not row["reached"] for row in rows)
    how = f"{len(rows)} figures, {f'{missed} of them missed' if missed else 'all reached'}"
    when = f"{found['date']}, commit `{found['commit']}`: {how}."
    return f"## {name}{_about(name)}\n\n{when}\n\n{table(['case', 'what', 'measured', 'at most'], _cells(rows))}"


def _about(name: str) -> str:
    """Of what a table is, as `make help` has it; "" of one without a target of its own."""
    targets = (ROOT / "Makefile").read_text(encoding="utf-8")
    found = re.search(rf"^accept-{name}: +## print the table of ([^(\n]+)", targets, re.MULTILINE)
    return f": {found[1].strip()}" if found else ""


def _cells(rows: list[dict[str, Any]]) -> Iterator[tuple[str, ...]]:
    for row in rows:
        unit = f" {row['unit']}" if row["unit"] else ""
        value = f"{row['value']:.3g}{unit}"
        yield row["case"], row["what"], value if row["reached"] else f"{value} (missed)", f"{row['bound']:.3g}{unit}"
