"""Every command line that README.md and docs/files.md print runs as it stands, in a folder with the files it names."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from rodshell.case.rod_ends import COLUMNS
from rodshell.cli import main, warmup
from rodshell.job import Job

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
QUICK = {
    "form": ["--only", "csv", "--checks.stages", "0", "--pop_up.ends", "clamped"],
    "refine": ["--only", "csv", "--checks.stages", "0", "--layout.spacing", "60 mm"],
}
"""What is added to a command so that it does no more than it must."""

README = [
    line
    for block in re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    for line in re.split(r"\n|&&", block)
    if line.strip().startswith("rodshell ")
]
FILES = re.findall(r"`(rodshell [^`]*)`", (ROOT / "docs" / "files.md").read_text())
FILES = [line for line in FILES if "..." not in line and "paper" not in line]  # figures of the paper take minutes


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A user's folder: a roof of 12 x 8 m in mm, a case, a table of rods on a sphere, an earlier result."""
    folder = tmp_path_factory.mktemp("user")
    x, y = np.meshgrid(np.linspace(-6, 6, 25), np.linspace(-4, 4, 17))
    roof = 1e3 * np.column_stack([x.ravel(), y.ravel(), (3 * np.cos(x / 6) * np.cos(y / 5)).ravel()])
    corner = (np.arange(16)[:, None] * 25 + np.arange(24)).ravel() + 1
    text = "".join(f"v {a} {b} {c}\n" for a, b, c in roof)
    text += "".join(f"f {k} {k + 1} {k + 26} {k + 25}\n" for k in corner)
    (folder / "roof.obj").write_text(text)
    case = '[target]\nkind = "cap"\nradius = "5 m"\nbase = "3 m"\n'
    for name in ("my_case.toml", "case.toml"):
        (folder / name).write_text(case)
    (folder / "rods.csv").write_text("\n".join([",".join(COLUMNS), *_rods()]))
    assert main(["form", "pavilion", "--out", str(folder / "out" / "pavilion"), "--quiet", *QUICK["form"]]) == 0
    assert main(["form", "hemisphere", "--out", str(folder / "DIR"), "--quiet", *QUICK["form"]]) == 4
    return folder


def _rods() -> list[str]:
    """Five rods each way over a disc of 400 mm, whose ends move in by a tenth."""
    rows = []
    for at in np.linspace(-300, 300, 5):
        end = np.sqrt(400.0**2 - at**2)
        for flat in ((-end, at, end, at), (at, -end, at, end)):
            x0, y0, x1, y1 = (0.9 * value for value in flat)
            rows.append(",".join(f"{value:.6f}" for value in (*flat, x0, y0, 0, x1, y1, 0)))
    return rows


@pytest.mark.parametrize("line", [*README, *FILES])
def test_a_documented_command_runs(line: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.setattr(warmup, "compile_before_first", lambda **options: 0)
    _, command, *arguments = shlex.split(line, comments=True)
    code = main([command, *arguments, *([] if "--help" in arguments else QUICK.get(command, []))])
    assert code in (0, 4)  # rubber and thin rods fall under their own weight


def test_the_readme_shows_what_the_program_prints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The pavilion's summary, word for word; numbers are compared elsewhere."""
    shown = re.search(r"```\n(pavilion: .*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert shown is not None
    assert main(["form", "pavilion", "--out", str(tmp_path / "pavilion"), "--only", "csv"]) == 0
    printed = capsys.readouterr().out.splitlines()[:-1]  # the last line names the folder
    number = re.compile(r"\d[\d.]*(e[-+]\d+)?")
    assert [number.sub("#", line) for line in printed] == [number.sub("#", line) for line in shown[1].splitlines()]


def test_the_commands_are_found() -> None:
    assert len(README) > 10
    assert len(FILES) >= 4


@pytest.mark.slow
def test_the_documented_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All of README.md, then all of docs/files.md, as one script each in a user's folder."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for page in (ROOT / "README.md", ROOT / "docs" / "files.md"):
        for block in re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL):
            exec(block, names)
        Job.load("hemisphere", {"layout.spacing": "60 mm", "checks.stages": 0}).run().save("out/dome", kinds=[])
    assert names["longer"].reused == ("target", "drape", "trim", "pop-up", "checks")  # type: ignore[attr-defined]
