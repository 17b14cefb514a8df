"""Drawings as DXF R2010 in millimetres, by ezdxf."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any
from xml.sax.saxutils import escape

from weavecore.fabricating.optional_libraries import need
from weavecore.fabricating.templates import LAYERS, LEFT, MIDDLE, RIGHT, Drawing, Line, Text

_MILLIMETRES = 4
_BLACK_OR_WHITE = 7
"""The colour that is black on a white screen and white on a black one."""

_HATCH_OF_A_MILLIMETRE = 100


def encode_dxf(drawing: Drawing, statement: str) -> bytes:
    """The bytes of a DXF file; the drawing lies in the model space, 1:1."""
    ezdxf = need("ezdxf", "DXF")
    from ezdxf.enums import TextEntityAlignment

    alignments = {
        LEFT: TextEntityAlignment.LEFT,
        MIDDLE: TextEntityAlignment.CENTER,
        RIGHT: TextEntityAlignment.RIGHT,
    }
    with _without_dates(ezdxf):
        document = ezdxf.new("R2010", setup=["linetypes"])
        document.header["$INSUNITS"] = _MILLIMETRES
        document.header["$MEASUREMENT"] = 1
        document.header.custom_vars.append("weavecore", statement)
        document.styles.add("SANS", font="arial.ttf")
        for layer, colour in LAYERS.items():
            entry = document.layers.add(layer, color=_BLACK_OR_WHITE)
            if any(colour):
                entry.rgb = colour
        space = document.modelspace()
        for line in drawing.lines:
            how = {"layer": line.layer, "lineweight": _line_weight(line.width)}
            if line.dashed:
                how["linetype"] = "DASHED"
            space.add_line((line.x1, line.y1), (line.x2, line.y2), dxfattribs=how)
        for text in drawing.texts:
            entity = space.add_text(
                text.text,
                height=text.height,
                rotation=90.0 if text.turned else 0.0,
                dxfattribs={"layer": text.layer, "style": "SANS"},
            )
            entity.set_placement((text.x, text.y), align=alignments[text.anchor])
        stream = io.StringIO()
        document.write(stream)
    return stream.getvalue().encode(document.output_encoding, "dxfreplace")


def _line_weight(width: float) -> int:
    """The nearest of the weights that DXF knows, in hundredths of a millimetre."""
    return min((9, 13, 18, 25, 35, 50), key=lambda weight: abs(weight - width * _HATCH_OF_A_MILLIMETRE))


@contextmanager
def _without_dates(ezdxf: object) -> Iterator[None]:
    """Let the file not tell when it was written: the same input gives the same bytes."""
    options = getattr(ezdxf, "options")  # noqa: B009 - the module is not known where it is not installed.
    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before


# ----------------------------------------------------------------------
# Drawings as SVG, 1:1: one unit of it is a millimetre.

_ANCHORS = {LEFT: "start", MIDDLE: "middle", RIGHT: "end"}
_HEIGHT_TO_SIZE = 1.39
"""Size of a sans-serif type over the height of its capitals."""


def encode_svg(drawing: Drawing, width: float, height: float, statement: str) -> bytes:
    """The bytes of an SVG file of the given size in millimetres; y runs up in the drawing."""
    size = f'width="{width:.3f}mm" height="{height:.3f}mm" viewBox="0 0 {width:.3f} {height:.3f}"'
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="Helvetica, Arial, sans-serif">',
        f"<title>{escape(statement)}</title>",
        f'<rect width="{width:.3f}" height="{height:.3f}" fill="white"/>',
    ]
    for layer, colour in LAYERS.items():
        rgb = "#{:02x}{:02x}{:02x}".format(*colour)
        parts.append(f'<g id="{layer}" stroke="{rgb}" fill="none">')
        parts += [_line(one, height) for one in drawing.lines if one.layer == layer]
        parts.append(f'</g><g class="{layer}" fill="{rgb}">')
        parts += [_text(one, height) for one in drawing.texts if one.layer == layer]
        parts.append("</g>")
    return "\n".join([*parts, "</svg>\n"]).encode()


def _line(one: Line, height: float) -> str:
    dashes = ' stroke-dasharray="1.5 1"' if one.dashed else ""
    return (
        f'<line x1="{one.x1:.3f}" y1="{height - one.y1:.3f}" x2="{one.x2:.3f}" y2="{height - one.y2:.3f}" '
        f'stroke-width="{one.width:g}"{dashes}/>'
    )


def _text(one: Text, height: float) -> str:
    x, y = f"{one.x:.3f}", f"{height - one.y:.3f}"
    place = f'transform="translate({x} {y}) rotate(-90)"' if one.turned else f'x="{x}" y="{y}"'
    bold = ' font-weight="bold"' if one.bold else ""
    return (
        f'<text {place} font-size="{one.height * _HEIGHT_TO_SIZE:.2f}" text-anchor="{_ANCHORS[one.anchor]}"{bold}>'
        f"{escape(one.text)}</text>"
    )


# ----------------------------------------------------------------------
# Drawings as PDF, 1:1, a page each, by reportlab.

POINTS_PER_MM = 72 / 25.4


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
