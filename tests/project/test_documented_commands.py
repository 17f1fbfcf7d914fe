"""Every code block of README.md and of docs/ runs as it stands, alone, in a folder with the files it names."""

import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rodshell.case import load_case
from rodshell.case.rod_ends import COLUMNS
from rodshell.cli import main, warmup
from rodshell.sweeps.search_plan import read_search

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
QUICK = {
    "form": ["--only", "csv", "--checks.stages", "0", "--pop_up.ends", "clamped"],
    "refine": ["--only", "csv", "--checks.stages", "0"],
    "advise": ["--most", "1"],
}
"""What is added to a command so that it does no more than it must."""

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
ELSEWHERE = ("rodshell studio", "rodshell paper", "--address", "--dry-run")
"""What is not run here: a server, figures of the paper (minutes), a cluster; plans are read without a dry run."""


def blocks(language: str) -> list[Any]:
    """The code blocks of a language, of README.md and of all pages of docs/, named by page and number."""
    found = {page.name: re.findall(rf"```{language}\n(.*?)```", page.read_text(), re.DOTALL) for page in PAGES}
    return [pytest.param(text, id=f"{page}-{k}") for page, texts in found.items() for k, text in enumerate(texts, 1)]


SHELL = [
    line
    for block in blocks("sh")
    for line in re.split(r"\n|&&", block.values[0])
    if line.strip().startswith("rodshell ") and not any(word in line for word in ELSEWHERE)
]
SHELL = [line for line in SHELL if "sweep.toml" not in line]  # a page's plans are read below
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
    for name in ("out/mine", "out/dome"):
        shutil.copytree(folder / ("DIR" if name == "out/dome" else "out/pavilion"), folder / name)
    lath = 'rod.section = "lath 12x40"\nrod.material.preset = "larch"\njoint.kind = "pin"\n'
    (folder / "roof.toml").write_text(f'{lath}[target]\nkind = "mesh"\nfile = "roof.obj"\nunit = "mm"\n')
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


@pytest.mark.parametrize("line", [*SHELL, *FILES])
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
    printed = capsys.readouterr().out.splitlines()
    number = re.compile(r"\d[\d.]*(e[-+]\d+)?")
    assert [number.sub("#", line) for line in printed] == [number.sub("#", line) for line in shown[1].splitlines()]


def test_the_commands_are_found() -> None:
    assert len(SHELL) > 15
    assert len(FILES) >= 4
    assert len(blocks("python")) >= 7
    assert len(blocks("toml")) >= 5


def test_the_readme_fits_who_has_a_surface() -> None:
    """Two screens of a builder's words: none of numerics, kernels and compilers."""
    text = (ROOT / "README.md").read_text()
    assert len(text.splitlines()) <= 120
    links = re.sub(r"## Further reading.*", "", text, flags=re.DOTALL)
    assert not re.search(
        r"Newton|Hessian|factori[sz]ation|residual|compiler|numba|RODSHELL_KERNELS", links, re.IGNORECASE
    )


@pytest.mark.parametrize("text", blocks("python"))
def test_a_block_of_python_runs_alone(text: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    names: dict[str, Any] = {}
    try:
        exec(text, names)
    finally:
        if server := names.get("server"):  # the studio's
            server.terminate()
            server.wait()
    if again := names.get("longer") or names.get("again"):
        assert again.reused == ("target", "drape", "trim", "pop-up", "checks")


@pytest.mark.parametrize("text", blocks("toml"))
def test_a_block_of_toml_is_read_alone(text: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a plan of a sweep or of a search, all of whose designs are read; or else as a case."""
    monkeypatch.chdir(folder)
    Path("plan.toml").write_text(text)
    if "[variables]" in text:
        assert read_search("plan.toml").variables
    elif "[axes]" in text:
        assert main(["sweep", "plan.toml", "--dry-run", "--out", "out/plan"]) == 0
    else:
        assert load_case("plan.toml").built_loads() is not None
