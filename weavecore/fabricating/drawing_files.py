"""Drawings as DXF, SVG and PDF, all in millimetres and free of dates.

DXF has x right and y up as the drawings do; SVG has y down, so y is replaced by height - y; PDF has points, so
pages are scaled by 72 / 25.4.  ``frame.dxf``, which ezdxf has made (``docs/generate/dxf_frame.py``), and reportlab are
the frame of a file: header, tables and fonts.  The entities are written as text, one after the other, because hundreds
of thousands of objects take these libraries minutes.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from html import escape
from importlib import import_module, resources
from typing import Any, Callable

import numpy as np

from weavecore.errors import Unsupported
from weavecore.fabricating.drawing import LEFT, MIDDLE, RIGHT, Drawing, DrawnLine, DrawnPath, DrawnText
from weavecore.geometry.arrays import Floats
from weavecore.polling import each, each_of_many

_N_OWN_LAYERS = 2
"""Layers of the frame."""

_MODEL_SPACE = "17"
"""Handle of the model space of the frame."""

_BLACK_OR_WHITE = 7
"""The colour index that is black on a white background and white on a black one."""

_LINE_WEIGHTS = (9, 13, 18, 25, 35, 50)
"""Those of DXF that the drawings come near, in hundredths of a millimetre."""

_ANCHORS = {LEFT: "start", MIDDLE: "middle", RIGHT: "end"}
_ALIGNMENTS = {LEFT: 0, MIDDLE: 1, RIGHT: 2}
"""Group 72 of a text of DXF."""

_HEIGHT_TO_SIZE = 1.39
"""Size of a sans-serif type over the height of its capitals: Helvetica's are 0.718 em high."""

_DASHES = (1.5, 1.0)
"""Dash and gap, in millimetres."""

_POINTS_PER_MM = 72 / 25.4


def encode_dxf(drawing: Drawing, statement: str) -> bytes:
    """Write a drawing as DXF R2010, 1:1 in millimetres in the model space.

    Parameters
    ----------
    drawing : Drawing
    statement : str
        Origin of the file, written as a custom property of the document.

    Returns
    -------
    bytes
    """
    first = int(_dxf_frame()[0], 16)
    layers = "".join(_dxf_layers(drawing, first))
    first += len(drawing.layers)
    entities = "".join(_dxf_entities(drawing, first))
    count = len(drawing.lines) + len(drawing.paths) + len(drawing.texts)
    filled = {
        "{HANDLE}": f"{first + count:X}",
        "{STATEMENT}": statement,
        "{N_LAYERS}": str(_N_OWN_LAYERS + len(drawing.layers)),
        "{LAYERS}": layers,
        "{ENTITIES}": entities,
    }
    parts = (filled.get(part, part).encode("utf-8", "backslashreplace") for part in _dxf_frame()[1:])
    return b"".join(parts)


@lru_cache(maxsize=1)
def _dxf_frame() -> tuple[str, ...]:
    """The first handle that is free, and the frame of a DXF, with its places to be filled as parts of their own."""
    text = resources.files("weavecore.fabricating").joinpath("frame.dxf").read_text("utf-8")
    handles = re.findall(r"\n *5\n([0-9A-F]+)\n", text)
    free = max(int(handle, 16) for handle in handles) + 1
    return (f"{free:X}", *re.split(r"(\{[A-Z_]+\}(?=\n|  0\n))", text))


def _dxf_layers(drawing: Drawing, handle: int) -> Iterator[str]:
    """The layers of a drawing as entries of the frame's table of layers, handles counting up."""
    for layer, colour in drawing.layers.items():
        red, green, blue = colour
        true_colour = f"420\n{red << 16 | green << 8 | blue}\n" if any(colour) else ""
        yield (
            f"0\nLAYER\n5\n{handle:X}\n330\n1\n100\nAcDbSymbolTableRecord\n100\nAcDbLayerTableRecord\n"
            f"2\n{layer}\n70\n0\n62\n{_BLACK_OR_WHITE}\n{true_colour}6\nContinuous\n370\n-3\n390\n13\n347\n21\n"
        )
        handle += 1


