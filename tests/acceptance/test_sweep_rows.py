"""A row of the table of sweeps reaches its figure; `make accept-sweep` prints all of them, in an hour."""

from pathlib import Path

from tests.acceptance.sweep import second_rows
from tests.acceptance.test_acceptance import check_reached


def test_second_sweep_into_a_folder_is_refused_and_loses_nothing(tmp_path: Path) -> None:
    check_reached(second_rows(tmp_path, 12))
