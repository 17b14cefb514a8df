"""The trims of a Brep, read from the bytes that rhino3dm encodes it to.

rhino3dm gives a Brep's edges and surfaces, but not the 2D curves that bound its faces.  They are in `Brep.Encode()`:
an openNURBS archive in base64, a tree of *chunks*::

    type code | length  | bytes …              | checksum
    4 bytes   | 8 bytes | length - 4 or length | 4 bytes, if the type code has bit 0x8000

A Brep's class data are nine chunks in a row: 2D curves, 3D curves, surfaces, then records of vertices, edges, trims,
loops and faces (openNURBS, ``opennurbs_brep_io.cpp``).  Linear in the bytes.
"""

from __future__ import annotations

import base64
import binascii
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from weavecore.errors import Unreadable

_CLASS_DATA = 0x0002FFFC
"""Type code of the chunk with an object's own data (TCODE_OPENNURBS_CLASS_DATA)."""

_SHORT = 0x80000000
"""Bit of the type code of a chunk that has no bytes: its length is a value."""

_CHECKED = 0x8000
"""Bit of the type code of a chunk that ends with a checksum."""

_MOST_RECORDS = 10_000_000
"""Records in a table: a damaged count must not allocate gigabytes."""


SINGULAR = 4
"""Trim type: a side of the surface that is a single point; it has no edge."""

OUTER_LOOP, INNER_LOOP, SLIT_LOOP = 1, 2, 3
"""Loop types of openNURBS that bound a face."""


@dataclass(frozen=True)
class TrimRecord:
    """One piece of a face's border in its (u, v) plane: part of a 2D curve, and the edge that it lies on."""

    curve: int
    domain: tuple[float, float]
    edge: int
    vertices: tuple[int, int]
    against_edge: bool
    kind: int
    loop: int
    reversed_curve: bool


@dataclass(frozen=True)
class EdgeRecord:
    """An edge: its end vertices and the trims that lie on it."""

    vertices: tuple[int, int]
    trims: tuple[int, ...]


@dataclass(frozen=True)
class LoopRecord:
    """A closed row of trims of one face, the face on its left in (u, v)."""

    trims: tuple[int, ...]
    kind: int
    face: int


@dataclass(frozen=True)
class FaceRecord:
    """A face: its loops, its surface, and whether it looks against its surface's normal."""

    loops: tuple[int, ...]
    surface: int
    reversed: bool


@dataclass(frozen=True)
class BrepArchive:
    """What is read from a Brep's bytes; ``curves`` holds each 2D curve's own bytes, or None."""

    curves: tuple[dict[str, Any] | None, ...]
    edges: tuple[EdgeRecord, ...]
    trims: tuple[TrimRecord, ...]
    loops: tuple[LoopRecord, ...]
    faces: tuple[FaceRecord, ...]


def read_brep_archive(encoded: dict[str, Any]) -> BrepArchive:
    """Read the trims of a Brep.

    Parameters
    ----------
    encoded : dict
        What ``rhino3dm.Brep.Encode()`` returns.

    Returns
    -------
    BrepArchive

    Raises
    ------
    Unreadable
        Where the bytes are not those of a Brep of the current format.
    """
    try:
        raw = base64.b64decode(encoded["data"], validate=True)
        body = _class_data(_Bytes(raw, 0, len(raw)))
        if body.unpack("B")[0] >> 4 != 3:
            raise ValueError("the Brep is not of chunk version 3")
        curves = _curve_bytes(body.chunk(), encoded)
        for _ in range(3):  # 3D curves, surfaces and vertices: rhino3dm gives these itself
            body.chunk()
        return BrepArchive(
            curves=curves,
            edges=tuple(_edge(r) for r in _records(body.chunk())),
            trims=tuple(_trim(r) for r in _records(body.chunk())),
            loops=tuple(_loop(r) for r in _records(body.chunk())),
            faces=tuple(_face(r) for r in _records(body.chunk())),
        )
    except (struct.error, ValueError, KeyError, binascii.Error) as error:
        raise Unreadable(
            f"The trims of a Brep cannot be read ({error})",
            remedy="Open the file in Rhino and save it again.",
        ) from error


