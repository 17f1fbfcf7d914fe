"""Six lines that a designer reads; all that was found, for who asks."""

import re
from pathlib import Path

import pytest

from rodshell.cli import main
from rodshell.results.archive import read
from tests.acceptance.kept import JOBS, unpacked

LINES = ("grid", "rod", "gap", "stress", "carries")
SOLVER = r"residual|iteration|Newton|factori[sz]ation|Hessian|unknowns|eigen|\d[eE][-+]\d|matrix|tolerance"


def labels(lines: list[str]) -> list[str]:
    """What the lines below the first are about."""
    return [line.split()[0] for line in lines[1:]]


@pytest.mark.parametrize("name", JOBS)
def test_a_summary_has_six_lines_at_most_and_no_word_of_the_solver(name: str, tmp_path: Path) -> None:
    """Of every kind of job: formulas, meshes, patches, laths, a fall, bracing under loads, a table of rods."""
    archive = read(unpacked(name, tmp_path))
    lines = archive.summary().splitlines()
    about = labels(lines)
    assert len(lines) <= 6
    assert about == [label for label in LINES if label in about]
    assert {"grid", "rod", "carries"} <= {*about}
    assert ("gap" in about) == (archive.results.target is not None)
    assert not re.search(SOLVER, "\n".join(lines))
    full = archive.summary(verbose=True).splitlines()
    assert [line for line in full if line in lines[1:]] == lines[1:]  # in the same words
    assert re.search(SOLVER, "\n".join(full))


def test_the_six_lines_are_all_that_a_command_prints_on_stdout(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Words about the run itself are on stderr: what was chosen, progress, where the result is."""
    out = tmp_path / "cap"
    assert main(["form", "cap", "--rod", "rod 3", "--rod.material.preset", "gfrp", "--target.radius", "1 m",
                 "--target.base", "800 mm", "--spacing", "0.2", "--edge", "0.1", "--length", "auto", "--rods", "auto",
                 "--checks.stages", "0", "--only", "csv", "--out", str(out)]) == 0  # fmt: skip
    said = capsys.readouterr()
    lines = said.out.splitlines()
    assert labels(lines) == [*LINES]
    assert re.match(r"cap: (Good|Check), unloaded: ", lines[0])
    assert lines[2].startswith("  rod       rod 3 mm; gfrp")
    written = f"rodshell: written to {out}: schedules; rodshell export {out} writes"
    assert any(line.startswith(written) for line in said.err.splitlines()[-2:])
    results = read(out).results
    for ends, carried in results.self_weight.items():
        assert re.search(rf"own weight: .*\b{ends} {str(carried.load_factor)[:4]} times", lines[5])
        assert re.search(rf"snow on top of it: .*\b{ends} [\d.]+ kN/m2", lines[5])
        assert f"{ends} {1e3 * results.agreement[ends].max:.3g}"[:10] in lines[3] or "under" in lines[3]
