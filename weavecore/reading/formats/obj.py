"""Wavefront .obj: vertices, faces with any number of corners, and the names of objects and groups; all else is ignored.

Lines ``v x y z …`` and ``f a/… b/… c/… …``; ``#`` begins a comment, and a backslash continues a
line.  ``o NAME`` and ``g NAME NAME…`` name the faces below them.  Linear in the bytes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.geometry.arrays import Ints
from weavecore.reading.formats.text import damaged, to_ints, to_points
from weavecore.reading.polygon_triangulation import mesh_of_polygons
from weavecore.reading.raw import RawMesh


def read_obj(data: bytes) -> RawMesh:
    """The mesh of all groups and objects in the file.

    Corners count from 1; negative ones count back from the last vertex above their line.
    Faces are numbered in the order of their lines, from 0.

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
    if b"\\\n" in data or b"\\\r\n" in data:
        data = _joined(data)
    lines = [line.partition(b"#")[0].strip().replace(b"\t", b" ") for line in data.splitlines()]
    vertex_rows = [k for k, line in enumerate(lines) if line[:2] == b"v "]
    face_rows = [k for k, line in enumerate(lines) if line[:2] == b"f "]
    vertices = to_points([lines[k][2:] for k in vertex_rows], "vertex", [k + 1 for k in vertex_rows])
    face_lines = [lines[k][2:] for k in face_rows]
    words = b" ".join(face_lines).split()
    if any(b"/" in line for line in face_lines):
        words = [word.partition(b"/")[0] for word in words]
    counts = np.array([len(line.split()) for line in face_lines], np.int64)
    numbers = np.repeat(np.array(face_rows, np.int64) + 1, counts)
    corners = to_ints(words, "face", numbers.tolist())
    if (corners == 0).any():
        where = int(numbers[np.argmax(corners == 0)])
        raise damaged(f"A face refers to vertex 0 in line {where}, but vertices are numbered from 1")
    if (corners < 0).any():
        above = np.repeat(_vertices_above(lines), counts)
        corners = np.where(corners < 0, above + corners, corners - 1)
    else:
        corners = corners - 1
    raw = mesh_of_polygons(vertices, corners, counts)
    names, part = _parts(lines)
    if len(names) < 2 or raw.face_ids is None:
        return raw
    return replace(raw, part_names=names, part_of_face=part[raw.face_ids])


def _joined(data: bytes) -> bytes:
    """The text with continued lines on one line, and as many line ends as before."""
    out: list[bytes] = []
    owed = 0
    for line in data.splitlines():
        if line.endswith(b"\\"):
            out.append(line[:-1] + b" ")
            owed += 1
        else:
            out.append(line + b"\n" * (owed + 1))
            owed = 0
    return b"".join(out)


def _parts(lines: list[bytes]) -> tuple[tuple[tuple[str, ...], ...], Ints]:
    """The names of each object and group together, and which of them each face belongs to."""
    known: dict[tuple[str, ...], int] = {}
    current: dict[bytes, tuple[str, ...]] = {b"o": (), b"g": ()}
    owner = []
    for line in lines:
        if line[:2] == b"f ":
            owner.append(known.setdefault((*current[b"o"], *current[b"g"]), len(known)))
        elif line[:1] in current and (len(line) == 1 or line[1:2] == b" "):
            text = line[2:].decode("utf-8", "replace").strip()
            current[line[:1]] = ((text,) if line[:1] == b"o" else tuple(text.split())) if text else ()
    return tuple(known), np.array(owner, np.int64)


def _vertices_above(lines: list[bytes]) -> Ints:
    """How many vertices stand above each face line."""
    kind = np.array([(line[:2] == b"v ") + 2 * (line[:2] == b"f ") for line in lines], np.int64)
    above: Ints = np.cumsum(kind == 1)[kind == 2]
    return above