class _Bytes:
    """A cursor over part of an archive, little endian."""

    def __init__(self, raw: bytes, at: int, end: int) -> None:
        self.raw, self.at, self.end = raw, at, end

    def unpack(self, form: str) -> tuple[Any, ...]:
        form = "<" + form
        after = self.at + struct.calcsize(form)
        if after > self.end:
            raise ValueError("it is cut short")
        values = struct.unpack_from(form, self.raw, self.at)
        self.at = after
        return values

    def chunk(self) -> _Bytes:
        """Step over a chunk and give a cursor over its bytes."""
        return self.typed_chunk()[1]

    def typed_chunk(self) -> tuple[int, _Bytes]:
        code, length = self.unpack("Iq")
        if code & _SHORT:
            return code, _Bytes(self.raw, self.at, self.at)
        if length < 0 or self.at + length > self.end:
            raise ValueError("a chunk is longer than what it lies in")
        inner = _Bytes(self.raw, self.at, self.at + length - (4 if code & _CHECKED else 0))
        self.at += length
        return code, inner

    def integers(self) -> tuple[int, ...]:
        """A counted row of integers."""
        (count,) = self.unpack("i")
        if not 0 <= count <= _MOST_RECORDS:
            raise ValueError("a count is out of range")
        return self.unpack(f"{count}i")


def _class_data(top: _Bytes) -> _Bytes:
    """The bytes of the object itself, inside its class chunk."""
    _, inner = top.typed_chunk()
    while inner.at < inner.end:
        code, part = inner.typed_chunk()
        if code == _CLASS_DATA:
            return part
    raise ValueError("it holds no object")


def _records(chunk: _Bytes) -> Iterator[_Bytes]:
    """The cursor of a table once for each of its records; the reader of a record moves it on."""
    _, count = chunk.unpack("Bi")
    if not 0 <= count <= _MOST_RECORDS:
        raise ValueError("a count is out of range")
    for _ in range(count):
        yield chunk


def _curve_bytes(chunk: _Bytes, encoded: dict[str, Any]) -> tuple[dict[str, Any] | None, ...]:
    """Cut each curve out, in the form that ``rhino3dm.CommonObject.Decode`` takes."""
    curves: list[dict[str, Any] | None] = []
    for cursor in _records(chunk):
        (present,) = cursor.unpack("i")
        if not present:
            curves.append(None)
            continue
        start = cursor.at
        cursor.chunk()
        data = base64.b64encode(cursor.raw[start : cursor.at]).decode("ascii")
        curves.append({**encoded, "data": data})
    return tuple(curves)


def _edge(cursor: _Bytes) -> EdgeRecord:
    cursor.unpack("iii2d")
    a, b = cursor.unpack("ii")
    trims = cursor.integers()
    cursor.unpack("3d")
    return EdgeRecord((a, b), trims)


def _trim(cursor: _Bytes) -> TrimRecord:
    _, curve, low, high, edge, a, b, against, kind, _, loop = cursor.unpack("ii2diiiiiii")
    cursor.unpack("2d2d")
    reversed_curve = cursor.unpack("32B")[0] == 1
    cursor.unpack("2d")
    return TrimRecord(curve, (low, high), edge, (a, b), against != 0, kind, loop, reversed_curve)


def _loop(cursor: _Bytes) -> LoopRecord:
    cursor.unpack("i")
    trims = cursor.integers()
    kind, face = cursor.unpack("ii")
    return LoopRecord(trims, kind, face)


def _face(cursor: _Bytes) -> FaceRecord:
    cursor.unpack("i")
    loops = cursor.integers()
    surface, is_reversed, _ = cursor.unpack("iii")
    return FaceRecord(loops, surface, is_reversed != 0)
