"""The command that makes figures: one, or all of them, each written as soon as it is made."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from rodshell.cli import main, paper
from rodshell.paper import FIGURES, figure_maker
from rodshell.results.folder import ResultFolder


@dataclass(frozen=True)
class Made:
    name: str
    status: str = "converged"

    def summary(self) -> str:
        return f"table of {self.name}"

    def result(self) -> dict[str, str]:
        return {"figure": self.name}

    def save(self, folder: ResultFolder) -> None:
        folder.put("table.txt", self.summary())
        folder.commit()


def stand_in(monkeypatch: pytest.MonkeyPatch, status: dict[str, str]) -> None:
    """Figures that cost nothing; `status` of those that do not converge."""

    def maker(figure: str) -> Callable[[object], Made]:
        return lambda progress: Made(figure, status.get(figure, "converged"))

    monkeypatch.setattr(paper, "figure_maker", maker)


def test_a_figure_that_is_not_there_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["paper", "fig5"]) == 2
    names = ", ".join(FIGURES)
    refused = f"rodshell: error: there is no figure fig5 here: the figures are {names}; or all\n"
    assert capsys.readouterr().err == refused


def test_all_figures_go_to_folders_of_their_own(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stand_in(monkeypatch, {})
    assert main(["paper", "all", "--out", str(tmp_path / "paper")]) == 0
    assert {path.name for path in (tmp_path / "paper").iterdir()} == set(FIGURES)
    told = capsys.readouterr().out
    assert [told.index(f"table of {name}") for name in FIGURES] == sorted(told.index(f"table of {n}") for n in FIGURES)


def test_a_figure_that_does_not_converge_does_not_stop_the_others(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stand_in(monkeypatch, {"fig6": "(a) was not at rest"})
    assert main(["paper", "all", "--out", str(tmp_path / "paper"), "--quiet"]) == 3
    assert (tmp_path / "paper" / "studies" / "table.txt").exists()
    assert "NOT CONVERGED: (a) was not at rest" in capsys.readouterr().err


def test_every_figure_has_a_function_that_makes_it() -> None:
    for name in FIGURES:
        assert callable(figure_maker(name))
