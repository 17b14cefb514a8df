"""Templates: pieces drawn straight, 1:1, with a tick at every mark.

A rod is laid on its outline.  Above a tick stands what crosses there, ``over A12`` where the rod runs over A12, and
below it the distance from the start of the piece in millimetres; the rod is seen from outside of the surface.
Texts that would lie on each other are moved aside, with a line to their tick.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Optional

from weavecore.fabricating.cut import Piece, Splice
from weavecore.fabricating.marks import OVER, UNDER, Mark
from weavecore.fabricating.plan import PAPERS, RodPlan

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


# ----------------------------------------------------------------------
# The sheets that templates lie on: one long one for plotters, and pages for printers.

_MARGIN, _FOOT = 9.0, 20.0
_NOTE = 2.6
_ROUND = 20.0
"""Sections of pieces are of round lengths."""


@dataclass(frozen=True)
class Sheet:
    """A drawing and its size in millimetres."""

    drawing: Drawing
    width: float
    height: float


def draw_roll(plan: RodPlan, strips: Sequence[Strip], statement: str) -> Sheet:
    """All pieces whole, one below the other; each begins at x = 0."""
    drawing = Drawing()
    for k, strip in enumerate(strips):
        draw_strip(drawing, plan, strip, 0.0, -ROW * (k + 0.5))
    draw_scale(drawing, 0.0, _FOOT, statement)
    longest = max([strip.high for strip in strips], default=0.0)
    return Sheet(drawing, longest + 2 * (NAME_WIDTH + _MARGIN), ROW * len(strips) + 2 * _FOOT + _MARGIN)


def to_corner(sheet: Sheet) -> Sheet:
    """The same sheet with its lower left corner at 0, for formats that have no negative coordinates."""
    return Sheet(
        sheet.drawing.moved(NAME_WIDTH + _MARGIN, sheet.height - 2 * _FOOT - _MARGIN / 2), sheet.width, sheet.height
    )


def draw_pages(plan: RodPlan, strips: Sequence[Strip], statement: str, paper: str) -> list[Sheet]:
    """The pieces on pages, long ones in sections and short ones beside each other; each page with a scale bar."""
    width, height = PAPERS[paper]
    rows = _fill_rows(strips, width - 2 * _MARGIN)
    per_page = int((height - _MARGIN - _FOOT) // ROW)
    pages = []
    count = max(1, -(-len(rows) // per_page))
    for number in range(count):
        drawing = Drawing()
        for k, row in enumerate(rows[number * per_page : (number + 1) * per_page]):
            for x, section in row:
                draw_strip(drawing, plan, section, _MARGIN + x, height - _MARGIN - ROW * (k + 0.5))
        draw_scale(drawing, NAME_WIDTH + _MARGIN, _MARGIN + 3.0, statement)
        note = f"page {number + 1} of {count}, print at 100 %"
        drawing.text(width - _MARGIN, _MARGIN - _NOTE, note, _NOTE, SCALE, anchor=RIGHT)
        pages.append(Sheet(drawing, width, height))
    return pages


def _fill_rows(strips: Sequence[Strip], width: float) -> list[list[tuple[float, Strip]]]:
    """Sections in their order, each with the x of its left end, in rows of a width."""
    longest = (width - 2 * NAME_WIDTH) // _ROUND * _ROUND
    rows: list[list[tuple[float, Strip]]] = []
    reached = width
    for strip in strips:
        for section in sections_of(strip, longest):
            need = section.high - section.low + 2 * NAME_WIDTH
            if reached + need > width:
                rows.append([])
                reached = 0.0
            rows[-1].append((reached + NAME_WIDTH, section))
            reached += need
    return rows


# ----------------------------------------------------------------------
# `Drawing`: lines and texts in millimetres, before they are of any format.
#
# x runs to the right and y up.  Layers: ``ROD`` outlines, ``TICKS`` marks, ``LABELS`` texts at the marks, ``NAMES`` of
# the pieces, ``SPLICES``, ``SCALE`` the scale bar and what the file states.

ROD, TICKS, LABELS, NAMES, SPLICES, SCALE = "ROD", "TICKS", "LABELS", "NAMES", "SPLICES", "SCALE"
LAYERS = {
    ROD: (120, 120, 120),
    TICKS: (0, 0, 0),
    LABELS: (0, 0, 0),
    NAMES: (0, 0, 0),
    SPLICES: (200, 56, 40),
    SCALE: (40, 96, 200),
}
"""Layers and their colours."""

LEFT, MIDDLE, RIGHT = "left", "middle", "right"


@dataclass(frozen=True)
class Line:
    """A straight line; dashed where it shows something that lies elsewhere."""

    x1: float
    y1: float
    x2: float
    y2: float
    layer: str
    width: float = 0.18
    dashed: bool = False


@dataclass(frozen=True)
class Text:
    """A text that begins, is centred or ends at a point on its base line, turned by 0 or 90 degrees."""

    x: float
    y: float
    text: str
    height: float
    layer: str
    anchor: str = LEFT
    turned: bool = False
    bold: bool = False


@dataclass
class Drawing:
    """What is drawn on one sheet."""

    lines: list[Line] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)

    def line(
        self, x1: float, y1: float, x2: float, y2: float, layer: str, *, width: float = 0.18, dashed: bool = False
    ) -> None:
        """Add a line."""
        self.lines.append(Line(x1, y1, x2, y2, layer, width, dashed))

    def text(
        self,
        x: float,
        y: float,
        text: str,
        height: float,
        layer: str,
        *,
        anchor: str = LEFT,
        turned: bool = False,
        bold: bool = False,
    ) -> None:
        """Add a text."""
        self.texts.append(Text(x, y, text, height, layer, anchor, turned, bold))

    def moved(self, x: float, y: float) -> Drawing:
        """The same drawing elsewhere."""
        return Drawing(
            [replace(one, x1=one.x1 + x, x2=one.x2 + x, y1=one.y1 + y, y2=one.y2 + y) for one in self.lines],
            [replace(one, x=one.x + x, y=one.y + y) for one in self.texts],
        )
