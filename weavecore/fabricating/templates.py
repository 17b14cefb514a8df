"""Templates: pieces drawn straight, 1:1, with a tick at every mark.

A rod is laid on its outline.  Above a tick stands what crosses there, ``over A12`` where the rod runs over A12, and
below it the distance from the start of the piece in millimetres; the rod is seen from outside of the surface.
Texts that would lie on each other are moved aside, with a line to their tick.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Optional

from weavecore.fabricating.drawing import (
    LABELS,
    LEFT,
    MIDDLE,
    NAMES,
    RIGHT,
    ROD,
    SCALE,
    SPLICES,
    TICKS,
    Drawing,
)
from weavecore.fabricating.marks import OVER, UNDER, Mark
from weavecore.fabricating.pieces import Piece, Splice
from weavecore.fabricating.plan import RodPlan

ROW = 42.0
"""Height of a piece with its texts."""

SCALE_BAR = 100.0

_TICK, _SHORT_TICK, _LEADER, _NAME, _SMALL = 4.0, 2.0, 2.5, 4.2, 2.6
_LINE = 3.6
"""From one turned line of text to the next."""

NAME_WIDTH = 28.0
"""Room for the name of a piece at each of its ends."""


@dataclass(frozen=True)
class Strip:
    """A piece with its marks, and what of it is drawn.

    Parameters
    ----------
    piece : Piece
    marks : tuple of Mark
    low, high : float
        From its start.
    """

    piece: Piece
    marks: tuple[Mark, ...]
    low: float
    high: float


def strips_of(pieces: Sequence[Piece], marks: Sequence[Mark]) -> list[Strip]:
    """One whole strip for each piece."""
    of_piece: dict[str, list[Mark]] = {piece.id: [] for piece in pieces}
    for mark in marks:
        of_piece[mark.piece.id].append(mark)
    return [Strip(piece, tuple(of_piece[piece.id]), 0.0, piece.cut_length) for piece in pieces]


def sections_of(strip: Strip, longest: float) -> list[Strip]:
    """The strip in parts that fit on a page: full ones, and the rest."""
    sections = []
    low = 0.0
    while low < strip.high:
        high = min(low + longest, strip.high)
        # A mark on the seam is drawn once, in the section that begins there.
        is_last = high == strip.high
        marks = tuple(m for m in strip.marks if low <= m.at and (m.at < high or is_last))
        sections.append(Strip(strip.piece, marks, low, high))
        low = high
    return sections


def draw_strip(drawing: Drawing, plan: RodPlan, strip: Strip, x: float, y: float) -> None:
    """Draw a strip whose left end is at ``x`` and whose axis is at ``y``."""
    half = max(plan.diameter / 2, 0.5)
    shift = x - strip.low
    right = strip.high + shift
    drawing.line(x, y + half, right, y + half, ROD)
    drawing.line(x, y - half, right, y - half, ROD)
    is_first, is_last = strip.low == 0.0, strip.high == strip.piece.cut_length
    for at, is_end in ((x, is_first), (right, is_last)):
        drawing.line(at, y - half - 1, at, y + half + 1, ROD, width=0.35 if is_end else 0.18, dashed=not is_end)
    _draw_names(drawing, strip, x, right, y, is_first, is_last)
    _draw_splices(drawing, strip, shift, y, half)
    _draw_ticks(drawing, plan, strip, shift, y)


def draw_scale(drawing: Drawing, x: float, y: float, statement: str) -> None:
    """Draw the scale bar from ``x``, and beside it what the file states."""
    drawing.line(x, y, x + SCALE_BAR, y, SCALE, width=0.35)
    for k in range(11):
        drawing.line(x + 10 * k, y, x + 10 * k, y + (3.0 if k % 5 == 0 else 1.8), SCALE)
    drawing.text(x, y - 3.6, "0", _SMALL, SCALE, anchor=MIDDLE)
    drawing.text(x + SCALE_BAR, y - 3.6, "100 mm", _SMALL, SCALE, anchor=MIDDLE)
    for k, line in enumerate(statement.split("; input ")):
        drawing.text(x + SCALE_BAR + 12, y - _LINE * k, f"input {line}" if k else line, _SMALL, SCALE)


def _draw_names(
    drawing: Drawing, strip: Strip, x: float, right: float, y: float, is_first: bool, is_last: bool
) -> None:
    piece = strip.piece
    start = ["start", *_splice_note(piece.splice_start)] if is_first else [f"from {strip.low:.0f}"]
    end = [f"end, cut {piece.cut_length:.1f}", *_splice_note(piece.splice_end)]
    if not is_last:
        end = [f"goes on at {strip.high:.0f}"]
    for at, notes, anchor, aside in ((x, start, RIGHT, -3.0), (right, end, LEFT, 3.0)):
        drawing.text(at + aside, y + 0.8, piece.id, _NAME, NAMES, anchor=anchor, bold=True)
        for k, note in enumerate(notes):
            layer = SPLICES if k else NAMES
            drawing.text(at + aside, y - 3.4 - _LINE * k, note, _SMALL, layer, anchor=anchor)


def _splice_note(splice: Optional[Splice]) -> list[str]:
    return [f"{splice.kind} {splice.id}"] if splice else []


def _draw_splices(drawing: Drawing, strip: Strip, shift: float, y: float, half: float) -> None:
    piece = strip.piece
    ends = ((piece.splice_start, 0.0, True), (piece.splice_end, piece.cut_length, False))
    for splice, end, is_start in ends:
        if splice is None:
            continue
        low, high = (end, end + splice.reach) if is_start else (end - splice.reach, end)
        a, b = max(low, strip.low) + shift, min(high, strip.high) + shift
        if a < b:
            drawing.line(a, y - half - 1.0, b, y - half - 1.0, SPLICES, width=0.5)


def _draw_ticks(drawing: Drawing, plan: RodPlan, strip: Strip, shift: float, y: float) -> None:
    for mark in strip.marks:
        reach = _TICK if mark.crossings else _SHORT_TICK
        drawing.line(mark.at + shift, y - reach, mark.at + shift, y + reach, TICKS, width=0.25)
    # A node that a rod passes alone asks nothing of the workshop: a short tick without words.
    marks = [mark for mark in strip.marks if mark.crossings]
    ticks = [mark.at + shift for mark in marks]
    widths = [_LINE * len(mark.crossings) for mark in marks]
    places = spread(ticks, widths, low=strip.low + shift, high=strip.high + shift)
    for mark, tick, place in zip(marks, ticks, places):
        above, below = y + _TICK + _LEADER, y - _TICK - _LEADER
        drawing.line(tick, y + _TICK, place, above, LABELS)
        drawing.line(tick, y - _TICK, place, below, LABELS)
        first = place - _LINE * (len(mark.crossings) - 1) / 2 + _SMALL / 2 - 0.2
        for k, other in enumerate(mark.crossings):
            text = f"{OVER if other.is_over else UNDER} {plan.ids[other.rod]}"
            drawing.text(first + k * _LINE, above + 0.8, text, _SMALL, LABELS, turned=True, bold=other.is_over)
        at = f"{mark.at:.1f}"
        drawing.text(place + _SMALL / 2 - 0.2, below - 0.8, at, _SMALL, LABELS, turned=True, anchor=RIGHT)


def spread(wanted: Sequence[float], widths: Sequence[float], *, low: float, high: float) -> list[float]:
    """Places as near to the wanted ones, which rise, as can be without two of the widths lying on each other.

    Neighbours that would are put side by side about the mean of what they want (pool adjacent violators).
    Where there is room they keep between ``low`` and ``high``.
    """
    groups: list[list[float]] = []  # [sum of wanted starts, number, start offset at the end]
    edges = [0.0]
    for width in widths:
        edges.append(edges[-1] + width)
    for k, at in enumerate(wanted):
        start = at - widths[k] / 2 - edges[k]
        groups.append([start, 1.0])
        while len(groups) > 1 and groups[-2][0] / groups[-2][1] > groups[-1][0] / groups[-1][1]:
            total, count = groups.pop()
            groups[-1][0] += total
            groups[-1][1] += count
    starts = [total / count for total, count in groups for _ in range(int(count))]
    most = high - edges[-1]
    starts = [min(max(start, low), max(most, low)) for start in starts]
    return [start + edges[k] + widths[k] / 2 for k, start in enumerate(starts)]
