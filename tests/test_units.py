"""Quantities with units become SI numbers, or one sentence that says what would do."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rodshell.errors import InputError
from rodshell.units import Kind, length_text, parse_quantity, places_text


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
