"""Stereolithography .stl, binary and text: triangles that share no vertices."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats
from weavecore.reading.formats.text import damaged, to_points
from weavecore.reading.raw import DOUBLE, SINGLE, RawMesh

_HEADER = 84
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(data: bytes) -> RawMesh:
    """The triangles of the file, each with three vertices of its own.

    Raises
    ------
    Unreadable
    """
    if _is_binary(data):
        triangles = np.frombuffer(data, _TRIANGLE, offset=_HEADER)["corners"]
        return _raw(triangles.reshape(-1, 3).astype(np.float64), SINGLE)
    if data.lstrip()[:5].lower() != b"solid":
        raise damaged("The file is no .stl: neither its length fits its number of triangles nor is it text")
    return _raw(_read_text(data), DOUBLE)


def _is_binary(data: bytes) -> bool:
    if len(data) < _HEADER:
        return False
    n_triangles = int.from_bytes(data[80:84], "little")
    return len(data) == _HEADER + n_triangles * _TRIANGLE.itemsize


def _read_text(data: bytes) -> Floats:
    lines = [line.strip().lower() for line in data.splitlines()]
    points = to_points([line[6:] for line in lines if line.startswith(b"vertex")], "vertex")
    n_facets = sum(line.startswith(b"endfacet") for line in lines)
    if 3 * n_facets != len(points) or not any(line.startswith(b"endsolid") for line in lines):
        raise damaged(f"The file breaks off: {len(points)} corners for {n_facets} triangles")
    return points


def _raw(points: Floats, epsilon: float) -> RawMesh:
    return RawMesh(points, np.arange(len(points)).reshape(-1, 3), epsilon=epsilon)
