"""Polygon file format .ply, as text or binary, with faces of any number of corners.

A header lists *elements* (vertex, face, tristrips, …) with their counts and *properties*; a property is one
number, or a list with its length before it.  The body has the elements in that order.  Binary elements whose lists
all have one length are read as a table; others are walked through one by one.  Linear in the bytes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.geometry.arrays import Floats, Ints
from weavecore.reading.formats.text import damaged, in_line, shown, to_floats, to_ints
from weavecore.reading.polygon_triangulation import mesh_of_polygons
from weavecore.reading.raw import DOUBLE, SINGLE, RawMesh

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
"""NumPy types of the names of numbers in headers."""

_FACE_LISTS = ("vertex_indices", "vertex_index")
"""Names of the property that lists the corners of a face."""

_RESTART = -1
"""The corner that ends a strip of triangles."""


@dataclass(frozen=True)
class _Property:
    name: str
    kind: str
    length_kind: str


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: tuple[_Property, ...]

    def index_of(self, names: tuple[str, ...]) -> int:
        found = [k for k, p in enumerate(self.properties) if p.name in names]
        if not found:
            raise damaged(f"The elements {self.name!r} have no property {names[0]!r}")
        return found[0]


def read_ply(data: bytes) -> RawMesh:
    """The mesh of the file; colours, normals and other elements are ignored.

    Parameters
    ----------
    data : bytes
        All of the file.

    Returns
    -------
    RawMesh

    Raises
    ------
    Unreadable, BadIndex, Unsupported
    """
    order, elements, start = _header(data)
    reader = _TextBody(data[start:], data[:start].count(b"\n") + 1) if order == "" else _BinaryBody(data, start, order)
    vertices, epsilon = np.empty((0, 3)), DOUBLE
    corners, counts = np.empty(0, np.int64), np.empty(0, np.int64)
    for element in elements:
        if element.name == "vertex":
            vertices, epsilon = reader.vertices(element), _epsilon(element, order)
        elif element.name == "face":
            corners, counts = reader.lists(element, element.index_of(_FACE_LISTS))
        elif element.name == "tristrips" and element.count:
            corners, counts = _unrolled(*reader.lists(element, element.index_of(_FACE_LISTS)))
        else:
            reader.skip(element)
        if len(vertices) and len(counts):
            break
    return mesh_of_polygons(vertices, corners, counts, epsilon=epsilon)


def _unrolled(corners: Ints, counts: Ints) -> tuple[Ints, Ints]:
    """The triangles of strips: corners end to end, and their counts.

    Three corners in a row make a triangle, every second one turned over; -1 begins a new strip.  Triangles that
    repeat a corner only lead from one row to the next.
    """
    is_break = corners == _RESTART
    begins = np.zeros(len(corners), bool)
    begins[(np.cumsum(counts) - counts)[counts > 0]] = True
    begins[1:] |= is_break[:-1]
    start = np.maximum.accumulate(np.where(begins, np.arange(len(corners)), 0))
    first = np.flatnonzero((start[2:] == start[:-2]) & ~is_break[2:]) if len(corners) > 2 else np.zeros(0, np.int64)
    a, b, c = corners[first], corners[first + 1], corners[first + 2]
    is_odd = (first - start[first]) % 2 == 1
    a, b = np.where(is_odd, b, a), np.where(is_odd, a, b)
    keep = (a != b) & (b != c) & (c != a)
    triangles = np.column_stack([a, b, c])[keep]
    return triangles.ravel(), np.full(len(triangles), 3, np.int64)


def _epsilon(element: _Element, order: str) -> float:
    return SINGLE if order and element.properties[element.index_of(("x",))].kind == "f4" else DOUBLE


def _header(data: bytes) -> tuple[str, list[_Element], int]:
    """Byte order ("" for text), the elements, and where the body begins."""
    end = data.find(b"end_header")
    if data[:3] != b"ply" or end < 0:
        raise damaged("The file does not have the header of a .ply")
    start = data.find(b"\n", end) + 1 or len(data)
    order, elements = None, list[_Element]()
    for line in data[:end].decode("ascii", "replace").splitlines()[1:]:
        words = line.split()
        if words[:1] == ["format"] and len(words) > 1:
            order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}.get(words[1])
        elif words[:1] == ["element"] and len(words) == 3 and words[2].isdigit():
            elements.append(_Element(words[1], int(words[2]), ()))
        elif words[:1] == ["property"] and elements:
            last = elements[-1]
            elements[-1] = _Element(last.name, last.count, (*last.properties, _property(words)))
        elif words and words[0] not in ("comment", "obj_info"):
            raise damaged(f"The header has a line {line[:60]!r}")
    if order is None:
        raise damaged("The header names an unknown format")
    return order, elements, start


def _property(words: list[str]) -> _Property:
    is_list = words[1:2] == ["list"]
    kinds = words[2:4] if is_list else words[1:2]
    if len(words) != (5 if is_list else 3) or any(kind not in _TYPES for kind in kinds):
        raise damaged(f"The header has a property {' '.join(words)[:60]!r}")
    return _Property(words[-1], _TYPES[kinds[-1]], _TYPES[kinds[0]] if is_list else "")


class _TextBody:
    """The body of a text file, one element a line."""

    def __init__(self, body: bytes, first: int) -> None:
        numbered = [(first + k, line) for k, line in enumerate(body.splitlines()) if line.strip()]
        self._lines = [line for _, line in numbered]
        self._numbers = [number for number, _ in numbered]
        self._at = 0

    def skip(self, element: _Element) -> None:
        self._rows(element)

    def vertices(self, element: _Element) -> Floats:
        columns = [element.index_of((axis,)) for axis in "xyz"]
        if any(p.length_kind for p in element.properties[: max(columns)]):
            raise damaged("The vertices have a list before their coordinates")
        lines, numbers = self._rows(element)
        rows = [line.split() for line in lines]
        short = next((k for k, row in enumerate(rows) if len(row) <= max(columns)), None)
        if short is not None:
            raise damaged(f"A vertex has too few coordinates{in_line(numbers, short)}: {shown(lines[short])}")
        words = [row[k] for row in rows for k in columns]
        return to_floats(words, "vertex", np.repeat(numbers, 3).tolist()).reshape(-1, 3)

    def lists(self, element: _Element, which: int) -> tuple[Ints, Ints]:
        lines, numbers = self._rows(element)
        rows = [line.split() for line in lines]
        begins = [0] * len(rows)
        try:
            for p in element.properties[:which]:
                begins = [at + (1 + int(row[at]) if p.length_kind else 1) for at, row in zip(begins, rows)]
            counts = to_ints([row[at] for at, row in zip(begins, rows)], "face", numbers)
        except (IndexError, ValueError):
            raise damaged("A face has fewer numbers than the header announces") from None
        words = [row[at + 1 : at + 1 + n] for at, row, n in zip(begins, rows, counts.tolist())]
        short = next((k for k, (found, n) in enumerate(zip(words, counts.tolist())) if len(found) != n), None)
        if short is not None:
            raise damaged(f"A face has fewer corners than its count{in_line(numbers, short)}: {shown(lines[short])}")
        return to_ints([word for found in words for word in found], "face", np.repeat(numbers, counts).tolist()), counts

    def _rows(self, element: _Element) -> tuple[list[bytes], list[int]]:
        rows = self._lines[self._at : self._at + element.count]
        numbers = self._numbers[self._at : self._at + element.count]
        if len(rows) < element.count:
            raise damaged(f"The header announces {element.count} elements {element.name!r}, but the file has fewer")
        self._at += element.count
        return rows, numbers


class _BinaryBody:
    """The body of a binary file: elements without gaps."""

    def __init__(self, data: bytes, start: int, order: str) -> None:
        self._data = np.frombuffer(data, np.uint8)
        self._at = start
        self._order = order

    def skip(self, element: _Element) -> None:
        if not element.properties:
            return
        if any(p.length_kind for p in element.properties):
            self._walk(element)
        else:
            self._table(element)

    def vertices(self, element: _Element) -> Floats:
        if any(p.length_kind for p in element.properties):
            raise damaged("The vertices have lists")
        table = self._table(element)
        columns = [table[f"p{element.index_of((axis,))}"] for axis in "xyz"]
        return np.stack(columns, axis=1).astype(np.float64)

    def lists(self, element: _Element, which: int) -> tuple[Ints, Ints]:
        """Corners end to end and their counts; at once where all lists are as long as the first."""
        start = self._at
        alike = self._alike(element)
        if alike is not None:
            found = alike[f"p{which}"].astype(np.int64)
            return found.ravel(), np.full(len(found), found.shape[1], np.int64)
        self._at = start
        begins, counts = self._walk(element, which)
        kind = np.dtype(self._order + element.properties[which].kind)
        owner = np.repeat(np.arange(len(counts)), counts)
        within = np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]
        where = begins[owner] + within * kind.itemsize
        raw = self._data[where[:, None] + np.arange(kind.itemsize)]
        return np.ascontiguousarray(raw).view(kind).ravel().astype(np.int64), counts

    def _alike(self, element: _Element) -> NDArray[np.void] | None:
        """The elements as a table, if each of their lists is as long as that of the first element."""
        if element.count == 0:
            return None
        lengths = self._first_lengths(element)
        if any(n > len(self._data) for n in lengths.values()):
            return None
        row = self._row_type(element, lengths)
        size = row.itemsize * element.count
        if self._at + size > len(self._data):
            return None
        table = self._data[self._at : self._at + size].view(row)
        if any((table[f"n{k}"] != n).any() for k, n in lengths.items()):
            return None
        self._at += size
        return table

    def _first_lengths(self, element: _Element) -> dict[int, int]:
        lengths, at = dict[int, int](), self._at
        for k, p in enumerate(element.properties):
            if p.length_kind:
                lengths[k] = self._number(at, p.length_kind)
                at += np.dtype(p.length_kind).itemsize + (lengths[k] - 1) * np.dtype(p.kind).itemsize
            at += np.dtype(p.kind).itemsize
        return lengths

    def _walk(self, element: _Element, which: int = -1) -> tuple[Ints, Ints]:
        """Where each element's list ``which`` begins, and how long it is, one element after the other."""
        sizes = [(np.dtype(p.kind).itemsize, p.length_kind) for p in element.properties]
        begins, counts = [], []
        for _ in range(element.count):
            for k, (size, length_kind) in enumerate(sizes):
                n = 1
                if length_kind:
                    n = self._number(self._at, length_kind)
                    self._at += np.dtype(length_kind).itemsize
                if k == which:
                    begins.append(self._at)
                    counts.append(n)
                self._at += n * size
        if self._at > len(self._data):
            raise damaged("The file is truncated")
        return np.array(begins, np.int64), np.array(counts, np.int64)

    def _number(self, at: int, kind: str) -> int:
        dtype = np.dtype(self._order + kind)
        if at + dtype.itemsize > len(self._data):
            raise damaged("The file is truncated")
        n = int(self._data[at : at + dtype.itemsize].view(dtype)[0])
        if n < 0:
            raise damaged("A list has a negative length")
        return n

    def _table(self, element: _Element) -> NDArray[np.void]:
        row = self._row_type(element, {})
        size = row.itemsize * element.count
        if self._at + size > len(self._data):
            raise damaged(f"The header announces {element.count} elements {element.name!r}, but the file has fewer")
        table: NDArray[np.void] = self._data[self._at : self._at + size].view(row)
        self._at += size
        return table

    def _row_type(self, element: _Element, lengths: dict[int, int]) -> np.dtype[np.void]:
        """One element as a row: property k is ``p{k}``, the length of its list ``n{k}``."""
        fields: list[Any] = []
        for k, p in enumerate(element.properties):
            if p.length_kind:
                fields.append((f"n{k}", self._order + p.length_kind))
                fields.append((f"p{k}", self._order + p.kind, (lengths[k],)))
            else:
                fields.append((f"p{k}", self._order + p.kind))
        return np.dtype(fields)
