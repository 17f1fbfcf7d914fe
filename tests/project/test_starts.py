"""The pages of docs/start/ and docs/tutorials/ can be followed literally, and find what they say."""

import csv
import re
import shlex
from pathlib import Path

import pytest

from rodshell.cli import main, warmup

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PAGES = {page.stem: page for room in ("start", "tutorials") for page in sorted((ROOT / "docs" / room).glob("*.md"))}
QUICK = ["--checks.stages", "0"]  # of the form's checks, what the pages do not speak of
OF_STAGES = ["schedule/end_paths.csv"]
UNBUILDABLE = {"out/thick", "out/dropped", "out/paraboloid"}
SAID = {
    "designers": ["24 rods", "2.5 mm"],
    "engineers": ["winter: pinned 2.4"],
    "researchers": ["rod ends off the exact net's"],
    "geodesic_boards": ["use 131 %", "88 % of larch's", "carries only 1.5 times", "2.7 times are asked for"],
    "rhino_mesh_to_laths": ["only 78 % of it", "1.66 times its own weight"],
    "fig6_to_sweep": ["3 of 3 designs are finished"],
    "desk_model": ["18 rods", "57 joints"],
}
"""What a page quotes of what its commands print."""


@pytest.mark.parametrize("name", SAID)
def test_a_page_can_be_followed(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = PAGES[name].read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(warmup, "compile_before_first", lambda **options: 0)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for file, content in re.findall(r"```toml\n# (\S+)\n(.*?)```", text, re.DOTALL):
        (tmp_path / file).write_text(content)
    lines = [line for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL) for line in block.splitlines()]
    commands = [shlex.split(line)[1:] for line in lines if line.startswith("rodshell ")]
    assert commands
    for command in commands:
        code = main([*command, *(QUICK if command[0] == "form" else [])])
        assert code == (4 if UNBUILDABLE & set(command) else 0), command
    printed = re.sub(r"\s+", " ", capsys.readouterr().out)
    for words in SAID[name]:
        assert words in printed, words
    for out, table in re.findall(r"\| file in `(.*?)/` .*?\n(.*?)\n\n", text, re.DOTALL):
        for first, *others in (re.findall(r"`(.*?)`", row.split("|")[1]) for row in table.splitlines()[1:]):
            files = [first, *(str(Path(first).parent / name) for name in others)]
            assert all(any(Path(out).glob(file)) or file in OF_STAGES for file in files), files
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(block, {})
    for joint, height in re.findall(r"^\| (\w+/\w+) \| ([\d.]+) \|$", text, re.MULTILINE):
        assert float(height) == pytest.approx(heights(tmp_path / "out" / "desk")[joint], abs=0.051), joint


def heights(folder: Path) -> dict[str, float]:
    """Of the joints of a result, above the supports [mm]."""
    with (folder / "schedule" / "joints.csv").open() as rows:
        return {row["id"]: float(row["final_z_mm"]) for row in csv.DictReader(rows)}


def test_every_page_is_followed() -> None:
    assert set(SAID) == set(PAGES) - {"index"}
