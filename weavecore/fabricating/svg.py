"""Drawings as SVG, 1:1: one unit of it is a millimetre."""

from __future__ import annotations

from xml.sax.saxutils import escape

from weavecore.fabricating.drawing import LAYERS, LEFT, MIDDLE, RIGHT, Drawing, Line, Text

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
