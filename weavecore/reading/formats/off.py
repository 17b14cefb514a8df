"""Object file format .off, as text: OFF, COFF, NOFF, STOFF and their mixtures.

A header with the counts, then a line for each vertex and for each face; ``#`` begins a comment.  Linear in the bytes.
"""

from __future__ import annotations

import re

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Ints
from weavecore.reading.formats.text import damaged, to_ints, to_points
from weavecore.reading.polygon_triangulation import mesh_of_polygons
from weavecore.reading.raw import RawMesh


def read_off(data: bytes) -> RawMesh:
    """The mesh of the file; colours and normals are ignored.

    Parameters
    ----------
    data : bytes
        All of the file.

    Returns
    -------
    RawMesh

    Raises
    ------
    Unreadable, Unsupported, BadIndex
    """
    if b"#" in data:
        data = re.sub(rb"#[^\r\n]*", b"", data)
    lines = [line for line in (raw.strip() for raw in data.splitlines()) if line]
    n_vertices, n_faces, first = _header(lines)
    if first + n_vertices + n_faces > len(lines):
        raise damaged(f"The header announces {n_vertices} vertices and {n_faces} faces, but the file has fewer")
    vertices = to_points(lines[first : first + n_vertices], "vertex")
    corners, counts = _polygons(lines[first + n_vertices : first + n_vertices + n_faces])
    return mesh_of_polygons(vertices, corners, counts)


def _header(lines: list[bytes]) -> tuple[int, int, int]:
    """Numbers of vertices and faces, and the line where the vertices begin."""
    words = lines[0].split() if lines else []
    if not words or not re.fullmatch(rb"(ST)?C?N?4?n?OFF", words[0]):
        raise damaged("The file does not begin with OFF")
    if b"4" in words[0] or b"n" in words[0] or b"BINARY" in words:
        raise Unsupported(
            f"The kind {b' '.join(words[:2]).decode('ascii', 'replace')} of .off file",
            remedy="Export the mesh as a plain OFF text file, or as .ply or .obj.",
        )
    counts, first = (words[1:], 1) if len(words) > 1 else (lines[1].split() if len(lines) > 1 else [], 2)
    if len(counts) < 2:
        raise damaged("The header lacks the numbers of vertices and faces")
    n_vertices, n_faces = to_ints(counts[:2], "header").tolist()
    if n_vertices < 0 or n_faces < 0:
        raise damaged("The header has negative counts")
    return n_vertices, n_faces, first


def _polygons(lines: list[bytes]) -> tuple[Ints, Ints]:
    """Corners of all faces end to end, and how many each has."""
    rows = [line.split() for line in lines]
    counts = to_ints([row[0] for row in rows], "face")
    short = np.flatnonzero(np.array([len(row) for row in rows], np.int64) < counts + 1)
    if len(short) or (counts < 0).any():
        raise damaged("A face has fewer corners than its count")
    words = [word for row, n in zip(rows, counts.tolist()) for word in row[1 : n + 1]]
    return to_ints(words, "face"), counts
