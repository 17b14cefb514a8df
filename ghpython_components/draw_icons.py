"""Draw the icons of the components and of the package: ``python ghpython_components/draw_icons.py``.

One family: shapes on a square of 24, strokes of the same width with dark edges, the colours of
`weavecore.palette`.  Everything is drawn large and averaged down.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Callable

import numpy as np
from numpy.typing import NDArray

from weavecore.palette import LONGITUDES, NODES, POCKETS, SURFACE, latitude_colours
from weavecore.viewing.picture import encode_png

HERE = Path(__file__).resolve().parent
SIDE = 24
_FINE = 16

Colour = Sequence[int]
Points = Sequence[tuple[float, float]]

BLUE, TEAL, GREEN = (tuple(row) for row in latitude_colours([1, 3, 5], 7).tolist())
DARK, AMBER, RED, PALE = NODES, LONGITUDES, POCKETS, SURFACE
STROKE, EDGE = 2.2, 0.9


class Icon:
    """A square of 24 by 24 that shapes are laid on, one over the other."""

    def __init__(self, size: int = SIDE) -> None:
        self._size = size
        n = size * _FINE
        centre = (np.arange(n) + 0.5) * SIDE / n
        self._x, self._y = np.meshgrid(centre, centre)
        self._colour = np.zeros((n, n, 3))
        self._alpha = np.zeros((n, n))

    def fill(self, points: Points, colour: Colour) -> None:
        """Fill a polygon (even-odd)."""
        inside = np.zeros(self._x.shape, bool)
        for (x0, y0), (x1, y1) in zip(points, [*points[1:], points[0]]):
            crosses = (y0 > self._y) != (y1 > self._y)
            slope = (x1 - x0) / (y1 - y0) if y1 != y0 else 0.0
            inside ^= crosses & (self._x < x0 + (self._y - y0) * slope)
        self._lay(inside, colour)

    def line(self, points: Points, colour: Colour, *, width: float = STROKE, edge: bool = True) -> None:
        """Draw a line with round ends, with a dark edge around it."""
        distance = np.full(self._x.shape, np.inf)
        for (x0, y0), (x1, y1) in zip(points, points[1:]):
            dx, dy = x1 - x0, y1 - y0
            part = np.clip(((self._x - x0) * dx + (self._y - y0) * dy) / max(dx * dx + dy * dy, 1e-12), 0.0, 1.0)
            distance = np.minimum(distance, np.hypot(self._x - x0 - part * dx, self._y - y0 - part * dy))
        if edge:
            self._lay(distance <= width / 2 + EDGE / 2, DARK)
            self._lay(distance <= width / 2 - EDGE / 2, colour)
        else:
            self._lay(distance <= width / 2, colour)

    def dot(self, x: float, y: float, radius: float, colour: Colour) -> None:
        """Draw a disc with a dark edge."""
        distance = np.hypot(self._x - x, self._y - y)
        self._lay(distance <= radius, DARK)
        self._lay(distance <= radius - EDGE, colour)

    def pixels(self) -> NDArray[np.uint8]:
        """Red, green, blue and opacity (size, size, 4)."""
        n = self._size
        alpha = self._alpha.reshape(n, _FINE, n, _FINE).mean((1, 3))
        weighted = (self._colour * self._alpha[..., None]).reshape(n, _FINE, n, _FINE, 3).mean((1, 3))
        colour = weighted / np.maximum(alpha, 1e-9)[..., None]
        pixels = np.concatenate([colour, 255.0 * alpha[..., None]], axis=2)
        return np.rint(pixels).astype(np.uint8)

    def png(self) -> bytes:
        """The bytes of a .png."""
        return encode_png(self.pixels())

    def _lay(self, where: NDArray[np.bool_], colour: Colour) -> None:
        self._colour[where] = colour
        self._alpha[where] = 1.0


def ellipse(
    x: float, y: float, a: float, b: float, start: float = 0.0, end: float = 360.0
) -> list[tuple[float, float]]:
    """Points of an elliptic arc; angles in degrees, clockwise on the picture."""
    angles = [math.radians(start + (end - start) * i / 48) for i in range(49)]
    return [(x + a * math.cos(t), y + b * math.sin(t)) for t in angles]


def surface(icon: Icon) -> None:
    """A dome with its border."""
    dome = [*ellipse(12, 17, 9.5, 13, 180, 360), *ellipse(12, 17, 9.5, 4, 0, 180)]
    icon.fill(dome, PALE)
    for a in (4.4, -4.4):
        icon.line(ellipse(12, 17, a, 13, 180, 270), DARK, width=0.8, edge=False)
    icon.line(ellipse(12, 11, 8.3, 2.6, 12, 168), DARK, width=0.8, edge=False)
    icon.line(ellipse(12, 17, 9.5, 13, 180, 360), DARK, width=1.2, edge=False)
    icon.line(ellipse(12, 17, 9.5, 4), BLUE)


def offset(icon: Icon) -> None:
    """Rings within rings."""
    icon.line(ellipse(12, 12, 10.4, 10.4), BLUE)
    icon.line(ellipse(12, 12, 6.9, 6.9), TEAL)
    icon.line(ellipse(12, 12, 3.3, 3.3), GREEN)


def link(icon: Icon) -> None:
    """Two rings bound to each other."""
    outer, inner = _arc(2.2, 8.0, 4.0), _arc(2.2, 21.0, 17.0)
    zigzag = [outer[0], inner[12], outer[24], inner[36], outer[48]]
    icon.line(zigzag, AMBER)
    icon.line(outer, BLUE)
    icon.line(inner, TEAL)
    for x, y in zigzag:
        icon.dot(x, y, 2.1, (255, 255, 255))


def strands(icon: Icon) -> None:
    """Rods over and under each other."""
    across = [6.0, 12.0, 18.0]
    for x in across:
        icon.line([(x, 1.6), (x, 22.4)], AMBER, width=3.0)
    for i, y in enumerate(across):
        icon.line([(1.6, y), (22.4, y)], BLUE if i % 2 == 0 else TEAL, width=3.0)
    for i, y in enumerate(across):
        for j, x in enumerate(across):
            if (i + j) % 2:
                icon.line([(x, y - 2.4), (x, y + 2.4)], AMBER, width=3.0)


def simulate(icon: Icon) -> None:
    """An arch as drawn, the arch that it sags to, and its two supports."""
    for x in (3.4, 20.6):
        icon.fill([(x, 17.2), (x - 3.2, 22.6), (x + 3.2, 22.6)], DARK)
    icon.line(_arc(3.4, 17.6, 1.8), DARK, width=0.9, edge=False)
    icon.line(_arc(3.4, 17.6, 7.6), AMBER, width=2.8)
    icon.line([(12.0, 10.6), (12.0, 16.2)], RED, width=1.8)
    icon.line([(9.4, 14.0), (12.0, 16.8), (14.6, 14.0)], RED, width=1.8)


def export(icon: Icon) -> None:
    """A ring and an arrow out of it."""
    icon.line(ellipse(9.5, 9.5, 7.6, 7.6), BLUE)
    icon.line(ellipse(9.5, 9.5, 3.6, 3.6), TEAL)
    shaft, head = [(10.5, 10.5), (20.5, 20.5)], [(20.8, 13.0), (20.8, 20.8), (13.0, 20.8)]
    icon.line(head, RED, width=2.8)
    icon.line(shaft, RED, width=2.8)
    icon.line([head[1], (18.2, 20.8)], RED, width=2.8 - EDGE * 2, edge=False)
    icon.line([head[1], (20.8, 18.2)], RED, width=2.8 - EDGE * 2, edge=False)


def measure(icon: Icon) -> None:
    """Two rings, and what lies between them measured."""
    icon.line(_arc(2.0, 6.6, 2.4), BLUE)
    icon.line(_arc(2.0, 22.2, 18.6), TEAL)
    upright, ends = [(12.0, 6.8), (12.0, 14.6)], (6.8, 14.6)
    icon.line(upright, RED)
    for y in ends:
        icon.line([(8.4, y), (15.6, y)], RED)
    icon.line(upright, RED, width=STROKE - EDGE, edge=False)


def choose(icon: Icon) -> None:
    """Rows of a table, one of them ticked."""
    for y, colour in ((4.5, BLUE), (12.0, TEAL), (19.5, BLUE)):
        icon.line([(2.4, y), (13.0, y)], colour)
    icon.line([(14.5, 11.5), (17.5, 15.5), (22.0, 6.5)], RED, width=2.8)


def preview(icon: Icon) -> None:
    """An eye on the weave: its lid, and rods in the pupil's place."""
    icon.fill([*_arc(1.4, 12.0, 3.0), *_arc(1.4, 12.0, 21.0)[::-1]], PALE)
    icon.line(_arc(1.4, 12.0, 3.0), DARK, width=1.6, edge=False)
    icon.line(_arc(1.4, 12.0, 21.0), DARK, width=1.6, edge=False)
    icon.dot(12, 12, 5.4, TEAL)
    icon.dot(12, 12, 2.2, DARK)


