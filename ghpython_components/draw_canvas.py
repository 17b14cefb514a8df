"""Draw a definition as Grasshopper shows it: ``python ghpython_components/draw_canvas.py FILE.gh -o PICTURE.svg``.

The picture is made from the file alone: what lies where, which wires there are, what is written on what.
`draw_component` draws a single component of the plugin.
"""

from __future__ import annotations

import argparse
import base64
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

from grasshopper_files import canvas_objects as canvas
from grasshopper_files.archive import Chunk, decode_archive
from grasshopper_files.components import SCRIPT_COMPONENT, Component

Box = tuple[float, float, float, float]

_FONT = "Segoe UI, Helvetica, Arial, sans-serif"
_INK, _EDGE, _FACE, _PANEL = "#222", "#444", "#d7d7d2", "#fffadc"
_RIM, _LABEL, _BULGE = 16.0, 24.0, 0.2


@dataclass
class Picture:
    """Lines of SVG, and how far they reach."""

    lines: list[str] = field(default_factory=list)
    right: float = 0.0
    bottom: float = 0.0

    def box(self, box: Box, fill: str, *, stroke: str = _EDGE, radius: float = 4.0, opacity: float = 1.0) -> None:
        """Draw a box with round corners."""
        x, y, width, height = box
        self.right, self.bottom = max(self.right, x + width), max(self.bottom, y + height)
        place = f'x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" rx="{radius:g}"'
        self.lines.append(f'<rect {place} fill="{fill}" fill-opacity="{opacity:g}" stroke="{stroke}"/>')

    def text(self, x: float, y: float, text: str, *, anchor: str = "start", size: float = 11.0, more: str = "") -> None:
        """Write a text whose middle line is at ``y``."""
        place = f'x="{x:.1f}" y="{y + 0.35 * size:.1f}" font-size="{size:g}" text-anchor="{anchor}"'
        self.lines.append(f'<text {place} fill="{_INK}" {more}>{escape(text)}</text>')

    def wire(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Draw a wire from an output to an input."""
        (x0, y0), (x1, y1) = start, end
        reach = max(40.0, abs(x1 - x0) / 2)
        if x1 < x0:  # A wire that goes back bulges out on both sides.
            self.right = max(self.right, x0 + _BULGE * reach)
        path = f"M{x0:.1f} {y0:.1f} C{x0 + reach:.1f} {y0:.1f} {x1 - reach:.1f} {y1:.1f} {x1:.1f} {y1:.1f}"
        self.lines.append(f'<path d="{path}" fill="none" stroke="{_EDGE}" stroke-width="2" stroke-opacity="0.75"/>')

    def dot(self, x: float, y: float) -> None:
        """Draw where a wire can end."""
        self.lines.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="#fff" stroke="{_EDGE}"/>')

    def svg(self) -> str:
        """The whole picture."""
        size = f'width="{self.right + 20:.0f}" height="{self.bottom + 20:.0f}"'
        view = f'viewBox="0 0 {self.right + 20:.0f} {self.bottom + 20:.0f}"'
        head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} {view} font-family="{_FONT}">'
        return "\n".join([head, '<rect width="100%" height="100%" fill="#f2f1ec"/>', *self.lines, "</svg>", ""])


def draw(root: Chunk) -> str:
    """The picture of a definition as SVG."""
    holders = [chunk.chunk("Container") for chunk in root.chunk("Definition").chunk("DefinitionObjects").chunks]
    kinds = [str(chunk.get("GUID")) for chunk in root.chunk("Definition").chunk("DefinitionObjects").chunks]
    picture = Picture()
    boxes = {str(h.get("InstanceGuid")): _bounds(h) for h, kind in zip(holders, kinds) if kind != canvas.GROUP}
    for holder, kind in zip(holders, kinds):
        if kind == canvas.GROUP:
            _draw_group(picture, holder, boxes)
    ends = dict(_wire_starts(holders, kinds))
    for target in _targets(holders, kinds):
        box = _bounds(target)
        for item in target.items:
            if item.name == "Source":
                picture.wire(ends[str(item.value)], (box[0], box[1] + box[3] / 2))
    for holder, kind in zip(holders, kinds):
        _DRAWN_AS.get(kind, _draw_nothing)(picture, holder)
    return picture.svg()


def draw_component(one: Component) -> str:
    """The picture of a component by itself as SVG, with its name and nickname below it."""
    picture, label = Picture(), f"{one.name} ({one.metadata['nickname']})"
    width = canvas.size_of(one)[0]
    beyond = max(0.0, (canvas.LETTER * len(label) - width) / 2)
    holder = canvas.component(one, (_RIM + beyond, _RIM), {}).chunk("Container")
    _draw_component(picture, holder, label=label)
    picture.right += beyond
    picture.bottom += _LABEL / 2
    return picture.svg()


def _bounds(chunk: Chunk) -> Box:
    box: Box = chunk.chunk("Attributes").get("Bounds")
    return box


def _parameters(holder: Chunk, side: str) -> list[Chunk]:
    return [chunk for chunk in holder.chunk("ParameterData").chunks if chunk.name == f"{side}Param"]


def _wire_starts(holders: Sequence[Chunk], kinds: Sequence[str]) -> Iterator[tuple[str, tuple[float, float]]]:
    for holder, kind in zip(holders, kinds):
        if kind in (canvas.GROUP, canvas.SCRIBBLE):
            continue
        for source in _parameters(holder, "Output") if kind == SCRIPT_COMPONENT else [holder]:
            x, y, width, height = _bounds(source)
            yield str(source.get("InstanceGuid")), (x + width, y + height / 2)


def _targets(holders: Sequence[Chunk], kinds: Sequence[str]) -> Iterator[Chunk]:
    for holder, kind in zip(holders, kinds):
        yield from _parameters(holder, "Input") if kind == SCRIPT_COMPONENT else [holder]


def _draw_group(picture: Picture, holder: Chunk, boxes: dict[str, Box]) -> None:
    members = [boxes[str(item.value)] for item in holder.items if item.name == "ID"]
    left, top = min(x for x, *_ in members) - _RIM, min(y for _, y, *_ in members) - _RIM - _LABEL
    right, bottom = max(x + w for x, _, w, _ in members) + _RIM, max(y + h for _, y, _, h in members) + _RIM + 8
    _, *colour = holder.get("Colour")
    box = (left, top, right - left, bottom - top)
    picture.box(box, _hex(colour), stroke="#8886", radius=10.0, opacity=0.55)
    picture.text(left + 14, top + _LABEL / 2 + 4, holder.get("NickName"), size=15.0, more='font-weight="bold"')


def _draw_component(picture: Picture, holder: Chunk, *, label: str = "") -> None:
    box = x, y, width, _ = _bounds(holder)
    picture.box(box, _FACE)
    inputs, outputs = _parameters(holder, "Input"), _parameters(holder, "Output")
    for parameter in inputs:
        left, top, _, height = _bounds(parameter)
        picture.dot(x, top + height / 2)
        picture.text(left + 6, top + height / 2, parameter.get("NickName"))
    for parameter in outputs:
        left, top, wide, height = _bounds(parameter)
        picture.dot(x + width, top + height / 2)
        picture.text(left + wide - 6, top + height / 2, parameter.get("NickName"), anchor="end")
    left, _, wide, _ = _bounds(inputs[0])
    middle = left + wide + canvas.ICON / 2
    icon = base64.b64encode(holder.get("IconOverride")).decode("ascii")
    place = f'x="{middle - 12:.1f}" y="{y + box[3] / 2 - 12:.1f}" width="24" height="24"'
    picture.lines.append(f'<image {place} href="data:image/png;base64,{icon}"/>')
    label = label or holder.get("Name")
    picture.text(x + width / 2, y + box[3] + 11, label, anchor="middle", more='font-style="italic"')


def _draw_slider(picture: Picture, holder: Chunk) -> None:
    x, y, width, height = _bounds(holder)
    settings = holder.chunk("Slider")
    low, high, value = (settings.get(name) for name in ("Min", "Max", "Value"))
    label = 0.36 * width
    picture.box((x, y, width, height), "#fff")
    picture.box((x, y, label, height), _FACE)
    picture.text(x + 6, y + height / 2, holder.get("NickName"))
    start, end = x + label + 10, x + width - 10
    knob = start + (end - start) * (value - low) / (high - low)
    picture.lines.append(f'<path d="M{start:.1f} {y + height / 2:.1f} H{end:.1f}" stroke="{_EDGE}"/>')
    picture.lines.append(f'<circle cx="{knob:.1f}" cy="{y + height / 2:.1f}" r="5" fill="#fff" stroke="{_INK}"/>')
    picture.text(min(knob + 9, end - 14), y + height / 2 - 4, f"{value:.{settings.get('Digits')}f}", size=9.0)


def _draw_toggle(picture: Picture, holder: Chunk) -> None:
    _draw_labelled(picture, holder, str(holder.get("ToggleValue")))


def _draw_value_list(picture: Picture, holder: Chunk) -> None:
    chosen = next(c.get("Name") for c in holder.chunks if c.name == "ListItem" and c.get("Selected"))
    _draw_labelled(picture, holder, f"{chosen} ▾")


def _draw_labelled(picture: Picture, holder: Chunk, value: str) -> None:
    x, y, width, height = _bounds(holder)
    picture.box((x, y, width, height), "#fff")
    picture.box((x, y, 0.48 * width, height), _FACE)
    picture.text(x + 6, y + height / 2, holder.get("NickName"))
    picture.text(x + width - 8, y + height / 2, value, anchor="end")


def _draw_mesh(picture: Picture, holder: Chunk) -> None:
    x, y, width, height = _bounds(holder)
    picture.box((x, y, width, height), _FACE, radius=height / 2)
    picture.text(x + width / 2, y + height / 2, holder.get("NickName"), anchor="middle")


def _draw_panel(picture: Picture, holder: Chunk) -> None:
    x, y, width, height = _bounds(holder)
    picture.box((x, y, width, height), _PANEL, radius=2.0)
    if holder.get("SourceCount"):
        picture.text(x + 8, y + 14, holder.get("NickName"), more='font-style="italic"')
        return
    for i, line in enumerate(textwrap.wrap(holder.get("UserText"), int(width / 6))):
        picture.text(x + 8, y + height / 2 + 13 * i, line)


def _draw_scribble(picture: Picture, holder: Chunk) -> None:
    x, y = holder.get("Ca")
    picture.text(x, y + 0.7 * holder.get("Size"), holder.get("Text"), size=holder.get("Size"))


def _draw_nothing(picture: Picture, holder: Chunk) -> None:
    """Groups lie under all the rest and are drawn before it."""


_DRAWN_AS: dict[str, Any] = {
    SCRIPT_COMPONENT: _draw_component,
    canvas.SLIDER: _draw_slider,
    canvas.TOGGLE: _draw_toggle,
    canvas.VALUE_LIST: _draw_value_list,
    canvas.MESH: _draw_mesh,
    canvas.PANEL: _draw_panel,
    canvas.SCRIBBLE: _draw_scribble,
}


def _hex(colour: Sequence[int]) -> str:
    return "#" + "".join(f"{part:02x}" for part in colour)


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw one file."""
    parser = argparse.ArgumentParser(description="Draw a Grasshopper definition.")
    parser.add_argument("file", type=Path, metavar="FILE.gh")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="PICTURE.svg")
    given = parser.parse_args(arguments)
    given.out.write_text(draw(decode_archive(given.file.read_bytes())), "utf-8")


if __name__ == "__main__":
    main()
