"""Every row of the acceptance table reaches its figure; `make accept` prints it."""

from collections.abc import Callable, Iterator

import pytest

from tests.acceptance.cases import AUTO, FURTHER, PAPER, AcceptanceCase
from tests.acceptance.rows import (
    Row,
    drape_rows,
    flat_rows,
    gravity_rows,
    net_rows,
    own_end_rows,
    pop_up_rows,
    refused_rows,
    scale_rows,
)

pytestmark = pytest.mark.slow


def check_reached(rows: Iterator[Row]) -> None:
    table = list(rows)
    missed = [str(row) for row in table if not row.reached]
    assert table
    assert not missed, "\n".join(missed)


@pytest.mark.parametrize("case", [*PAPER, *AUTO], ids=lambda case: case.name)
def test_footprint_is_the_exact_net(case: AcceptanceCase) -> None:
    check_reached(net_rows(case))


@pytest.mark.parametrize("case", AUTO, ids=lambda case: case.name)
def test_drape_alone_gives_nearly_the_same_ends(case: AcceptanceCase) -> None:
    check_reached(own_end_rows(case))


@pytest.mark.parametrize("case", [*PAPER, *AUTO, *FURTHER], ids=lambda case: case.name)
def test_bound_drape_is_in_equilibrium(case: AcceptanceCase) -> None:
    check_reached(drape_rows(case))


@pytest.mark.parametrize("case", [*PAPER, *AUTO, *FURTHER], ids=lambda case: case.name)
def test_popped_up_shell_agrees_with_its_target(case: AcceptanceCase) -> None:
    check_reached(pop_up_rows(case))


@pytest.mark.parametrize("rows", [flat_rows, refused_rows, gravity_rows, scale_rows])
def test_the_other_rows(rows: Callable[[], Iterator[Row]]) -> None:
    check_reached(rows())
