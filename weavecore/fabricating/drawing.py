"""`Drawing`: lines, paths and texts in millimetres, x right and y up, before they are written as DXF, SVG or PDF.

Everything lies on a named layer, which has a colour.  The items are plain tuples: a large weave has hundreds of
thousands of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from weavecore.geometry.arrays import Floats

LEFT, MIDDLE, RIGHT = "left", "middle", "right"
"""Where a text lies by its point: it begins there, is centred on it, or ends there."""

THIN, BOLD = 0.18, 0.35
"""Line widths in millimetres (ISO 128)."""

TEXT_HEIGHT = 2.3
"""Height in millimetres of the capitals of texts that are read close by."""

LINE_STEP = 3.3
"""Distance of base lines of such texts, in millimetres."""

Colour = tuple[int, int, int]
"""Red, green and blue from 0 to 255."""


class DrawnLine(NamedTuple):
    """A straight line; dashed where a piece continues on another page."""

    x1: float
    y1: float
    x2: float
    y2: float
    layer: str
    width: float = THIN
    is_dashed: bool = False


class DrawnPath(NamedTuple):
    """A polyline through points (n, 2)."""

    points: Floats
    layer: str
    width: float = THIN


class DrawnText(NamedTuple):
    """A text at a point of its base line; its height is that of its capitals, and if turned it runs upwards."""

    x: float
    y: float
    text: str
    height: float
    layer: str
    anchor: str = LEFT
    is_turned: bool = False
    bold: bool = False


@dataclass
class Drawing:
    """The contents of a sheet.

    Parameters
    ----------
    layers : mapping of name to Colour
    width, height : float
        Of the sheet, in millimetres; its lower left corner is at (0, 0).
    origin : (x, y)
        The point of the sheet that is the origin in formats that may have negative coordinates.
    scale : float
        Millimetres of the model on one of the sheet.
    lines : list of DrawnLine
    paths : list of DrawnPath
    texts : list of DrawnText
    """

    layers: Mapping[str, Colour]
    width: float = 0.0
    height: float = 0.0
    origin: tuple[float, float] = (0.0, 0.0)
    scale: float = 1.0
    lines: list[DrawnLine] = field(default_factory=list)
    paths: list[DrawnPath] = field(default_factory=list)
    texts: list[DrawnText] = field(default_factory=list)

    def line(
        self, x1: float, y1: float, x2: float, y2: float, layer: str, *, width: float = THIN, is_dashed: bool = False
    ) -> None:
        """Add a line."""
        self.lines.append(DrawnLine(x1, y1, x2, y2, layer, width, is_dashed))

    def path(self, points: Floats, layer: str, *, width: float = THIN) -> None:
        """Add a polyline through points (n, 2)."""
        self.paths.append(DrawnPath(points, layer, width))

    def text(
        self,
        x: float,
        y: float,
        text: str,
        height: float,
        layer: str,
        *,
        anchor: str = LEFT,
        is_turned: bool = False,
        bold: bool = False,
    ) -> None:
        """Add a text; control characters, which no format can hold, become blanks."""
        if not text.isprintable():
            text = "".join(sign if sign.isprintable() else " " for sign in text)
        self.texts.append(DrawnText(x, y, text, height, layer, anchor, is_turned, bold))
