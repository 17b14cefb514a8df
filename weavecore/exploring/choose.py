"""Which variant of a table is the best for building.

By three rules, each decides where those before leave several: all rods bend, or else the more of them; the fewest rods
end inside; the spacing is nearest to the wish, as a ratio.  What is still equal is taken in the order of the table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Optional

from weavecore.errors import NoSurface
from weavecore.exploring.evaluate import BEND, DIAMETER, ENDS, RODS
from weavecore.exploring.table import Row
from weavecore.units import with_unit

_ALL = 100.0
_RUNNERS_UP = 3


@dataclass(frozen=True)
class Choice:
    """The best variant.

    Parameters
    ----------
    best : Row
    reason : str
        One line.
    runners_up : tuple of Row
        The next best.
    """

    best: Row
    reason: str
    runners_up: tuple[Row, ...]


def choose_variant(rows: Sequence[Row], *, spacing: Optional[float] = None, runners_up: int = _RUNNERS_UP) -> Choice:
    """Choose the best variant of a table; see the module.

    Parameters
    ----------
    rows : sequence of Row
    spacing : float, optional
        The spacing that is wished for, in the unit of the rows.
    runners_up : int
        How many others are named.

    Returns
    -------
    Choice

    Raises
    ------
    NoSurface
        Where no variant was woven.
    """
    woven = [row for row in rows if row.figures.get(BEND) is not None]
    if not woven:
        errors = sorted({row.error for row in rows if row.error})
        first = f": {errors[0]}" if errors else ""
        raise NoSurface(f"None of {len(rows)} variants was woven{first}", remedy="Explore with other options.")

    ranked = rank_rows(woven, spacing=spacing)
    return Choice(ranked[0], _reason(ranked, spacing), tuple(ranked[1 : 1 + runners_up]))


def rank_rows(rows: Sequence[Row], *, spacing: Optional[float] = None) -> list[Row]:
    """Order variants from the best on, those that were not woven last.

    Parameters
    ----------
    rows : sequence of Row
    spacing : float, optional
        The spacing that is wished for, in the unit of the rows.

    Returns
    -------
    list of Row
    """

    def rank(row: Row) -> tuple[bool, float, float, float, int]:
        if row.figures.get(BEND) is None:
            return True, 0.0, 0.0, 0.0, row.number
        off = abs(math.log(row.spacing / spacing)) if spacing else 0.0
        return False, -_figure(row, BEND), _figure(row, ENDS), off, row.number

    return sorted(rows, key=rank)


def describe_row(row: Row) -> str:
    """A variant in one line: its options and the figures that it is chosen by.

    Parameters
    ----------
    row : Row
    """
    inputs = row.inputs
    diameter = with_unit(_figure(row, DIAMETER), row.unit)
    parts = [f"{row.number}: {inputs['surface']}", inputs["pattern"], f"spacing {with_unit(row.spacing, row.unit)}"]
    parts += [f"{diameter} {inputs['material']}", f"borders {inputs['borders']}"]
    figures = f"{_figure(row, BEND):.3g}% of {_figure(row, RODS):,.0f} rods bend, {_ends(row)}"
    return f"{', '.join(parts)}: {figures}"


def _reason(ranked: Sequence[Row], spacing: Optional[float]) -> str:
    best, share = ranked[0], _figure(ranked[0], BEND)
    equal = [row for row in ranked if _figure(row, BEND) == share]
    fewest = [row for row in equal if _figure(row, ENDS) == _figure(best, ENDS)]
    if share == _ALL:
        first = f"all rods bend in {len(equal)} of {len(ranked)} variants"
    else:
        first = f"rods that cannot be bent remain in every variant; here {share:.3g}% bend, the most"
    reason = f"{first}; of these it has the fewest ends, {_ends(best)}"
    if len(fewest) > 1:
        near = f"nearest to {with_unit(spacing, best.unit)}" if spacing else "the first in the table"
        reason += f"; of {len(fewest)} such its spacing of {with_unit(best.spacing, best.unit)} is {near}"
    return reason


def _ends(row: Row) -> str:
    count = int(_figure(row, ENDS))
    return f"{count:,} inside"


def _figure(row: Row, name: str) -> float:
    value = row.figures.get(name)
    return math.nan if value is None else float(value)
