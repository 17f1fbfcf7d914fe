"""Level, exit code, colour and first sentence of the verdict: the same in Python, command line and report."""

import contextlib
import html
import io
import json
import re
import tempfile
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import rodshell as rs
from rodshell.cli import main
from rodshell.formfinding import pipeline
from tests.acceptance.rows import Row
from tests.formfinding.altered import with_report

CODES = {"good": 0, "check": 0, "unbuildable": 4, "unknown": 3}


@dataclass(frozen=True)
class Said:
    """What everybody says of one case: (level, headline) by who says it; and the exit code of the command line."""

    exit_code: int
    levels: dict[str, str]
    headlines: dict[str, str]

    @property
    def disagreements(self) -> list[str]:
        """Who does not say what Python says."""
        wrong = [who for who, level in self.levels.items() if level != self.levels["python"]]
        wrong += [who for who, headline in self.headlines.items() if headline != self.headlines["python"]]
        return wrong + ([] if self.exit_code == CODES[self.levels["python"]] else [f"exit code {self.exit_code}"])


MORE_REASONS = " (there are more reasons: --verbose, or the report)"  # of which the summary has the first


def said_of(*words: str) -> Said:
    """What is said of `rodshell form WORDS`."""
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(io.StringIO()):
        out = Path(folder) / "out"
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            code = main(["form", *words, "--only", "report", "--out", str(out)])
        stored = json.loads((out / "result.json").read_text())["verdict"]
        page = (out / "report.html").read_text()
        verdict = rs.read(out).verdict
        section = re.search(r'<section class="notice (\w+)" aria-label="Verdict">\s*<strong>(.*?)</strong>', page)
        assert section is not None
        first = printed.getvalue().splitlines()[0].split(": ", 1)[1].removesuffix(MORE_REASONS)
    levels = {"python": verdict.level, "result.json": stored["level"], "report": section[1]}
    headlines = {"python": verdict.headline, "summary": first, "report": html.unescape(section[2])}
    return Said(code, levels, headlines)


CASES: dict[str, tuple[str, list[str], str]] = {  # level, words of the command line, what the first sentence says
    "20 mm rods on the hemisphere": ("unbuildable", ["hemisphere", "--rod.section.radius", "10 mm"], "touch"),
    "strength exceeded": ("unbuildable", ["hemisphere", "--checks.strength", "1 kPa"], "of the given strength"),
    "unstable": ("unbuildable", ["hemisphere"], "unstable (2 buckling modes)"),
    "the README's pavilion": ("good", ["pavilion"], "is stable and carries at least"),
    "the paper's hemisphere": ("unbuildable", ["hemisphere"], "does not stand under its own weight"),
}


@contextlib.contextmanager
def unstable() -> Iterator[None]:
    """Every pop-up is called unstable, whatever it is."""
    plain = pipeline.pop_up

    def pop_up(*arguments: Any, **options: Any) -> rs.PopUp:
        popped = plain(*arguments, **options)
        return with_report(popped, negative_modes=2)

    pipeline.pop_up = pop_up
    try:
        yield
    finally:
        pipeline.pop_up = plain


def rows(names: Collection[str] = tuple(CASES)) -> Iterator[Row]:
    for name in names:
        level, words, says = CASES[name]
        with unstable() if name == "unstable" else contextlib.nullcontext():
            said = said_of(*words)
        note = said.headlines["python"]
        yield Row(name, "level, code, colour, sentence: disagree", len(said.disagreements), 0, note=note)
        yield Row(name, f"level is not {level}", float(said.levels["python"] != level), 0)
        yield Row(name, f'first sentence without "{says}"', float(says not in said.headlines["python"]), 0)
