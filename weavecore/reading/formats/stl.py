"""Stereolithography .stl, binary and text: triangles that share no vertices.

Binary files may begin with "solid" as text does, so the length decides: 84 bytes and 50 for each triangle that the
header counts.  Some programs write a few bytes more, which are left out.  Linear in the bytes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.geometry.arrays import Floats
from weavecore.model import Note
from weavecore.reading.formats.text import damaged, shown, to_points
from weavecore.reading.raw import DOUBLE, SINGLE, RawMesh, counted

_HEADER = 84
"""Bytes before the triangles: 80 of text and the number of triangles."""

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""One triangle of a binary file, 50 bytes."""

_LOOKED_AT = 1024
"""First bytes in which a text file has its first facet: more than any name after "solid" takes."""


def read_stl(data: bytes) -> RawMesh:
    """The triangles of the file, each with three vertices of its own.

    Parameters
    ----------
    data : bytes
        All of the file.

    Returns
    -------
    RawMesh

    Raises
    ------
    Unreadable
    """
    n_triangles = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER else 0
    beyond = len(data) - _HEADER - n_triangles * _TRIANGLE.itemsize
    if len(data) >= _HEADER and (beyond == 0 or not _is_text(data)):
        if beyond < 0 or n_triangles == 0 < beyond:
            raise damaged(f"The file is not an .stl: it has no text, and {len(data)} bytes for {n_triangles} triangles")
        triangles = np.frombuffer(data, _TRIANGLE, n_triangles, _HEADER)["corners"]
        raw = _raw(triangles.reshape(-1, 3).astype(np.float64), SINGLE)
        if beyond == 0:
            return raw
        text = f"Left out {counted(beyond, 'byte')} after the last triangle."
        return replace(raw, notes=(Note("DROPPED", text, {"count": beyond}),))
    if not _is_text(data):
        raise damaged(f"The file is not an .stl: it begins with {shown(data[:20])}")
    return _raw(_read_text(data), DOUBLE)


def _is_text(data: bytes) -> bool:
    """Whether a file is text: a binary one may begin with "solid" too, but has no facets in words."""
    begin = data[:_LOOKED_AT].lstrip().lower()
    return begin[:5] == b"solid" and (b"facet" in begin or b"endsolid" in begin)


def _read_text(data: bytes) -> Floats:
    lines = [line.strip().lower() for line in data.splitlines()]
    rows = [k for k, line in enumerate(lines) if line.startswith(b"vertex")]
    vertices = to_points([lines[k][6:] for k in rows], "vertex", [k + 1 for k in rows])
    n_facets = sum(line.startswith(b"endfacet") for line in lines)
    if 3 * n_facets != len(vertices) or not any(line.startswith(b"endsolid") for line in lines):
        raise damaged(f"The file is truncated: {len(vertices)} corners for {n_facets} triangles")
    return vertices


def _raw(vertices: Floats, epsilon: float) -> RawMesh:
    return RawMesh(vertices, np.arange(len(vertices)).reshape(-1, 3), epsilon=epsilon)