def _dxf_entities(drawing: Drawing, handle: int) -> Iterator[str]:
    """The group codes of every entity, handles counting up."""
    left, low = drawing.origin
    owner = _MODEL_SPACE
    for one in each_of_many(drawing.lines):
        style = "6\nDASHED\n" if one.is_dashed else ""
        yield (
            f"0\nLINE\n5\n{handle:X}\n330\n{owner}\n100\nAcDbEntity\n8\n{one.layer}\n{style}370\n{_weight(one.width)}\n"
            f"100\nAcDbLine\n10\n{one.x1 - left:.4f}\n20\n{one.y1 - low:.4f}\n30\n0.0\n"
            f"11\n{one.x2 - left:.4f}\n21\n{one.y2 - low:.4f}\n31\n0.0\n"
        )
        handle += 1
    for path in each_of_many(drawing.paths):
        points = _written("10\n%.4f\n20\n%.4f\n", path.points - drawing.origin)
        yield (
            f"0\nLWPOLYLINE\n5\n{handle:X}\n330\n{owner}\n100\nAcDbEntity\n8\n{path.layer}\n370\n{_weight(path.width)}\n"
            f"100\nAcDbPolyline\n90\n{len(path.points)}\n70\n0\n{points}"
        )
        handle += 1
    for text in each_of_many(drawing.texts):
        turn, x, y = 90.0 if text.is_turned else 0.0, f"{text.x - left:.4f}", f"{text.y - low:.4f}"
        align = _ALIGNMENTS[text.anchor]
        second = f"72\n{align}\n11\n{x}\n21\n{y}\n31\n0.0\n" if align else ""
        yield (
            f"0\nTEXT\n5\n{handle:X}\n330\n{owner}\n100\nAcDbEntity\n8\n{text.layer}\n100\nAcDbText\n"
            f"10\n{x}\n20\n{y}\n30\n0.0\n40\n{text.height}\n1\n{text.text}\n50\n{turn}\n7\nSANS\n{second}"
            "100\nAcDbText\n"
        )
        handle += 1


@lru_cache(maxsize=64)
def _weight(width: float) -> int:
    """The nearest line weight of DXF, in hundredths of a millimetre."""
    return min(_LINE_WEIGHTS, key=lambda weight: abs(weight - width * 100))


def encode_svg(drawing: Drawing, statement: str) -> bytes:
    """Write a drawing as SVG, 1:1: one user unit is a millimetre.

    Parameters
    ----------
    drawing : Drawing
        With y up, from 0 to its width and height; SVG has y down.
    statement : str
        Origin of the file, written as its title.

    Returns
    -------
    bytes
    """
    width, height = drawing.width, drawing.height
    size = f'width="{width:.3f}mm" height="{height:.3f}mm" viewBox="0 0 {width:.3f} {height:.3f}"'
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="Helvetica, Arial, sans-serif">',
        f"<title>{escape(statement, quote=False)}</title>",
        f'<rect width="{width:.3f}" height="{height:.3f}" fill="white"/>',
    ]
    lines, paths, texts = (_by(items, lambda one: one.layer) for items in (drawing.lines, drawing.paths, drawing.texts))
    for layer, colour in drawing.layers.items():
        rgb = "#{:02x}{:02x}{:02x}".format(*colour)
        parts.append(f'<g id="{layer}" stroke="{rgb}" fill="none">')
        parts += [_svg_line(one, height) for one in each_of_many(lines.get(layer, ()))]
        parts += [_svg_path(one, height) for one in each_of_many(paths.get(layer, ()))]
        parts.append(f'</g><g class="{layer}" fill="{rgb}">')
        parts += [_svg_text(one, height) for one in each_of_many(texts.get(layer, ()))]
        parts.append("</g>")
    return "\n".join([*parts, "</svg>\n"]).encode()


def _written(pattern: str, points: Floats) -> str:
    """Points (n, 2) by a pattern for each: all in one call."""
    return pattern * len(points) % tuple(points.ravel().tolist())


def _by(items: Iterable[Any], key: Callable[[Any], Any]) -> Mapping[Any, list[Any]]:
    """The items of each key, in their order."""
    found: dict[Any, list[Any]] = {}
    for one in each_of_many(items):
        found.setdefault(key(one), []).append(one)
    return found


def _svg_line(one: DrawnLine, height: float) -> str:
    dashes = f' stroke-dasharray="{_DASHES[0]:g} {_DASHES[1]:g}"' if one.is_dashed else ""
    return (
        f'<line x1="{one.x1:.3f}" y1="{height - one.y1:.3f}" x2="{one.x2:.3f}" y2="{height - one.y2:.3f}" '
        f'stroke-width="{one.width:g}"{dashes}/>'
    )


def _svg_path(one: DrawnPath, height: float) -> str:
    points = _written("%.3f,%.3f ", np.column_stack([one.points[:, 0], height - one.points[:, 1]]))
    return f'<polyline points="{points[:-1]}" stroke-width="{one.width:g}"/>'


def _svg_text(one: DrawnText, height: float) -> str:
    x, y = f"{one.x:.3f}", f"{height - one.y:.3f}"
    place = f'transform="translate({x} {y}) rotate(-90)"' if one.is_turned else f'x="{x}" y="{y}"'
    bold = ' font-weight="bold"' if one.bold else ""
    return (
        f'<text {place} font-size="{one.height * _HEIGHT_TO_SIZE:.2f}" text-anchor="{_ANCHORS[one.anchor]}"{bold}>'
        f"{escape(one.text, quote=False)}</text>"
    )


