"""Stereolithography .stl, binary and text: triangles that share no vertices.

Binary files may begin with "solid" as text does, so the length decides: 84 bytes and 50 for each triangle that the
header counts.  Linear in the bytes.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats
from weavecore.reading.formats.text import damaged, to_points
from weavecore.reading.raw import DOUBLE, SINGLE, RawMesh

_HEADER = 84
"""Bytes before the triangles: 80 of text and the number of triangles."""

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""One triangle of a binary file, 50 bytes."""


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
    if _is_binary(data):
        triangles = np.frombuffer(data, _TRIANGLE, offset=_HEADER)["corners"]
        return _raw(triangles.reshape(-1, 3).astype(np.float64), SINGLE)
    if data.lstrip()[:5].lower() != b"solid":
        raise damaged("The file is not an .stl: its length does not match its number of triangles, and it is not text")
    return _raw(_read_text(data), DOUBLE)


def _is_binary(data: bytes) -> bool:
    if len(data) < _HEADER:
        return False
    n_triangles = int.from_bytes(data[80:84], "little")
    return len(data) == _HEADER + n_triangles * _TRIANGLE.itemsize


def _read_text(data: bytes) -> Floats:
    lines = [line.strip().lower() for line in data.splitlines()]
    vertices = to_points([line[6:] for line in lines if line.startswith(b"vertex")], "vertex")
    n_facets = sum(line.startswith(b"endfacet") for line in lines)
    if 3 * n_facets != len(vertices) or not any(line.startswith(b"endsolid") for line in lines):
        raise damaged(f"The file is truncated: {len(vertices)} corners for {n_facets} triangles")
    return vertices


def _raw(vertices: Floats, epsilon: float) -> RawMesh:
    return RawMesh(vertices, np.arange(len(vertices)).reshape(-1, 3), epsilon=epsilon)
