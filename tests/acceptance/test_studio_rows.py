"""Cheap rows of the studio's table, with the server as a program; `make accept-studio` prints all."""

from pathlib import Path

import pytest

from tests.acceptance.test_acceptance import check_reached
from tests.output.browser import needs_browser

pytest.importorskip("starlette")
pytest.importorskip("httpx2")


@pytest.mark.slow
def test_nobody_is_let_in_who_should_not_be(tmp_path: Path) -> None:
    from tests.acceptance.studio import refusal_rows

    check_reached(refusal_rows(tmp_path))


@pytest.mark.slow
@needs_browser
def test_a_geodesic_shell_of_the_studio_is_in_its_files_as_in_its_result() -> None:
    from tests.acceptance.lattices_studio import studio_rows

    check_reached(studio_rows())
