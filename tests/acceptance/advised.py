"""Prints the table of shells that are advised: `python -m tests.acceptance.advised [count]`.

Forty random roofs of 4 to 24 m as meshes, of tubes and spacings at random, every third of them under snow. Up to three
times the best of the offers is pasted as it is printed. Every offer that is marked as a help was formed and betters the
figure of its finding; the one that is pasted comes to what was said of it; and no step leads back to an earlier case.
"""

import shlex
import sys
import tempfile
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from time import process_time

import numpy as np

from rodshell.cli import main
from rodshell.results import Results, read
from rodshell.rods.section import TRADE_SIZES, Tube, size_text
from tests.acceptance.designed import SEED, roof
from tests.acceptance.rows import Row, print_table

SHELLS, STEPS, MOST = 40, 3, 10
FOUND = (0, 3, 4)
SAME = 1e-9  # a case that is formed again gives the same figures
LEVELS = ("good", "check", "unbuildable", "unknown")


def command_of(k: int, folder: Path) -> list[str]:
    """The command that forms the k-th shell: its size is likely for its width, or too thin or too thick."""
    rng = np.random.default_rng((SEED, k, 1))
    shape = roof(k)
    tubes = [size for size in TRADE_SIZES["gfrp"] if isinstance(size, Tube)]
    likely = min(tubes, key=lambda tube: abs(tube.depth - shape.width / 400))
    tube = tubes[int(np.clip(tubes.index(likely) + rng.integers(-3, 4), 0, len(tubes) - 1))]
    spacing = float(f"{shape.width / rng.uniform(8, 14):.2g}")
    words = ["form", str(shape.write(folder)), "--target.unit", "mm", "--target.up", "y", "--rod", size_text(tube)]
    words += ["--spacing", f"{spacing} m", "--edge", f"{spacing / 3} m", "--ends", rng.choice(["pinned", "both"])]
    return [*words, *(["--snow", "0.3 kN/m2", "--bracing.kind", "laths"] if k % 3 == 2 else [])]


def said_by(words: list[str]) -> tuple[int, str]:
    """The exit code of a command, and what it prints."""
    said, errors = StringIO(), StringIO()
    with redirect_stdout(said), redirect_stderr(errors):
        code = main(words)
    assert code in FOUND, errors.getvalue()[-400:]
    return code, said.getvalue()


def faults_of_marks(results: Results) -> list[str]:
    """Offers that are marked as a help and were not formed, or do not better the figure of their finding."""
    faults = []
    assert results.verdict is not None
    for each in results.advice:
        if not each.helps:
            continue
        of = next(
            finding
            for finding in results.verdict.findings
            if each.offer in finding.offers and finding.code == each.code
        )
        if each.level is None:
            faults.append(f"{each.offer} was not formed")
        elif LEVELS.index(each.level) > LEVELS.index(results.verdict.level):
            faults.append(f"{each.offer} leads to {each.level}")
        elif None not in (each.after, each.before, of.limit):
            up = of.figure < of.limit
            if (each.after > each.before) != up or each.after == each.before:
                faults.append(f"{each.offer}: {each.code} from {each.before} to {each.after}")
    return faults


def figure(results: Results, code: str) -> float | None:
    """A figure from the records, where it is simple to find: the least factor on the weight, the largest use."""
    weighed = results.self_weight.values()
    if code in ("falls", "reserve") and not results.loads:
        return min(np.inf if each.load_factor is None else each.load_factor for each in weighed)
    if code == "strength" and results.bending and len(results.pop_up) == 1:
        return results.bending.shapes()[next(iter(results.pop_up))].utilisation
    return None


def advised(k: int, folder: Path, steps: int = STEPS, most: int = MOST) -> tuple[int, int, list[str], str]:
    """How many offers of the k-th shell were tried, how many help, what is wrong with them, and its levels."""
    out, tried, helpful, faults = folder / f"shell {k}", 0, 0, list[str]()
    said_by([*command_of(k, folder), "--only", "csv", "-q", "--out", str(out)])
    cases, levels = [(out / "case.toml").read_text()], list[str]()
    for _ in range(steps):
        before = read(out).results
        assert before.verdict is not None
        levels.append(before.verdict.level)
        if before.verdict.level == "good":
            break
        *_, last = said_by(["advise", str(out), "-q", "--most", str(most)])[1].strip().splitlines() or [""]
        results = read(out).results
        faults += faults_of_marks(results)
        if results.plain() | {"advice": []} != before.plain() | {"advice": []}:
            faults.append("the result is another than before")
        tried, helpful = tried + len(results.advice), helpful + sum(bool(each.helps) for each in results.advice)
        if not last.startswith("rodshell form"):
            break
        best, words = results.advice[0], shlex.split(last)[1:]
        out = Path(words[words.index("--out") + 1])
        said_by([*words, "--only", "csv", "-q"])
        now = read(out).results
        assert now.verdict is not None
        if now.verdict.level != best.level or now.verdict.headline != best.said:
            faults.append(f"{best.offer} comes to {now.verdict.headline}, and not {best.said}")
        other = figure(now, best.code)
        if other is not None and best.after is not None and abs(other - best.after) > SAME * abs(other):
            faults.append(f"{best.offer} comes to {other}, and not {best.after}")
        cases.append((out / "case.toml").read_text())
        if cases[-1] in cases[:-1]:
            faults.append(f"{best.offer} leads back")
    else:
        levels.append(now.verdict.level)
    return tried, helpful, faults, " -> ".join(levels)


def rows(count: int) -> Iterator[Row]:
    """A row for each shell: what is wrong with its advice."""
    tried = helpful = 0
    with tempfile.TemporaryDirectory() as folder:
        for k in range(count):
            begun = process_time()
            of, help_of, faults, levels = advised(k, Path(folder))
            tried, helpful = tried + of, helpful + help_of
            note = f"{levels}, {help_of} of {of} help, {process_time() - begun:.0f} s {'; '.join(faults)}"
            yield Row(roof(k).name, "wrong or circular advice", len(faults), 0, "", note)
    yield Row("all", "shells without an offer that helps", float(not helpful), 0, "", f"{helpful} of {tried} help")


if __name__ == "__main__":
    sys.exit(print_table("advised", rows(int(sys.argv[1]) if len(sys.argv) > 1 else SHELLS)))
