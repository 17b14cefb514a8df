"""Wavefront .obj: vertices and faces with any number of corners; all else is ignored.

Lines ``v x y z …`` and ``f a/… b/… c/… …``; a backslash continues a line.  Linear in the bytes.
"""

from __future__ import annotations

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
        data = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    lines = [line.strip().replace(b"\t", b" ") for line in data.splitlines()]
    vertices = to_points([line[2:] for line in lines if line[:2] == b"v "], "vertex")
    face_lines = [line[2:] for line in lines if line[:2] == b"f "]
    words = b" ".join(face_lines).split()
    if any(b"/" in line for line in face_lines):
        words = [word.partition(b"/")[0] for word in words]
    counts = np.array([len(line.split()) for line in face_lines], np.int64)
    corners = to_ints(words, "face")
    if (corners == 0).any():
        raise damaged("A face refers to vertex 0, but vertices are numbered from 1")
    if (corners < 0).any():
        above = np.repeat(_vertices_above(lines), counts)
        corners = np.where(corners < 0, above + corners, corners - 1)
    else:
        corners = corners - 1
    return mesh_of_polygons(vertices, corners, counts)


def _vertices_above(lines: list[bytes]) -> Ints:
    """How many vertices stand above each face line."""
    kind = np.array([(line[:2] == b"v ") + 2 * (line[:2] == b"f ") for line in lines], np.int64)
    above: Ints = np.cumsum(kind == 1)[kind == 2]
    return above
