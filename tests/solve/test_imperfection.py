"""Imperfect structures: how large the deviation is, how it grows, and what it costs."""

import numpy as np
import pytest

from rodshell.errors import InputError
from rodshell.solve.imperfection import imperfect
from rodshell.solve.load_path import load_path
from rodshell.solve.modes import linear_buckling
from tests.solve import stability_problems as known


@pytest.mark.parametrize("amplitude", [1e-4, -1e-4])
def test_a_bow_grows_as_one_over_what_is_left_of_eulers_load(amplitude: float) -> None:
    """Perry and Robertson: of a column of length 1, in its plane, a bow a is a / (1 - P/Pe)."""
    column = known.eulers_column(40)
    buckling = linear_buckling(column.unloaded, column.load)
    bowed = imperfect(column.unloaded, buckling.shapes[0], amplitude)
    assert not bowed.report.negative_modes
    middle = [float(np.linalg.norm((bowed.state - column.unloaded.state)[column.node]))]
    assert middle[0] == pytest.approx(abs(amplitude), rel=1e-6)
    stations = (0.25, 0.5, 0.75)
    path = load_path(bowed, column.load, most=0.76, stations=stations)
    for factor in stations:
        found = path.at(factor)
        assert found is not None
        size = np.linalg.norm((found.state - column.unloaded.state)[column.node, 1:])
        assert size == pytest.approx(abs(amplitude) / (1 - factor / buckling.factors[0]), rel=2e-4)


def test_both_signs_are_mirror_images_where_the_structure_is() -> None:
    arch = known.shallow_arch(8.0, 32)
    shape = linear_buckling(arch.unloaded, arch.load).shapes[0]  # sideways: to the left is as to the right
    perfect = load_path(arch.unloaded, arch.load).factor
    left, right = (load_path(imperfect(arch.unloaded, shape, a), arch.load).factor for a in (2e-4, -2e-4))
    assert left == pytest.approx(right, rel=2e-3)
    assert left < 0.95 * perfect


def test_a_sign_matters_where_the_structure_has_none() -> None:
    """A von Mises truss, higher or lower by a tenth."""
    truss = known.von_mises()
    shape = np.zeros_like(truss.unloaded.state)
    shape[2, 1] = 1.0
    higher, lower = (imperfect(truss.unloaded, shape, a) for a in (0.1, -0.1))
    assert higher.state[2, 1] == pytest.approx(1.1, rel=1e-9)
    assert lower.state[2, 1] == pytest.approx(0.9, rel=1e-9)
    assert load_path(higher, truss.load, most=1e3).factor > load_path(lower, truss.load, most=1e3).factor


def test_several_modes_are_added_and_the_farthest_node_goes_by_the_amplitude() -> None:
    column = known.eulers_column(40)
    shapes = linear_buckling(column.unloaded, column.load, 4).shapes
    off = imperfect(column.unloaded, shapes, 1e-3).state - column.unloaded.state
    assert np.linalg.norm(off, axis=1).max() == pytest.approx(1e-3, rel=1e-3)


def test_what_is_no_shape_is_refused() -> None:
    truss = known.von_mises()
    with pytest.raises(InputError, match="the modes have the shape"):
        imperfect(truss.unloaded, np.ones((2, 3)), 0.1)
    with pytest.raises(InputError, match="moves no node"):
        imperfect(truss.unloaded, np.zeros((3, 3)), 0.1)
    one = np.zeros((3, 3))
    one[2, 1] = 1.0
    with pytest.raises(InputError, match="cancel"):
        imperfect(truss.unloaded, np.array([one, -one]), 0.1)
