"""`Drawing`: lines and texts in millimetres, before they are of any format.

x runs to the right and y up.  Layers: ``ROD`` outlines, ``TICKS`` marks, ``LABELS`` texts at the marks, ``NAMES`` of
the pieces, ``SPLICES``, ``SCALE`` the scale bar and what the file states.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

ROD, TICKS, LABELS, NAMES, SPLICES, SCALE = "ROD", "TICKS", "LABELS", "NAMES", "SPLICES", "SCALE"
LAYERS = {
    ROD: (120, 120, 120),
    TICKS: (0, 0, 0),
    LABELS: (0, 0, 0),
    NAMES: (0, 0, 0),
    SPLICES: (200, 56, 40),
    SCALE: (40, 96, 200),
}
"""Layers and their colours."""

LEFT, MIDDLE, RIGHT = "left", "middle", "right"


@dataclass(frozen=True)
class Line:
    """A straight line; dashed where it shows something that lies elsewhere."""

    x1: float
    y1: float
    x2: float
    y2: float
    layer: str
    width: float = 0.18
    dashed: bool = False


@dataclass(frozen=True)
class Text:
    """A text that begins, is centred or ends at a point on its base line, turned by 0 or 90 degrees."""

    x: float
    y: float
    text: str
    height: float
    layer: str
    anchor: str = LEFT
    turned: bool = False
    bold: bool = False


@dataclass
class Drawing:
    """What is drawn on one sheet."""

    lines: list[Line] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)

    def line(
        self, x1: float, y1: float, x2: float, y2: float, layer: str, *, width: float = 0.18, dashed: bool = False
    ) -> None:
        """Add a line."""
        self.lines.append(Line(x1, y1, x2, y2, layer, width, dashed))

    def text(
        self,
        x: float,
        y: float,
        text: str,
        height: float,
        layer: str,
        *,
        anchor: str = LEFT,
        turned: bool = False,
        bold: bool = False,
    ) -> None:
        """Add a text."""
        self.texts.append(Text(x, y, text, height, layer, anchor, turned, bold))

    def moved(self, x: float, y: float) -> Drawing:
        """The same drawing elsewhere."""
        return Drawing(
            [replace(one, x1=one.x1 + x, x2=one.x2 + x, y1=one.y1 + y, y2=one.y2 + y) for one in self.lines],
            [replace(one, x=one.x + x, y=one.y + y) for one in self.texts],
        )
