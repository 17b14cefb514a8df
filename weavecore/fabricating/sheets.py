"""The sheets that templates lie on: one long one for plotters, and pages for printers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from weavecore.fabricating.drawing import RIGHT, SCALE, Drawing
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.templates import NAME_WIDTH, ROW, Strip, draw_scale, draw_strip, sections_of
from weavecore.fabricating.workshop import PAPERS

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
