"""Drawings as DXF (by ezdxf), SVG and PDF (by reportlab), all 1:1 in millimetres and free of dates.

DXF has x right and y up as the drawings do; SVG has y down, so y is replaced by height - y; PDF has points, so
pages are scaled by 72 / 25.4.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any
from xml.sax.saxutils import escape

from weavecore.errors import Unsupported
from weavecore.fabricating.templates import LAYERS, LEFT, MIDDLE, RIGHT, DrawnLine, DrawnText, TemplateDrawing
from weavecore.polling import each, poll

_MILLIMETRES = 4
"""$INSUNITS of DXF."""

_METRIC = 1
"""$MEASUREMENT of DXF: line types and hatches in metric units."""

_BLACK_OR_WHITE = 7
"""The colour index that is black on a white background and white on a black one."""

_LINE_WEIGHTS = (9, 13, 18, 25, 35, 50)
"""Those of DXF that the drawings come near, in hundredths of a millimetre."""

_ANCHORS = {LEFT: "start", MIDDLE: "middle", RIGHT: "end"}

_HEIGHT_TO_SIZE = 1.39
"""Size of a sans-serif type over the height of its capitals: Helvetica's are 0.718 em high."""

_DASHES = (1.5, 1.0)
"""Dash and gap, in millimetres."""

_POINTS_PER_MM = 72 / 25.4


def encode_dxf(drawing: TemplateDrawing, statement: str) -> bytes:
    """Write a drawing as DXF R2010, 1:1 in millimetres in the model space.

    Parameters
    ----------
    drawing : Drawing
    statement : str
        Origin of the file, written as a custom property of the document.

    Returns
    -------
    bytes

    Raises
    ------
    Unsupported
        Where ezdxf is not installed.
    """
    ezdxf = import_optional("ezdxf", "DXF")
    from ezdxf.enums import TextEntityAlignment

    alignments = {
        LEFT: TextEntityAlignment.LEFT,
        MIDDLE: TextEntityAlignment.CENTER,
        RIGHT: TextEntityAlignment.RIGHT,
    }
    with _without_dates(ezdxf):
        document = ezdxf.new("R2010", setup=["linetypes"])
        document.header["$INSUNITS"] = _MILLIMETRES
        document.header["$MEASUREMENT"] = _METRIC
        document.header.custom_vars.append("weavecore", statement)
        document.styles.add("SANS", font="arial.ttf")
        for layer, colour in LAYERS.items():
            entry = document.layers.add(layer, color=_BLACK_OR_WHITE)
            if any(colour):
                entry.rgb = colour
        space = document.modelspace()
        for line in each(drawing.lines):
            attributes = {"layer": line.layer, "lineweight": _line_weight(line.width)}
            if line.is_dashed:
                attributes["linetype"] = "DASHED"
            space.add_line((line.x1, line.y1), (line.x2, line.y2), dxfattribs=attributes)
        for text in each(drawing.texts):
            entity = space.add_text(
                text.text,
                height=text.height,
                rotation=90.0 if text.is_turned else 0.0,
                dxfattribs={"layer": text.layer, "style": "SANS"},
            )
            entity.set_placement((text.x, text.y), align=alignments[text.anchor])
        _sort_classes(document)
        stream = _PolledText()
        document.write(stream)
    return stream.getvalue().encode(document.output_encoding, "dxfreplace")


class _PolledText(io.StringIO):
    """A text that is written in many small parts."""

    def write(self, text: str, /) -> int:
        poll()
        return super().write(text)


def _line_weight(width: float) -> int:
    """The nearest line weight of DXF, in hundredths of a millimetre."""
    return min(_LINE_WEIGHTS, key=lambda weight: abs(weight - width * 100))


def _sort_classes(document: Any) -> None:
    """Sort the CLASSES section: ezdxf fills it from a set, whose order changes with the hash seed of the process."""
    classes = document.classes
    classes.add_required_classes(document.dxfversion)
    classes.classes = dict(sorted(classes.classes.items()))


@contextmanager
def _without_dates(ezdxf: object) -> Iterator[None]:
    """Leave the date and random ids out of the file, so that the same input gives the same bytes."""
    options = getattr(ezdxf, "options")  # noqa: B009 - mypy knows the module only where it is installed.
    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before


