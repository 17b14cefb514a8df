"""Meshes of rhino3dm from whole arrays, by the archive of opennurbs that its ``Decode`` reads.

rhino3dm takes vertices, faces and colours one by one, about 1.5 µs each.  Its ``Decode`` takes the bytes of an object
as a ``.3dm`` file holds them (opennurbs, ``ON_Mesh::Write``)::

    class chunk    class id, class data chunk, end
    class data     version, counts, boxes, faces, buffers of vertices (float), normals, texture, curvature and colours,
                   mappings, a chunk with the vertices once more (double), domains, CRC-32
    buffer         size, CRC-32, 0 for "not compressed", bytes

What does not depend on the arrays is taken from the archive of a triangle that rhino3dm writes itself.  Where that
archive is not laid out so, as another version may do, nothing is made here.
"""

from __future__ import annotations

import base64
import struct
import zlib
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Optional

import numpy as np

from weavecore.geometry.arrays import Floats, Ints

_CLASS, _CLASS_ID, _CLASS_DATA, _CLASS_END, _CHUNK = 0x27FFA, 0x2FFFB, 0x2FFFC, 0x80027FFF, 0x40008000
_CHUNK_HEAD, _ID_SIZE, _CRC_SIZE = 12, 32, 4
_BOXES = 153
"""Bytes from the counts to the faces: domains, scales, boxes, and what a plain mesh does not have."""

_UNSET = 48
"""Bytes after the last chunk: three domains."""

_SHORT_INDICES = 1 << 16
"""Vertices that indices of two bytes can tell apart."""


@dataclass(frozen=True)
class MeshArchive:
    """What the archives of all meshes have in common.

    Parameters
    ----------
    header : mapping
        What ``Encode`` gives beside the bytes.
    class_id, version, boxes, mappings, domains : bytes
        The parts of the archive between what depends on the mesh.
    """

    header: dict[str, Any]
    class_id: bytes
    version: bytes
    boxes: bytes
    mappings: bytes
    domains: bytes

    def encode(self, points: Floats, quads: Ints, colour: Optional[tuple[int, int, int]] = None) -> dict[str, Any]:
        """The archive of a mesh, for ``Decode``.

        Parameters
        ----------
        points : (n, 3) float64
        quads : (F, 4) int64
        colour : (int, int, int), optional
            Of all vertices: red, green and blue in 0…255.
        """
        n = len(points)
        colours = bytes((*colour, 0)) * n if colour is not None else b""
        size = 2 if n <= _SHORT_INDICES else 4
        faces = quads.astype(f"<u{size}").tobytes()
        exact = _chunk(_CHUNK, struct.pack("<iii", 1, 0, n) + _buffer(points.astype("<f8").tobytes()), has_crc=True)
        parts = [self.version, struct.pack("<ii", n, len(quads)), self.boxes, struct.pack("<i", size), faces]
        parts += [_buffer(points.astype("<f4").tobytes()), _buffer(b"") * 3, _buffer(colours), self.mappings]
        data = _chunk(_CLASS_DATA, b"".join([*parts, exact, self.domains]), has_crc=True)
        body = _chunk(_CLASS, self.class_id + data + _chunk(_CLASS_END, b""))
        return {**self.header, "data": base64.b64encode(body).decode("ascii")}


@lru_cache(maxsize=1)
def mesh_archive(library: Any) -> Optional[MeshArchive]:
    """The archive's layout as a rhino3dm writes it.

    Parameters
    ----------
    library : module
        ``rhino3dm``, or what has the same classes.

    Returns
    -------
    MeshArchive
        None where there is no ``Encode``, or it writes meshes otherwise.
    """
    if not (hasattr(library, "CommonObject") and hasattr(library.Mesh, "Encode")):
        return None
    corners = np.eye(3) / 3
    mesh = library.Mesh()
    list(map(mesh.Vertices.AddPoint3d, *corners.T.tolist()))
    mesh.Faces.AddFace(0, 1, 2, 2)
    encoded = mesh.Encode()
    found = _layout(encoded)
    if found is None:
        return None
    again = library.CommonObject.Decode(found.encode(corners, np.array([[0, 1, 2, 2]])))
    return found if again is not None and again.Encode() == encoded else None


def _layout(encoded: dict[str, Any]) -> Optional[MeshArchive]:
    """The parts of the archive of a triangle without normals and colours."""
    data = base64.b64decode(encoded["data"])
    start = _CHUNK_HEAD + _ID_SIZE + _CHUNK_HEAD
    boxes = start + 1 + 8
    # One byte for each index of the triangle, then its vertices, and four buffers that are empty.
    rest = boxes + _BOXES + 4 + 4 + len(_buffer(bytes(36))) + 16
    exact = len(_chunk(_CHUNK, bytes(12) + _buffer(bytes(72)), has_crc=True))
    end = len(data) - _CHUNK_HEAD - _CRC_SIZE - _UNSET
    if end - exact <= rest or data[start + 1 : boxes] != struct.pack("<ii", 3, 1):
        return None
    return MeshArchive(
        header={key: value for key, value in encoded.items() if key != "data"},
        class_id=data[_CHUNK_HEAD : _CHUNK_HEAD + _ID_SIZE],
        version=data[start : start + 1],
        boxes=data[boxes : boxes + _BOXES],
        mappings=data[rest : end - exact],
        domains=data[end : end + _UNSET],
    )


def _chunk(code: int, content: bytes, *, has_crc: bool = False) -> bytes:
    tail = struct.pack("<I", zlib.crc32(content)) if has_crc else b""
    return struct.pack("<Iq", code, len(content) + len(tail)) + content + tail


def _buffer(content: bytes) -> bytes:
    size = struct.pack("<i", len(content))
    return size + struct.pack("<IB", zlib.crc32(content), 0) + content if content else size
