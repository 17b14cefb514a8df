"""What the report checks of the templates: their ticks, read back, are the marks.

The pieces are rows one `ROW` apart, the first at the top, and all begin at one x::

    row = round((y of the first row - y) / ROW),    distance from the start = x - x0
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Optional
from xml.etree import ElementTree as ET

import numpy as np

from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder
from weavecore.fabricating.template_files import import_optional
from weavecore.fabricating.templates import ROW, SCALE, SCALE_BAR, TICKS
from weavecore.geometry.arrays import Floats
from weavecore.polling import each, poll

_LIMIT = 0.01
"""How far a tick may be from its mark, and the scale bar from its length, in millimetres."""

_SVG = "{http://www.w3.org/2000/svg}"


def check_templates(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Check the ticks and the scale bars of the DXF and the SVG.

    Parameters
    ----------
    folder : WrittenFolder
    """
    wanted = _marks(folder)
    if "templates.dxf" in folder.files:
        lines = _read_dxf_lines(folder.files["templates.dxf"])
        yield _ticks_off("dxf", lines[TICKS], wanted)
        yield CheckResult("dxf_scale_bar_off_mm", _scale_off(lines[SCALE]), _LIMIT)
    if "templates.svg" in folder.files:
        lines = _read_svg_lines(folder.files["templates.svg"])
        yield _ticks_off("svg", lines[TICKS], wanted)
        yield CheckResult("svg_scale_bar_off_mm", _scale_off(lines[SCALE]), _LIMIT)


class _PolledBytes(io.BytesIO):
    """Bytes that are read line by line."""

    def readline(self, size: Optional[int] = -1, /) -> bytes:
        poll()
        return super().readline(size)


def _read_dxf_lines(content: bytes) -> dict[str, Floats]:
    """The lines (n, 4) of every layer of a DXF, as x, y, x, y with y up."""
    import_optional("ezdxf", "DXF")
    from ezdxf.addons import iterdxf

    lines: dict[str, list[tuple[float, ...]]] = {TICKS: [], SCALE: []}
    for line in each(iterdxf.single_pass_modelspace(_PolledBytes(content), types=["LINE"])):
        (a, b, _), (c, d, _) = line.dxf.start, line.dxf.end
        lines.setdefault(line.dxf.layer, []).append((a, b, c, d))
    return {layer: np.array(rows, np.float64).reshape(-1, 4) for layer, rows in lines.items()}


def _read_svg_lines(content: bytes) -> dict[str, Floats]:
    """The lines (n, 4) of every layer of an SVG, as x, y, x, y with y up."""
    root = ET.fromstring(content)
    lines = {}
    for group in root.iter(f"{_SVG}g"):
        if group.get("id"):
            rows = [
                [float(line.get(key, "nan")) for key in ("x1", "y1", "x2", "y2")]
                for line in each(group.iter(f"{_SVG}line"))
            ]
            lines[str(group.get("id"))] = np.array(rows, np.float64).reshape(-1, 4) * (1, -1, 1, -1)
    return lines


def _marks(folder: WrittenFolder) -> Floats:
    """(n, 2) row and distance from the start of every tick, by row."""
    marks, pieces = folder.table("marks"), folder.table("pieces")
    row = {piece: k for k, piece in enumerate(pieces["piece_id"])}
    ticks = {
        (row.get(piece, -1), int(number)): at
        for piece, number, at in zip(marks["piece_id"], marks["no"], marks.floats("from_start").tolist())
    }
    return np.array(sorted((key[0], at) for key, at in ticks.items()), np.float64).reshape(-1, 2)


def _ticks_off(name: str, lines: Floats, wanted: Floats) -> CheckResult:
    """How far ticks (n, 4) are from their marks, given as row and distance from the start (n, 2)."""
    invariant = f"{name}_tick_off_its_mark_mm"
    if len(lines) != len(wanted):
        return CheckResult(invariant, float("nan"), _LIMIT)
    if len(lines) == 0:
        return CheckResult(invariant, 0.0, _LIMIT)
    middle = (lines[:, 1] + lines[:, 3]) / 2
    row = np.round((middle.max() - middle) / ROW)
    order = np.lexsort([lines[:, 0], row])
    # A piece without a tick has an empty row; the first row found is that of the first piece with one.
    rows_off = np.abs(row[order] - (wanted[:, 0] - wanted[0, 0]))
    # x0 is 0 in the DXF and behind a margin in the SVG.
    shift = lines[order, 0] - wanted[:, 1]
    off = np.abs(shift - np.median(shift))
    return CheckResult(invariant, float(np.max(off + rows_off * ROW)), _LIMIT)


def _scale_off(lines: Floats) -> float:
    """How far the longest line of the scale bar is from its length."""
    length = np.linalg.norm(lines[:, :2] - lines[:, 2:], axis=1)
    return float(abs(length.max(initial=0.0) - SCALE_BAR))
