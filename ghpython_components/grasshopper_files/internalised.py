"""Geometry inside a definition: a .NET BinaryFormatter stream about the fields of rhino3dm's ``Encode()``.

The stream is always the same but for the class, three numbers and the bytes: a header, the assembly, a class with
four members, their values, and the array of bytes that the last one refers to.
"""

from __future__ import annotations

import base64
import struct
from typing import Any

from grasshopper_files.archive import deflate, encode_text, inflate

_ASSEMBLY = "RhinoCommon, Version=8.6.24101.5001, Culture=neutral, PublicKeyToken=552281e97c755530"
_MEMBERS = ("version", "archive3dm", "opennurbs", "data")
_HEADER = struct.pack("<B4i", 0, 1, -1, 1, 0)
_LIBRARY, _CLASS, _REFERENCE, _BYTES, _END = b"\x0c", b"\x05", b"\x09", b"\x0f", b"\x0b"
# Three primitives and an array of primitives; the primitives are Int32, those of the array Byte.
_KINDS = bytes([0, 0, 0, 7, 8, 8, 8, 2])
_LIBRARY_ID, _OBJECT_ID, _DATA_ID, _BYTE = 2, 1, 3, b"\x02"


def encode_geometry(geometry: Any) -> bytes:
    """The ``ON_Data`` of a rhino3dm geometry."""
    encoded = geometry.Encode()
    data = base64.b64decode(encoded["data"])
    return deflate(
        b"".join(
            [
                _HEADER,
                _LIBRARY + struct.pack("<i", _LIBRARY_ID) + encode_text(_ASSEMBLY),
                _CLASS + struct.pack("<i", _OBJECT_ID) + encode_text(f"Rhino.Geometry.{type(geometry).__name__}"),
                struct.pack("<i", len(_MEMBERS)) + b"".join(map(encode_text, _MEMBERS)) + _KINDS,
                struct.pack("<i", _LIBRARY_ID),
                struct.pack("<3i", *(encoded[name] for name in _MEMBERS[:3])),
                _REFERENCE + struct.pack("<i", _DATA_ID),
                _BYTES + struct.pack("<2i", _DATA_ID, len(data)) + _BYTE + data + _END,
            ]
        )
    )


def decode_geometry(content: bytes) -> Any:
    """The rhino3dm geometry of an ``ON_Data``.

    Raises
    ------
    ValueError
        Where it is no stream of this form.
    """
    import rhino3dm

    stream = inflate(content)
    reference = _REFERENCE + struct.pack("<i", _DATA_ID) + _BYTES + struct.pack("<i", _DATA_ID)
    head, found, tail = stream.partition(reference)
    (length,) = struct.unpack_from("<i", tail) if found else (-1,)
    if tail[4:5] != _BYTE or tail[5 + length : 6 + length] != _END or not head.startswith(_HEADER):
        raise ValueError("The stream is not that of one geometry")
    numbers = dict(zip(_MEMBERS, struct.unpack("<3i", head[-12:])))
    data = base64.b64encode(tail[5 : 5 + length]).decode("ascii")
    return rhino3dm.CommonObject.Decode({**numbers, "data": data})


def archive_version(geometry: Any) -> int:
    """The version of Rhino whose archives the geometry is encoded for."""
    return int(geometry.Encode()["archive3dm"]) // 10
