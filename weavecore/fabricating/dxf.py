"""Drawings as DXF R2010 in millimetres, by ezdxf."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager

from weavecore.fabricating.drawing import LAYERS, LEFT, MIDDLE, RIGHT, Drawing
from weavecore.fabricating.needed import need

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
