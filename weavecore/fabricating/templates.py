"""Templates: pieces drawn straight, 1:1, with a tick at every mark.

::

              over A12 R  under B07 L    turned by 90 degrees, above the tick: which rod crosses, and whether it
                 ╲          │            goes on to the left or to the right
    A03-1  ╞══════╪═════════╪══════╡  A03-1      names at both ends
    start         │         ╲       end, cut 812.4
            J0041 120.0  J0053 304.5     below: code of the joint, distance from the start of the piece in mm

The rod is seen from outside of the surface.  x runs right and y up, in millimetres.  Labels that would overlap are
moved aside with a line to their tick, by the pool adjacent violators algorithm (isotonic regression), in time linear
in their number.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Optional

from weavecore.fabricating import marks as sides
from weavecore.fabricating.drawing import BOLD, LEFT, LINE_STEP, MIDDLE, RIGHT, TEXT_HEIGHT, THIN, Drawing
from weavecore.fabricating.marks import OVER, UNDER, Mark
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.splices import Piece, Splice
from weavecore.fabricating.workshop import PAPERS
from weavecore.polling import each

ROD, TICKS, LABELS, NAMES, SPLICES, SCALE = "ROD", "TICKS", "LABELS", "NAMES", "SPLICES", "SCALE"
LAYERS = {
    ROD: (120, 120, 120),
    TICKS: (0, 0, 0),
    LABELS: (0, 0, 0),
    NAMES: (0, 0, 0),
    SPLICES: (200, 56, 40),
    SCALE: (40, 96, 200),
}
"""Layers and their colours (red, green, blue from 0 to 255): outlines of rods, ticks at marks, texts at ticks, names of
pieces, splices, and the scale bar with the statement."""

_LEGEND = "This rod lies over or under the other, which goes on to the left (L) or right (R)."
_SIDES = {sides.LEFT: "L", sides.RIGHT: "R"}

ROW = 53.0
"""Height of a piece with its texts, in millimetres: ``under A123 R`` above, ``J0123 1234.5`` below; 5 fit on A3."""

SCALE_BAR = 100.0
"""Length of the scale bar in millimetres."""

_TICK, _SHORT_TICK, _LEADER = 3.0, 1.5, 2.0
"""Half the height of a tick, and of one without a crossing; height of the line from a tick to its label."""

_NAME_HEIGHT = 4.2
"""Height of capitals in millimetres of names, which are read from an arm's length."""

_LEAST_HALF_WIDTH = 0.5
"""Thin rods are drawn 1 mm thick, so that their two outlines do not merge on paper."""

_TICK_WIDTH, _SPLICE_WIDTH = 0.25, 0.5
"""Line widths in millimetres."""

_NAME_WIDTH = 28.0
"""Room for the name of a piece at each of its ends."""

_MARGIN, _FOOT = 9.0, 20.0
"""Margin of a page that printers leave white, and height of the scale bar with the statement."""

_SECTION_STEP = 20.0
"""Sections of pieces on pages are multiples of this length, in millimetres."""


@dataclass(frozen=True)
class TemplateStrip:
    """A piece with its marks, or a section of it.

    Parameters
    ----------
    piece : Piece
    marks : tuple of Mark
    low, high : float
        Ends of the section, from the start of the piece.
    """

    piece: Piece
    marks: tuple[Mark, ...]
    low: float
    high: float


def strips_of(pieces: Sequence[Piece], marks: Sequence[Mark]) -> list[TemplateStrip]:
    """One whole strip for each piece.

    Parameters
    ----------
    pieces : sequence of Piece
    marks : sequence of Mark
        Of these pieces.

    Returns
    -------
    list of TemplateStrip
    """
    of_piece: dict[str, list[Mark]] = {piece.id: [] for piece in pieces}
    for mark in marks:
        of_piece[mark.piece.id].append(mark)
    return [TemplateStrip(piece, tuple(of_piece[piece.id]), 0.0, piece.cut_length) for piece in pieces]


def draw_roll(plan: RodPlan, strips: Sequence[TemplateStrip], statement: str) -> Drawing:
    """Draw all pieces whole, one below the other, for plotters and lasers.

    Parameters
    ----------
    plan : RodPlan
    strips : sequence of TemplateStrip
    statement : str
        Origin of the file.

    Returns
    -------
    Drawing
        With the start of the pieces' axes at its origin: the k-th has its axis `ROW` (k + 1/2) below it.
    """
    longest = max([strip.high for strip in strips], default=0.0)
    drawing = Drawing(LAYERS, longest + 2 * (_NAME_WIDTH + _MARGIN), ROW * len(strips) + 2 * _FOOT + _MARGIN)
    x, top = _NAME_WIDTH + _MARGIN, drawing.height - 2 * _FOOT - _MARGIN / 2
    drawing.origin = (x, top)
    for k, strip in each(enumerate(strips)):
        _draw_strip(drawing, plan, strip, x, top - ROW * (k + 0.5))
    _draw_scale(drawing, x, top + _FOOT, statement)
    return drawing


