"""`rodshell advise`: what it tries, what it calls a help, what it keeps; that its commands do what was said."""

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rodshell.case import load_case
from rodshell.cli import advise, main
from rodshell.results import read
from tests.acceptance.advised import FOUND, advised

COARSE = ["--spacing", "2 m", "--edge", "1 m", "--checks.stages", "0", "--only", "csv"]
THIN = ["--rod", "tube 15x1.4", *COARSE]


@pytest.fixture
def formed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    monkeypatch.chdir(tmp_path)

    def form(name: str, *words: str) -> Path:
        assert main(["form", "pavilion", *words, "--out", name, "-q"]) in FOUND
        return tmp_path / name

    return form


def lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return capsys.readouterr().out.splitlines()


def test_the_command_for_the_best_comes_to_what_is_said_of_it(
    formed: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """A shell of thin tubes carries too little; results, but for the advice, and all other files stay as they are."""
    folder = formed("a thin one", *THIN)
    before = json.loads((folder / "result.json").read_text())
    files = {
        path: path.read_bytes() for path in folder.rglob("*.*") if path.name not in ("result.json", "manifest.json")
    }
    capsys.readouterr()
    assert main(["advise", "a thin one", "--most", "2"]) == 0
    *said, left, command = lines(capsys)
    assert left.startswith("not tried: ")
    assert said[0].startswith("pavilion: Check, unloaded: with pinned ends the shell does not stand")
    assert said[1].split() == ["finding", "before", "after", "limit", "verdict", "option"]
    after = json.loads((folder / "result.json").read_text())
    advice = after.pop("advice")
    assert after == {key: value for key, value in before.items() if key != "advice"}
    assert all(path.read_bytes() == content for path, content in files.items())
    assert len(advice) == len(said) - 2 == 2
    assert [line.startswith("tried, helps") for line in said[2:]] == [each["helps"] for each in advice]
    best = advice[0]
    assert best["helps"]
    assert best["offer"].removeprefix("rodshell form case.toml ") in command
    assert main([*shlex.split(command)[1:], "--only", "csv", "-q"]) == 0
    found = read("a thin one-2")
    assert found.verdict.headline == best["said"]
    factors = [each.load_factor or 0.0 for each in found.results.self_weight.values()]
    assert min(factors) == pytest.approx(best["after"], rel=1e-12)
    assert min(factors) > best["before"]
    assert main(["export", "a thin one", "--only", "report", "-q"]) == 0
    assert "tried, helps" in (folder / "report.html").read_text()


def test_what_is_formed_says_last_what_tries_its_offers(
    formed: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["form", "pavilion", *THIN, "--out", "it's thin"]) == 0
    folder = shlex.quote(str(Path("it's thin").resolve()))
    assert capsys.readouterr().err.splitlines()[-1].endswith(f"rodshell advise {folder} tries what may help")


def test_a_good_result_has_nothing_to_mend(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    fine = ["--spacing", "1.2 m", "--edge", "400 mm", "--checks.stages", "2", "--only", "csv"]
    assert main(["form", "pavilion", *fine, "--out", "good"]) == 0
    assert read("good").verdict.level == "good"
    assert "advise" not in capsys.readouterr().err
    assert main(["advise", "good"]) == 0
    assert lines(capsys)[-1] == "there is nothing to mend"


def test_what_was_tried_is_kept_when_it_is_interrupted(
    formed: Callable[..., Path], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, tries, trial = formed("thin", *THIN), list[str](), advise._trial

    def second_is_interrupted(*arguments: Any) -> Any:
        tries.append(arguments[3])
        if len(tries) == 2:
            raise KeyboardInterrupt
        return trial(*arguments)

    monkeypatch.setattr(advise, "_trial", second_is_interrupted)
    assert main(["advise", "thin"]) == 130
    assert "interrupted: what was tried is kept in thin: 1 of " in capsys.readouterr().err
    assert [each.offer for each in read(folder).results.advice] == tries[:1]


def test_an_offer_that_cannot_be_formed_is_no_help_and_says_why(formed: Callable[..., Path]) -> None:
    folder = formed("thin", *THIN)
    verdict = read(folder).verdict
    finding = verdict.findings[0]
    for option, why in (
        ('--rod "tube 3x32"', "wall"),
        ("--spacings 1", "No such option"),
        ("--base 9", "base"),
        ('--rod "', "cannot be read"),
    ):
        tried, _ = advise._trial(folder, verdict, finding, f"rodshell form case.toml {option}", lambda *_: None)
        assert (tried.helps, tried.level, tried.after) == (False, None, None)
        assert why in tried.said


def test_frames_of_a_fall_are_not_written_by_a_trial(tmp_path: Path) -> None:
    case = tmp_path / "case.toml"
    case.write_text(load_case("hemisphere", {"drape.method": "paper", "drape.frames": "fall"}).to_toml())
    assert load_case(str(case)).drape.frames == "fall"
    assert advise.case_of(case, "rodshell form case.toml --ends pinned").drape.frames is None


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["thin", "--most", "0"], "--most is 0: give at least 1"),
        (["thin", "--most", "few"], "'few' is not a valid integer"),
        (["nowhere"], "nowhere holds no rodshell result"),
        ([], "Missing argument 'DIR'"),
    ],
)
def test_what_cannot_be_advised_is_refused_in_a_sentence(
    words: list[str], said: str, formed: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    if "thin" in words:
        formed("thin", *THIN)
        capsys.readouterr()
    assert main(["advise", *words]) == 2
    assert said in capsys.readouterr().err


def test_a_result_without_loads_is_asked_for_them(
    formed: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    folder = formed("thin", *THIN)
    before = (folder / "result.json").read_bytes()
    assert main(["check", "thin"]) == 2
    said = capsys.readouterr().err
    assert '"thin" has no loads: give --snow "0.5 kN/m2", --wind "0.5 kN/m2" or --own' in said
    assert (folder / "result.json").read_bytes() == before


@pytest.mark.slow
@pytest.mark.parametrize("k", [1, 3])
def test_three_steps_of_advice_never_lead_back(k: int, tmp_path: Path) -> None:
    """Roofs of the acceptance table, of which six offers are tried a step."""
    tried, helpful, faults, levels = advised(k, tmp_path, most=6)
    assert not faults
    assert tried >= helpful > 0, levels
