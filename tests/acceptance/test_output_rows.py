"""Every row of the acceptance table of what people take away; `make accept-output` prints it."""

from collections.abc import Callable, Iterator

import pytest

from tests.acceptance.output import TARGETS, circle_rows, file_rows, reaction_rows, rebuilt_rows, size_rows
from tests.acceptance.rows import Row
from tests.acceptance.test_acceptance import check_reached

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("rows", [rebuilt_rows, file_rows, reaction_rows])
def test_every_shell(rows: Callable[[str], Iterator[Row]], name: str) -> None:
    check_reached(rows(name))


@pytest.mark.parametrize("rows", [circle_rows, size_rows])
def test_the_other_rows(rows: Callable[[], Iterator[Row]]) -> None:
    check_reached(rows())
