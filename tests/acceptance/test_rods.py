"""Every row of the rod's own table reaches its figure; `make accept-rods` prints it."""

import pytest

from tests.acceptance.rods import buckling_rows, convergence_rows, derivative_rows, holonomy_rows, rigid_rows
from tests.acceptance.rods_dynamics import conservation_rows, frequency_rows, order_rows
from tests.acceptance.test_acceptance import check_reached

pytestmark = pytest.mark.slow

TABLE = (
    derivative_rows, rigid_rows, convergence_rows, buckling_rows, holonomy_rows,
    frequency_rows, order_rows, conservation_rows,
)  # fmt: skip


@pytest.mark.parametrize("rows", TABLE, ids=lambda rows: rows.__name__)
def test_rod_reaches_the_figures_of_its_table(rows) -> None:
    check_reached(rows())
