"""Drawings as PDF, 1:1, a page each, by reportlab."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

from weavecore.fabricating.drawing import LAYERS, MIDDLE, RIGHT, Drawing, Line, Text
from weavecore.fabricating.needed import need

POINTS_PER_MM = 72 / 25.4
_HEIGHT_TO_SIZE = 1.39


def encode_pdf(pages: Sequence[Drawing], width: float, height: float, statement: str) -> bytes:
    """The bytes of a PDF file with pages of the given size in millimetres."""
    need("reportlab", "PDF")
    from reportlab.pdfgen.canvas import Canvas

    stream = io.BytesIO()
    # Invariant: without the date and a random id.
    canvas: Any = Canvas(stream, pagesize=(width * POINTS_PER_MM, height * POINTS_PER_MM), invariant=1)
    canvas.setTitle("weavecore templates")
    canvas.setSubject(statement)
    canvas.setCreator("weavecore")
    # Printers are told not to shrink the page to their margins.
    canvas.setViewerPreference("PrintScaling", "None")
    for page in pages:
        canvas.scale(POINTS_PER_MM, POINTS_PER_MM)
        for line in page.lines:
            _draw_line(canvas, line)
        for text in page.texts:
            _draw_text(canvas, text)
        canvas.showPage()
    canvas.save()
    return stream.getvalue()


def _draw_line(canvas: Any, line: Line) -> None:
    canvas.setStrokeColorRGB(*(part / 255 for part in LAYERS[line.layer]))
    canvas.setLineWidth(line.width)
    canvas.setDash([1.5, 1] if line.dashed else [])
    canvas.line(line.x1, line.y1, line.x2, line.y2)


def _draw_text(canvas: Any, text: Text) -> None:
    canvas.setFillColorRGB(*(part / 255 for part in LAYERS[text.layer]))
    canvas.setFont("Helvetica-Bold" if text.bold else "Helvetica", text.height * _HEIGHT_TO_SIZE)
    canvas.saveState()
    canvas.translate(text.x, text.y)
    if text.turned:
        canvas.rotate(90)
    draw = {MIDDLE: canvas.drawCentredString, RIGHT: canvas.drawRightString}.get(text.anchor, canvas.drawString)
    draw(0, 0, text.text)
    canvas.restoreState()
