"""Labels for both ends of every piece, on sheets of A4 with 3 by 8 labels of 70 mm by 37 mm (a common label stock).

::

    ┌──────────────────────────────┐
    │ A03-1            start       │    piece, and which of its ends
    │ gfrp 3 mm, cut 812.4 mm      │    what it is cut from: material, diameter, length,
    │ bar S007, step 12            │    bar, and the step that sets it
    │ J0041 at 12.0 over L02       │    the joints nearest to this end
    │ J0053 at 71.5 under L03      │
    └──────────────────────────────┘
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from weavecore.fabricating.drawing import RIGHT, THIN, Drawing
from weavecore.fabricating.marks import OVER, UNDER, Mark
from weavecore.fabricating.nesting import Bar
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.steps import Step
from weavecore.fabricating.templates import TemplateStrip
from weavecore.polling import each

LABELS, CUT = "LABELS", "CUT"
LAYERS = {LABELS: (0, 0, 0), CUT: (170, 170, 170)}
"""Texts, and the outlines along which plain paper is cut."""

_PAGE = (210.0, 297.0)
_ACROSS, _DOWN = 3, 8
_WIDTH, _HEIGHT = 70.0, 37.0
"""Of a label; 8 of them are 1 mm short of A4, half of it on each side."""

_NAME, _TEXT, _STEP, _INSET = 4.6, 2.4, 4.3, 5.0
"""Heights of capitals of the name and of the other lines, distance of base lines, and the margin, in millimetres."""

_LONGEST_LINE = 36
"""Characters of a line that fits on a label."""

_JOINTS_SHOWN = 3
"""Joints on a label: enough to find the end of a piece on the weave."""


def draw_labels(
    plan: RodPlan, strips: Sequence[TemplateStrip], bars: Sequence[Bar], steps: Sequence[Step]
) -> Iterator[Drawing]:
    """Draw the labels of all pieces, bar by bar in the order of cutting.

    Parameters
    ----------
    plan : RodPlan
    strips : sequence of TemplateStrip
        Every piece with its marks.
    bars : sequence of Bar
    steps : sequence of Step

    Yields
    ------
    Drawing
        A page.
    """
    step_of: dict[str, int] = {}
    for step in steps:
        step_of.setdefault(step.piece.id, step.number)
    of_piece = {strip.piece.id: strip for strip in strips}
    texts = [
        _lines(plan, of_piece[piece.id], bar, step_of, is_start)
        for bar in each(bars)
        for piece in bar.pieces
        for is_start in (True, False)
    ]
    per_page = _ACROSS * _DOWN
    for first in each(range(0, max(len(texts), 1), per_page)):
        page = Drawing(LAYERS, *_PAGE)
        for k, lines in enumerate(texts[first : first + per_page]):
            row, column = divmod(k, _ACROSS)
            top = _PAGE[1] - (_PAGE[1] - _DOWN * _HEIGHT) / 2 - row * _HEIGHT
            _draw_label(page, column * _WIDTH, top, lines)
        yield page


def _lines(
    plan: RodPlan, strip: TemplateStrip, bar: Bar, step_of: Mapping[str, int], is_start: bool
) -> tuple[str, str, list[str]]:
    """The name of the piece, its end, and the other lines of a label."""
    piece = strip.piece
    splice = piece.splice_start if is_start else piece.splice_end
    lines = [
        f"{plan.weave.material.name} {plan.diameters[piece.rod]:.4g} mm, cut {piece.cut_length:.1f} mm",
        f"bar {bar.id}, step {step_of[piece.id]}" + (f", {splice.kind} {splice.id}" if splice else ""),
    ]
    marks = [mark for mark in strip.marks if mark.crossings]
    shown = marks[:_JOINTS_SHOWN] if is_start else marks[: -_JOINTS_SHOWN - 1 : -1]
    return piece.id, "start" if is_start else "end", lines + [_joint(plan, mark) for mark in shown]


def _joint(plan: RodPlan, mark: Mark) -> str:
    """The code and place of a joint, and as many of the rods there as fit on a line."""
    text = f"{mark.code} at {mark.at:.1f}"
    for one in mark.crossings:
        longer = f"{text} {OVER if one.is_over else UNDER} {plan.ids[one.rod]}"
        if len(longer) > _LONGEST_LINE:
            return f"{text} …"
        text = longer
    return text


def _draw_label(page: Drawing, x: float, top: float, lines: tuple[str, str, list[str]]) -> None:
    name, end, others = lines
    page.line(x, top, x + _WIDTH, top, CUT, width=THIN)
    page.line(x, top - _HEIGHT, x + _WIDTH, top - _HEIGHT, CUT, width=THIN)
    page.line(x, top, x, top - _HEIGHT, CUT, width=THIN)
    page.line(x + _WIDTH, top, x + _WIDTH, top - _HEIGHT, CUT, width=THIN)
    base = top - _INSET - _NAME
    page.text(x + _INSET, base, name, _NAME, LABELS, bold=True)
    page.text(x + _WIDTH - _INSET, base, end, _TEXT, LABELS, anchor=RIGHT)
    for k, line in enumerate(others):
        page.text(x + _INSET, base - 5.2 - _STEP * k, line, _TEXT, LABELS)
