"""The frame of every DXF that weavecore writes: header, tables, blocks and objects without an entity.

    python docs/generate/dxf_frame.py

writes ``weavecore/fabricating/frame.dxf`` with ezdxf, R2010 in millimetres.  Names in braces stand where
`weavecore.fabricating.drawing_files` puts the statement, the layers, the entities and the next handle.
"""

from __future__ import annotations

import io
import re
from pathlib import Path

import ezdxf

TARGET = Path(__file__).resolve().parents[2] / "weavecore" / "fabricating" / "frame.dxf"
MILLIMETRES, METRIC = 4, 1
"""$INSUNITS and $MEASUREMENT of DXF: line types and hatches in metric units."""


def frame() -> str:
    """The text of the frame."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True  # No date and no random ids.
    try:
        document = ezdxf.new("R2010", setup=["linetypes"])
        document.header["$INSUNITS"] = MILLIMETRES
        document.header["$MEASUREMENT"] = METRIC
        document.header.custom_vars.append("weavecore", "{STATEMENT}")
        document.styles.add("SANS", font="arial.ttf")
        classes = document.classes
        classes.add_required_classes(document.dxfversion)
        # ezdxf fills the section from a set, whose order changes with the hash seed of the process.
        classes.classes = dict(sorted(classes.classes.items()))
        stream = io.StringIO()
        document.write(stream)
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
    text = stream.getvalue()
    text = replaced(text, r"(\$HANDSEED\n *5\n)[0-9A-F]+\n", r"\1{HANDLE}\n")
    text = replaced(text, r"(\n *2\nLAYER\n(?: *\d+\n[^\n]*\n){3} *70\n)2\n", r"\1{N_LAYERS}\n")
    text = replaced(
        text,
        r"(\n *2\nLAYER\n(?: *\d+\n(?!LAYER)[^\n]*\n)*? *0\nLAYER\n(?:[^\n]*\n)*?) *0\nENDTAB\n",
        r"\1{LAYERS}  0\nENDTAB\n",
    )
    return replaced(text, r"(\n *2\nENTITIES\n)", r"\1{ENTITIES}")


def replaced(text: str, pattern: str, by: str) -> str:
    """The text with its only match replaced."""
    text, count = re.subn(pattern, by, text)
    if count != 1:
        raise ValueError(f"{pattern!r} occurs {count} times")
    return text


if __name__ == "__main__":
    TARGET.write_text(frame(), encoding="utf-8", newline="\n")