def encode_svg(drawing: TemplateDrawing, width: float, height: float, statement: str) -> bytes:
    """Write a drawing as SVG, 1:1: one user unit is a millimetre.

    Parameters
    ----------
    drawing : Drawing
        With y up; SVG has y down.
    width, height : float
        In millimetres.
    statement : str
        Origin of the file, written as its title.

    Returns
    -------
    bytes
    """
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
        parts += [_svg_line(one, height) for one in drawing.lines if one.layer == layer]
        parts.append(f'</g><g class="{layer}" fill="{rgb}">')
        parts += [_svg_text(one, height) for one in drawing.texts if one.layer == layer]
        parts.append("</g>")
    return "\n".join([*parts, "</svg>\n"]).encode()


def _svg_line(one: DrawnLine, height: float) -> str:
    dashes = f' stroke-dasharray="{_DASHES[0]:g} {_DASHES[1]:g}"' if one.is_dashed else ""
    return (
        f'<line x1="{one.x1:.3f}" y1="{height - one.y1:.3f}" x2="{one.x2:.3f}" y2="{height - one.y2:.3f}" '
        f'stroke-width="{one.width:g}"{dashes}/>'
    )


def _svg_text(one: DrawnText, height: float) -> str:
    x, y = f"{one.x:.3f}", f"{height - one.y:.3f}"
    place = f'transform="translate({x} {y}) rotate(-90)"' if one.is_turned else f'x="{x}" y="{y}"'
    bold = ' font-weight="bold"' if one.bold else ""
    return (
        f'<text {place} font-size="{one.height * _HEIGHT_TO_SIZE:.2f}" text-anchor="{_ANCHORS[one.anchor]}"{bold}>'
        f"{escape(one.text)}</text>"
    )


def encode_pdf(pages: Sequence[TemplateDrawing], width: float, height: float, statement: str) -> bytes:
    """Write drawings as PDF, 1:1, one a page.

    Parameters
    ----------
    pages : sequence of TemplateDrawing
    width, height : float
        Of the pages, in millimetres.
    statement : str
        Origin of the file, written as its subject.

    Returns
    -------
    bytes

    Raises
    ------
    Unsupported
        Where reportlab is not installed.
    """
    import_optional("reportlab", "PDF")
    from reportlab.pdfgen.canvas import Canvas

    stream = io.BytesIO()
    # Invariant: without a date and a random id.
    canvas: Any = Canvas(stream, pagesize=(width * _POINTS_PER_MM, height * _POINTS_PER_MM), invariant=1)
    canvas.setTitle("weavecore templates")
    canvas.setSubject(statement)
    canvas.setCreator("weavecore")
    # Printers should not shrink the page to their margins.
    canvas.setViewerPreference("PrintScaling", "None")
    for page in pages:
        canvas.scale(_POINTS_PER_MM, _POINTS_PER_MM)
        for line in each(page.lines):
            _pdf_line(canvas, line)
        for text in each(page.texts):
            _pdf_text(canvas, text)
        canvas.showPage()
    canvas.save()
    return stream.getvalue()


def _pdf_line(canvas: Any, line: DrawnLine) -> None:
    canvas.setStrokeColorRGB(*(part / 255 for part in LAYERS[line.layer]))
    canvas.setLineWidth(line.width)
    canvas.setDash(list(_DASHES) if line.is_dashed else [])
    canvas.line(line.x1, line.y1, line.x2, line.y2)


def _pdf_text(canvas: Any, text: DrawnText) -> None:
    canvas.setFillColorRGB(*(part / 255 for part in LAYERS[text.layer]))
    canvas.setFont("Helvetica-Bold" if text.bold else "Helvetica", text.height * _HEIGHT_TO_SIZE)
    canvas.saveState()
    canvas.translate(text.x, text.y)
    if text.is_turned:
        canvas.rotate(90)
    draw = {MIDDLE: canvas.drawCentredString, RIGHT: canvas.drawRightString}.get(text.anchor, canvas.drawString)
    draw(0, 0, text.text)
    canvas.restoreState()


def import_optional(library: str, template: str) -> Any:
    """Import a library that only some templates need.

    Parameters
    ----------
    library : str
    template : str
        The kind of template, named in the error.

    Returns
    -------
    module

    Raises
    ------
    Unsupported
        Where it is not installed, or not for this version of Python.
    """
    try:
        return import_module(library)
    except ImportError as error:
        raise Unsupported(
            f"{template} templates need {library}, which could not be imported: {str(error).splitlines()[0]}",
            remedy='Install it with pip install "weavecore[fabricate]", or use --templates svg or --templates none.',
        ) from None