def draw_pages(plan: RodPlan, strips: Sequence[TemplateStrip], statement: str, paper: str) -> Iterator[Drawing]:
    """Draw the pieces on pages, long ones in sections and short ones beside each other; each page with a scale bar.

    Parameters
    ----------
    plan : RodPlan
    strips : sequence of TemplateStrip
    statement : str
        Origin of the file.
    paper : str
        One of `PAPERS`.

    Yields
    ------
    Drawing
    """
    width, height = PAPERS[paper]
    rows = _fill_rows(strips, width - 2 * _MARGIN)
    per_page = int((height - _MARGIN - _FOOT) // ROW)
    count = max(1, -(-len(rows) // per_page))
    for number in range(count):
        drawing = Drawing(LAYERS, width, height)
        for k, row in each(enumerate(rows[number * per_page : (number + 1) * per_page])):
            for x, section in row:
                _draw_strip(drawing, plan, section, _MARGIN + x, height - _MARGIN - ROW * (k + 0.5))
        _draw_scale(drawing, _NAME_WIDTH + _MARGIN, _MARGIN + 3.0, statement)
        note = f"page {number + 1} of {count}, print at 100 %"
        drawing.text(width - _MARGIN, _MARGIN - TEXT_HEIGHT, note, TEXT_HEIGHT, SCALE, anchor=RIGHT)
        yield drawing


def _fill_rows(strips: Sequence[TemplateStrip], width: float) -> list[list[tuple[float, TemplateStrip]]]:
    """Sections in their order, each with the x of its left end, in rows of this width."""
    longest = (width - 2 * _NAME_WIDTH) // _SECTION_STEP * _SECTION_STEP
    rows: list[list[tuple[float, TemplateStrip]]] = []
    reached = width
    for strip in each(strips):
        for section in sections_of(strip, longest):
            need = section.high - section.low + 2 * _NAME_WIDTH
            if reached + need > width:
                rows.append([])
                reached = 0.0
            rows[-1].append((reached + _NAME_WIDTH, section))
            reached += need
    return rows


def sections_of(strip: TemplateStrip, longest: float) -> list[TemplateStrip]:
    """Divide a strip into sections of full length, and the rest.

    Parameters
    ----------
    strip : TemplateStrip
    longest : float
        Length of a section in millimetres.

    Returns
    -------
    list of TemplateStrip
    """
    sections = []
    low = 0.0
    while low < strip.high:
        high = min(low + longest, strip.high)
        # A mark between two sections is drawn once, in the section that begins there.
        is_last = high == strip.high
        marks = tuple(m for m in strip.marks if low <= m.at and (m.at < high or is_last))
        sections.append(TemplateStrip(strip.piece, marks, low, high))
        low = high
    return sections


def _draw_strip(drawing: Drawing, plan: RodPlan, strip: TemplateStrip, x: float, y: float) -> None:
    """Draw a strip whose left end is at ``x`` and whose axis is at ``y``."""
    half = max(float(plan.diameters[strip.piece.rod]) / 2, _LEAST_HALF_WIDTH)
    shift = x - strip.low
    right = strip.high + shift
    drawing.line(x, y + half, right, y + half, ROD)
    drawing.line(x, y - half, right, y - half, ROD)
    is_first, is_last = strip.low == 0.0, strip.high == strip.piece.cut_length
    for at, is_end in ((x, is_first), (right, is_last)):
        drawing.line(at, y - half - 1, at, y + half + 1, ROD, width=BOLD if is_end else THIN, is_dashed=not is_end)
    _draw_names(drawing, strip, x, right, y, is_first, is_last)
    _draw_splices(drawing, strip, shift, y, half)
    _draw_ticks(drawing, plan, strip, shift, y)


def _draw_names(
    drawing: Drawing, strip: TemplateStrip, x: float, right: float, y: float, is_first: bool, is_last: bool
) -> None:
    piece = strip.piece
    start = ["start", *_splice_note(piece.splice_start)] if is_first else [f"from {strip.low:.0f}"]
    end = [f"end, cut {piece.cut_length:.1f}", *_splice_note(piece.splice_end)]
    if not is_last:
        end = [f"goes on at {strip.high:.0f}"]
    for at, notes, anchor, aside in ((x, start, RIGHT, -3.0), (right, end, LEFT, 3.0)):
        drawing.text(at + aside, y + 0.8, piece.id, _NAME_HEIGHT, NAMES, anchor=anchor, bold=True)
        for k, note in enumerate(notes):
            layer = SPLICES if k else NAMES
            drawing.text(at + aside, y - 3.4 - LINE_STEP * k, note, TEXT_HEIGHT, layer, anchor=anchor)


def _splice_note(splice: Optional[Splice]) -> list[str]:
    return [f"{splice.kind} {splice.id}"] if splice else []


def _draw_splices(drawing: Drawing, strip: TemplateStrip, shift: float, y: float, half: float) -> None:
    piece = strip.piece
    ends = ((piece.splice_start, 0.0, True), (piece.splice_end, piece.cut_length, False))
    for splice, end, is_start in ends:
        if splice is None:
            continue
        low, high = (end, end + splice.reach) if is_start else (end - splice.reach, end)
        a, b = max(low, strip.low) + shift, min(high, strip.high) + shift
        if a < b:
            drawing.line(a, y - half - 1.0, b, y - half - 1.0, SPLICES, width=_SPLICE_WIDTH)


def _draw_ticks(drawing: Drawing, plan: RodPlan, strip: TemplateStrip, shift: float, y: float) -> None:
    for mark in strip.marks:
        reach = _TICK if mark.crossings else _SHORT_TICK
        drawing.line(mark.at + shift, y - reach, mark.at + shift, y + reach, TICKS, width=_TICK_WIDTH)
    # Where a rod passes a node alone there is nothing to tie: a short tick without a label.
    marks = [mark for mark in strip.marks if mark.crossings]
    ticks = [mark.at + shift for mark in marks]
    widths = [LINE_STEP * len(mark.crossings) for mark in marks]
    places = spread_labels(ticks, widths, low=strip.low + shift, high=strip.high + shift)
    for mark, tick, place in zip(marks, ticks, places):
        above, below = y + _TICK + _LEADER, y - _TICK - _LEADER
        drawing.line(tick, y + _TICK, place, above, LABELS)
        drawing.line(tick, y - _TICK, place, below, LABELS)
        first = place - LINE_STEP * (len(mark.crossings) - 1) / 2 + TEXT_HEIGHT / 2 - 0.2
        for k, other in enumerate(mark.crossings):
            side = OVER if other.is_over else UNDER
            text = f"{side} {plan.ids[other.rod]} {_SIDES[other.side]}"
            drawing.text(
                first + k * LINE_STEP, above + 0.8, text, TEXT_HEIGHT, LABELS, is_turned=True, bold=other.is_over
            )
        at = f"{mark.code} {mark.at:.1f}"
        drawing.text(place + TEXT_HEIGHT / 2 - 0.2, below - 0.8, at, TEXT_HEIGHT, LABELS, is_turned=True, anchor=RIGHT)


def spread_labels(wanted: Sequence[float], widths: Sequence[float], *, low: float, high: float) -> list[float]:
    """Move labels so that none overlap, as little as possible in the sum of squares (pool adjacent violators).

    Parameters
    ----------
    wanted : sequence of float
        Middles of the labels, rising.
    widths : sequence of float
    low, high : float
        Range that the labels stay in where it is wide enough.

    Returns
    -------
    list of float
        Middles of the labels.
    """
    groups: list[list[float]] = []  # Of labels that touch: the sum of their wanted starts, and their count.
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


def _draw_scale(drawing: Drawing, x: float, y: float, statement: str) -> None:
    """Draw the scale bar from ``x``, and the statement beside it."""
    drawing.line(x, y, x + SCALE_BAR, y, SCALE, width=BOLD)
    for k in range(11):
        drawing.line(x + 10 * k, y, x + 10 * k, y + (3.0 if k % 5 == 0 else 1.8), SCALE)
    drawing.text(x, y - 3.6, "0", TEXT_HEIGHT, SCALE, anchor=MIDDLE)
    drawing.text(x + SCALE_BAR, y - 3.6, "100 mm", TEXT_HEIGHT, SCALE, anchor=MIDDLE)
    stated, _, source = statement.partition("; input ")
    for k, line in enumerate((_LEGEND, stated, f"input {source}" if source else "")):
        drawing.text(x + SCALE_BAR + 12, y - LINE_STEP * (k - 1), line, TEXT_HEIGHT, SCALE)
