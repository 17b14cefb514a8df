"""The dates in a .3dm: openNURBS writes the time of writing into each file, and no call of rhino3dm changes that.

A .3dm is a header of 32 bytes and then *chunks*: a type code of 4 bytes, a length of 8 and a body of that length.
A chunk whose code has the highest bit set has a value in place of the length, and no body.
"""

from __future__ import annotations

import struct
import zlib

_PROPERTIES, _HISTORY = 0x10000014, 0x20008021
_NO_BODY = 0x80000000
_HEADER, _HEAD = 32, 12
_N_DATES = 2
_NEW_YEAR_2000 = (0, 0, 0, 1, 0, 100, 6, 0)
"""Second, minute, hour, day, month, year, day of the week and of the year, as C counts them."""


def with_fixed_dates(content: bytes) -> bytes:
    """The bytes of a .3dm, of version 5 or later, with the dates of its history set to one that does not change.

    The history's body is a version byte, then the author and the date of the making, the
    same of the last change, a count, and a CRC-32 of all this.
    """
    table = _find_chunk(content, _PROPERTIES, _HEADER)
    history = table and _find_chunk(content, _HISTORY, table[0])
    if not history:
        return content
    start, end = history
    body = bytearray(content[start : end - 4])
    at = 1
    for _ in range(_N_DATES):
        (n_letters,) = struct.unpack_from("<i", body, at)
        at += 4 + 2 * n_letters
        struct.pack_into("<8i", body, at, *_NEW_YEAR_2000)
        at += 32
    return content[:start] + bytes(body) + struct.pack("<I", zlib.crc32(body)) + content[end:]


def _find_chunk(content: bytes, wanted: int, at: int) -> tuple[int, int] | None:
    """Start and end of the body of the first chunk with that code, from ``at`` on; None where there is none."""
    while at + _HEAD <= len(content):
        code, length = struct.unpack_from("<Iq", content, at)
        at += _HEAD
        if code & _NO_BODY:
            continue
        if code == wanted:
            return at, at + length
        at += length
    return None
