"""The same tree of chunks as XML: ``.ghx``."""

from __future__ import annotations

import base64
import struct
import uuid
from typing import Any
from xml.etree import ElementTree as ET
from xml.sax.saxutils import escape, quoteattr

from grasshopper_files import archive
from grasshopper_files.archive import NO_INDEX, TYPE_NAMES, Chunk, Item

_HEAD = """\
<?xml version="1.0" encoding="utf-8" standalone="yes"?>
<Archive name="Root">
  <!--Grasshopper archive-->
"""
_PARTS = {
    archive.POINT: "XY",
    archive.POINT_F: "XY",
    archive.SIZE: "WH",
    archive.SIZE_F: "WH",
    archive.RECTANGLE: "XYWH",
    archive.RECTANGLE_F: "XYWH",
    archive.VERSION: ("Major", "Minor", "Revision"),
}
_WHOLE = (archive.INT32, archive.INT64, archive.DATE, archive.POINT, archive.SIZE, archive.RECTANGLE, archive.VERSION)
_STREAMS = {archive.BYTES: "stream", archive.BITMAP: "bitmap"}


def encode_xml(root: Chunk) -> bytes:
    """The bytes of a ``.ghx`` file."""
    lines = _body_lines(root, "  ")
    return (_HEAD + "\n".join([*lines, "</Archive>"])).encode("utf-8")


def decode_xml(content: bytes) -> Chunk:
    """The tree that a ``.ghx`` file holds."""
    element = ET.fromstring(content.decode("utf-8-sig"))
    return _chunk_of(element)


def _body_lines(chunk: Chunk, space: str) -> list[str]:
    lines = []
    if chunk.items:
        lines.append(f'{space}<items count="{len(chunk.items)}">')
        lines += [_item_line(item, space + "  ") for item in chunk.items]
        lines.append(f"{space}</items>")
    if chunk.chunks:
        lines.append(f'{space}<chunks count="{len(chunk.chunks)}">')
        for child in chunk.chunks:
            lines.append(f"{space}  <chunk name={quoteattr(child.name)}{_index(child.index)}>")
            lines += [*_body_lines(child, space + "    "), f"{space}  </chunk>"]
        lines.append(f"{space}</chunks>")
    return lines


def _item_line(item: Item, space: str) -> str:
    kind = f'type_name="{TYPE_NAMES[item.type]}" type_code="{item.type}"'
    return f"{space}<item name={quoteattr(item.name)}{_index(item.index)} {kind}>{_value_text(item)}</item>"


def _index(index: int) -> str:
    return "" if index == NO_INDEX else f' index="{index}"'


def _value_text(item: Item) -> str:
    value = item.value
    if item.type in _PARTS:
        return "".join(f"<{name}>{_number(part)}</{name}>" for name, part in zip(_PARTS[item.type], value))
    if item.type == archive.COLOUR:
        return f"<ARGB>{';'.join(map(str, value))}</ARGB>"
    if item.type in _STREAMS:
        tag = _STREAMS[item.type]
        return f'<{tag} length="{len(value)}">{base64.b64encode(value).decode()}</{tag}>'
    if item.type == archive.BOOL:
        return "true" if value else "false"
    # A carriage return that is not written as an entity would be read as a line's end.
    return escape(_number(value) if isinstance(value, float) else str(value), {"\r": "&#xD;"})


def _number(value: Any) -> str:
    """The shortest text of a number, without the point that .NET leaves away."""
    text = repr(value) if isinstance(value, float) else str(value)
    return text.removesuffix(".0")


def _chunk_of(element: ET.Element) -> Chunk:
    items = [_item_of(child) for child in element.findall("items/item")]
    chunks = [_chunk_of(child) for child in element.findall("chunks/chunk")]
    return Chunk(element.get("name", ""), int(element.get("index", NO_INDEX)), items, chunks)


def _item_of(element: ET.Element) -> Item:
    type_ = int(element.get("type_code", "0"))
    return Item(element.get("name", ""), type_, _value_of(element, type_), int(element.get("index", NO_INDEX)))


def _value_of(element: ET.Element, type_: int) -> Any:
    text = element.text or ""
    if type_ in _PARTS:
        number = int if type_ in _WHOLE else _single
        return tuple(number(element.findtext(name, "0")) for name in _PARTS[type_])
    if type_ == archive.COLOUR:
        return tuple(map(int, element.findtext("ARGB", "").split(";")))
    if type_ in _STREAMS:
        return base64.b64decode(element.findtext(_STREAMS[type_], ""))
    if type_ == archive.BOOL:
        return text.strip() == "true"
    if type_ == archive.GUID:
        return uuid.UUID(text.strip())
    if type_ == archive.SINGLE:
        return _single(text)
    if type_ == archive.DOUBLE:
        return float(text)
    return int(text) if type_ in _WHOLE else text


def _single(text: str) -> float:
    """A number as it is kept in single precision."""
    number: float = struct.unpack("<f", struct.pack("<f", float(text)))[0]
    return number