def encode_pdf(pages: Iterable[Drawing], title: str, statement: str) -> bytes:
    """Write drawings as PDF, 1:1, one a page; they may be made one after the other.

    Parameters
    ----------
    pages : iterable of Drawing
    title : str
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
    stream = io.BytesIO()
    with _as_binary():
        canvas = _new_canvas(stream, title, statement)
        for page in each(pages):
            _draw_page(canvas, page)
        canvas.save()
    return stream.getvalue()


@contextmanager
def _as_binary() -> Iterator[None]:
    """Leave out the coding of pages as ASCII, which takes longer than all the rest."""
    config = import_module("reportlab.rl_config")
    # mypy knows the module only where it is installed.
    before = config.useA85  # type: ignore[attr-defined]
    config.useA85 = 0  # type: ignore[attr-defined]
    try:
        yield
    finally:
        config.useA85 = before  # type: ignore[attr-defined]


def _new_canvas(stream: io.BytesIO, title: str, statement: str) -> Any:
    from reportlab.pdfgen.canvas import Canvas

    # Invariant: without a date and a random id.
    canvas: Any = Canvas(stream, invariant=1)
    canvas.setTitle(f"weavecore {title}")
    canvas.setSubject(statement)
    canvas.setCreator("weavecore")
    # Printers should not shrink the page to their margins.
    canvas.setViewerPreference("PrintScaling", "None")
    return canvas


def _draw_page(canvas: Any, page: Drawing) -> None:
    """Draw a page; lines of one kind are one path, and texts of one font one text object."""
    from reportlab.pdfbase.pdfmetrics import stringWidth

    canvas.setPageSize((page.width * _POINTS_PER_MM, page.height * _POINTS_PER_MM))
    canvas.scale(_POINTS_PER_MM, _POINTS_PER_MM)
    for (layer, width, is_dashed), lines in each(_by(page.lines, lambda one: one[4:]).items()):
        _set_stroke(canvas, page, layer, width, is_dashed)
        segments = [f"{x1:.3f} {y1:.3f} m {x2:.3f} {y2:.3f} l" for x1, y1, x2, y2, *_ in each_of_many(lines)]
        canvas.addLiteral("\n".join([*segments, "S"]))
    for (layer, width), paths in each(_by(page.paths, lambda one: one[1:]).items()):
        _set_stroke(canvas, page, layer, width, False)
        canvas.addLiteral("\n".join([*(_pdf_path(one) for one in each_of_many(paths)), "S"]))
    for (layer, bold, height), texts in each(_by(page.texts, lambda one: (one.layer, one.bold, one.height)).items()):
        font, size = "Helvetica-Bold" if bold else "Helvetica", height * _HEIGHT_TO_SIZE
        canvas.setFillColorRGB(*(part / 255 for part in page.layers[layer]))
        canvas.setFont(font, size)
        widths = (0.0 if one.anchor == LEFT else stringWidth(one.text, font, size) for one in texts)
        shown = [_pdf_text(one, width) for one, width in each_of_many(zip(texts, widths))]
        canvas.addLiteral("\n".join(["BT", *shown, "ET"]))
    canvas.showPage()


def _set_stroke(canvas: Any, page: Drawing, layer: str, width: float, is_dashed: bool) -> None:
    canvas.setStrokeColorRGB(*(part / 255 for part in page.layers[layer]))
    canvas.setLineWidth(width)
    canvas.setDash(list(_DASHES) if is_dashed else [])


def _pdf_path(one: DrawnPath) -> str:
    return (_written("%.3f %.3f m ", one.points[:1]) + _written("%.3f %.3f l ", one.points[1:]))[:-1]


def _pdf_text(one: DrawnText, width: float) -> str:
    """The operators that place and show a text of that width."""
    back = {LEFT: 0.0, MIDDLE: width / 2, RIGHT: width}[one.anchor]
    place = ("0 1 -1 0", one.x, one.y - back) if one.is_turned else ("1 0 0 1", one.x - back, one.y)
    text = one.text
    if not text.isascii() or any(sign in text for sign in "\\()"):
        # WinAnsi, the encoding of the standard fonts, is Windows' code page 1252.
        coded = text.encode("cp1252", "replace")
        text = "".join(chr(c) if 32 <= c < 127 and chr(c) not in "\\()" else f"\\{c:03o}" for c in coded)
    return "{} {:.3f} {:.3f} Tm ({}) Tj".format(*place, text)


def import_optional(library: str, template: str) -> Any:
    """Import a library that only some drawings need.

    Parameters
    ----------
    library : str
    template : str
        The kind of file, named in the error.

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
