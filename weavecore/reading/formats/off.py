"""Object file format .off, as text: OFF, COFF, NOFF, STOFF and their mixtures.

A header with the counts, then a line for each vertex and for each face; ``#`` begins a comment.  Where the lines are
broken elsewhere, the words alone are read, one after the other.  Linear in the bytes.
"""

from __future__ import annotations

import re

import numpy as np

from weavecore.errors import Unreadable, Unsupported
from weavecore.geometry.arrays import Floats, Ints
from weavecore.reading.formats.text import damaged, in_line, shown, to_floats, to_ints, to_points
from weavecore.reading.polygon_triangulation import mesh_of_polygons
from weavecore.reading.raw import RawMesh

_KIND = re.compile(rb"(ST)?C?N?4?n?OFF")


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
    numbered = [(k + 1, line) for k, line in enumerate(raw.strip() for raw in data.splitlines()) if line]
    lines, numbers = [line for _, line in numbered], [number for number, _ in numbered]
    try:
        n_vertices, n_faces, first = _header(lines)
        if first + n_vertices + n_faces > len(lines):
            raise damaged(f"The header announces {n_vertices} vertices and {n_faces} faces, but the file has fewer")
        end = first + n_vertices
        vertices = to_points(lines[first:end], "vertex", numbers[first:end])
        corners, counts = _polygons(lines[end : end + n_faces], numbers[end : end + n_faces])
    except Unreadable:
        words = b" ".join(lines).split()
        # The number of edges may be missing.
        found = _by_words(words, 4) or _by_words(words, 3)
        if found is None:
            raise
        vertices, corners, counts = found
    return mesh_of_polygons(vertices, corners, counts)


def _by_words(words: list[bytes], first: int) -> tuple[Floats, Ints, Ints] | None:
    """Vertices, corners and counts of a file whose lines break anywhere; None where the words do not add up.

    The vertices begin at the word ``first``.
    """
    if len(words) < first or not _KIND.fullmatch(words[0]) or not (words[1].isdigit() and words[2].isdigit()):
        return None
    n_vertices, n_faces = to_ints(words[1:3], "header").tolist()
    name, words = words[0], words[first:]
    width = 3 + 3 * (b"N" in name) + 4 * (b"C" in name) + 2 * (b"ST" in name)
    at = n_vertices * width
    if at > len(words):
        return None
    begins = []
    for _ in range(n_faces):
        if at >= len(words) or not words[at].isdigit():
            return None
        begins.append(at)
        at += 1 + int(words[at])
    if at != len(words):
        return None
    counts = to_ints([words[k] for k in begins], "face")
    corners = [word for k, n in zip(begins, counts.tolist()) for word in words[k + 1 : k + 1 + n]]
    table = to_floats(words[: n_vertices * width], "vertex").reshape(-1, width)
    return table[:, :3], to_ints(corners, "face"), counts


def _header(lines: list[bytes]) -> tuple[int, int, int]:
    """Numbers of vertices and faces, and the line where the vertices begin."""
    words = lines[0].split() if lines else []
    if not words or not _KIND.fullmatch(words[0]):
        raise damaged(f"The file does not begin with OFF, but with {shown(lines[0] if lines else b'')}")
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


def _polygons(lines: list[bytes], numbers: list[int]) -> tuple[Ints, Ints]:
    """Corners of all faces end to end, and how many each has."""
    rows = [line.split() for line in lines]
    counts = to_ints([row[0] for row in rows], "face", numbers)
    short = np.flatnonzero((np.array([len(row) for row in rows], np.int64) < counts + 1) | (counts < 0))
    if len(short):
        k = int(short[0])
        raise damaged(f"A face has fewer corners than its count{in_line(numbers, k)}: {shown(lines[k])}")
    words = [word for row, n in zip(rows, counts.tolist()) for word in row[1 : n + 1]]
    return to_ints(words, "face", np.repeat(numbers, counts).tolist()), counts
