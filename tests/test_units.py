"""Quantities with units become SI numbers, or one sentence that says what would do."""

import math
import re
from fractions import Fraction
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rodshell.errors import InputError
from rodshell.units import _KINDS, RANGES, Kind, length_text, parse_quantity, places_text, shown
from rodshell.validation import not_negative, number, positive

ROOT = Path(__file__).parent.parent


@pytest.mark.parametrize(
    ("text", "kind", "si"),
    [
        ("200 mm", "length", 0.2),
        ("30mm", "length", 0.03),
        ("1.2 m", "length", 1.2),
        ("  -18 cm ", "length", -0.18),
        ("0.5 km", "length", 500.0),
        ("12 in", "length", 0.3048),
        ('12"', "length", 0.3048),
        ("1 ft", "length", 0.3048),
        ("2.5e2 µm", "length", 2.5e-4),
        ("45 deg", "angle", math.pi / 4),
        ("90°", "angle", math.pi / 2),
        ("0.5 rad", "angle", 0.5),
        (6.2832, "angle", 6.2832),
        ("360 deg", "angle", 2 * math.pi),
        ("-540 deg", "angle", -math.pi),
        ("1 MPa", "stress", 1e6),
        ("25 GPa", "stress", 25e9),
        ("3 N/mm²", "stress", 3e6),
        ("1 ksi", "stress", 6894757.293168361),
        ("1000 kg/m3", "density", 1000.0),
        ("1 g/cm^3", "density", 1000.0),
        ("2.7 g / cm³", "density", 2700.0),
        ("981 cm/s2", "acceleration", 9.81),
        ("0.5", "number", 0.5),
        ("0.03", "length", 0.03),
        (0.03, "length", 0.03),
        (2, "length", 2.0),
    ],
)
def test_a_quantity_is_its_si_value_to_the_last_bit(text: object, kind: Kind, si: float) -> None:
    value = parse_quantity(text, kind, "key")
    assert value == si
    assert isinstance(value, float)


@given(st.decimals(min_value=-1000, max_value=1000, places=3))
def test_millimetres_are_rounded_once(number: object) -> None:
    assert parse_quantity(f"{number} mm", "length", "key") == float(f"{number}e-3")


@pytest.mark.parametrize(
    ("value", "kind", "reason"),
    [
        ("30 furlong", "length", 'unknown unit "furlong"'),
        ("30 MM", "length", "did you mean mm?"),
        ("30 mpa", "stress", "did you mean MPa?"),
        ("5 mn", "length", "did you mean mm?"),
        ("5 kM", "force", "did you mean kN?"),
        ("5 meterz", "length", "did you mean meters?"),
        ("3 kg/m3", "length", "kg/m3 is a unit of density"),
        ("3 mm", "stress", "mm is a unit of length"),
        ("3 mm", "angle", "mm is a unit of length"),
        ("0.5 %", "number", "takes no unit"),
        ("about 3 mm", "length", "not a finite number"),
        ("", "length", "not a finite number"),
        ("nan", "length", "not a finite number"),
        (math.nan, "length", "not finite"),
        (math.inf, "length", "not finite"),
        ("1e400 m", "length", "not finite"),
        ("1e999999999 km", "length", "not finite"),
        (10**400, "length", "not finite"),
        (True, "length", "not a number"),
        (None, "length", "not a number"),
        ([1], "length", "not a number"),
    ],
)
def test_a_bad_quantity_is_one_sentence_with_key_reason_and_remedy(value: object, kind: Kind, reason: str) -> None:
    remedies = {"length": '"200 mm"', "stress": '"25 GPa"', "angle": '"45 deg"', "number": "0.5", "force": '"5 kN"'}
    with pytest.raises(InputError) as caught:
        parse_quantity(value, kind, "target.radius")
    message = str(caught.value)
    assert message.startswith("target.radius = ")
    assert reason in message
    assert remedies[kind] in message
    assert "\n" not in message
    assert len(message) < 200


def test_the_message_shows_the_value_as_given() -> None:
    with pytest.raises(InputError, match=r'^rotate = "45 dg": unknown unit "dg" \(did you mean deg\?\); give an angle'):
        parse_quantity("45 dg", "angle", "rotate")


@given(st.floats(1e-5, 9e5))
def test_a_length_as_it_is_shown_can_be_read_again(length: float) -> None:
    assert parse_quantity(length_text(length), "length", "length") == pytest.approx(length, rel=5.01e-3)  # three digits


@pytest.mark.parametrize(
    ("length", "text"), [(1 / 12, "83.3 mm"), (20.0, "20 m"), (0.99999, "1 m"), (0.9994, "999 mm"), (1234.0, "1230 m")]
)
def test_a_length_is_shown_in_the_unit_that_reads_well(length: float, text: str) -> None:
    assert length_text(length) == text


@pytest.mark.parametrize(("value", "written"), [(30, "30 deg"), ("-7", "-7 deg"), (6.31, "6.31 deg")])
def test_degrees_without_their_unit_are_no_radians(value: object, written: str) -> None:
    with pytest.raises(InputError, match=f'= .*: a plain number is in radians, .* full turn; write "{written}"'):
        parse_quantity(value, "angle", "layout.rotate")


@pytest.mark.parametrize(
    ("shares", "words"),
    [
        ([0.8214], "at 82 %"),
        ([0.2, 0.344], "at 20 % and 34 %"),
        ([0.016, 0.2, 0.344, 0.998], "at 2 %, 20 %, 34 % and 99 %"),
        ([0.2, 0.3, 0.4, 0.5, 0.938], "5 times from 20 % to 94 %"),
    ],
)
def test_places_on_a_way_are_named_or_counted(shares: list[float], words: str) -> None:
    assert places_text(shares) == words


@pytest.mark.parametrize("unit", RANGES)
def test_a_size_has_a_range_and_a_coordinate_may_be_of_round_off(unit: str) -> None:
    least, most = RANGES[unit]
    for size in (least, most):
        assert positive("size", size, unit) == number("size", size, unit) == not_negative("size", size, unit) == size
    assert number("coordinate", -1e-300, unit) == -1e-300
    assert not_negative("size", 0, unit) == 0.0
    for check, size, said in (
        (positive, 0.99 * least, "at least"), (positive, 1.01 * most, "at most"), (number, 1.01 * most, "at most"),
        (number, -1.01 * most, "at least"), (not_negative, 1.01 * most, "at most"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=f"size must be {said} .*, not "):
            check("size", size, unit)


@pytest.mark.parametrize("kind", get_args(Kind))
def test_every_kind_of_quantity_has_the_range_of_its_unit(kind: Kind) -> None:
    most = RANGES[_KINDS[kind].si][1]
    if kind != "angle":  # which is reduced to one turn
        assert parse_quantity(most, kind, "key") == most
    with pytest.raises(InputError, match=r"key = .*: must be at most"):
        parse_quantity(1.01 * most, kind, "key")


def test_the_ranges_are_those_of_the_documentation() -> None:
    rows = re.findall(r"\| `?([^|`]*)`? \| ([\d.e+-]+) \| ([\d.e+-]+) \|", (ROOT / "docs" / "limits.md").read_text())
    said = {unit.replace(" ", "").replace("(none)", ""): (float(low), float(high)) for unit, low, high in rows}
    assert said == RANGES


def test_what_is_shown_is_short_however_long_or_deep_the_value_is() -> None:
    itself: list[object] = []
    itself.append(itself)
    for value in ("x" * 10**6, [1] * 10**6, itself, {"a" * 1000: 1}, 10**5000, Fraction(10**5000, 3)):
        assert len(shown(value)) <= 80
