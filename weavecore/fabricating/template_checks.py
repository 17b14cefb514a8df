"""What the report checks of the templates: their ticks, read back, are the marks.

The pieces are rows one `ROW` apart, the first at the top, and all begin at one x::

    row = round((y of the first row - y) / ROW),    distance from the start = x - x0
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from xml.parsers.expat import ParserCreate

import numpy as np

from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder
from weavecore.fabricating.templates import ROW, SCALE, SCALE_BAR, TICKS
from weavecore.geometry.arrays import Floats
from weavecore.polling import each_of_many

_LIMIT = 0.01
"""How far a tick may be from its mark, and the scale bar from its length, in millimetres."""

_DXF_LINE = re.compile(rb"(?<=\n) *0\nLINE\n((?: *[1-9]\d*\n[^\n]*\n)+)(?= *0\n)")
"""An entity of a DXF: pairs of a group code and a value up to the next code 0."""


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


def _read_dxf_lines(content: bytes) -> dict[str, Floats]:
    """The lines (n, 4) of every layer of a DXF, as x, y, x, y with y up."""
    lines: dict[str, list[tuple[float, ...]]] = {TICKS: [], SCALE: []}
    for found in each_of_many(_DXF_LINE.finditer(content)):
        parts = found.group(1).split(b"\n")
        codes = list(map(bytes.strip, parts[::2]))
        layer = parts[2 * codes.index(b"8") + 1].decode()
        if layer in lines:
            groups = dict(zip(codes, parts[1::2]))
            lines[layer].append(tuple(float(groups[code]) for code in (b"10", b"20", b"11", b"21")))
    return {layer: np.array(rows, np.float64).reshape(-1, 4) for layer, rows in lines.items()}


def _read_svg_lines(content: bytes) -> dict[str, Floats]:
    """The lines (n, 4) of every layer of an SVG, as x, y, x, y with y up."""
    lines: dict[str, list[tuple[float, ...]]] = {TICKS: [], SCALE: []}
    layer = [""]

    def begin(name: str, attributes: dict[str, str]) -> None:
        if name == "g":
            layer[0] = attributes.get("id", "")
        elif name == "line" and layer[0] in lines:
            lines[layer[0]].append(tuple(float(attributes.get(key, "nan")) for key in ("x1", "y1", "x2", "y2")))

    # A stream of events: a tree of the elements of a large weave takes a gigabyte.
    parser = ParserCreate()
    parser.StartElementHandler = begin
    parser.Parse(content, True)
    return {key: np.array(rows, np.float64).reshape(-1, 4) * (1, -1, 1, -1) for key, rows in lines.items()}


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
