"""Ten small jobs give what they gave before; results of all earlier formats open, are exported, and run again."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rodshell.results.archive import read
from tests.acceptance import kept
from tests.acceptance.house import again_rows, export_rows, result_rows
from tests.acceptance.kept import EARLIER, JOBS, unpacked
from tests.acceptance.same_results import HERE, SOLVED_ANEW, Difference, Tolerances, differences
from tests.acceptance.test_acceptance import check_reached


@pytest.mark.parametrize("name", JOBS)
def test_a_job_gives_the_states_and_every_field_of_its_kept_result(name: str, tmp_path: Path) -> None:
    check_reached(result_rows([name], tmp_path))


@pytest.mark.parametrize("name", [*JOBS, *EARLIER])
def test_a_kept_result_opens_and_its_upgraded_keys_are_there(name: str, tmp_path: Path) -> None:
    archive = read(unpacked(name, tmp_path))
    assert set(archive.states) >= {"flat", "popped_pinned", "rod_nodes"}
    assert all(patch.drape is not None and patch.drape.net_deviation for patch in archive.results.patches)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*JOBS, *EARLIER])
def test_a_kept_result_is_exported_and_runs_again(name: str, tmp_path: Path) -> None:
    check_reached(again_rows(name, tmp_path))
    check_reached(export_rows(name, tmp_path))


CHANGES: dict[str, tuple[Any, float, bool]] = {  # what is done to a number; whether it is seen where solved anew, too
    ".rods[2].length": (lambda rods: rods[2].__setitem__("length", rods[2]["length"] * (1 + 1e-8)), 0.0, False),
    ".verdict.level": (lambda verdict: verdict.__setitem__("level", "good"), 0.0, True),
    ".pop_up.pinned.iterations": (lambda ends: ends["pinned"].__setitem__("iterations", 99), 0.0, False),
    ".agreement.clamped": (lambda ends: ends.pop("clamped"), 0.0, True),
    ".states.popped_pinned": (None, 1e-11, False),
    ".states.draped": (None, 1e-8, True),
    ".case.layout.edge": ("edge = ", 0.0, True),
}


@pytest.mark.parametrize("path", CHANGES)
def test_a_change_of_any_kind_is_seen(path: str, tmp_path: Path) -> None:
    """Of a field, a count, a state (by a share of the size), a key of the case."""
    change, moved, always = CHANGES[path]
    before, after = unpacked("hemisphere", tmp_path), tmp_path / "after"
    shutil.copytree(before, after)
    name = path.split(".")[2] if moved else path.split(".")[1].partition("[")[0]
    if moved:
        with np.load(before / "states.npz") as held:
            states = dict(held)
        states[name][5, 1] += moved * 0.2
        np.savez(after / "states.npz", **states)
    elif isinstance(change, str):
        text = (before / "case.toml").read_text()
        (after / "case.toml").write_text(text.replace(change, f"other_{change}"))
    else:
        content = json.loads((before / "result.json").read_text())
        change(content[name])
        (after / "result.json").write_text(json.dumps(content))

    def seen(within: Tolerances) -> list[str]:
        return [each.path for each in differences(before, after, within)]

    assert seen(HERE) == [path]
    assert seen(SOLVED_ANEW) == [path] * always


def test_what_changes_on_purpose_is_named_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept, "CHANGED_ON_PURPOSE", {"*.joint_loads.*.moment": "were 0.0", "table.name": "why"})
    moment = Difference("laths.joint_loads.pinned[3].moment", 0.0, 75.0)
    other = Difference("laths.joint_loads.pinned[3].force", 0.0, 1.0)
    assert kept.unexpected([moment, other]) == [other]
    assert list(kept.unneeded([moment, other])) == ["table.name"]
