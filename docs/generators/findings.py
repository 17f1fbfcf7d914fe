"""The how-to of findings: a section for each code, with what it means, what is said, and what to do about it."""

import re
import tomllib
from pathlib import Path

from rodshell.figures.findings import CODES, level_of
from rodshell.figures.sentences import SENTENCES

HEAD = """# Each finding, and what to do

A verdict consists of findings, and is as grave as the gravest of them: *good*, *check*, *unbuildable*, or *unknown*
where a computation did not end. A finding has a code, in `result.json` and in Python (`form.verdict.findings`); the
dots below stand for figures of the shell. Where options may mend it, a finding offers them as commands to paste
(`offers`); `rodshell advise DIR` tries those of a result, and says which of them help.

"""

WHAT_TO_DO: dict[str, str] = tomllib.loads(Path(__file__).with_name("what_to_do.toml").read_text(encoding="utf-8"))


def page() -> str:
    return HEAD + "\n".join(map(_section, CODES))


def _section(code: str) -> str:
    said = [_dotted(text) for name, text in SENTENCES.items() if name.partition(":")[0] == code]
    quotes = "".join(f"> {text}\n\n" for text in said if text.strip(". "))
    meaning = f"{_sentence(CODES[code])}. By itself: *{level_of(code)}*."
    return f"## `{code}`\n\n{meaning}\n\n{quotes}**What to do.** {WHAT_TO_DO[code]}\n"


def _dotted(sentence: str) -> str:
    """A sentence with dots for what is filled in."""
    dotted = re.sub(r"\{\w+\}", "...", sentence)
    return re.sub(r" ([,:;])", r"\1", re.sub(r"(\.\.\.)[. ]*", r"\1 ", dotted)).strip()


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:]
