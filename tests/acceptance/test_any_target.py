"""Rows of `make accept-targets` that take seconds; examples/gallery.py holds the gallery to its figures."""

from collections.abc import Iterator

import pytest

from tests.acceptance.rows import Row
from tests.acceptance.targets import SURFACES, mesh_rows, nurbs_rows, same_rows

pytestmark = pytest.mark.slow


def check_reached(rows: Iterator[Row]) -> None:
    table = list(rows)
    missed = [str(row) for row in table if not row.reached]
    assert table
    assert not missed, "\n".join(missed)


@pytest.mark.parametrize("name", SURFACES)
def test_a_mesh_gives_the_form_of_its_analytic_target(name: str) -> None:
    check_reached(mesh_rows(name, ("2k", "20k")))


def test_a_nurbs_gives_the_form_of_its_analytic_target() -> None:
    pytest.importorskip("rhino3dm", reason="no rhino3dm: pip install rhino3dm")
    pytest.importorskip("OCP", reason="no OpenCASCADE: pip install cadquery-ocp-novtk")
    check_reached(nurbs_rows())


def test_the_same_surface_in_another_mesh_gives_the_same_form() -> None:
    check_reached(same_rows())
