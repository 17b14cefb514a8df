"""The best variant: all rods bend, then fewest ends, then the spacing nearest to the wish."""

from __future__ import annotations

import pytest

from weavecore.errors import NoSurface
from weavecore.exploring import Row, choose_variant
from weavecore.exploring.evaluate import BEND, DIAMETER, ENDS, RODS
from weavecore.exploring.table import INPUTS


def row(number: int, *, bend: float, ends: int, spacing: float, error: str = "") -> Row:
    inputs = dict(zip(INPUTS, ("s", "all", f"{spacing:g}", "plain", "stock", "gfrp")))
    figures = {} if error else {BEND: bend, ENDS: ends, RODS: 40, DIAMETER: 1.5}
    return Row(number, inputs, figures, error, f"k{number}", "", "", "Millimeters")


ROWS = [
    row(1, bend=99.0, ends=0, spacing=30),
    row(2, bend=100.0, ends=6, spacing=30),
    row(3, bend=100.0, ends=4, spacing=60),
    row(4, bend=100.0, ends=4, spacing=20),
    row(5, bend=0, ends=0, spacing=30, error="DEGENERATE: thin"),
]


def test_rods_that_bend_come_before_ends_and_ends_before_the_wish() -> None:
    choice = choose_variant(ROWS, spacing=30)
    assert choice.best.number == 4  # 20 is nearer to 30 than 60, as a ratio.
    assert [one.number for one in choice.runners_up] == [3, 2, 1]
    assert choose_variant(ROWS, spacing=38).best.number == 3  # 22 above, but by a smaller ratio than 18 below.


def test_without_a_wish_the_first_of_equals_is_taken() -> None:
    assert choose_variant(ROWS).best.number == 3


def test_the_reason_is_one_line_that_names_what_decided() -> None:
    reason = choose_variant(ROWS, spacing=30).reason
    assert "\n" not in reason
    assert "all rods bend in 3 of 4 variants" in reason
    assert "4 inside" in reason
    assert "20 mm is nearest to 30 mm" in reason
    assert "99% bend, the most" in choose_variant(ROWS[:1]).reason


def test_a_table_without_weaves_gives_an_error_that_quotes_the_first() -> None:
    with pytest.raises(NoSurface, match="DEGENERATE: thin"):
        choose_variant(ROWS[4:])