def deconstruct_lattice(icon: Icon) -> None:
    """A triangle, its corners apart from its sides."""
    corners = [(12.0, 3.4), (21.0, 19.6), (3.0, 19.6)]
    for (x0, y0), (x1, y1) in zip(corners, [*corners[1:], corners[0]]):
        ends = [(x0 + (x1 - x0) * part, y0 + (y1 - y0) * part) for part in (0.3, 0.7)]
        icon.line(ends, AMBER, width=2.6)
    for x, y in corners:
        icon.dot(x, y, 2.9, BLUE)


def deconstruct_weave(icon: Icon) -> None:
    """Two rods pulled apart from their joint."""
    icon.line([(2.4, 6.0), (21.6, 6.0)], BLUE, width=3.2)
    icon.line([(2.4, 18.0), (21.6, 18.0)], AMBER, width=3.2)
    icon.line([(12.0, 9.2), (12.0, 14.8)], RED, width=1.4, edge=False)
    icon.dot(12, 12, 2.4, (255, 255, 255))


def fabricate(icon: Icon) -> None:
    """Straight rods of different lengths with marks."""
    for y, end, colour in ((4.6, 21.6, BLUE), (12.0, 16.0, TEAL), (19.4, 19.0, AMBER)):
        icon.line([(2.4, y), (end, y)], colour, width=3.6)
        for x in (6.0, 10.5, 14.0):
            icon.line([(x, y - 2.4), (x, y + 2.4)], DARK, width=1.0, edge=False)


