"""Projects that use rodshell as a library are type-checked against it, and do what their types say."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import rodshell as rs
from tests.types.greenhouse import study

PACKAGE = Path(rs.__file__).parent
PROJECT = Path(study.__file__).parent


@pytest.mark.slow
def test_a_downstream_project_passes_mypy_strict(tmp_path: Path) -> None:
    pytest.importorskip("mypy", reason="no mypy: pip install mypy")
    assert (PACKAGE / "py.typed").is_file()
    installed = "site-packages" in PACKAGE.parts  # where mypy looks by itself, and must not be sent
    environment = os.environ | ({} if installed else {"MYPYPATH": str(PACKAGE.parent)})
    command = [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", "--config-file=", str(PROJECT)]
    done = subprocess.run(
        [*command, f"--cache-dir={tmp_path}"], cwd=tmp_path, env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def test_stages_calls_and_jobs_agree_in_a_downstream_project(tmp_path: Path) -> None:
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.02)
    assert all(study.by_stages(target, layout, study.wires()) < 0.05 for target in study.targets()[:2])
    form = study.by_call(tmp_path / "called")
    gaps = study.by_job(tmp_path / "called" / "case.toml")
    assert gaps["as it is"] == pytest.approx(form.agreement["pinned"].rms_relative, rel=1e-9)
    assert len(study.methods()) == 3
    assert "radius" in study.refused()
