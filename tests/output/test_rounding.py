"""Lengths are shown as finely as their tolerance asks for, each rounded from its exact value."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rodshell.figures.form import Rod
from rodshell.output.schedules import heading
from rodshell.results import Results
from rodshell.results.results import Drawings
from rodshell.results.wording import rounding_of


def result(longest: float, tolerance: float | None = None) -> Results:
    rods = [Rod(id="U", family="u", start=0.0, end=length, length=length) for length in (longest, 0.5 * longest)]
    return Results(rods=tuple(rods), drawings=Drawings(tolerance=tolerance))


@given(st.floats(1e-5, 0.05))
def test_rounding_takes_a_quarter_of_the_tolerance_at_most(tolerance: float) -> None:
    step = 1e-3 * rounding_of(result(16.0, tolerance)).step
    assert 0.5 * step <= 0.25 * tolerance * (1 + 1e-9)
    assert step == 1e-3 or 20 * step > tolerance * (1 - 1e-9)  # and no digit more than that


@pytest.mark.parametrize(
    ("longest", "tolerance", "shown"),
    [
        (16.0, None, "12346"),
        (16.0, 1e-3, "12345.7"),
        (16.0, 2e-3, "12346"),
        (16.0, 0.02, "12346"),
        (0.628, None, "12345.68"),
        (0.628, 5e-4, "12345.7"),
        (1.2, None, "12345.7"),
        (1e-4, None, "12345.679"),
    ],
)
def test_lengths_are_shown_by_tolerance_or_longest_rod(longest: float, tolerance: float | None, shown: str) -> None:
    assert rounding_of(result(longest, tolerance)).mm(12.34567891) == shown


def test_no_minus_before_a_zero_and_nothing_where_nothing_is_known() -> None:
    mm = rounding_of(result(0.628)).mm
    assert (mm(-1e-9), mm(None), mm(float("nan"))) == ("0.00", "", "")


@given(st.lists(st.floats(1e-3, 1.0), min_size=2, max_size=30))
def test_distances_along_a_rod_do_not_add_up_their_roundings(steps: list[float]) -> None:
    rounding, at = rounding_of(result(16.0, 1e-3)), np.cumsum(steps)
    shown = [float(rounding.mm(one)) for one in at.tolist()]
    assert np.abs(np.subtract(shown, 1e3 * at)).max() <= 0.5 * rounding.step * (1 + 1e-6)


def test_heads_of_tables_are_words_with_units() -> None:
    columns = (
        "cut_length_mm",
        "max_stress_pop_up_MPa",
        "flat_deg",
        "id",
        "force_x_N_pinned",
        "mass_kg",
        "at_a_from_cut_end_mm",
    )
    assert [heading(column) for column in columns] == [
        "cut length [mm]", "max stress pop up [MPa]", "angle flat [\N{DEGREE SIGN}]", "id", "force x pinned [N]",
        "mass [kg]", "at a from cut end [mm]",
    ]  # fmt: skip