def view(icon: Icon) -> None:
    """A window with a ring in it."""
    frame = [(1.8, 3.4), (22.2, 3.4), (22.2, 20.6), (1.8, 20.6)]
    icon.fill(frame, (255, 255, 255))
    icon.fill([(1.8, 3.4), (22.2, 3.4), (22.2, 7.6), (1.8, 7.6)], BLUE)
    icon.line([*frame, frame[0]], DARK, width=1.4, edge=False)
    icon.line(ellipse(12, 14, 5.6, 4.2), AMBER)


def bake(icon: Icon) -> None:
    """Rods that go down into a layer."""
    icon.fill([(1.6, 17.6), (12.0, 12.4), (22.4, 17.6), (12.0, 22.8)], GREEN)
    icon.line([(1.6, 17.6), (12.0, 12.4), (22.4, 17.6), (12.0, 22.8), (1.6, 17.6)], DARK, width=1.0, edge=False)
    icon.line([(12.0, 1.8), (12.0, 16.4)], RED, width=2.8)
    icon.line([(7.8, 12.4), (12.0, 17.0), (16.2, 12.4)], RED, width=2.8)


def _arc(x: float, y: float, top: float) -> list[tuple[float, float]]:
    """An arc from (x, y) over the middle at ``top`` to the other side."""
    return [(x + (SIDE - 2 * x) * i / 48, y + (top - y) * math.sin(math.pi * i / 48)) for i in range(49)]


DRAWINGS: dict[str, Callable[[Icon], None]] = {
    "Weave_Surface": surface,
    "Weave_Offset": offset,
    "Weave_Link": link,
    "Weave_Strands": strands,
    "Weave_Simulate": simulate,
    "Weave_Export": export,
    "Weave_Measure": measure,
    "Weave_Choose": choose,
    "Weave_Preview": preview,
    "Deconstruct_Lattice": deconstruct_lattice,
    "Deconstruct_Weave": deconstruct_weave,
    "Weave_Fabricate": fabricate,
    "Weave_View": view,
    "Weave_Bake": bake,
}


def draw(name: str, *, size: int = SIDE) -> bytes:
    """The icon of a component as a .png of ``size`` by ``size``."""
    icon = Icon(size)
    DRAWINGS[name](icon)
    return icon.png()


def main() -> None:
    """Write ``icon.png`` into every component's folder, and the package's, which is larger, beside them."""
    for name in DRAWINGS:
        (HERE / name / "icon.png").write_bytes(draw(name))
    (HERE / "package_icon.png").write_bytes(draw("Weave_Strands", size=64))


if __name__ == "__main__":
    main()
