"""Every command, killed at any time while it replaces an older result in a folder with files of its user."""

import os
from pathlib import Path

import pytest

from tests.acceptance.kills import JOBS, jobs_of_files
from tests.acceptance.verdict_harm import kill_rows

TIMES = int(os.environ.get("RODSHELL_ATTACK", "1"))
pytestmark = [
    pytest.mark.attack,
    pytest.mark.slow,
    pytest.mark.skipif(TIMES < 2, reason="needs RODSHELL_ATTACK=2 or more; the first kills are in tests/cli"),
]


@pytest.mark.parametrize("name", [*JOBS, "check", "refine", "popup"])
def test_kill_leaves_the_old_result_or_the_new_one_and_nothing_else(name: str, tmp_path: Path) -> None:
    job = JOBS.get(name) or jobs_of_files(tmp_path / "inputs")[name]
    missed = [str(row) for row in kill_rows(job, tmp_path / "killed", 3 * TIMES) if not row.reached]
    assert missed == []
