"""The sheets that templates lie on: one long one for plotters, and pages for printers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from weavecore.fabricating.drawing import SCALE, Drawing
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.templates import NAME_WIDTH, ROW, Strip, draw_scale, draw_strip, sections_of
from weavecore.fabricating.workshop import PAPERS

_MARGIN, _FOOT = 12.0, 14.0
_NOTE = 2.4
_ROUND = 50.0
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
    """The pieces in sections on pages, each with a scale bar; a page at least."""
    width, height = PAPERS[paper]
    longest = (width - 2 * (NAME_WIDTH + _MARGIN)) // _ROUND * _ROUND
    per_page = int((height - 2 * _MARGIN - _FOOT) // ROW)
    sections = [section for strip in strips for section in sections_of(strip, longest)]
    pages = []
    count = max(1, -(-len(sections) // per_page))
    for number in range(count):
        drawing = Drawing()
        for k, section in enumerate(sections[number * per_page : (number + 1) * per_page]):
            draw_strip(drawing, plan, section, NAME_WIDTH + _MARGIN, height - _MARGIN - ROW * (k + 0.5))
        draw_scale(drawing, NAME_WIDTH + _MARGIN, _MARGIN, statement)
        drawing.text(
            width - _MARGIN,
            height - _MARGIN,
            f"page {number + 1} of {count}, print at 100 %",
            _NOTE,
            SCALE,
            anchor="right",
        )
        pages.append(Sheet(drawing, width, height))
    return pages
