"""Lengths as people type them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from weavecore.errors import Unsupported
from weavecore.units import METRES, SUFFIXES, Length, parse_length, with_unit


@pytest.mark.parametrize(
    ("text", "length"),
    [
        ("120", Length(120.0)),
        ("120mm", Length(120.0, "Millimeters")),
        (" 4.7 in ", Length(4.7, "Inches")),
        ("0.12m", Length(0.12, "Meters")),
        (".5ft", Length(0.5, "Feet")),
        ('3"', Length(3.0, "Inches")),
        ("1e2cm", Length(100.0, "Centimeters")),
        ("+2.", Length(2.0)),
    ],
)
def test_numbers_with_and_without_unit(text: str, length: Length) -> None:
    assert parse_length(text) == length


@pytest.mark.parametrize("text", ["", "mm", "12 parsecs", "1,5m", "0", "-1mm", "1e999", "nan", "inf", "1.2.3", "1m2"])
def test_what_is_no_length(text: str) -> None:
    with pytest.raises(ValueError, match=r"is not a length|must be above|is not a known unit"):
        parse_length(text)


def test_conversions_are_exact_where_they_can_be() -> None:
    assert parse_length("120mm").in_unit("Meters") == 0.12
    assert parse_length("0.12m").in_unit("Millimeters") == 120.0
    assert parse_length("1ft").in_unit("Inches") == pytest.approx(12.0, rel=1e-15)
    assert parse_length("7").in_unit("Feet") == 7.0
    assert parse_length("7").in_unit("None") == 7.0


@given(st.floats(1e-6, 1e6), st.sampled_from(sorted(set(SUFFIXES.values()))), st.sampled_from(sorted(METRES)))
def test_converting_there_and_back_changes_nothing(value: float, unit: str, other: str) -> None:
    there = Length(value, unit).in_unit(other)
    assert Length(there, other).in_unit(unit) == pytest.approx(value, rel=1e-14)
    assert there * METRES[other] == pytest.approx(value * METRES[unit], rel=1e-14)


def test_a_file_without_unit_cannot_take_one() -> None:
    with pytest.raises(Unsupported, match="120 mm cannot be converted"):
        parse_length("120mm").in_unit("None")


def test_lengths_are_shown_with_their_unit() -> None:
    assert with_unit(19790.3, "Millimeters") == "19,790 mm"
    assert with_unit(1.5, "None") == "1.5"
    assert with_unit(2.0, "NauticalMiles") == "2 nauticalmiles"
